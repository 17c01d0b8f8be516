"""Instructions per point and step of each scheme, counted by valgrind: a guard that a busy machine cannot spoil.

    instructions.py BUILD_DIRECTORY [--record] [--limit 1.03]

Runs bench_kernel on input/quickstart.nml (1600 points, homogeneous) up to 0.4 s and up to 0.6 s, while the column
flows; the difference is the cost of the steps between. Prints the ratio to tests/bench/instructions.json and ends with
1 when one is above the limit; --record writes that file instead. Compiler and flags are part of the record: with others
the ratios are printed and not judged. Wants the portable preset, because valgrind knows no AVX-512; takes two minutes.
"""

import argparse
import json
import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
RECORD = HERE / "instructions.json"
CASE = HERE.parents[1] / "input" / "quickstart.nml"
SCHEMES = ("usl", "musl", "usf")
TIMES = (0.4, 0.6)  # s


def count(program, scheme, end_time):
    """Points, steps and instructions of one run."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", program, CASE, str(end_time), scheme]
    run = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    if run.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))} failed:\n{run.stderr[-2000:]}")
    points = int(re.search(r"points (\d+)", run.stdout).group(1))
    steps = int(re.search(r"(\d+) steps", run.stdout).group(1))
    return points, steps, int(re.search(r"Collected : (\d+)", run.stderr).group(1))


def per_point_and_step(program, scheme):
    """Instructions between the two times."""
    (points, early, few), (_, late, many) = (count(program, scheme, end_time) for end_time in TIMES)
    return (many - few) / (points * (late - early))


def compiler(build):
    """Compiler and flags, as the program itself has them for the provenance of results."""
    text = (build / "generated" / "sg_version.f90").read_text()
    text = re.sub(r"'// &\s*'", "", text)
    return ", ".join(re.findall(r"COMPILER(?:_FLAGS)? = &?\s*'([^']*)'", text))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path, help="for instance build/portable")
    parser.add_argument("--record", action="store_true", help="write the figures as those to compare with")
    parser.add_argument("--limit", type=float, default=1.03, help="largest ratio that passes")
    options = parser.parse_args()
    program = options.build.resolve() / "tests" / "bench" / "bench_kernel"
    figures = {scheme: round(per_point_and_step(program, scheme), 1) for scheme in SCHEMES}
    made_by = compiler(options.build)
    if options.record:
        record = {"compiler": made_by, "instructions per point and step": figures}
        RECORD.write_text(json.dumps(record, indent=2) + "\n")
        print(f"recorded: {figures}")
        return
    record = json.loads(RECORD.read_text())
    worst = 0.0
    for scheme, figure in figures.items():
        before = record["instructions per point and step"][scheme]
        ratio = figure / before
        worst = max(worst, ratio)
        print(f"{scheme:5s} {figure:8.1f} instructions per point and step, {ratio:.3f} of the recorded {before}")
    if record["compiler"] != made_by:
        print(f"not judged: recorded with {record['compiler']}, now {made_by}")
    elif worst > options.limit:
        sys.exit(f"FAILED: {worst:.3f} times the recorded instructions, limit {options.limit}")


if __name__ == "__main__":
    main()
