"""`sgimp-post paper`: the paper beside a run of `input/paper/study.nml` or `baseline.nml`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from . import (
    __version__,
    field_figures,
    paper_consequences,
    paper_figures,
    paper_method,
    paper_runouts,
    printed,
)
from .ensemble import RUNOUTS, read_ensemble
from .errors import PostError
from .fits import LAWS
from .page import environment
from .paper import BLOCK, DECIMETRES, compare_with_paper, in_decimetres, paper_cases
from .paper_verdicts import p_text
from .printed import ACFS, BASELINE, NUMBERS
from .random_fields import random_fields_of
from .snapshots import find_snapshots, read_snapshot
from .style import Gallery
from .tables import null_for_nan, write_table
from .verdict import dependence_sentence


def run(options) -> int:
    """Writes DIR/paper or --out: paper.html, paper.md, paper.json, tables, figures; exit code 0."""
    directory = Path(options.out) if options.out else Path(options.directory) / "paper"
    print(write_comparison(options.directory, options.sensitivity, directory, options.runout))
    return 0


def write_comparison(directory: Path, others: list, output: Path, name: str) -> Path:
    """Returns the path of the page; `others`: directories of the sensitivities."""
    ensemble = in_decimetres(read_ensemble(directory))
    beside = [in_decimetres(read_ensemble(other)) for other in others]
    numbers = compare_with_paper(ensemble, beside, name)
    found = [*paper_runouts.statements(numbers), *paper_method.statements(numbers)]
    consequences = paper_consequences.statements(numbers)
    gallery = Gallery()
    tables = _tables(numbers, found, consequences)
    values = {
        "n": numbers,
        "groups": {"verdicts": found, "consequences": consequences},
        "readings": paper_method.readings(numbers),
        "warnings": warnings(numbers),
        "summary": summary(numbers, found, consequences),
        "a": ensemble.attributes,
        "runouts": RUNOUTS,
        "laws": LAWS,
        "acfs": ACFS,
        "printed": printed,
        "block": BLOCK,
        "p_text": p_text,
        "files": [file for file, rows in tables.items() if rows],
        "post_version": __version__,
        **_figures(ensemble, beside, numbers, gallery),
    }
    templates = environment()
    pages = {
        "paper.html": templates.get_template("paper.html.j2").render(**values),
        "paper.md": templates.get_template("paper.md.j2").render(**values),
        "paper.json": json.dumps(
            null_for_nan(
                {
                    **numbers,
                    "statements": [asdict(one) for one in found],
                    "consequences": [asdict(one) for one in consequences],
                    "provenance": {
                        str(one.directory): one.provenance for one in (ensemble, *beside)
                    },
                }
            ),
            indent=1,
        ),
    }
    try:
        output.mkdir(parents=True, exist_ok=True)
        for file, rows in tables.items():
            if rows:
                write_table(output / file, rows)
            else:  # that of an earlier call
                (output / file).unlink(missing_ok=True)
        gallery.write(output / "figures")
        for file, text in pages.items():
            (output / file).write_text(text, encoding="utf-8")
    except OSError as cause:
        raise PostError(f"{output}: cannot be written ({cause.strerror})") from cause
    return output / "paper.html"


def summary(numbers: dict, found: list, consequences: list) -> list:
    """The answer in sentences."""
    name = numbers["runout"]
    lines = [
        f"{len(found)} statements of the paper: {_counts(found, name)} (runout: {RUNOUTS[name]}).",
        f"{len(consequences)} inconsistencies and consequences of its numbers, not counted there:"
        f" {_counts(consequences, name)}.",
    ]
    for key in ("underestimate_0.05", "functions_differ_0.05", "best_law"):
        one = next(one for one in found if one.key == key)
        lines.append(
            f"{one.claim}: {one.verdict(name)}. {one.numbers[:1].upper()}{one.numbers[1:]}."
        )
    return lines


def _counts(found: list, name: str) -> str:
    verdicts = [one.verdict(name) for one in found]
    return ", ".join(f"{verdicts.count(word)} {word}" for word in dict.fromkeys(sorted(verdicts)))


def warnings(numbers: dict) -> list:
    """What a reader must know before quoting a number."""
    found, keys, floor = [], numbers["settings"], numbers["homogeneous"][numbers["runout"]]
    damping = keys["damping"]
    if damping is not None:
        is_printed = np.isclose(damping, NUMBERS["damping"].value)
        found.append(
            f"Damping of this run: {damping:g}/s, "
            + (
                "as the paper prints it."
                if is_printed
                else f"not the printed {NUMBERS['damping'].value:g}: it was chosen so that the"
                " homogeneous column comes near 60.03 dm."
            )
        )
    if numbers["state"] != "complete":
        totals = numbers["totals"]
        found.append(
            f"The run is {numbers['state']}: {totals['done']} of {totals['planned']} members are"
            f" done, {totals['used']} without a gap from the first on are used."
        )
    if line := dependence_sentence(numbers["sampling"]):
        found.append(line)
    if numbers["missing"]:
        found.append(f"Of the paper's 15 cases without members: {', '.join(numbers['missing'])}.")
    if floor["n"] == 0:
        found.append("There is no homogeneous run: nothing can be held against its value.")
    elif floor["nominal_is_outlier"]:
        found.append(
            f"The nominal homogeneous run ({floor['nominal']:.2f} dm) lies far outside the other"
            f" {floor['others']['n']} ({floor['others']['mean']:.2f} ± {floor['others']['sd']:.2f}"
            " dm)."
        )
    for one in numbers["sensitivities"]:
        if not one["has_same_numbers"] and any(row["role"] == "study" for row in one["rows"]):
            found.append(f"{one['directory']} has other random numbers: it is not paired.")
        if not one["rows"]:
            found.append(f"{one['directory']} has no case of this run.")
    return found


def _figures(ensemble, beside: list, numbers: dict, gallery: Gallery) -> dict:
    """Data URIs by the names of the template; None where there is nothing to draw."""
    name, cases = numbers["runout"], paper_cases(ensemble)
    floor = numbers["homogeneous"][name]
    drawn = [row for row in numbers["cases"] if row["n"]]
    baseline = paper_figures.baseline_of(cases, name)
    shown = {
        "fig_02": paper_figures.correlation_figure(),
        "fig_03": paper_figures.surface_figure(),
        "fig_07": _front(ensemble, beside, numbers),
        "fig_08": _maps(ensemble),
        "fig_10": paper_figures.convergence_figure(baseline, name) if baseline else None,
        "fig_11": paper_figures.histogram_figure(baseline, name, floor) if baseline else None,
        "fig_12": paper_figures.density_figure(baseline, name, floor, numbers["implied"])
        if baseline
        else None,
        "fig_13": paper_figures.cov_figure(drawn, numbers["homogeneous"], numbers["implied"])
        if drawn
        else None,
        "fig_14": paper_figures.exceedance_figure(drawn) if drawn else None,
        "table_5": paper_figures.law_figure(numbers["blocks"]) if numbers["blocks"] else None,
    }
    return {
        **{key: gallery.add(key, figure) for key, figure in shown.items()},
        "column": _column(ensemble, gallery),
        "deposits": _deposits(ensemble, baseline, gallery),
        "sensitivity_figures": [
            gallery.add(f"sensitivity_{k}", paper_figures.sensitivity_figure(one, name))
            for k, one in enumerate(numbers["sensitivities"], start=1)
        ],
    }


def _snapshots(ensemble):
    """(case, snapshot) of every member 1 that has one."""
    known = {case.label: case for case in ensemble.cases}
    for label, member, path in find_snapshots(ensemble.directory):
        if label in known and member == 1 and (snapshot := read_snapshot(label, member, path)):
            yield known[label], snapshot


def _front(ensemble, beside: list, numbers: dict):
    """The history of a homogeneous run, of this directory or else of another."""
    for one in (ensemble, *beside):
        for case, snapshot in _snapshots(one):
            toe = case.geometry.toe
            if case.is_homogeneous and toe is not None and len(snapshot.history.get("time", ())):
                floor = numbers["homogeneous"][numbers["runout"]]
                origin = one.directory.name
                return paper_figures.front_figure(snapshot.history, origin, floor, toe)
    return None


def _maps(ensemble):
    """The random fields of the first members of the baseline, rebuilt from the seed."""
    try:
        fields = random_fields_of(ensemble)
        if fields is None:
            return None
        spec, rows = fields.specs[0], []
        ids = np.arange(1, field_figures.SHOWN_MEMBERS + 1)
        for acf in ACFS:
            rows += [
                (case, acf, fields.values(case, ids)[spec.name])
                for case in fields.cases
                if case.acf == acf and np.isclose(case.cov, BASELINE)
            ]
    except PostError:  # a run without the record of its fields
        return None
    return field_figures.maps_figure(spec, rows) if rows else None


def _column(ensemble, gallery: Gallery):
    for case, snapshot in _snapshots(ensemble):
        if case.is_homogeneous:
            toe = DECIMETRES * (case.geometry.toe or 0.0)
            place = toe + NUMBERS["homogeneous"].value
            return gallery.add(
                "fig_07_column",
                paper_figures.deposit_figure(snapshot, case.geometry, place, place),
            )
    return None


def _deposits(ensemble, baseline: list, gallery: Gallery) -> list:
    labels = {case.label: case.acf for case in baseline}
    found = []
    for case, snapshot in _snapshots(ensemble):
        if case.label in labels:
            figure = paper_figures.deposit_figure(snapshot, case.geometry, *NUMBERS["fronts"].value)
            found.append({"acf": case.acf, "image": gallery.add(f"fig_09_{case.acf}", figure)})
    return sorted((one for one in found if one["image"]), key=lambda one: ACFS.index(one["acf"]))


def _tables(numbers: dict, found: list, consequences: list) -> dict:
    """Rows of the CSV files by name."""
    name = numbers["runout"]
    laws = [
        {
            "acf": row["acf"],
            "n": row["n"],
            "law": law,
            "delta_aic": delta,
            "p_value": row["p_value"].get(law, np.nan),
        }
        for row in numbers["laws"]
        for law, delta in row["delta_aic"].items()
    ]
    return {
        "verdicts.csv": [
            {
                "group": group,
                "key": one.key,
                "place": one.place,
                "claim": one.claim,
                **{word: one.verdict(word) for word in dict.fromkeys((name, *RUNOUTS))},
                "numbers": one.numbers,
                "why": one.why,
            }
            for group, members in (("statement", found), ("consequence", consequences))
            for one in members
        ],
        "printed.csv": printed.rows(),
        "implied.csv": numbers["implied"],
        "cases.csv": numbers["cases"],
        "pairs.csv": numbers["pairs"],
        "spreads.csv": numbers["spreads"],
        "table_5.csv": numbers["table_5"],
        "laws.csv": laws,
        "blocks.csv": numbers["blocks"],
        "convergence.csv": numbers["convergence"],
        "fronts.csv": numbers["fronts"],
        "sensitivities.csv": [
            {"directory": one["directory"], **row}
            for one in numbers["sensitivities"]
            for row in one["rows"]
        ],
    }
