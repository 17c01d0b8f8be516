"""Members that fail in every way become rows with a status, a reason, a step, a point and its position; the others go
on and are the same as in a run without failures; max_failed_fraction decides the exit code; --realization replays good
and failed members bit for bit, with and without snapshots.

The failures come in through the case file: a field of stiffness that is imported (`file`), in which single realizations
hold what makes that member fail and no other. (Runs in which a number is no number from the start: test_guards.pf.)"""

import re

import h5py
import numpy as np
from common import Program, arguments, check, tried

MEMBERS = 7
CASE = """
&case name='failing' /
&grid x_min=0, x_max=5, y_min=0, y_max=7.5, cell_size=0.5, right='free' /
&material name='rubber', model='neo_hookean', density=1450, young=2.6e6, poisson=0.31 /
&body name='column', material='rubber', shape='rectangle', x=0, y=0, width=5, height=5 /
&solver end_time=1 /
&random_field property='young', material='rubber', distribution='lognormal', mean=2.6e6, cov=0.1, acf='snx',
              scale_x=0.5, scale_y=0.5, lower=1e-300, {file} /
&monte_carlo realizations=7, noise_members=2, member_seconds=1, max_failed_fraction={allowed} /
&output directory='failing' /
"""
# Member: its stiffness in Pa, and how it fails: status, words of the reason, whether a point is to blame.
FAILING = {
    2: (1.5e308, 3, "time step fell", True),
    3: (1e-3, 1, "not a finite number", True),
    4: (1e3, 8, "volume under stress", True),
    5: (2e4, 2, "point left the grid", True),
    # Its steps are so short that it never ends.
    6: (1e30, 4, "wall clock limit of a member", False),
}
NAMES = {1: "not finite", 2: "point lost", 3: "time step collapsed", 4: "time limit", 8: "extreme strain"}
given = arguments()
program = Program(given)


def write_case(name, file, allowed=0.01):
    """A case file that takes its field from a file."""
    path = program.root / f"{name}.nml"
    path.write_text(CASE.format(file=f"file='{file}'" if file else "", allowed=allowed))
    return path


def rows(directory, label="base"):
    """{name: value of each member}, with the profile."""
    found = {}
    with h5py.File(program.root / directory / "ensemble.h5") as file:
        group = file["cases"][label]
        found.update({name: item[:] for name, item in group.items() if isinstance(item, h5py.Dataset)})
        found["height"] = group["profile/height"][:]
    return found


def same(one, other):
    """Equal, or both not a number."""
    return one == other or (one != one and other != other)


def replay(label, member, table, *options):
    """One member again, by itself: what is printed is its row."""
    text = program.run("replay", 0, "--realization", str(member), "--study-case", label, *options, case=case)
    name = f"{label}_r{member:06d}"
    status = int(table["status"][member - 1])
    first, *lines = text.splitlines()
    check(first == f"{name}: {NAMES[status] if status else 'ok'}", f"{first} is not said of status {status}")
    words = [line.split() for line in lines if re.fullmatch(r"  \w+ +\S+ \S+", line)]
    printed = {word[0]: float(word[1]) for word in words if word[0] in table}
    compared = [column for column in printed if column != "seconds"]
    check(len(compared) == 23, f"{len(compared)} columns are printed:\n{text}")
    for column in compared:
        row = float(table[column][member - 1])
        check(same(row, printed[column]), f"{name}, {column}: {printed[column]!r}, in the run {row!r}")
    reason = table["reason"][member - 1].decode()
    check(reason == "" or f"  {reason}" in lines, f"{name}: reason is not '{reason}':\n{text}")
    check(" degree" not in text, f"stiffness in degrees:\n{text}")
    snapshot = program.root / "replay" / "snapshots" / f"{name}.h5"
    check(snapshot.exists() == ("--snapshots" in options), f"{snapshot}")
    snapshot.unlink(missing_ok=True)


healthy = program.root / "healthy.h5"
case = write_case("sampled", "")
program.run("fields", 0, "--write-fields", str(healthy), case=case)
poisoned = program.root / "poisoned.h5"
poisoned.write_bytes(healthy.read_bytes())
with h5py.File(poisoned, "r+") as file:
    for member, (young, *_) in FAILING.items():
        file["cases/base/young"][member - 1, :] = young
text = program.run("healthy", 2, case=write_case("healthy", healthy))
check("0 failed" in text, f"healthy members fail:\n{text}")
case = write_case("poisoned", poisoned)
text = program.run("poisoned", 2, case=case, expect=4)
check("more members failed than allowed" in text, f"not said:\n{text}")
program.run("allowed", 1, case=write_case("allowed", poisoned, 5.1 / 9), expect=0)
program.run("not_allowed", 1, case=write_case("not_allowed", poisoned, 4.9 / 9), expect=4)
tried("more failed members than allowed")

good, bad = rows("healthy"), rows("poisoned")
check(list(bad["id"]) == list(range(1, MEMBERS + 1)), "a member is missing")
left = {path.name for path in (program.root / "poisoned" / "failures").iterdir()}
for member, (_, status, reason, has_point) in FAILING.items():
    k = member - 1
    what = f"member {member}, {NAMES[status]}"
    check(bad["status"][k] == status, f"{what}: status {bad['status'][k]}")
    check(reason in bad["reason"][k].decode(), f"{what}: reason {bad['reason'][k]}")
    check(f"member {member} of base failed ({NAMES[status]})" in text, f"{what}: not in the log")
    check(bad["failure_step"][k] > 0, f"{what}: no step")
    check(has_point == (bad["failure_point"][k] > 0), f"{what}: point {bad['failure_point'][k]}")
    place = np.isfinite([bad["failure_x"][k], bad["failure_y"][k]])
    check(place.all() == has_point, f"{what}: position {place}")
    check(np.isnan(bad["runout_max"][k]), f"{what}: has a runout")
    # The computing time is no state that could be gone back to.
    capsule = {f"base_r{member:06d}{ending}" for ending in (".h5", ".xdmf", ".nml")} if status != 4 else set()
    check(capsule <= left, f"{what}: no capsule")
    left -= capsule
check(not left, f"capsules of members that did not fail: {left}")
for member in set(range(1, MEMBERS + 1)) - set(FAILING):
    for name in good:
        one, other = (table[name][member - 1].tobytes() for table in (good, bad))
        check(name == "seconds" or one == other, f"member {member}: {name} is another one beside failures")
check(not rows("poisoned", "deterministic")["status"].any(), "homogeneous members fail")
for member in (1, 2, 3, 4, 5, 7):
    replay("base", member, bad)
    replay("base", member, bad, "--snapshots")
replay("deterministic", 2, rows("poisoned", "deterministic"))
for _, status, *_ in FAILING.values():
    tried(f"member fails: {NAMES[status]}")
tried("replay of good and failed members")
program.clean()
