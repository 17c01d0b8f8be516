"""Writes the report: HTML from the template, CSV and JSON beside it."""

from __future__ import annotations

import base64
import csv
import json
import math
from pathlib import Path

import jinja2

from . import __version__, figures
from .analysis import analyse
from .ensemble import FLOAT_COLUMNS, INTEGER_COLUMNS, RUNOUTS, STATUS_TEXTS, read_ensemble
from .errors import PostError
from .field_figures import UNIT_TEXTS
from .fits import LAWS
from .snapshots import find_snapshots, read_snapshot

#: Snapshots that are shown: the first of each case, at most so many; homogeneous ground first, then
#: one of each autocorrelation function before a second one of any.
MOST_CONFIGURATIONS = 6
#: Cases whose own figure is shown.
MOST_CASES = 15


def write_report(directory: Path, output: Path | None = None, primary: str = "runout_max") -> Path:
    """Reads DIR and writes the report of it; returns the path of the HTML."""
    ensemble = read_ensemble(directory)
    output = Path(output) if output else Path(directory) / "report" / "report.html"
    summary = analyse(ensemble, primary)
    drawn = _figures(ensemble, summary)
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
            post_version=__version__,
        )
    )
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        _write_csv(output.parent, ensemble, summary)
        (output.parent / "report.json").write_text(
            json.dumps(_finite({**summary, "provenance": ensemble.attributes}), indent=1)
        )
        for shown in drawn["configurations"]:
            name = f"{shown['label']}_r{shown['id']:06d}.png"
            (output.parent / name).write_bytes(base64.b64decode(shown["image"].split(",")[1]))
        output.write_text(html, encoding="utf-8")
    except OSError as cause:
        raise PostError(f"{output.parent}: cannot be written ({cause.strerror})") from cause
    return output


def verdict(summary: dict) -> list:
    """The answer in sentences: how many, how far, how sure, against what."""
    totals, name = summary["totals"], summary["primary"]
    floor = summary["deterministic"][name]
    lines = [
        f"{totals['ok']} members ok, {totals['failed']} failed, {totals['unsettled']} not at rest"
        f" at the end, of {totals['planned']} planned."
    ]
    if math.isfinite(floor["mean"]):
        line = f"Homogeneous ground: {floor['mean']:.3f} m ({RUNOUTS[name]})"
        if math.isfinite(floor["sd"]):
            line += (
                f", mean of {floor['n']} runs with a noise floor of {floor['sd']:.3f} m;"
                " the nominal run "
            )
            is_known = math.isfinite(floor["nominal"])
            line += f"alone gives {floor['nominal']:.3f} m" if is_known else "has no result"
        lines.append(line + ".")
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


def _case_sentence(case: dict, summary: dict) -> str:
    runout, share = case["runouts"][summary["primary"]], case["exceedance"]
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


def _study_sentence(summary: dict) -> str:
    name = summary["primary"]
    rows = [case for case in summary["cases"] if case["runouts"][name]["n"]]
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
    if summary["sampling"] != "random":
        found.append(
            f"The sampling plan is {summary['sampling'].replace('_', ' ')}: members are not"
            " independent, and the intervals and p values here, which take them to be, do not hold"
            " for means and exceedance (mostly they are too wide)."
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
    floor = summary["deterministic"][summary["primary"]]
    if floor["nominal_is_outlier"]:
        found.append(
            f"The nominal homogeneous run ({floor['nominal']:.3f} m) lies far outside the other"
            f" {floor['others']['n']} ({floor['others']['mean']:.3f} ± {floor['others']['sd']:.3f}"
            f" m). It alone makes up most of the noise floor of {floor['sd']:.3f} m: more"
            " homogeneous members (noise_members) are needed before a spread is called noise."
        )
    inside = [case["label"] for case in summary["cases"] if case["shift_below_noise"]]
    if inside:
        found.append(
            "The mean differs from homogeneous ground by less than the noise floor in: "
            + ", ".join(inside)
            + ". Such a difference is not a finding."
        )
    pairs = [pair for pair in summary["pairs"] if pair["n"]]
    if pairs and all(pair["below_noise"] for pair in pairs):
        found.append(
            "All paired differences between autocorrelation functions are smaller than the noise"
            f" floor (largest {max(abs(pair['mean']) for pair in pairs):.3f} m against"
            f" {floor['sd']:.3f} m)."
        )
    noisy = [case for case in summary["cases"] if case["noise_share"] > 0.5]
    if noisy:
        line = (
            "More than half of the variance of the runout is discretisation noise in: "
            + ", ".join(case["label"] for case in noisy)
        )
        if floor["nominal_is_outlier"]:
            spreads = [case["runouts"][summary["primary"]]["sd"] for case in noisy]
            share = 100.0 * (floor["others"]["sd"] / min(spreads)) ** 2
            line += f". Without the nominal homogeneous run it is at most {share:.0f} %"
        found.append(line + ".")
    return found


def _figures(ensemble, summary: dict) -> dict:
    """Data URIs by the names of the template; None or empty where there is nothing to draw."""
    name = summary["primary"]
    floor = summary["deterministic"][name]
    cases = [case for case in ensemble.for_statistics() if not case.is_homogeneous]
    drawn = [case for case in cases if len(case.values(name))]
    covs = {case.cov for case in drawn}
    profile = figures.profile_figure(
        cases or [case for case in ensemble.cases if case.is_homogeneous], ensemble.geometry
    )
    return {
        "case_figures": {
            case.label: figures.data_uri(figures.case_figure(case, name, floor))
            for case in drawn[:MOST_CASES]
        },
        "comparison": figures.data_uri(figures.comparison_figure(drawn, name, floor))
        if len(drawn) > 1
        else None,
        "study": figures.data_uri(figures.study_figure(summary))
        if len(drawn) > 1 and len(covs) > 1
        else None,
        "profiles": figures.data_uri(profile) if profile else None,
        "configurations": _configurations(ensemble),
    }


def _configurations(ensemble) -> list:
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
        figure = snapshot and figures.configuration_figure(snapshot, ensemble.geometry)
        if figure:
            labels.add(label)
            shown.append(
                {"label": label, "id": member, "image": figures.data_uri(figure, "png", 100)}
            )
    return shown


def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("sgimp_post"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = _number
    environment.filters["percent"] = lambda value: _number(100.0 * value, 1)
    return environment


def _number(value, digits: int = 3) -> str:
    """A number for a table; a dash for what is not known."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.{digits}f}"


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
        rows = [("deterministic", summary["deterministic"])]
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


def _finite(value):
    """The same with null for what is not finite, which JSON cannot hold."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
