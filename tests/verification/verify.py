"""Runs cases of input/verification and compares their own output files with the references.

Usage: verify.py --sgimp EXECUTABLE --inputs DIRECTORY [--table] [--precision double single] [CASE ...]
Without CASE all are run. Prints each number beside its reference; exit code 1 if one is missed.
`--table` prints the table of README.md instead, with both precisions beside each other if both are asked for.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import cases_beam
import cases_column
import cases_footing
import cases_manufactured
import cases_motion
import cases_relaxation
import cases_slope
import cases_stability
import cases_strength
import numpy as np
from runner import Bench

# Number in the list of demands, and the function that runs the case and judges it.
CASES = {
    "element_compression": (2, cases_strength.element_compression),
    "element_extension": (2, cases_strength.element_extension),
    "element_unconfined": (2, cases_strength.element_unconfined),
    "cones": (3, cases_strength.cones),
    "free_fall": (4, cases_motion.free_fall),
    "flying_disc": (6, cases_motion.flying_disc),
    "affine": (6, cases_motion.affine),
    "spinning_disc": (6, cases_motion.spinning_disc),
    "manufactured": (7, cases_manufactured.manufactured),
    "bar": (8, cases_column.bar),
    "self_weight_column": (9, cases_column.self_weight_column),
    "gravity_oscillation": (10, cases_column.gravity_oscillation),
    "two_discs": (11, cases_motion.two_discs),
    "frictional_plane": (12, cases_slope.frictional_plane),
    "infinite_slope": (13, cases_slope.infinite_slope),
    "cantilever": (14, cases_beam.cantilever),
    "relaxed_column": ("-", cases_relaxation.relaxed_column),
    "footing": (15, cases_footing.footing),
    "slope_stability": ("-", cases_stability.slope_stability),
}

COLUMNS = ("ours", "error", "allowed (and why)")


def table_header(precisions):
    """The columns of README.md; those of each precision, if there are more."""
    columns = COLUMNS
    if len(precisions) > 1:
        columns = [f"{precision}: {column}" for precision in precisions for column in COLUMNS]
    columns = ("case", "reference", *columns, "command")
    return "| " + " | ".join(columns) + " |\n" + "|---" * len(columns) + "|"


def table_row(number, case, checks):
    """One row of the table, from the same number in each precision; what is told and not judged has no error."""
    cells = [f"{number} {case}: {checks[0].quantity}", checks[0].reference]
    for check in checks:
        error, allowed = f"{check.error:.1e}", f"{check.allowed:.1g} ({check.why})"
        if not np.isfinite(check.allowed):
            error, allowed = "", check.why
        cells += [check.ours, error + ("" if check.is_met else " **missed**"), allowed]
    return "| " + " | ".join((*cells, f"`ctest -R verify_{case}`")) + " |"


def report(case, precisions, checks):
    """The same number in each precision, a line each."""
    for precision, check in zip(precisions, checks, strict=True):
        name = case if precision == "double" else f"{case}, {precision}"
        print(
            f"{name}: {check.quantity}: reference {check.reference}, ours {check.ours}, error "
            f"{check.error:.1e}, allowed {check.allowed:.0e}{'' if check.is_met else '  MISSED'}"
        )


def main():
    """Runs and judges the cases asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sgimp", type=Path, required=True, help="executable")
    parser.add_argument("--inputs", type=Path, required=True, help="directory of the namelists")
    parser.add_argument("--table", action="store_true", help="print rows of a table")
    parser.add_argument("--precision", nargs="+", choices=("double", "single"), default=["double"])
    parser.add_argument("case", nargs="*", choices=[*CASES, []], help="cases to run")
    options = parser.parse_args()
    missed = 0
    if options.table:
        print(table_header(options.precision))
    for case in options.case or CASES:
        number, judge = CASES[case]
        with tempfile.TemporaryDirectory() as scratch:
            benches = []
            for precision in options.precision:
                (folder := Path(scratch, precision)).mkdir()
                benches.append(Bench(options.sgimp, options.inputs, folder, precision))
            for checks in zip(*(judge(bench) for bench in benches), strict=True):
                missed += sum(not check.is_met for check in checks)
                if options.table:
                    print(table_row(number, case, checks), flush=True)
                else:
                    report(case, options.precision, checks)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
