"""Tries to break the program with many short runs: a designed sample of inputs, and awkward cases by hand.

Usage: sweep.py EXE [--runs N] [--jobs J] [--seed S] [--out DIR] [--only NAME ...] [--no-edges] [--precision P]

Every run ends in one of five verdicts (judge.py says how): ok, failed (a named failure), refused (bad input,
where that is right), gained (created energy without a word) or broken. Exit code 1 if any run is broken or
gained energy. Called again with the same DIR it goes on where it stopped; runs that are neither ok, failed nor
refused leave their namelist and messages in DIR/kept.
"""

import argparse
import collections
import concurrent.futures
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from cases import design, designed_case
from edges import edge_cases
from judge import judge

# Beyond any honest run of this size (a fraction of a second, with a limit of 20 s a member in its namelist).
TIMEOUT = 60
# Compression of a point beyond which the energy columns of the table leave its run out.
MOST_COMPRESSION = 0.2

VERDICTS = ("ok", "failed", "refused", "gained", "broken")


def environment(scratch):
    """One rank without a launcher: no daemon, no network; saves Open MPI half its start-up time."""
    quick = {
        # The topology of the machine is looked at several times otherwise.
        "HWLOC_SYNTHETIC": "pu:1",
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMPI_MCA_ess_singleton_isolated": "1",
        "OMPI_MCA_pml": "ob1",
        "OMPI_MCA_btl": "self",
        # Without a launcher all runs would share one session directory.
        "OMPI_MCA_orte_tmpdir_base": str(scratch),
        "OPENBLAS_NUM_THREADS": "1",
    }
    return {**os.environ, **quick}


def run_case(case, executable, root):
    """Runs one case in a directory of its own and judges it; keeps what must be looked at."""
    with tempfile.TemporaryDirectory(prefix="sgimp_stress_") as scratch:
        scratch = Path(scratch)
        write_case(case, scratch)
        started = time.monotonic()
        code, message = execute([executable, f"{case['name']}.nml", "--output", "out"], scratch)
        verdict, detail, numbers = judge(case, code, message, scratch / "out")
        record = {
            "name": case["name"],
            "groups": case["groups"],
            "cfl": case["facts"]["cfl"],
            "verdict": verdict,
            "detail": detail,
            "numbers": numbers,
            "wall": round(time.monotonic() - started, 3),
        }
        if verdict in ("gained", "broken"):
            kept = root / "kept" / verdict
            kept.mkdir(parents=True, exist_ok=True)
            write_case(case, kept)
            (kept / f"{case['name']}.txt").write_text(f"{verdict}: {detail}\nexit code {code}\n{message}")
    return record


def write_case(case, directory):
    """The namelist and its files; in a common directory files carry the name of their case."""
    text = case["text"]
    for name, content in case["files"].items():
        own = f"{case['name']}_{name}"
        text = text.replace(f"'{name}'", f"'{own}'")
        (directory / own).write_text(content)
    (directory / f"{case['name']}.nml").write_text(text)


def execute(command, directory):
    """Exit code (None when it took too long) and all it said."""
    process = subprocess.Popen(
        command,
        cwd=directory,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env=environment(directory),
        start_new_session=True,
    )
    try:
        text = process.communicate(timeout=TIMEOUT)[0]
        code = process.returncode
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        text, code = process.communicate()[0], None
    return code, text.decode(errors="replace")


def all_cases(runs, seed, with_edges, precision):
    """The awkward cases, then the first `runs` of the design."""
    cases = edge_cases() if with_edges else []
    cases += [designed_case(index, u) for index, u in enumerate(design(runs, seed))]
    for case in cases:
        case["facts"]["precision"] = precision
        if precision != "double":
            case["text"] = case["text"].replace("&solver ", f"&solver precision='{precision}', ")
    return cases


def table(records):
    """Counts by group, and the extremes of the energy account."""
    groups = collections.defaultdict(list)
    for record in records:
        for name in ["all", *record["groups"]]:
            groups[name].append(record)
    width = max(len(name) for name in groups)
    columns = " ".join(f"{verdict:>8}" for verdict in VERDICTS)
    yield f"{'group':<{width}} {'runs':>6} {columns} {'created':>10} {'ledger':>10} {'lost':>10}"
    for name in sorted(groups, key=lambda key: (key != "all", key)):
        rows = groups[name]
        count = collections.Counter(row["verdict"] for row in rows)
        counts = " ".join(f"{count[verdict]:>8}" for verdict in VERDICTS)
        # Of the good runs; under large compression stress in rate form does not keep its energy.
        good = [row["numbers"] for row in rows if row["verdict"] == "ok"]
        numbers = [number for number in good if number["compression"] < MOST_COMPRESSION]
        extremes = ""
        if numbers:
            created, ledger = (max(n[key] for n in numbers) for key in ("created", "ledger"))
            extremes = f"{created:>+10.1e} {ledger:>+10.1e} {min(n['lost'] for n in numbers):>+10.1e}"
        yield f"{name:<{width}} {len(rows):>6} {counts} {extremes}".rstrip()


def worst(records):
    """The runs to look at first."""
    finished = [r for r in records if r["verdict"] in ("ok", "gained")]
    for title, key, order in (
        ("created energy", "created", 1),
        ("ledger", "ledger", 1),
        ("lost energy", "lost", -1),
        ("reported energy_error", "reported", 1),
        ("volume of a point over the mean", "swelling", 1),
        ("steps", "steps", 1),
        ("seconds in the solver", "seconds", 1),
    ):
        for record in sorted(finished, key=lambda r: -order * r["numbers"].get(key, 0))[:1]:
            yield f"worst {title}: {record['numbers'].get(key, 0):.4g} in {record['name']}"
    reasons = collections.Counter(
        re.sub(r"[-+.eE\d]*\d", "#", r["detail"].split(":")[0])[:60]
        for r in records
        if r["verdict"] == "failed"
    )
    for reason, count in reasons.most_common():
        yield f"named failure, {count} times: {reason}"
    for record in records:
        if record["verdict"] in ("gained", "broken"):
            yield f"{record['verdict']}: {record['name']} (CFL {record['cfl']:.2f}): {record['detail']}"


def main():
    """Runs what is missing and prints the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("executable", type=Path)
    parser.add_argument("--runs", type=int, default=2000, help="of the design, beside the cases by hand")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=2022)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--no-edges", action="store_true")
    parser.add_argument("--precision", choices=("double", "single"), default="double")
    given = parser.parse_args()
    root = given.out or Path(tempfile.mkdtemp(prefix="sgimp_sweep_"))
    root.mkdir(parents=True, exist_ok=True)
    journal = root / f"results_seed{given.seed}.jsonl"
    done = {}
    if journal.exists():
        done = {record["name"]: record for record in map(json.loads, journal.read_text().splitlines())}
    cases = all_cases(given.runs, given.seed, not given.no_edges, given.precision)
    if given.only:
        cases = [case for case in cases if case["name"] in given.only]
    missing = [case for case in cases if case["name"] not in done]
    executable = str(given.executable.resolve())
    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool, journal.open("a") as file:
        for record in pool.map(lambda case: run_case(case, executable, root), missing):
            done[record["name"]] = record
            file.write(json.dumps(record) + "\n")
            file.flush()
    records = [done[case["name"]] for case in cases]
    print("\n".join([*table(records), "", *worst(records)]))
    if given.out is None:
        if any(r["verdict"] in ("gained", "broken") for r in records):
            print(f"kept: {root}")
        else:
            shutil.rmtree(root)
    return 1 if any(r["verdict"] in ("broken", "gained") for r in records) else 0


if __name__ == "__main__":
    sys.exit(main())
