"""What other settings cost in runout and save in time: the same members with both.

Usage: settings.py SGIMP_EXECUTABLE CASE.nml [--from solver.precision=double ...] [--to solver.precision=single ...]
                   [--set GROUP.KEY=VALUE ...] [--realizations 20] [--noise-members 8] [--rounds 1] [--ranks 1]
                   [--scratch DIR]

Each round runs the case with the keys of --from and then with those of --to (by default double and single precision);
keys of --set hold for both; lists are written a,b. Prints, for every case of the study and each runout: the mean of the
first, mean and standard deviation over members of the second less the first, the standard error of that mean, the
largest difference, and the noise floor: the standard deviation of the homogeneous members, which differ in nothing
physical. A difference of two members that know nothing of each other spreads by 1.4 of it. Times are paired: seconds
of a member with the second settings over those with the first, the least of all rounds, and the same per step.
Run it again with the same --scratch and it goes on where it was stopped.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from launch import run_members

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "verification"))
from runner import write_changed

RUNOUTS = ("runout_max", "runout_q99", "runout_q995", "runout_connected")
TOLD = ("settle_time", "energy_error")
COLUMNS = (*RUNOUTS, *TOLD, "status", "steps", "seconds")
NO_OUTPUT = dict.fromkeys(f"output.{name}" for name in ("snapshot_members", "snapshot_interval", "history_interval"))


def value_of(text):
    """A number where the text is one, a list where it has commas."""
    if "," in text:
        return [value_of(part) for part in text.split(",")]
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def key_and_value(text):
    """(group.key, value)"""
    key, _, value = text.partition("=")
    return key, value_of(value)


def arguments():
    """Parses the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("executable", type=lambda name: Path(name).resolve())
    parser.add_argument("case", type=Path)
    changes = {"type": key_and_value, "nargs": "+", "metavar": "GROUP.KEY=VALUE"}
    parser.add_argument("--from", dest="first", default=[("solver.precision", "double")], **changes)
    parser.add_argument("--to", dest="second", default=[("solver.precision", "single")], **changes)
    parser.add_argument("--set", dest="both", default=[], **changes)
    parser.add_argument("--realizations", type=int, help="of each case of a study; as the case has it")
    parser.add_argument("--noise-members", type=int, help="homogeneous members; as the case has it")
    parser.add_argument("--rounds", type=int, default=1, help="runs of each member with each settings")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--mpiexec", default="mpirun")
    parser.add_argument("--scratch", type=Path, help="keeps the runs here")
    return parser.parse_args()


def run(options, scratch, name, changes):
    """Columns of all members, {case of the study: {column: [members]}}."""
    changes = NO_OUTPUT | dict(options.both) | dict(changes)
    for key in ("realizations", "noise_members"):
        if getattr(options, key) is not None:
            changes[f"monte_carlo.{key}"] = getattr(options, key)
    directory = scratch / name
    namelist = directory.with_suffix(".nml")
    write_changed(options.case, changes, namelist)
    return run_members(options, namelist, directory, COLUMNS)


def compare(label, first, second, noise):
    """Rows of the table for one case of the study."""
    good = (first["status"] == 0) & (second["status"] == 0)
    for name in (*RUNOUTS, *TOLD) if good.any() else ():
        change = (second[name] - first[name])[good]
        spread = np.std(change, ddof=1) if len(change) > 1 else np.nan
        floor = np.std(noise[name], ddof=1) if len(noise[name]) > 1 else np.nan
        print(
            f"| {label} | `{name}` | {len(change)} | {first[name][good].mean():.4f} | {change.mean():+.4f} "
            f"+- {spread / np.sqrt(len(change)):.4f} | {spread:.4f} | {np.abs(change).max():.4f} | {floor:.4f} |"
        )
    if not good.all():
        failed = [np.count_nonzero(rows["status"]) for rows in (first, second)]
        print(f"| {label} | failed members, first and second | {failed[0]} {failed[1]} | | | | | |")


def pooled(cases):
    """Columns of the members of all random fields."""
    fields = [rows for label, rows in cases.items() if label != "deterministic"]
    return {name: np.concatenate([rows[name] for rows in fields]) for name in COLUMNS}


def all_seconds(rounds):
    """Seconds of each member, the least of all rounds, and its steps."""
    each = [np.concatenate([rows["seconds"] for rows in one.values()]) for one in rounds]
    return np.min(each, axis=0), np.concatenate([rows["steps"] for rows in rounds[0].values()])


def print_times(first, second):
    """Ratios of the second to the first over all members, from [round: {label: columns}]."""
    (before, steps_before), (after, steps_after) = all_seconds(first), all_seconds(second)
    ratio = after / before
    per_step = ratio * steps_before / steps_after
    print(
        f"time of {len(ratio)} members, second over first: median {np.median(ratio):.3f}, from {ratio.min():.3f} to "
        f"{ratio.max():.3f}; per step {np.median(per_step):.3f}; sums {after.sum():.1f} s over {before.sum():.1f} s"
    )


def main():
    """Both settings in turns, and what differs."""
    options = arguments()
    with tempfile.TemporaryDirectory(prefix="sgimp_settings_") as directory:
        scratch = options.scratch or Path(directory)
        scratch.mkdir(parents=True, exist_ok=True)
        first, second = [], []
        for turn in range(options.rounds):
            first.append(run(options, scratch, f"first_{turn}", options.first))
            second.append(run(options, scratch, f"second_{turn}", options.second))
    before, after = first[0], second[0]
    print("| case | column | members | first | second less first | sd | largest | noise floor |")
    print("|---|---|---|---|---|---|---|---|")
    for label in before:
        compare(label, before[label], after[label], before["deterministic"])
    if len(before) > 2:
        compare("all fields", pooled(before), pooled(after), before["deterministic"])
    print_times(first, second)


if __name__ == "__main__":
    main()
