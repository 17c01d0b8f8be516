"""`sgimp-post allocate`: from a pilot with twins on coarser cells to the size of the next run."""

from __future__ import annotations

import math

import numpy as np

from .analysis import analyse
from .control_variates import FEWEST, allocate_for_cost, allocate_for_half_width
from .ensemble import RUNOUTS, read_ensemble
from .errors import PostError
from .statistics import CONFIDENCE, _z, correlation_interval

#: Of one case, as the program has it.
MOST_MEMBERS = 1e9


def run(options) -> int:
    """Prints the table; exit code 0."""
    for name in ("half_width", "hours"):
        value = getattr(options, name)
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise PostError(f"--{name.replace('_', '-')} must be above zero")
    ensemble = read_ensemble(options.directory)
    controls = [case for case in ensemble.cases if case.role == "control"]
    if not controls:
        raise PostError(
            f"{options.directory}: no case has a twin on coarser cells: a pilot needs control cases"
        )
    summary = analyse(ensemble, options.runout)
    if summary["sampling"] not in ("", "random"):
        raise PostError(
            f"{options.directory}: sampling='{summary['sampling']}': members are not independent;"
            " the pilot needs sampling='random'"
        )
    pilots = [
        entry
        for entry in summary["controls"]
        if entry["twin"] and math.isfinite(entry["correlation"])
    ]
    if not pilots:
        raise PostError(f"{options.directory}: too few finished pairs: 9 or more are needed")
    for line in _lines(pilots, options):
        print(line)
    return 0


def _lines(pilots: list, options):
    yield f"mean of {options.runout} ({RUNOUTS[options.runout]})"
    yield (
        f"{'case':<24} {'pairs':>6} {'r (95 %)':>21} {'w':>7} {'gain':>6} {'M/n':>6}"
        f" {'members':>9} {'twins':>9} {'plain':>9}"
    )
    found = []
    for entry in pilots:
        n, twins, plain = _numbers(entry, options, len(pilots))
        pairs = next(r["n"] for r in entry["rows"] if r["control"] == "twin")
        low, high = correlation_interval(entry["correlation"], pairs)
        r = f"{entry['correlation']:.3f} ({low:.3f}, {high:.3f})"
        yield (
            f"{entry['case']:<24} {pairs:>6} {r:>21} {entry['cost_ratio']:>7.2f}"
            f" {entry['predicted_gain']:>6.2f} {entry['best_ratio']:>6.1f} {n or '-':>9}"
            f" {twins or '-':>9} {plain or '-':>9}"
        )
        found.append((n, twins, plain))
    yield "r: correlation of a member with its twin; w: cost of a member over that of its twin;"
    yield "gain: variance of plain Monte Carlo over that with twins at equal core-hours, if r holds"
    losing = [entry["case"] for entry in pilots if entry["predicted_gain"] <= 1.0]
    if losing:
        yield "the twin costs more than it brings in: " + ", ".join(losing)
    if options.half_width is None and options.hours is None:
        yield "--half-width or --hours turns this into numbers of members"
        return
    # The numbers of members are those of a namelist, which all cases share.
    choose = max if options.half_width is not None else min
    n, twins, plain = (choose(column) for column in zip(*found))
    hours = sum(e["seconds"] * (n + twins / e["cost_ratio"]) for e in pilots) / 3600.0
    yield (
        f"realizations = {n}, control realizations = {twins} in each case:"
        f" {hours:.3g} core-hours (plain Monte Carlo: {plain} realizations)"
    )


def _numbers(entry, options, cases: int):
    """(n, M, plain n) of one case; zeros where nothing is asked. Hours are shared equally."""
    r, w = entry["correlation"], entry["cost_ratio"]
    if options.half_width is not None:
        root = _z(CONFIDENCE) * entry["sd"] / options.half_width
        if not root <= MOST_MEMBERS**0.5:
            raise PostError(f"--half-width asks for more than {MOST_MEMBERS:.0e} members of a case")
        plain = int(np.ceil(root**2))
        return *allocate_for_half_width(entry["sd"], r, w, options.half_width), plain
    if options.hours is not None:
        plain = 3600.0 * options.hours / cases / entry["seconds"]
        if not plain <= MOST_MEMBERS:
            raise PostError(f"--hours pays for more than {MOST_MEMBERS:.0e} members of a case")
        n, twins = allocate_for_cost(r, w, int(plain))
        if n <= FEWEST:
            raise PostError(f"--hours does not pay for {FEWEST + 1} members of each case")
        return n, twins, int(plain)
    return 0, 0, 0
