"""Runs the members of a case to rest and, the same ones, to its end_time whatever happens, and says how far each
runout still went after rest was declared, in cells, and how many steps were saved.

Usage: rest.py SGIMP_EXECUTABLE CASE.nml [--settle 1e-3 1e-4] [--realizations 7] [--end-time 16] [--scratch DIR]
               [--ranks 1] [--most runout_q995=0.5 ...] [--mean runout_q995=0.1 ...]

Run it again with the same --scratch and it goes on where it was stopped. --most and --mean make it a test: exit code 1
if a runout of any member, or of all on average, changes by more cells. With homogeneous members beside the random
fields, the standard deviation of their runouts, the noise floor, is told for comparison; they are rows like the others.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from launch import run_members
from scipy import stats

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "verification"))
from runner import read_namelist, write_changed

RUNOUTS = ("runout_max", "runout_q99", "runout_q995", "runout_connected")
COLUMNS = (*RUNOUTS, "status", "settled", "settle_time", "steps")


def bound(text):
    """What --most and --mean take."""
    name, most = text.split("=")
    return name, float(most)


def arguments():
    """Parses the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("executable", type=lambda name: Path(name).resolve())
    parser.add_argument("case", type=Path)
    parser.add_argument("--settle", type=float, nargs="+", help="shares of the peak; as the case has it")
    parser.add_argument("--realizations", type=int, help="of each case of the study; as the case has it")
    parser.add_argument("--end-time", type=float, help="of all runs, in s; as the case has it")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--mpiexec", default="mpirun")
    parser.add_argument("--scratch", type=Path, help="keeps the runs here")
    parser.add_argument("--most", type=bound, nargs="*", default=[], metavar="RUNOUT=CELLS")
    parser.add_argument("--mean", type=bound, nargs="*", default=[], metavar="RUNOUT=CELLS")
    return parser.parse_args()


def run(options, scratch, settle):
    """Columns of all members of the case, [members], by name; nominal is where the case is homogeneous."""
    changes = {"solver.settle": settle, "output.snapshot_members": None, "output.snapshot_interval": None}
    if options.realizations:
        changes["monte_carlo.realizations"] = options.realizations
    if options.end_time:
        changes["solver.end_time"] = options.end_time
    name = "long" if settle == 0 else f"settle_{settle:g}"
    namelist = scratch / f"{name}.nml"
    write_changed(options.case, changes, namelist)
    cases = run_members(options, namelist, scratch / name, COLUMNS)
    rows = {c: np.concatenate([case[c] for case in cases.values()]) for c in COLUMNS}
    rows["case"] = np.repeat(list(cases), [len(case["status"]) for case in cases.values()])
    if (rows["status"] != 0).any():
        sys.exit(f"{np.count_nonzero(rows['status'])} members of {namelist} failed")
    return rows, cases["deterministic"]


def print_noise(homogeneous, cell):
    """Standard deviation of the homogeneous members, in cells."""
    if len(homogeneous["status"]) < 2:
        return
    spread = ", ".join(f"{name} {np.std(homogeneous[name], ddof=1) / cell:.2f}" for name in RUNOUTS)
    print(f"noise floor, standard deviation in cells: {spread}")


def print_cases(rows, long):
    """Whether rest shifts the cases with a random field alike and leaves their spread as it is."""
    masks = [rows["case"] == case for case in np.unique(rows["case"]) if case != "deterministic"]
    if len(masks) < 2 or min(mask.sum() for mask in masks) < 3:
        return
    for name in RUNOUTS:
        at_rest, after = (np.sqrt(np.mean([columns[name][mask].var() for mask in masks])) for columns in (rows, long))
        change = long[name] - rows[name]
        odds = stats.f_oneway(*(change[mask] for mask in masks)).pvalue
        print(
            f"{name}: standard deviation within cases at rest {at_rest / after:.3f} of that afterwards; changes of "
            f"{len(masks)} cases differ with p = {odds:.2f} (F test)"
        )


def compare(settle, rows, long, cell):
    """Prints one settle value; returns the largest and the mean change of each runout, in cells."""
    rested = rows["settled"] == 1
    saved = 1 - rows["steps"].sum() / long["steps"].sum()
    print(
        f"settle {settle:g}: {rested.sum()} of {len(rested)} members at rest, since "
        f"{rows['settle_time'][rested].mean():.2f} s on average; {rows['steps'].mean():.0f} steps each, "
        f"{100 * saved:.1f} % saved"
    )
    print("| change after rest, in cells | mean | of a case, from | to | 99 % | largest |\n|---|---|---|---|---|---|")
    largest, mean = {}, {}
    for name in RUNOUTS:
        change = (long[name] - rows[name]) / cell
        largest[name], mean[name] = np.abs(change).max(), change.mean()
        ninety_nine = np.quantile(np.abs(change), 0.99)
        means = [change[rows["case"] == case].mean() for case in np.unique(rows["case"])]
        print(
            f"| `{name}` | {mean[name]:+.3f} | {min(means):+.3f} | {max(means):+.3f} | {ninety_nine:.3f} "
            f"| {largest[name]:.3f} |"
        )
    print_cases(rows, long)
    if not rested.all():
        sys.exit("not all members came to rest: give a longer --end-time")
    return largest, mean


def main():
    """All settle values against the long run."""
    options = arguments()
    keys = {group: values for group, values in read_namelist(options.case)}
    cell = float(keys["grid"]["cell_size"])
    shares = options.settle or [float(keys["solver"]["settle"])]
    beyond = []
    with tempfile.TemporaryDirectory(prefix="sgimp_rest_") as directory:
        scratch = options.scratch or Path(directory)
        scratch.mkdir(parents=True, exist_ok=True)
        runs = {settle: run(options, scratch, settle)[0] for settle in shares}
        long, homogeneous = run(options, scratch, 0.0)
    print(f"{len(long['status'])} members, to {long['steps'].mean():.0f} steps each without a rest")
    print_noise(homogeneous, cell)
    for settle, rows in runs.items():
        largest, mean = compare(settle, rows, long, cell)
        for what, values, bounds in (("largest", largest, options.most), ("mean", mean, options.mean)):
            too_large = [(name, most) for name, most in bounds if abs(values[name]) > most]
            beyond += [f"{what} {name} {values[name]:.3f}, allowed {most}" for name, most in too_large]
    if beyond:
        sys.exit("FAILED: changes by more cells than allowed: " + ", ".join(beyond))


if __name__ == "__main__":
    main()
