"""What threads within a member gain: the first steps of the paper's column, cells halved each time.

    threads.py BUILD_DIRECTORY [--threads 2] [--scheme usl] [--precision double] [--sizes 6400 102400 1638400]
               [--repeats 30]

By the clock, from the difference between a longer and a shorter run of bench_kernel. All runs take turns, and of each
the least time counts: other work on the cores can only add to it, and more to several threads, which wait for the last.
On cores that do other work too, run it with OMP_WAIT_POLICY=passive.
"""

import argparse
import re
import subprocess
import tempfile
from pathlib import Path

from flatness import CASE, SMALLEST

POINT_STEPS = 1.5e6  # in the longer run, at the least LEAST_STEPS steps
LEAST_STEPS = 8


def clock(program, case, end_time, scheme):
    """Steps and seconds of one run."""
    command = [str(program), str(case), repr(end_time), scheme]
    out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    steps, seconds = re.search(r"(\d+) steps,.*by the clock\s+([\d.]+) s", out).groups()
    return int(steps), float(seconds)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path, help="for instance build/release")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--scheme", default="usl")
    parser.add_argument("--precision", default="double")
    parser.add_argument("--sizes", type=int, nargs="+", default=[6400, 102400, 1638400], help="6400 times a power of 4")
    parser.add_argument("--repeats", type=int, default=30)
    given = parser.parse_args()
    program = given.build.resolve() / "tests" / "bench" / "bench_kernel"
    print(f"{'points':>8}  {'1 thread':>8}  {given.threads} threads  ratio (ns per point and step, by the clock)")
    for points in given.sizes:
        cell = 0.125 * (SMALLEST / points) ** 0.5
        end_time = 0.4 * cell / 50.0 * max(LEAST_STEPS, POINT_STEPS / points)  # waves travel at 50 m/s
        text = CASE.read_text().replace("cell_size=0.25", f"cell_size={cell!r}")
        steps, least = {}, {}
        with tempfile.TemporaryDirectory() as scratch:
            case = Path(scratch) / "case.nml"
            for _ in range(given.repeats):
                for threads in (1, given.threads):
                    keys = f"&solver threads={threads}, precision='{given.precision}',"
                    case.write_text(text.replace("&solver", keys, 1))
                    for share in (0.25, 1.0):
                        steps[share], seconds = clock(program, case, share * end_time, given.scheme)
                        least[threads, share] = min(seconds, least.get((threads, share), seconds))
        scale = 1e9 / (points * (steps[1.0] - steps[0.25]))
        one, several = (scale * (least[threads, 1.0] - least[threads, 0.25]) for threads in (1, given.threads))
        print(f"{points:8d}  {one:8.1f}  {several:9.1f}  {one / several:5.2f}", flush=True)


if __name__ == "__main__":
    main()
