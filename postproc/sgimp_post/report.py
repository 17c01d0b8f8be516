"""Writes the report: HTML from the template, CSV and JSON beside it."""

from __future__ import annotations

import json
import math
from pathlib import Path

import jinja2

from . import __version__, field_figures, figures, study_figures
from .analysis import analyse
from .ensemble import RUNOUTS, read_ensemble
from .errors import PostError
from .field_audit import audit, audit_rows, one_of_each_acf
from .fits import LAWS
from .heat_table import heat_tables
from .noise_floor import noise_floor
from .random_fields import read_random_fields
from .report_tables import report_tables
from .snapshots import find_snapshots, read_snapshot
from .style import UNIT_TEXTS, Gallery
from .tables import null_for_nan, write_table
from .verdict import verdict, warnings

#: Snapshots that are shown: the first of each case, at most so many; homogeneous ground first, then
#: one of each autocorrelation function before a second one of any.
MOST_CONFIGURATIONS = 6
#: Cases whose own figure is shown.
MOST_CASES = 15
#: Members of each case whose fields are rebuilt and tested, at 10 ms each on a lattice of 80 x 80.
AUDITED_MEMBERS = 30
#: Cases among the small multiples.
MOST_MULTIPLES = 30
#: Rows of paired differences that are shown of each kind, those of the smallest p first if there
#: are more; report.json has them all.
MOST_PAIRS = 45


def write_report(directory: Path, output: Path | None = None, primary: str = "runout_max") -> Path:
    """Reads DIR and writes the report of it; returns the path of the HTML."""
    ensemble = read_ensemble(directory)
    output = Path(output) if output else Path(directory) / "report" / "report.html"
    summary = analyse(ensemble, primary)
    gallery = Gallery()
    drawn = {**_figures(ensemble, summary, gallery), **_field_audit(ensemble, gallery)}
    tables = report_tables(ensemble, summary)
    html = (
        _environment()
        .get_template("report.html.j2")
        .render(
            **drawn,
            s=summary,
            a=ensemble.attributes,
            directory=Path(directory).resolve(),
            verdict=verdict(summary),
            warnings=warnings(summary),
            runouts=RUNOUTS,
            laws=LAWS,
            field_unit=_field_unit(ensemble),
            pair_groups=_pair_groups(summary["pairs"]),
            files=[*tables, "report.json"],
            post_version=__version__,
        )
    )
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        for name, rows in tables.items():
            write_table(output.parent / name, rows)
        (output.parent / "report.json").write_text(
            json.dumps(null_for_nan({**summary, "provenance": ensemble.attributes}), indent=1)
        )
        gallery.write(output.parent / "figures")
        output.write_text(html, encoding="utf-8")
    except OSError as cause:
        raise PostError(f"{output.parent}: cannot be written ({cause.strerror})") from cause
    return output


def _pair_groups(pairs: list) -> list:
    """(what differs, rows to show, number of all rows) of each kind of paired difference."""
    groups = {}
    for pair in pairs:
        groups.setdefault(pair["by"], []).append(pair)
    shown = []
    for by, rows in groups.items():
        kept = sorted(rows, key=lambda row: row["p_value"] if row["n"] > 1 else 2.0)[:MOST_PAIRS]
        kept = rows if len(rows) <= MOST_PAIRS else kept
        shown.append((by.replace("_", " "), kept, len(rows)))
    return shown


def _field_unit(ensemble) -> str:
    """Of the property that the first random field varies, as the columns field_* have it."""
    unit = next((case.units.get("field_mean", "") for case in ensemble.cases), "")
    return UNIT_TEXTS.get(unit, unit)


def _figures(ensemble, summary: dict, gallery: Gallery) -> dict:
    """Data URIs by the names of the template; None or empty where there is nothing to draw."""
    name = summary["primary"]
    floors = {label: floor[name] for label, floor in summary["floors"].items()}
    unknown = noise_floor(None)[name]
    shared = next(iter(floors.values())) if len(floors) == 1 else unknown
    cases = [case for case in ensemble.for_statistics() if case.role == "study"]
    drawn = [case for case in cases if len(case.values(name))]
    plain = [] if ensemble.is_weighted else drawn
    deposits = plain if ensemble.is_weighted else cases
    profiles = figures.profile_figure(
        deposits or [case for case in ensemble.cases if case.is_homogeneous]
    )
    weighted = (
        figures.weighted_figure(drawn, name, shared) if ensemble.is_weighted and drawn else None
    )
    return {
        **_study_figures(plain, summary, shared, gallery),
        "weighted": gallery.add("weighted", weighted),
        "profiles": gallery.add("profiles", profiles),
        "case_figures": {
            case.label: gallery.add(
                f"case_{case.label}",
                figures.case_figure(case, name, floors.get(case.noise_case, unknown)),
            )
            for case in plain[:MOST_CASES]
        },
        "configurations": _configurations(ensemble, gallery),
    }


def _study_figures(cases, summary: dict, deterministic: dict, gallery: Gallery) -> dict:
    """Of two cases or more; else nothing."""
    name = summary["primary"]
    if len(cases) < 2:
        return {}
    drawn = {
        "multiples": study_figures.multiples_figure(cases[:MOST_MULTIPLES], name, deterministic),
        "comparison": study_figures.comparison_figure(cases, name, deterministic),
        "soil": study_figures.soil_figure(summary),
    }
    if len({case.cov for case in cases}) > 1 and not any(case.varied for case in cases):
        drawn["study"] = study_figures.study_figure(summary)
    return {
        **{key: gallery.add(key, figure) for key, figure in drawn.items()},
        "heat": heat_tables(summary),
    }


def _field_audit(ensemble, gallery: Gallery) -> dict:
    """Of the first members of each case, or why there is none."""
    try:
        fields = read_random_fields(ensemble.directory)
    except PostError as cause:
        return {"audit_verdict": f"The fields cannot be rebuilt: {cause}."}
    if fields is None or not fields.cases:
        return {"audit_verdict": "Homogeneous ground: there is no random field."}
    if fields.tilt:
        return {"audit_verdict": "Weighted members have shifted fields, which no law describes."}
    numbers = audit(fields, AUDITED_MEMBERS)
    entries = [e for e in numbers["fields"] if any(c["lag"] for c in e["correlation"])]
    first = one_of_each_acf(e for e in entries if e["field"] == entries[0]["field"])
    figure = field_figures.correlation_figure(first) if first else None
    return {
        "audit_verdict": numbers["verdict"],
        "audit": audit_rows(numbers),
        "correlation": gallery.add("correlation", figure),
    }


def _configurations(ensemble, gallery: Gallery) -> list:
    shown, labels = [], set()
    rank, seen = {}, {}
    for order, case in enumerate(ensemble.cases):
        seen[case.acf] = seen.get(case.acf, 0) + 1
        rank[case.label] = (seen[case.acf], order)
    found = [entry for entry in find_snapshots(ensemble.directory) if entry[0] in rank]
    for label, member, path in sorted(found, key=lambda entry: rank[entry[0]]):
        if label in labels or len(shown) >= MOST_CONFIGURATIONS:
            continue
        snapshot = read_snapshot(label, member, path)
        figure = snapshot and figures.configuration_figure(snapshot, ensemble.case(label).geometry)
        if figure:
            labels.add(label)
            image = gallery.add(f"{label}_r{member:06d}", figure)
            shown.append({"label": label, "id": member, "image": image})
    return shown


def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("sgimp_post"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = _number
    environment.filters["share"] = lambda value: _number(100.0 * max(value, 0.0), 0)
    environment.filters["scientific"] = _scientific
    environment.filters["percent"] = lambda value: _number(100.0 * value, 1)
    return environment


def _number(value, digits: int = 3) -> str:
    """A number for a table; a dash for what is not known."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.{digits}f}"


def _scientific(value) -> str:
    """A probability for a table, two digits."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.2g}" if value >= 1e-3 or value == 0.0 else f"{value:.1e}"
