"""Runs cases of input/verification and compares their own output files with the references.

Usage: verify.py --sgimp EXECUTABLE --inputs DIRECTORY [--table] [CASE ...]
Without CASE all are run. Prints each number beside its reference; exit code 1 if one is missed.
`--table` prints the table of README.md instead.
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
}

COLUMNS = ("case", "reference", "ours", "error", "allowed (and why)", "command")


def table_row(number, case, check):
    """One row of README.md; a number that is told and not judged has no error."""
    error, allowed = f"{check.error:.1e}", f"{check.allowed:.1g} ({check.why})"
    if not np.isfinite(check.allowed):
        error, allowed = "", check.why
    name = f"{number} {case}: {check.quantity}"
    mark = "" if check.is_met else " **missed**"
    command = f"`ctest -R verify_{case}`"
    return "| " + " | ".join((name, check.reference, check.ours, error + mark, allowed, command)) + " |"


def main():
    """Runs and judges the cases asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sgimp", type=Path, required=True, help="executable")
    parser.add_argument("--inputs", type=Path, required=True, help="directory of the namelists")
    parser.add_argument("--table", action="store_true", help="print rows of a table")
    parser.add_argument("case", nargs="*", choices=[*CASES, []], help="cases to run")
    options = parser.parse_args()
    missed = 0
    if options.table:
        print("|", " | ".join(COLUMNS), "|\n" + "|---" * len(COLUMNS) + "|")
    for case in options.case or CASES:
        number, judge = CASES[case]
        with tempfile.TemporaryDirectory() as scratch:
            for check in judge(Bench(options.sgimp, options.inputs, scratch)):
                missed += not check.is_met
                if options.table:
                    print(table_row(number, case, check), flush=True)
                else:
                    print(
                        f"{case}: {check.quantity}: reference {check.reference}, ours {check.ours}, error "
                        f"{check.error:.1e}, allowed {check.allowed:.0e}{'' if check.is_met else '  MISSED'}"
                    )
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
