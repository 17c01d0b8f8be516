"""What single precision costs in runout and saves in time: the same members with both kernels.

Usage: precision.py SGIMP_EXECUTABLE CASE.nml ... [--realizations 20] [--noise-members 8] [--rounds 1]
                    [--scratch DIR]

Each round runs a case in double and then in single precision, on one rank. Prints, for every case of the study and
each runout: the mean in double, mean and standard deviation over members of single less double, the standard error of
that mean, the largest difference, and the noise floor: the standard deviation of the homogeneous members in double,
which differ in nothing physical. A difference of two members that know nothing of each other spreads by 1.4 of it.
Times are paired: seconds of a member in single over those in double, the least of all rounds, and the same per step.
Run it again with the same --scratch and it goes on where it was stopped.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "verification"))
from runner import change_keys, namelist_text, read_namelist

RUNOUTS = ("runout_max", "runout_q99", "runout_q995", "runout_connected")
TOLD = ("settle_time", "energy_error")
COLUMNS = (*RUNOUTS, *TOLD, "status", "steps", "seconds")
PRECISIONS = ("double", "single")


def arguments():
    """Parses the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("executable", type=lambda name: Path(name).resolve())
    parser.add_argument("case", type=Path, nargs="+")
    parser.add_argument("--realizations", type=int, help="of each case of a study; as the case has it")
    parser.add_argument("--noise-members", type=int, help="homogeneous members; as the case has it")
    parser.add_argument("--rounds", type=int, default=1, help="runs of each member in each precision")
    parser.add_argument("--scratch", type=Path, help="keeps the runs here")
    return parser.parse_args()


def run(options, case, scratch, precision, turn):
    """Columns of all members, {case of the study: {column: [members]}}."""
    groups = read_namelist(case)
    changes = {"solver.precision": precision}
    changes |= dict.fromkeys(
        [f"output.{name}" for name in ("snapshot_members", "snapshot_interval", "history_interval")]
    )
    if options.realizations and any(name == "random_field" for name, _ in groups):
        changes["monte_carlo.realizations"] = options.realizations
    if options.noise_members:
        changes["monte_carlo.noise_members"] = options.noise_members
    change_keys(groups, changes)
    directory = scratch / f"{case.stem}_{precision}_{turn}"
    namelist = directory.with_suffix(".nml")
    namelist.write_text(namelist_text(groups))
    command = [options.executable, namelist, "--output", directory]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    with h5py.File(directory / "ensemble.h5") as file:
        return {label: {c: group[c][:] for c in COLUMNS} for label, group in file["cases"].items()}


def compare(label, double, single, noise):
    """Rows of the table for one case of the study."""
    good = (double["status"] == 0) & (single["status"] == 0)
    for name in (*RUNOUTS, *TOLD):
        change = (single[name] - double[name])[good]
        spread = np.std(change, ddof=1) if len(change) > 1 else np.nan
        floor = np.std(noise[name], ddof=1) if len(noise[name]) > 1 else np.nan
        print(
            f"| {label} | `{name}` | {len(change)} | {double[name][good].mean():.4f} | {change.mean():+.4f} "
            f"+- {spread / np.sqrt(len(change)):.4f} | {spread:.4f} | {np.abs(change).max():.4f} | {floor:.4f} |"
        )
    if not good.all():
        failed = [np.count_nonzero(rows["status"]) for rows in (double, single)]
        print(f"| {label} | failed members, double and single | {failed[0]} {failed[1]} | | | | | |")


def pooled(cases):
    """Columns of the members of all random fields."""
    fields = [rows for label, rows in cases.items() if label != "deterministic"]
    return {name: np.concatenate([rows[name] for rows in fields]) for name in COLUMNS}


def print_times(runs):
    """Ratios of single to double over all members of a case, from {precision: [round: {label: columns}]}."""
    seconds, steps = {}, {}
    for precision, rounds in runs.items():
        each = [np.concatenate([rows["seconds"] for rows in one.values()]) for one in rounds]
        seconds[precision] = np.min(each, axis=0)
        steps[precision] = np.concatenate([rows["steps"] for rows in rounds[0].values()])
    ratio = seconds["single"] / seconds["double"]
    per_step = ratio * steps["double"] / steps["single"]
    print(
        f"time of {len(ratio)} members, single over double: median {np.median(ratio):.3f}, from {ratio.min():.3f} to "
        f"{ratio.max():.3f}; per step {np.median(per_step):.3f}; sums {seconds['single'].sum():.1f} s over "
        f"{seconds['double'].sum():.1f} s\n"
    )


def main():
    """All cases."""
    options = arguments()
    with tempfile.TemporaryDirectory(prefix="sgimp_precision_") as directory:
        scratch = options.scratch or Path(directory)
        scratch.mkdir(parents=True, exist_ok=True)
        for case in options.case:
            runs = {precision: [] for precision in PRECISIONS}
            for turn in range(options.rounds):
                for precision in PRECISIONS:
                    runs[precision].append(run(options, case, scratch, precision, turn))
            double, single = (runs[precision][0] for precision in PRECISIONS)
            print(f"{case.stem}\n")
            print("| case | column | members | double | single less double | sd | largest | noise floor |")
            print("|---|---|---|---|---|---|---|---|")
            for label in double:
                compare(label, double[label], single[label], double["deterministic"])
            if len(double) > 2:
                compare("all fields", pooled(double), pooled(single), double["deterministic"])
            print_times(runs)


if __name__ == "__main__":
    main()
