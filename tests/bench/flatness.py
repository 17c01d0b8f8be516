"""Cost per point and step against the number of points: the first steps of the paper's column, cells halved each time.

    flatness.py BUILD_DIRECTORY [--scheme usl] [--largest 1600000] [--repeats 5]

The cost is the difference between a longer and a shorter run of bench_kernel, so that the set-up does not count; of the
repeats, taken in turn over the sizes, the least. Prints ns per point and step and the ratio to the smallest size.
"""

import argparse
import re
import subprocess
import tempfile
from pathlib import Path

CASE = Path(__file__).resolve().parents[2] / "input" / "quickstart.nml"
SMALLEST = 6400  # points: cells of 0.125 m
POINT_STEPS = 3.0e7  # in the longer run, at the least LEAST_STEPS steps
LEAST_STEPS = 40


def run(program, case, end_time, scheme):
    """Points, steps and seconds of one run."""
    command = [program, case, repr(end_time), scheme]
    out = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True).stdout
    steps, seconds = re.search(r"(\d+) steps,\s+([\d.]+) s", out).groups()
    return int(re.search(r"points (\d+)", out).group(1)), int(steps), float(seconds)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path, help="for instance build/release")
    parser.add_argument("--scheme", default="usl")
    parser.add_argument("--largest", type=int, default=1600000)
    parser.add_argument("--repeats", type=int, default=5)
    given = parser.parse_args()
    program = given.build.resolve() / "tests" / "bench" / "bench_kernel"
    with tempfile.TemporaryDirectory() as scratch:
        cases = []
        cell, points = 0.125, SMALLEST
        while points <= given.largest * 1.03:
            case = Path(scratch) / f"{points}.nml"
            case.write_text(CASE.read_text().replace("cell_size=0.25", f"cell_size={cell!r}"))
            step = 0.4 * cell / 50.0  # about; waves travel at 50 m/s
            cases.append((points, case, step * max(LEAST_STEPS, POINT_STEPS / points)))
            cell, points = cell / 2, points * 4
        cost = {}
        for _ in range(given.repeats):
            for points, case, end_time in cases:
                (n, few, early), (_, many, late) = (
                    run(program, case, share * end_time, given.scheme) for share in (0.25, 1.0)
                )
                assert n == points, (n, points)
                each = 1e9 * (late - early) / (points * (many - few))
                cost[points] = min(each, cost.get(points, each))
    print(f"{'points':>8}  {'ns per point and step':>21}  {'ratio':>5}")
    for points, each in cost.items():
        print(f"{points:8d}  {each:21.1f}  {each / cost[SMALLEST]:5.2f}")


if __name__ == "__main__":
    main()
