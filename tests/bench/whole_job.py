"""The whole job on this machine, from a few members of it: wall time, idle share, and how long all of it would take.

    whole_job.py EXE CASE --members N [--ranks 2] [--acf snx] [--out DIR]

Runs one autocorrelation function of CASE (input/paper/baseline.nml, or another with &study) with N realizations and its
homogeneous members, from the start. Then, for R ranks, and members of the mean wall time that these had,

    wall = members x mean member time / ranks / busy share

for 1000 realizations of one function and for the study of 5 functions x 3 COV x 1000, each with the homogeneous
members. The busy share is the members' time over ranks x wall time. What is lost (start-up, the last member of each
rank, output) hardly grows with the members, so that it is a larger share of a small run than of the whole job; the same
with the idle time of this run instead of its share is printed too, as the shorter of the two. Members of other
functions and COVs are taken to cost as much as these, which is not measured here. Wall times are of this machine as it
was: with other work on it they say nothing.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from launch import timed_run

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "verification"))
from runner import write_changed

REALIZATIONS, STUDY_CASES = 1000, 15


def arguments():
    """Parses the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("executable", type=lambda name: Path(name).resolve())
    parser.add_argument("case", type=Path)
    parser.add_argument("--members", type=int, required=True, help="realizations; the homogeneous members come on top")
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--acf", default="snx")
    parser.add_argument("--out", type=Path, help="keeps the run here")
    parser.add_argument("--mpiexec", default="mpirun")
    return parser.parse_args()


def in_words(seconds):
    """Hours and minutes."""
    return f"{seconds / 3600:.2f} h" if seconds >= 3600 else f"{seconds / 60:.1f} min"


def main():
    """Runs and tells."""
    options = arguments()
    with tempfile.TemporaryDirectory(prefix="sgimp_job_") as scratch:
        out = options.out or Path(scratch)
        out.mkdir(parents=True, exist_ok=True)
        changes = {"study.acf": [options.acf], "monte_carlo.realizations": options.members}
        write_changed(options.case, changes, out / "job.nml")
        command = [options.executable, out / "job.nml"]
        wall, cases = timed_run(command, out / "run", options.ranks, options.mpiexec)
    homogeneous = cases.pop("deterministic")
    random = np.concatenate(list(cases.values()))
    busy = random.sum() + homogeneous.sum()
    idle = options.ranks * wall - busy
    share = busy / (options.ranks * wall)
    print(
        f"{len(random)} members and {len(homogeneous)} homogeneous ones on {options.ranks} ranks: {wall:.1f} s; "
        f"{busy:.1f} core-seconds in members, {idle:.1f} ({100 * (1 - share):.1f} %) idle\n"
        f"a member takes {random.mean():.3f} s (standard deviation {random.std(ddof=1):.3f}, {random.min():.3f} to "
        f"{random.max():.3f}), a homogeneous one {homogeneous.mean():.3f} s"
    )
    for name, realizations in (("one function", REALIZATIONS), ("the study", STUDY_CASES * REALIZATIONS)):
        work = realizations * random.mean() + homogeneous.sum()
        print(
            f"{name}, {realizations} + {len(homogeneous)} members: {in_words(work / options.ranks / share)} with this "
            f"idle share, {in_words((work + idle) / options.ranks)} with this idle time"
        )


if __name__ == "__main__":
    main()
