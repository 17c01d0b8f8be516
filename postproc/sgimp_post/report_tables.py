"""The numbers of the report as tables: rows by the names of their CSV files."""

from __future__ import annotations

from .ensemble import FLOAT_COLUMNS, INTEGER_COLUMNS, RUNOUTS, STATUS_TEXTS

_OF_A_FIT = ("law", "n", "k", "log_likelihood", "aic", "bic", "wins", "p_value")
_STATISTICS = (
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


def report_tables(ensemble, summary: dict, *others: dict) -> dict:
    """Those that have any row, `others` among them."""
    tables = {
        "members.csv": [row for case in ensemble.cases for row in _members(case)],
        "summary.csv": _summary(summary),
        "fits.csv": [row for case in summary["cases"] for row in _fits(case)],
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
    for more in others:
        tables.update(more)
    return {name: rows for name, rows in tables.items() if rows}


def _members(case) -> list:
    names = (*FLOAT_COLUMNS, *INTEGER_COLUMNS)
    return [
        {
            "case": case.label,
            "id": int(case.id[k]),
            "status": STATUS_TEXTS.get(int(case.status[k]), int(case.status[k])),
            **{name: case.column(name)[k].item() for name in names},
            "reason": case.reason[k],
        }
        for k in range(case.count)
    ]


def _summary(summary: dict) -> list:
    rows = list(summary["floors"].items()) or [("deterministic", summary["deterministic"])]
    rows += [(case["label"], case["runouts"]) for case in summary["cases"]]
    return [
        {"case": label, "runout": name, **{key: runouts[name][key] for key in _STATISTICS}}
        for label, runouts in rows
        for name in RUNOUTS
    ]


def _fits(case: dict) -> list:
    return [
        {
            "case": case["label"],
            **{key: fit[key] for key in _OF_A_FIT},
            "parameters": " ".join(f"{key}={value!r}" for key, value in fit["parameters"].items()),
            "note": fit["note"],
        }
        for fit in case["fits"]
    ]


def _flat(row: dict, prefix: str = "") -> dict:
    """Dictionaries within it by joined names."""
    flat = {}
    for key, value in row.items():
        inner = _flat(value, f"{prefix}{key}_") if isinstance(value, dict) else None
        flat.update({f"{prefix}{key}": value} if inner is None else inner)
    return flat
