"""What the paper says of its statistics, its numerics and its fields, each statement with its
verdict; and how its gaps are read."""

from __future__ import annotations

from functools import partial

import numpy as np

from .fits import LAWS, UNDECIDED
from .paper import BLOCK
from .paper_verdicts import (
    DOES_NOT,
    NONE_YET,
    OPEN,
    REPRODUCES,
    Statement,
    floor_text,
    for_all,
    judge,
    of_all,
    p_text,
    spans,
)
from .printed import COVS, NUMBERS


def statements(n: dict) -> list:
    """Of the numbers of `compare_with_paper`."""
    return [
        _best_law(n),
        _converged(n),
        _rule(n),
        _isotropic(n),
        _clipped(n),
    ]


def _best_law(n) -> Statement:
    def verdict(row):
        lead = min(d for law, d in row["delta_aic"].items() if law != row["best"])
        if row["best"] == "gumbel":
            return REPRODUCES if lead >= UNDECIDED else OPEN
        return DOES_NOT if row["delta_aic"]["gumbel"] >= UNDECIDED else OPEN

    laws, numbers = [row for row in n["laws"] if row["best"]], NONE_YET
    texts = [
        f"{row['acf'].upper()} {LAWS[row['best']]} (Gumbel: ΔAIC {row['delta_aic']['gumbel']:.1f},"
        f" p {p_text(row['p_value'].get('gumbel', np.nan), row['least_p'])})"
        for row in laws
    ]
    if laws:
        numbers = f"of {min(row['n'] for row in laws)} and more members: {'; '.join(texts)}"
        hopeless = [row["acf"].upper() for row in laws if row["none_fits"]]
        if hopeless:
            numbers += f"; best of the four, but none fits: {', '.join(hopeless)}"
    return Statement(
        "best_law",
        "4.2.1, Table 5",
        "Gumbel's law fits best with every function",
        {n["runout"]: for_all(laws, verdict)},
        numbers,
        f"laws within {UNDECIDED:g} in AIC cannot be told apart; p: Anderson and Darling's test of"
        " whether the members can be of the law at all",
    )


def _converged(n) -> Statement:
    early = NUMBERS["converged"].value
    rows = [row for row in n["convergence"] if row["later_n"] >= BLOCK]

    def verdict(row):
        return of_all(
            judge(row[f"{key}_low"], row[f"{key}_high"], nothing, nothing)
            for key, nothing in (("later_shift", 0.0), ("later_sd_ratio", 1.0))
        )

    numbers = f"fewer than {early + BLOCK} members"
    if rows:
        halves = [row["early_half_width"] for row in rows]
        numbers = (
            f"at {early}: means ± {min(halves):.2f} to {max(halves):.2f} dm; the"
            f" {min(row['later_n'] for row in rows)} and more members after: "
            + spans(rows, "later_shift", "later_shift_low", "later_shift_high")
            + " dm"
        )
    own = [row["sd"] for row in n["implied"]]
    half = 1.96 * max(own) / np.sqrt(NUMBERS["converged"].value)
    return Statement(
        "converged",
        NUMBERS["converged"].place,
        "Statistics have converged after about 700 simulations",
        {n["runout"]: for_all(rows, verdict)},
        numbers,
        f"the members after the first {early}, {BLOCK} at least, against those: mean (Welch) and sd"
        f" (Shoemaker), all at once; with the paper's spread {early} members leave ± {half:.1f} dm",
    )


def _rule(n) -> Statement:
    rows = [row for row in n["convergence"] if row["rule_n"]]
    tolerance = NUMBERS["tolerance"].value
    numbers, verdict = "not met by the members there are", OPEN
    if rows:
        counts = [row["rule_n"] for row in rows]
        halves = [row["rule_half_width"] for row in rows]
        numbers = (
            f"met first after {min(counts)} to {max(counts)} members, where means are known to"
            f" ± {min(halves):.2f} to {max(halves):.2f} dm"
        )
        verdict = DOES_NOT if min(halves) > tolerance else REPRODUCES
    return Statement(
        "rule",
        NUMBERS["tolerance"].place,
        "Means that change by less than 1e-3 from one simulation to the next have converged",
        {n["runout"]: verdict},
        numbers,
        "the change goes as s/N, the error as s/√N: the rule bounds no error",
    )


def _isotropic(n) -> Statement:
    shapes = {row["acf"]: row for row in n["shapes"]}
    verdict = of_all(
        REPRODUCES
        if np.isclose(shapes[acf]["along_axis"], shapes[acf]["along_diagonal"], rtol=1e-9)
        else DOES_NOT
        for acf in ("smk", "sqx")
    )
    texts = [
        f"{acf.upper()} {shapes[acf]['along_axis']:.3f} and {shapes[acf]['along_diagonal']:.3f}"
        for acf in ("sqx", "smk")
    ]
    return Statement(
        "isotropic",
        "2.3, Fig. 3",
        "The surfaces of SMK and SQX are isotropic",
        {"": verdict},
        f"half a scale away, along an axis and along the diagonal: {'; '.join(texts)}",
        "of the products of Table 1 only that of SQX is a function of the distance",
    )


def _clipped(n) -> Statement:
    rows = [row for row in n["clipped"] if np.isclose(row["cov"], max(COVS))]
    keys = n["settings"]
    numbers, verdict = NONE_YET, OPEN
    if rows:
        share = max(row["clipped"] for row in rows)
        low, high = min(r["field_min"] for r in rows), max(r["field_max"] for r in rows)
        numbers = f"angles from {low:.1f}° to {high:.1f}°, {100 * share:.2g} % of the points set to"
        numbers += " a bound"
        if keys["lower"] is not None:
            numbers += f" ({keys['lower']:g} and {keys['upper']:g} degrees)"
        verdict = REPRODUCES if share * NUMBERS["points"].value < 1.0 else DOES_NOT
    return Statement(
        "clipped",
        "3.1.2, Table 4",
        f"The friction angle follows a normal law at COV {max(COVS):.2f}",
        {"": verdict},
        numbers,
        "a normal law has no bounds, an angle has; less than one point of a field is changed"
        if verdict == REPRODUCES
        else "a normal law has no bounds, an angle has",
    )


def readings(n: dict) -> list:
    """How the gaps of the paper are read: (printed, reading, this run)."""
    keys, own = n["settings"], partial(_setting, n["settings"])
    spacing = keys["point_spacing"]
    count = round(NUMBERS["width"].value / spacing) ** 2 if spacing else None
    nodes = None
    if keys["cell_size"] and keys["x_max"] and keys["y_max"]:
        nodes = 2 * np.prod([round(keys[k] / keys["cell_size"]) + 1 for k in ("x_max", "y_max")])
    return [
        (
            'cell side "0.125 mm (1.25 dm)", points of "radius 0.0625 m"',
            "cells of 0.125 m, points 0.0625 m apart: 80 x 80 = 6400, as printed",
            f"cells of {own('cell_size', unit='m')}, {count or '–'} points",
        ),
        (
            '"10170 background grids"',
            "113 x 45 x 2, the nodes of one layer of 14.0 m x 5.5 m; the text has 20 m",
            f"{own('x_max')} m x {own('y_max')} m, {nodes or '–'} nodes in two layers",
        ),
        (
            "time increment 2.0e-2 s",
            "step from the CFL number",
            f"CFL {own('cfl')}, mean step {n['settle_time']['time_step']:.2e} s"
            if np.isfinite(n["settle_time"]["time_step"])
            else f"CFL {own('cfl')}",
        ),
        (
            "damping coefficient 2, no unit",
            "1/s in Eq. 14; `as_printed` has 2, the study the one that gives 60.03 dm",
            own("damping", unit="1/s"),
        ),
        (
            "S_x = 60.03 dm; fronts at 110 to 120 dm",
            "S_x from the initial toe at 50 dm; 60.03 dm is 1.2 times the width of 50 dm, Lube's"
            " law at an aspect ratio of 1",
            floor_text(n["homogeneous"][n["runout"]]),
        ),
        (
            "Table 1, SQX: δ = √π b",
            "δ = √π/b, as the two-dimensional form has it; then 2∫ρ dτ = δ as for all",
            "2∫ρ dτ/δ: "
            + ", ".join(f"{s['acf'].upper()} {s['twice_integral']:.6f}" for s in n["shapes"]),
        ),
        ('Table 1, "CSK"; "if i ≤ N the MCS is aborted"', "CSX; continue while i ≤ N", "–"),
        (
            "converged when mean and variance change by less than 1e-3",
            "`stop_rule='successive'` offers it; the study runs a count",
            f"{own('realizations')} realizations",
        ),
        (
            "1000 realizations of each case; 5000 simulations",
            "1000 of each of 5 functions x 3 COVs",
            f"{n['totals']['done']} of {n['totals']['planned']} members",
        ),
        (
            "initial stress, cohesion, dilation, tension: nothing",
            "none, gravity switched on; 0, 0, 0",
            f"initial stress {own('initial_stress') or '–'}; cohesion, dilation, tension"
            f" {own('cohesion', 'dilation_angle', 'tension_strength') or '–'}",
        ),
        (
            "element of the random field: nothing",
            "one value a material point, at its initial place",
            f"averaging {own('averaging') or '–'}",
        ),
        (
            "normal law",
            "cut off at stated bounds, the share of cut points reported",
            f"{own('lower', 'upper') or '–'}"
            + (
                f"; {100 * max(r['clipped'] for r in n['clipped']):.2g} % at most"
                if n["clipped"]
                else ""
            ),
        ),
    ]


def _setting(keys: dict, *names, unit="") -> str:
    """Those of these keys that are known, with their unit."""
    known = [keys[name] for name in names if keys[name] is not None]
    text = ", ".join(f"{value:g}" if _is_number(value) else str(value) for value in known)
    return f"{text} {unit}" if known and unit else text


def _is_number(value) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
