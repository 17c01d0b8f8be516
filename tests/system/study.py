"""A study of any key: its cases are what runs of their own are, byte for byte; twins of a control variate change
nothing of their cases; runs of disjoint members are the parts of the whole, and so is what is left after a stop."""

import pathlib
import subprocess
import sys

import h5py
import numpy as np
from common import Program, arguments, check, columns

program = Program(arguments())
MEMBERS = 6
POST = pathlib.Path(__file__).parents[2] / "postproc"


def case(name, study, *changes):
    """The case file with fewer members, other groups in place of its study, and texts replaced."""
    text = program.given.case.read_text().replace("realizations=160", f"realizations={MEMBERS}")
    text = text.replace("&study acf='snx', 'csx', cov=0.1 /", study)
    for old, new in changes:
        check(old in text, f"{old} is not in the case file")
        text = text.replace(old, new)
    path = program.root / f"{name}.nml"
    path.write_text(text)
    return path


def post(expect, *words):
    """Runs the post-processor and returns what it printed."""
    code = f"import sys; sys.path.insert(0, {str(POST)!r}); from sgimp_post.cli import main; sys.exit(main())"
    done = subprocess.run([sys.executable, "-c", code, *map(str, words)], capture_output=True, text=True, check=False)
    check(done.returncode == expect, f"sgimp-post {words}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def check_part(whole, label, part, other, what):
    """Case `label` of one directory has the columns of case `other` of another."""
    left, right = columns(program.root / whole), columns(program.root / part)
    names = [name for name in right if name.startswith(other + "/")]
    check(len(names) > 20, f"{what}: no columns of {other}")
    for name in names:
        mine = name.replace(other, label, 1)
        check(left.get(mine) == right[name], f"{what}: {mine} differs")


# Damping and cell size; a field without one of its own is that of the finest cells.
study = case("study", "&study damping=0.4, 0.7, cell_size=0.5, 0.25 /")
listing = program.run("listed", 0, "--dry", case=study)
check("snx_cov0.10_cell_size0.25_damping0.7: 6 members" in listing, f"--dry:\n{listing}")
check(not (program.root / "listed").exists(), "--dry wrote something")
program.run("study", 3, case=study)
plain = case("plain", "", ("damping=0.4", "damping=0.7"), ("cell_size=0.5", "cell_size=0.25"))
program.run("plain", 2, case=plain)
check_part("study", "snx_cov0.10_cell_size0.25_damping0.7", "plain", "base", "a case of the study")
check_part("study", "deterministic_cell_size0.25_damping0.7", "plain", "deterministic", "homogeneous ground")
with h5py.File(program.root / "study" / "ensemble.h5") as file:
    fine = file["cases/snx_cov0.10_cell_size0.25_damping0.4"]
    coarse = file["cases/snx_cov0.10_cell_size0.5_damping0.4"]
    check(fine.attrs["varied"].decode() == "cell_size=0.25, damping=0.4", "what varies is not told")
    shapes = fine["profile/height"].shape, coarse["profile/height"].shape
    check(shapes == ((MEMBERS, 80), (MEMBERS, 40)), f"profiles {shapes}")
    # The coarse points see means of four: the same mean of the field, up to what is set to its bounds.
    difference = np.abs(fine["field_mean"][:] - coarse["field_mean"][:]).max()
    check(difference < 1e-12 * 35, f"another field on coarser cells: {difference}")
resolved = program.root / "study" / "resolved.nml"
program.run("again", 1, case=resolved)
check(columns(program.root / "study") == columns(program.root / "again"), "resolved.nml is another study")
program.run("study", 2, case=case("turned", "&study cell_size=0.5, 0.25, damping=0.4, 0.7 /"))
check(columns(program.root / "study") == columns(program.root / "again"), "the order of the keys is another study")
failing = program.run("study", 1, case=case("other", "&study damping=0.4, 0.8, cell_size=0.5, 0.25 /"), expect=2)
check("&study damping: 0.4, 0.7 -> 0.4, 0.8" in failing, f"the list that differs is not named:\n{failing}")

# Twins on coarser cells.
control = "&control_variate cell_size=0.5, realizations=9 /"
finer = ("cell_size=0.5,\n", "cell_size=0.25,\n")
program.run("twins", 2, case=case("twins", control, ("damping=0.4", "damping=0.7"), finer))
check_part("twins", "base", "plain", "base", "beside a control variate")
with h5py.File(program.root / "twins" / "ensemble.h5") as file:
    twin = file["cases/base_control"]
    check(twin.attrs["role"].decode() == "control" and twin.attrs["cell_size"] == 0.5, "attributes of the twin")
    check(list(twin["id"][:]) == list(range(1, 10)), "members of the twin")
    check(np.allclose(twin["field_mean"][:MEMBERS], file["cases/base/field_mean"][:], atol=1e-12 * 35), "another field")

# Members by ranges, as the jobs of an array run them.
program.run("first", 2, "--members", "1-4", case=plain)
program.run("second", 1, "--members=5-100", case=plain)
with h5py.File(program.root / "plain" / "ensemble.h5") as whole:
    for name, ids in (("first", slice(0, 4)), ("second", slice(4, None))):
        with h5py.File(program.root / name / "ensemble.h5") as part:
            check(part.attrs["members"].decode() != "", "the range is not told")
            check(part.attrs["state"].decode() == "complete", f"{name} is not complete")
            wanted = whole["cases/base/runout_max"][ids]
            check(np.array_equal(part["cases/base/runout_max"][:], wanted), f"members of {name}")
text = program.run("first", 2, case=plain)
check("complete: 9 of 9 members" in text, f"a part does not become the whole:\n{text}")
check(columns(program.root / "first") == columns(program.root / "plain"), "a part became another whole")

# Joined again: equal to the whole, also for the program, which finds nothing missing.
program.run("third", 2, "--members", "1-4", case=plain)
post(0, "merge", program.root / "third", program.root / "second", "--out", program.root / "merged")
check(columns(program.root / "merged") == columns(program.root / "plain"), "merged parts are another whole")
text = program.run("merged", 1, case=plain)
check("resumed: 9 members are there, 0 are missing" in text, f"the program does not take the merged run:\n{text}")
check(columns(program.root / "merged") == columns(program.root / "plain"), "the program changed the merged run")
text = post(2, "merge", program.root / "third", program.root / "plain", "--out", program.root / "twice")
check("both have 1-4 of base" in text, f"members that are there twice:\n{text}")
text = post(2, "merge", program.root / "third", program.root / "twins", "--out", program.root / "other")
check("control_variate" in text, f"another configuration:\n{text}")
check(not (program.root / "twice").exists() and not (program.root / "other").exists(), "refused, but written")

text = program.run("nothing", 2, "--members", "7-9", case=plain, expect=2)
check("there is no such member" in text, f"members that are not there:\n{text}")
print("studies, twins and ranges of members")
program.clean()
