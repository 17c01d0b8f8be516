"""The paper's homogeneous column: runouts by all four definitions for the three schemes, two CFL numbers and two
damping coefficients, and the damping at which the farthest point reaches the paper's 60.03 dm.

Usage: homogeneous_table.py SGIMP_EXECUTABLE CASE.nml [--ranks 2] [--calibrate]

Each entry is the nominal run and, behind it, mean +- standard deviation of the homogeneous members (nominal and
jittered). Prints a Markdown table. The farthest point of one run is a draw, so the calibration is on the mean of the
members: with secant steps on ln(damping), to 0.5 dm, half of the standard deviation of that mean.
"""

import argparse
import math
import re
import subprocess
import tempfile
from pathlib import Path

import h5py
import numpy as np
from launch import environment, on_ranks

TARGET = 6.003
RUNOUTS = ("runout_max", "runout_connected", "runout_q995", "runout_q99")


def run(options, directory, scheme, cfl, damping):
    """Runs the case with other values and returns its columns."""
    text = options.case.read_text()
    text = re.sub(r"damping=[0-9.]+", f"damping={damping!r}", text)
    text = re.sub(r"scheme='\w+'", f"scheme='{scheme}'", text)
    text = re.sub(r"cfl=[0-9.]+", f"cfl={cfl}", text)
    text = re.sub(r"_interval=[0-9.]+", "_interval=0", text)
    case = Path(directory) / "case.nml"
    case.write_text(text)
    result = Path(directory) / f"{scheme}_{cfl}_{damping}"
    command = [options.executable, case, "--output", result, "--overwrite"]
    if options.ranks > 1:
        command = on_ranks(options.ranks, command)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment())
    with h5py.File(result / "ensemble.h5") as file:
        group = file["cases/deterministic"]
        names = (*RUNOUTS, "height_wall", "seconds", "steps")
        return {name: group[name][:] for name in names}


def entry(values):
    """Nominal value, and mean and standard deviation of all members."""
    return f"{values[0]:.3f} ({values.mean():.3f} +- {values.std(ddof=1):.3f})"


def print_table(options, directory, dampings):
    """All combinations, in metres."""
    print("| scheme | CFL | damping 1/s | farthest | connected | 99.5 % | 99 % | height | s/member |")
    print("|---|---|---|---|---|---|---|---|---|")
    for damping in dampings:
        for scheme in ("usf", "usl", "musl"):
            for cfl in (0.2, 0.4):
                columns = run(options, directory, scheme, cfl, damping)
                entries = " | ".join(entry(columns[name]) for name in (*RUNOUTS, "height_wall"))
                seconds = np.median(columns["seconds"])
                print(f"| {scheme} | {cfl} | {damping} | {entries} | {seconds:.2f} |", flush=True)


def calibrate(options, directory, scheme):
    """Damping at which the mean farthest point is at the target, by secant steps on its logarithm."""
    logs, fronts = [math.log(0.4), math.log(0.7)], []
    while True:
        if len(fronts) >= 2:
            slope = (fronts[-1] - fronts[-2]) / (logs[-1] - logs[-2])
            slope = min(slope, -0.4)
            logs.append(min(max(logs[-1] + (TARGET - fronts[-1]) / slope, math.log(0.05)), math.log(3)))
        damping = round(math.exp(logs[len(fronts)]), 3)
        front = run(options, directory, scheme, 0.4, damping)["runout_max"]
        fronts.append(front.mean())
        print(
            f"calibration {scheme}: damping {damping} 1/s, farthest point {front.mean():.3f} m, "
            f"nominal {front[0]:.3f} m, sd {front.std(ddof=1):.3f} m",
            flush=True,
        )
        if abs(front.mean() - TARGET) < 0.05 or len(fronts) > 9:
            return


def main():
    """Parses the command line and prints what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("executable", type=lambda name: Path(name).resolve())
    parser.add_argument("case", type=Path)
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--damping", type=float, nargs="*", default=[2.0, 0.4])
    parser.add_argument("--calibrate", nargs="*", default=[], metavar="SCHEME")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        for scheme in options.calibrate:
            calibrate(options, directory, scheme)
        print_table(options, directory, options.damping)


if __name__ == "__main__":
    main()
