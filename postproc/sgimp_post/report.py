"""Writes the report: HTML from the template, CSV and JSON beside it."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import jinja2

from . import __version__, figures
from .analysis import analyse
from .ensemble import FLOAT_COLUMNS, INTEGER_COLUMNS, RUNOUTS, STATUS_TEXTS, read_ensemble
from .errors import PostError
from .fits import LAWS
from .noise_floor import noise_floor
from .snapshots import find_snapshots, read_snapshot
from .style import UNIT_TEXTS, Gallery
from .tables import null_for_nan, write_table

#: Snapshots that are shown: the first of each case, at most so many; homogeneous ground first, then
#: one of each autocorrelation function before a second one of any.
MOST_CONFIGURATIONS = 6
#: Cases whose own figure is shown.
MOST_CASES = 15
#: Rows of paired differences that are shown of each kind, those of the smallest p first if there
#: are more; report.json has them all.
MOST_PAIRS = 45


def write_report(directory: Path, output: Path | None = None, primary: str = "runout_max") -> Path:
    """Reads DIR and writes the report of it; returns the path of the HTML."""
    ensemble = read_ensemble(directory)
    output = Path(output) if output else Path(directory) / "report" / "report.html"
    summary = analyse(ensemble, primary)
    gallery = Gallery()
    drawn = _figures(ensemble, summary, gallery)
    tables = _tables(summary)
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
            files=["members.csv", "summary.csv", "fits.csv", *tables],
            post_version=__version__,
        )
    )
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        _write_csv(output.parent, ensemble, summary)
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


def verdict(summary: dict) -> list:
    """The answer in sentences: how many, how far, how sure, against what."""
    totals = summary["totals"]
    lines = [
        f"{totals['ok']} members ok, {totals['failed']} failed, {totals['unsettled']} not at rest"
        f" at the end, of {totals['planned']} planned."
    ]
    lines += _homogeneous_sentences(summary)
    for case in summary["cases"][:3] if len(summary["cases"]) <= 3 else []:
        lines.append(_case_sentence(case, summary))
    if len(summary["cases"]) > 3:
        lines.append(_study_sentence(summary))
    cost = summary["cost"]
    if cost["seconds"]["n"]:
        lines.append(
            f"Cost: {cost['seconds']['mean']:.2f} s a member,"
            f" {cost['core_hours']:.3g} core-hours in all."
        )
    return lines


def _homogeneous_sentences(summary: dict) -> list:
    name, floors = summary["primary"], summary["floors"]
    known = [f[name] for f in floors.values() if math.isfinite(f[name]["mean"])]
    if len(floors) > 1 and known:
        means, spreads = ([f[key] for f in known] for key in ("mean", "sd"))
        return [
            f"Homogeneous ground, {len(known)} cases: means from {min(means):.3f} m to"
            f" {max(means):.3f} m ({RUNOUTS[name]}), noise floors of {min(spreads):.3f} m to"
            f" {max(spreads):.3f} m."
        ]
    if not known:
        return []
    floor = known[0]
    line = f"Homogeneous ground: {floor['mean']:.3f} m ({RUNOUTS[name]})"
    if math.isfinite(floor["sd"]):
        line += (
            f", mean of {floor['n']} runs with a noise floor of {floor['sd']:.3f} m;"
            " the nominal run "
        )
        is_known = math.isfinite(floor["nominal"])
        line += f"alone gives {floor['nominal']:.3f} m" if is_known else "has no result"
    return [line + "."]


def _case_sentence(case: dict, summary: dict) -> str:
    runout, share = case["runouts"][summary["primary"]], case["exceedance"]
    weighted = next((w for w in summary["importance"] if w["label"] == case["label"]), None)
    if weighted:
        return _weighted_sentence(weighted)
    if runout["n"] == 0:
        return f"{case['label']}: no member has ended well yet."
    text = f"{case['label']}: mean {runout['mean']:.3f} m"
    if runout["n"] > 1:
        text += f" (95 %: {runout['mean_low']:.3f} to {runout['mean_high']:.3f})"
        text += f", sd {runout['sd']:.3f} m"
    if share["n"]:
        text += (
            f"; {100 * share['value']:.0f} % run farther than homogeneous ground"
            f" (95 %: {100 * share['low']:.0f} to {100 * share['high']:.0f} %)"
        )
    if case["best"]:
        text += f"; best law {LAWS[case['best']]}"
        if case["rivals"]:
            text += f", not told apart from {', '.join(LAWS[law] for law in case['rivals'])}"
    return text + "."


def _weighted_sentence(weighted: dict) -> str:
    text = f"{weighted['label']}: {weighted['n']} weighted members"
    if not weighted["rows"]:
        return text + ", too few beyond any runout to tell its probability."
    row = min(weighted["rows"], key=lambda row: row["value"])
    return (
        f"{text}; P(runout > {row['threshold']:.3f} m) = {row['value']:.2g}"
        f" (95 %: {row['low']:.2g} to {row['high']:.2g})."
    )


def _study_sentence(summary: dict) -> str:
    name = summary["primary"]
    rows = [case for case in summary["cases"] if case["runouts"][name]["n"]]
    if summary["importance"]:
        return " ".join(_weighted_sentence(weighted) for weighted in summary["importance"][:3])
    if not rows:
        return "No heterogeneous member has ended well yet."
    means = [case["runouts"][name]["mean"] for case in rows]
    shares = [case["exceedance"]["value"] for case in rows if case["exceedance"]["n"]]
    text = f"Heterogeneous ground, {len(rows)} cases:"
    text += f" means from {min(means):.3f} m to {max(means):.3f} m"
    if shares:
        text += (
            f"; between {100 * min(shares):.0f} % and {100 * max(shares):.0f} % of the members run"
            " farther than homogeneous ground"
        )
    return text + "."


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


def warnings(summary: dict) -> list:
    """What a reader must know before quoting a number."""
    totals, found = summary["totals"], []
    if not summary["complete"]:
        found.append(
            f"The run is {summary['state']}: statistics use the {totals['used']} members without a"
            " gap"
            f" from the first on, of {totals['done']} done."
        )
    if summary["sampling"] == "importance":
        found.append(
            "Importance sampling: members are drawn where the event is, not as often as nature"
            " draws them. Plain means, spreads, histograms and counts of such members mean nothing"
            " and are left out; what is told weighs each member."
        )
    elif summary["sampling"] not in ("", "random"):
        found.append(
            f"The sampling plan is {summary['sampling'].replace('_', ' ')}: members are not"
            " independent, and the intervals and p values here, which take them to be, do not hold"
            " for means and exceedance (mostly they are too wide). Control variates are left out."
        )
    if summary["sampling"] == "antithetic":
        means = [
            f"{case['label']} {pair['mean']:.3f} m ({pair['mean_low']:.3f} to"
            f" {pair['mean_high']:.3f} m, {pair['n']} pairs)"
            for case in summary["cases"]
            if (pair := case["pairs_of_members"])["n"] > 1
        ]
        if means:
            found.append("Means with the interval of their mirrored pairs: " + "; ".join(means))
    if totals["unsettled"]:
        found.append(
            f"{totals['unsettled']} members were still moving at end_time;"
            " their runout is a lower bound."
        )
    if totals["wall_touched"]:
        found.append(
            f"{totals['wall_touched']} members touched a wall; it may have cut their runout short."
        )
    ended = [case["label"] for case in summary["cases"] if case["stop_rule_met"]]
    if ended:
        found.append(
            "The stop rule ended "
            + ", ".join(ended)
            + ": an interval that is looked at until it is"
            " short enough holds a little less often than it says."
        )
    name = summary["primary"]
    for label, floor in ((label, floor[name]) for label, floor in summary["floors"].items()):
        if not floor["nominal_is_outlier"]:
            continue
        which = "" if len(summary["floors"]) == 1 else f" of {label}"
        found.append(
            f"The nominal homogeneous run{which} ({floor['nominal']:.3f} m) lies far outside the"
            f" other {floor['others']['n']} ({floor['others']['mean']:.3f} ±"
            f" {floor['others']['sd']:.3f} m). It alone makes up most of the noise floor of"
            f" {floor['sd']:.3f} m: more homogeneous members (noise_members) are needed before a"
            " spread is called noise."
        )
    inside = [case["label"] for case in summary["cases"] if case["shift_below_noise"]]
    if inside:
        found.append(
            "The mean differs from homogeneous ground by less than the noise floor in: "
            + ", ".join(inside)
            + ". Such a difference is not a finding."
        )
    pairs = [pair for pair in summary["pairs"] if pair["n"] and pair["by"] == "acf"]
    if pairs and all(pair["below_noise"] for pair in pairs):
        found.append(
            "All paired differences between autocorrelation functions are smaller than the noise"
            f" floor (largest {max(abs(pair['mean']) for pair in pairs):.3f} m against"
            f" {max(pair['noise'] for pair in pairs):.3f} m)."
        )
    noisy = [case for case in summary["cases"] if case["noise_share"] > 0.5]
    if noisy:
        line = (
            "More than half of the variance of the runout is discretisation noise in: "
            + ", ".join(case["label"] for case in noisy)
        )
        floors = [summary["floors"].get(case["noise_case"]) for case in noisy]
        if all(floor and floor[name]["nominal_is_outlier"] for floor in floors):
            share = max(
                (floor[name]["others"]["sd"] / case["runouts"][name]["sd"]) ** 2
                for floor, case in zip(floors, noisy)
            )
            line += f". Without the nominal homogeneous run it is at most {100.0 * share:.0f} %"
        found.append(line + ".")
    return found


def _figures(ensemble, summary: dict, gallery: Gallery) -> dict:
    """Data URIs by the names of the template; None or empty where there is nothing to draw."""
    name = summary["primary"]
    floors = {label: floor[name] for label, floor in summary["floors"].items()}
    unknown = noise_floor(None)[name]
    shared = next(iter(floors.values())) if len(floors) == 1 else unknown
    cases = [case for case in ensemble.for_statistics() if case.role == "study"]
    drawn = [case for case in cases if len(case.values(name))]
    plain = [] if ensemble.is_weighted else drawn
    covs = {case.cov for case in plain}
    is_by_cov = len(covs) > 1 and not any(case.varied for case in plain)
    deposits = plain if ensemble.is_weighted else cases
    shown = {
        "comparison": figures.comparison_figure(plain, name, shared) if len(plain) > 1 else None,
        "study": figures.study_figure(summary) if is_by_cov else None,
        "soil": figures.soil_figure(summary) if len(plain) > 1 else None,
        "weighted": figures.weighted_figure(drawn, name, shared)
        if ensemble.is_weighted and drawn
        else None,
        "profiles": figures.profile_figure(
            deposits or [case for case in ensemble.cases if case.is_homogeneous]
        ),
    }
    return {
        **{key: gallery.add(key, figure) for key, figure in shown.items()},
        "case_figures": {
            case.label: gallery.add(
                f"case_{case.label}",
                figures.case_figure(case, name, floors.get(case.noise_case, unknown)),
            )
            for case in plain[:MOST_CASES]
        },
        "configurations": _configurations(ensemble, gallery),
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


def _write_csv(directory: Path, ensemble, summary: dict) -> None:
    with open(directory / "members.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        names = (*FLOAT_COLUMNS, *INTEGER_COLUMNS)
        writer.writerow(["case", "id", "status", *names, "reason"])
        for case in ensemble.cases:
            for k in range(case.count):
                row = [case.column(name)[k].item() for name in names]
                status = STATUS_TEXTS.get(int(case.status[k]), int(case.status[k]))
                writer.writerow([case.label, int(case.id[k]), status, *row, case.reason[k]])
    with open(directory / "summary.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        statistics = (
            "n",
            "mean",
            "mean_low",
            "mean_high",
            "sd",
            "sd_low",
            "sd_high",
            "p05",
            "median",
            "p95",
        )
        writer.writerow(["case", "runout", *statistics])
        rows = list(summary["floors"].items()) or [("deterministic", summary["deterministic"])]
        rows += [(case["label"], case["runouts"]) for case in summary["cases"]]
        for label, runouts in rows:
            for name in RUNOUTS:
                writer.writerow([label, name, *(runouts[name][key] for key in statistics)])
    with open(directory / "fits.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(
            ["case", "law", "n", "k", "log_likelihood", "aic", "bic", "parameters", "note"]
        )
        for case in summary["cases"]:
            for fit in case["fits"]:
                parameters = " ".join(
                    f"{key}={value!r}" for key, value in fit["parameters"].items()
                )
                writer.writerow(
                    [
                        case["label"],
                        fit["law"],
                        fit["n"],
                        fit["k"],
                        fit["log_likelihood"],
                        fit["aic"],
                        fit["bic"],
                        parameters,
                        fit["note"],
                    ]
                )


def _tables(summary: dict) -> dict:
    """Rows of the further CSV files by name; of those only that have any."""
    tables = {
        "noise_floor.csv": [
            {"case": case["label"], "noise_case": case["noise_case"], "runout": name, **_flat(row)}
            for case in summary["cases"]
            for name, row in case["against_floor"].items()
        ],
        "pairs.csv": summary["pairs"],
        "controls.csv": [
            {"case": entry["case"], "twin": entry["twin"], **row}
            for entry in summary["controls"]
            for row in entry["rows"]
        ],
        "importance.csv": [
            {"case": case["label"], **row} for case in summary["importance"] for row in case["rows"]
        ],
    }
    return {name: rows for name, rows in tables.items() if rows}


def _flat(row: dict, prefix: str = "") -> dict:
    """Dictionaries within it by joined names."""
    flat = {}
    for key, value in row.items():
        inner = _flat(value, f"{prefix}{key}_") if isinstance(value, dict) else None
        flat.update({f"{prefix}{key}": value} if inner is None else inner)
    return flat
