"""Numbers of a study as tables whose cells are shaded: a column a coefficient of variation, a row
an autocorrelation function with whatever else the study varies."""

from __future__ import annotations

import math

import numpy as np

#: Shade of the largest number; the least one has none.
DARKEST = 0.45


def heat_tables(summary: dict) -> list:
    """Of mean and standard deviation in m and P(S > homogeneous mean): title, digits, covs, rows
    [(name, cells)]; a cell is value, half width of its 95 % interval, and shade, None where there
    is no such case."""
    name, cases = summary["primary"], summary["cases"]
    covs = sorted({case["cov"] for case in cases})
    names = list(dict.fromkeys(_row_name(case) for case in cases))
    at = {(_row_name(case), case["cov"]): case for case in cases}
    tables = []
    for title, digits, estimate in (
        ("mean [m]", 3, lambda case: _of(case["runouts"][name], "mean")),
        ("standard deviation [m]", 3, lambda case: _of(case["runouts"][name], "sd")),
        ("P(S > homogeneous)", 2, lambda case: _share(case["against_floor"][name])),
    ):
        grid = [
            [estimate(at[row, cov]) if (row, cov) in at else (math.nan, math.nan) for cov in covs]
            for row in names
        ]
        shades = _shades(np.array([[value for value, _ in cells] for cells in grid]))
        rows = [
            (row, [_cell(*cell, shade) for cell, shade in zip(cells, shades_of_row)])
            for row, cells, shades_of_row in zip(names, grid, shades)
        ]
        tables.append({"title": title, "digits": digits, "covs": covs, "rows": rows})
    return tables


def _row_name(case: dict) -> str:
    return " ".join([case["acf"].upper(), *(f"{k}={v}" for k, v in case["varied"].items())])


def _of(row: dict, key: str):
    return row[key], 0.5 * (row[f"{key}_high"] - row[f"{key}_low"])


def _share(against: dict):
    e = against["exceedance"]
    return e["share"]["value"], 0.5 * (e["high"] - e["low"])


def _cell(value: float, half: float, shade: float) -> dict:
    return {"value": value, "half": half, "shade": shade if math.isfinite(shade) else None}


def _shades(values: np.ndarray) -> np.ndarray:
    known = values[np.isfinite(values)]
    reach = float(np.ptp(known)) if len(known) else 0.0
    return (
        DARKEST * (values - known.min()) / reach if reach > 0.0 else np.full(values.shape, np.nan)
    )
