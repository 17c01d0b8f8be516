"""A rule that ends cases early: each case of a study ends at the member that its own values say, the same on 1, 2
and 3 ranks and after kill -9; on resume a looser rule ends it earlier, a stricter one goes on."""

import json
import os
import random
import signal
import time

import h5py
import numpy as np
from common import Program, arguments, check, check_equal, columns, state
from scipy.stats import t

# Of the small case sd is 0.12 to 0.13 m: some 55, 20 and 100 members.
LOOSE, USUAL, STRICT = 0.06, 0.035, 0.026
MINIMUM, BATCH, MOST = 20, 10, 160
given = arguments()
program = Program(given)


def within(half_width):
    """The case that ends at this half-width of the mean."""
    rule = f"stop_rule='precision', half_width={half_width}, stop_minimum={MINIMUM}, stop_batch={BATCH}"
    path = program.changed_case(f"realizations={MOST}", f"realizations={MOST}, {rule}")
    return path.rename(path.with_name(f"within_{half_width}.nml"))


def end_of(values, half_width):
    """The first member at which the interval is narrow, and whether there is one."""
    for n in range(MINIMUM, len(values) + 1, BATCH):
        if t.ppf(0.975, n - 1) * np.std(values[:n], ddof=1) / np.sqrt(n) <= half_width:
            return n, True
    return len(values), False


def check_ends(name, half_width):
    """Every case holds the members up to its end, as the whole run has them."""
    found = {}
    with h5py.File(program.root / "whole/ensemble.h5") as whole, h5py.File(program.root / name / "ensemble.h5") as file:
        for label, case in file["cases"].items():
            everything = whole["cases"][label]
            wanted, met = len(everything["id"]), False
            if not case.attrs["is_homogeneous"]:
                wanted, met = end_of(everything["runout_q995"][()], half_width)
                found[label] = wanted
            check(case.attrs["planned"] == wanted, f"{name}, {label}: ends at {case.attrs['planned']}, not {wanted}")
            check(case.attrs["stop_rule_met"] == met, f"{name}, {label}: stop_rule_met {case.attrs['stop_rule_met']}")
            check(np.array_equal(case["id"], np.arange(1, wanted + 1)), f"{name}, {label}: other ids")
            check(np.array_equal(case["runout_q995"], everything["runout_q995"][:wanted]), f"{name}, {label}: values")
    check(state(program.root / name) == "complete", f"{name} is not complete")
    return found


def check_told(name, text, ends):
    """Log and events say where each case has ended."""
    lines = (program.root / name / "events.jsonl").read_text().splitlines()
    events = [event for event in map(json.loads, lines) if event["event"] == "stop_rule"]
    for label, end in ends.items():
        check(f"{label}: precision met at {end} of {MOST}: " in text, f"{name}: nothing of {label}\n{text}")
        check(any(e["case"] == label and e["met"] and e["members"] == end for e in events), f"{name}: no event")


program.run("whole", 2)
usual = within(USUAL)
ends = {}
for ranks in (1, 2, 3):
    name = f"on_{ranks}"
    text = program.run(name, ranks, case=usual)
    ends = check_ends(name, USUAL)
    check_told(name, text, ends)
    check_equal(program.root / "on_1", program.root / name, f"{ranks} ranks")
check(len(set(ends.values())) > 1 and MINIMUM < min(ends.values()) < max(ends.values()) < MOST, f"no test: {ends}")

chance = random.Random(given.seed)
begin = time.monotonic()
program.run("timed", 2, case=usual)
length = time.monotonic() - begin
kills = 0
events = program.root / "killed/events.jsonl"
for attempt in range(4):
    process = program.start("killed", 1 + attempt % 3, case=usual)
    # Once it is at work, within a tenth of the whole.
    limit = time.monotonic() + 20
    while time.monotonic() < limit and (not events.exists() or events.read_text().count('"start"') <= attempt):
        time.sleep(0.01)
    time.sleep(chance.uniform(0.0, 0.1) * length)
    if process.poll() is None:
        kills += 1
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    # mpirun puts each rank into a process group of its own: they end when they lose their parent.
    time.sleep(1)
program.run("killed", 3, case=usual)
check(kills >= 2, f"only {kills} of four kills met a run at work")
check_equal(program.root / "on_1", program.root / "killed", "after kills")

# On resume: looser, stricter, as at first, none.
for half_width in (LOOSE, STRICT, USUAL):
    program.run("on_2", 3, case=within(half_width))
    check_ends("on_2", half_width)
check_equal(program.root / "on_1", program.root / "on_2", "after other rules")
program.run("on_2", 2)
check_equal(program.root / "whole", program.root / "on_2", "without a rule")

# A rule that is never met: all realizations, and it is said.
text = program.run("never", 2, case=within(0.001))
check("precision not met at 160 of 160" in text, f"nothing of a rule that is not met\n{text}")
check(columns(program.root / "never") == columns(program.root / "whole"), "other results with a rule that is not met")
text = program.run("never", 0, "--check", case=usual)
check("the mean of runout_q995 is within +-0.035 m" in text, f"--check says nothing of the rule\n{text}")
print(f"ends {ends}, {kills} kills")
program.clean()
