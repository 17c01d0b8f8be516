"""Writes the report: HTML from the template, CSV and JSON beside it."""

from __future__ import annotations

import json
from pathlib import Path

from . import __version__, field_figures, figures, reach, soil_map, study_figures
from .analysis import analyse
from .ensemble import RUNOUTS, most_variable, read_ensemble
from .errors import PostError
from .field_audit import audit, audit_rows, one_of_each_acf
from .fits import LAWS
from .heat_table import heat_tables
from .member_section import member_entries
from .noise_floor import noise_floor
from .page import environment, field_unit
from .random_fields import random_fields_of
from .reach_figures import overview_figure, reach_figure
from .report_tables import report_tables
from .soil_map_figures import shared_limit, soil_map_figure
from .style import Gallery
from .tables import null_for_nan, write_table
from .verdict import verdict, warnings

#: Cases whose own figure is shown.
MOST_CASES = 15
#: Members of each case whose fields are rebuilt and tested, at 10 ms each on a lattice of 80 x 80.
AUDITED_MEMBERS = 30
#: Cases whose surfaces and reach are drawn on their own.
MOST_REACHES = 5
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
    reaches, (maps, notes) = reach.reaches(ensemble), soil_map.soil_maps(ensemble, primary)
    drawn = {
        **_figures(ensemble, summary, gallery),
        **_reach(ensemble, reaches, gallery),
        **_soil_maps(maps, notes, gallery),
        **_field_audit(ensemble, gallery),
        "members": member_entries(ensemble, primary, gallery),
    }
    tables = report_tables(ensemble, summary, reach.tables(reaches), soil_map.tables(maps))
    html = (
        environment()
        .get_template("report.html.j2")
        .render(
            **drawn,
            s=summary,
            a=ensemble.attributes,
            provenance=ensemble.provenance,
            directory=Path(directory).resolve(),
            verdict=verdict(summary),
            warnings=warnings(summary),
            runouts=RUNOUTS,
            laws=LAWS,
            field_unit=field_unit(ensemble),
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


def _figures(ensemble, summary: dict, gallery: Gallery) -> dict:
    """Data URIs by the names of the template; None or empty where there is nothing to draw."""
    name = summary["primary"]
    floors = {label: floor[name] for label, floor in summary["floors"].items()}
    unknown = noise_floor(None)[name]
    shared = next(iter(floors.values())) if len(floors) == 1 else unknown
    cases = [case for case in ensemble.for_statistics() if case.role == "study"]
    drawn = [case for case in cases if len(case.values(name))]
    plain = [] if ensemble.is_weighted else drawn
    weighted = (
        figures.weighted_figure(drawn, name, shared) if ensemble.is_weighted and drawn else None
    )
    return {
        **_study_figures(plain, summary, shared, gallery),
        "weighted": gallery.add("weighted", weighted),
        "case_figures": {
            case.label: gallery.add(
                f"case_{case.label}",
                figures.case_figure(case, name, floors.get(case.noise_case, unknown)),
            )
            for case in plain[:MOST_CASES]
        },
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
        fields = random_fields_of(ensemble)
    except PostError as cause:
        return {"audit_verdict": f"The fields cannot be rebuilt: {cause}."}
    if fields is None or not fields.cases:
        return {"audit_verdict": "Homogeneous ground: there is no random field."}
    if fields.tilt:
        return {"audit_verdict": "Weighted members have shifted fields, which no law describes."}
    if any(spec.is_too_dense for spec in fields.specs):
        words = "A dense factor takes long to make again: `sgimp-post fields` audits the fields."
        return {"audit_verdict": words}
    numbers = audit(fields, AUDITED_MEMBERS)
    entries = [e for e in numbers["fields"] if any(c["lag"] for c in e["correlation"])]
    first = one_of_each_acf(e for e in entries if e["field"] == entries[0]["field"])
    figure = field_figures.correlation_figure(first) if first else None
    return {
        "audit_verdict": numbers["verdict"],
        "audit": audit_rows(numbers),
        "correlation": gallery.add("correlation", figure),
    }


def _reach(ensemble, reaches, gallery: Gallery) -> dict:
    """Of each case where they are few; of many an overview, and the cases where the soil varies
    most."""
    shown = reaches if len(reaches) <= MOST_REACHES else most_variable(reaches, MOST_REACHES)
    homogeneous = {case.label: case for case in ensemble.cases if case.is_homogeneous}
    beside = {case.label: homogeneous.get(case.noise_case) for case in ensemble.cases}
    overview = overview_figure(reaches) if len(reaches) > 1 else None
    return {
        "reaches": reaches,
        "reach_overview": gallery.add("reach", overview),
        "reach_figures": {
            one.label: gallery.add(f"reach_{one.label}", reach_figure(one, beside[one.label]))
            for one in shown
        },
    }


def _soil_maps(maps, notes, gallery: Gallery) -> dict:
    limit = shared_limit(maps)
    return {
        "soil_maps": maps,
        "soil_map_notes": notes,
        "soil_map_figures": [
            gallery.add(f"soil_map_{one.label}_{one.spec.name}", soil_map_figure(one, limit))
            for one in maps
        ],
    }
