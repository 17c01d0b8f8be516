"""Numbers of a study as tables whose cells are shaded: a column a coefficient of variation, a row
an autocorrelation function with whatever else the study varies."""

from __future__ import annotations

import math

import numpy as np

#: Shade of the largest number; the least one has none.
DARKEST = 0.45


def heat_tables(summary: dict) -> list:
    """Of mean and standard deviation (sd) in m and P(S > homogeneous mean): title, digits, covs,
    rows [(name, cells)]; a cell is value, low and high of its 95 % interval, and shade, None where
    there is no such case."""
    name, cases = summary["primary"], summary["cases"]
    covs = sorted({_cov(case) for case in cases})
    names = list(dict.fromkeys(_row_name(case) for case in cases))
    at = {(_row_name(case), _cov(case)): case for case in cases}
    tables = []
    for title, digits, estimate in (
        ("mean [m]", 3, lambda case: _of(case["runouts"][name], "mean")),
        ("sd [m]", 3, lambda case: _of(case["runouts"][name], "sd")),
        ("P(S > homogeneous)", 2, lambda case: _share(case["against_floor"][name])),
    ):
        grid = [
            [estimate(at[row, cov]) if (row, cov) in at else (math.nan,) * 3 for cov in covs]
            for row in names
        ]
        shades = _shades(np.array([[cell[0] for cell in cells] for cells in grid]))
        rows = [
            (row, [_cell(*cell, shade) for cell, shade in zip(cells, shades_of_row)])
            for row, cells, shades_of_row in zip(names, grid, shades)
        ]
        tables.append({"title": title, "digits": digits, "covs": covs, "rows": rows})
    return tables


def _cov(case: dict) -> float:
    """0 of a spread that is given otherwise."""
    return case["cov"] if math.isfinite(case["cov"]) else 0.0


def _row_name(case: dict) -> str:
    return " ".join([case["acf"].upper(), *(f"{k}={v}" for k, v in case["varied"].items())])


def _of(row: dict, key: str):
    return row[key], row[f"{key}_low"], row[f"{key}_high"]


def _share(against: dict):
    e = against["exceedance"]
    return e["share"]["value"], e["low"], e["high"]


def _cell(value: float, low: float, high: float, shade: float) -> dict:
    shade = shade if math.isfinite(shade) else None
    return {"value": value, "low": low, "high": high, "shade": shade}


def _shades(values: np.ndarray) -> np.ndarray:
    known = values[np.isfinite(values)]
    reach = float(np.ptp(known)) if len(known) else 0.0
    return (
        DARKEST * (values - known.min()) / reach if reach > 0.0 else np.full(values.shape, np.nan)
    )
