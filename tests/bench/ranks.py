"""The whole job on 1 rank and on more, in turns: speed-up, and the share of the ranks' time that members take.

Usage: ranks.py SGIMP_EXECUTABLE CASE.nml [--ranks 2] [--pairs 3] [--mpiexec mpirun]

On a shared machine the speed-up falls with what others do; the busy share, the sum of the members' wall times over
ranks x wall time of the run, does not: it is what scheduling, start-up and output leave. Speed-up = ranks x busy share
x (time of a member alone) / (time of a member beside others).
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from launch import timed_run


def arguments():
    """Parses the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("executable", type=lambda name: Path(name).resolve())
    parser.add_argument("case", type=Path)
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--mpiexec", default="mpirun")
    return parser.parse_args()


def run(options, ranks, directory):
    """Wall time of a run, the sum of its members' times, in s, and their number."""
    wall, cases = timed_run([options.executable, options.case], directory, ranks, options.mpiexec)
    members = np.concatenate(list(cases.values()))
    return wall, members.sum(), len(members)


def main():
    """Prints one line a pair."""
    options = arguments()
    speed_ups = []
    with tempfile.TemporaryDirectory(prefix="sgimp_ranks_") as directory:
        for _ in range(options.pairs):
            one, busy_one, members = run(options, 1, directory)
            many, busy_many, _ = run(options, options.ranks, directory)
            speed_ups.append(one / many)
            shares = 100 * busy_one / one, 100 * busy_many / (options.ranks * many)
            print(
                f"{members} members: {one:.2f} s on 1 rank, {many:.2f} s on {options.ranks}, speed-up "
                f"{one / many:.3f}; busy {shares[0]:.2f} % and {shares[1]:.2f} %; a member takes "
                f"{busy_many / busy_one:.3f} times as long",
                flush=True,
            )
    print(f"speed-up {np.median(speed_ups):.3f} (median of {options.pairs})")


if __name__ == "__main__":
    main()
