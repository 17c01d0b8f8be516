"""Runs a case of input/verification and compares its own output files with the reference.

Usage: verify.py CASE SGIMP_EXECUTABLE INPUT_DIRECTORY
Prints one line `case: quantity: reference, ours, error, allowed` for each quantity; exit code 1 if one is missed.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np


def run(case, executable, inputs, directory):
    """Runs the namelist in `directory` and returns its snapshot file."""
    subprocess.run(
        [executable, inputs / f"{case}.nml", "--output", directory],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return h5py.File(directory / "snapshots" / "deterministic_r000001.h5", "r")


def last_state(snapshots):
    """The group of the last step."""
    return snapshots[max(name for name in snapshots if name.startswith("step_"))]


def self_weight_column(snapshots):
    """Case 9, rate form: dX/dx = exp(rho0 g (L - X)/E); demand 0.1 % of the height at 64 cells.

    The height is extrapolated by half a spacing from the two highest points, since the widths of uGIMP points
    stay as they were. The stress demand allows what the top and bottom rows of a first-order method miss.
    """
    young, weight, length = 1.0e6, 800.0, 50.0
    # y(X) is the integral of exp(-w (L - X)/E): the stretch of the point at X carries the weight above it.
    height = young / weight * (1.0 - np.exp(-weight * length / young))
    state = last_state(snapshots)
    y = np.unique(state["position"][:, 1].round(12))
    start = state["position"][:, 1] - state["displacement"][:, 1]
    top = y[-1] + 0.5 * (y[-1] - y[-2])
    stress = state["stress"][:, 1]
    exact = -weight * (length - start)
    yield "height (closed form)", 49.01320, height, 1e-5 / 49
    yield "height", height, top, 1e-3
    error = np.sqrt(np.mean((stress - exact) ** 2)) / (weight * length)
    yield "stress, root mean square over rho0 g L", 1.0, 1.0 + error, 1e-2


def gravity_oscillation(snapshots):
    """Case 10: period 4 L/c = 0.40117 s within 1 %, top between 0 and twice the settlement within 2 %.

    The top moves as its highest edge does: points at the top move with it to within half a point.
    The period is read from the minima of the height, refined by a parabola.
    """
    settlement, period = 0.0493, 0.40117
    time = snapshots["history/time"][:]
    top = snapshots["history/height_max"][:]
    drop = top[0] - top
    lows = [
        k
        for k in range(1, len(drop) - 1)
        if drop[k] == drop[max(0, k - 40) : k + 41].max() and drop[k] > settlement
    ]
    instants = []
    for k in lows:
        a, b, c = drop[k - 1 : k + 2]
        instants.append(time[k] + 0.5 * (a - c) / (a - 2 * b + c) * (time[k + 1] - time[k]))
    yield "period", period, np.mean(np.diff(instants)), 0.01
    # The first peak: later ones are rounded by the dispersion of the kink that runs through the column.
    yield "largest drop of the top", 2 * settlement, drop.max(), 0.02
    yield "return of the top", 1.0, 1.0 + drop[lows[0] :].min() / (2 * settlement), 0.05


CASES = {"self_weight_column": self_weight_column, "gravity_oscillation": gravity_oscillation}


def main():
    """Runs and judges one case."""
    case, executable, inputs = sys.argv[1], Path(sys.argv[2]).resolve(), Path(sys.argv[3])
    missed = 0
    with tempfile.TemporaryDirectory() as directory:
        snapshots = run(case, executable, inputs, Path(directory) / case)
        for quantity, reference, ours, allowed in CASES[case](snapshots):
            error = abs(ours - reference) / abs(reference)
            missed += error > allowed
            print(
                f"{case}: {quantity}: reference {reference:.6g}, ours {ours:.6g}, "
                f"error {error:.2e}, allowed {allowed:.0e}{'' if error <= allowed else '  MISSED'}"
            )
        snapshots.close()
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
