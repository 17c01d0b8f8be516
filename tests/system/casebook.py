"""`sgimp-post casebook`: replays are the recorded members and leave the run alone, animations have the frames that were
asked for, what is there is not computed again, a replay that fails or differs is told, and the others go on."""

import contextlib
import io
import re
import stat
import sys
from pathlib import Path

import h5py
from common import Program, arguments, check
from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "postproc"))
from sgimp_post.cli import main  # noqa: E402

LABEL, FRAMES = "snx_cov0.10", 6
NAMES = ["P5", "P50", "max"]  # of 12 members the farthest is P95, too


def casebook(sgimp, expect=0):
    """Makes it with this program; the lines it prints, without the path of the page."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        code = main(["casebook", str(directory), "--study-case", LABEL, "--sgimp", str(sgimp), "--frames", str(FRAMES)])
    check(code == expect, f"exit code {code}, not {expect}:\n{said.getvalue()}")
    return said.getvalue().splitlines()[:-1]


def contents():
    """Everything in the run's directory but the casebook, as bytes."""
    found = (path for path in directory.rglob("*") if path.is_file() and book not in path.parents)
    return {path: path.read_bytes() for path in found}


given = arguments()
program = Program(given)
case = program.changed_case("realizations=160", "realizations=12")
program.run("run", 2, case=case)
directory = program.root / "run"
book = directory / "casebook"
before = contents()
lines = casebook(given.sgimp)
check(contents() == before, "files of the run have changed")
check([line.split()[1] for line in lines] == [f"{name}:" for name in NAMES], f"members: {lines}")
check(all(line.endswith("equal to the last bit") for line in lines), f"replays differ: {lines}")

members = [int(re.search(r"member (\d+)", line)[1]) for line in lines]
with h5py.File(directory / "ensemble.h5") as file:
    group = file["cases"][LABEL]
    runouts = {int(k): float(value) for k, value in zip(group["id"], group["runout_max"], strict=True)}
ranked = sorted(runouts, key=runouts.get)
check(members == [ranked[0], ranked[5], ranked[11]], f"members {members} of {ranked}")
page = (book / "casebook.html").read_text()
check("http" not in page.replace("http://www.w3.org", ""), "the page refers to the network")
for member in members:
    name = f"{LABEL}_r{member:06d}"
    printed = re.search(r"runout_max +(\S+)", (book / "replays" / f"{name}.txt").read_text())[1]
    check(float(printed) == runouts[member], f"{name}: {printed}, recorded {runouts[member]!r}")
    with Image.open(book / f"{name}.gif") as film:
        check(film.n_frames == FRAMES, f"{name}.gif has {film.n_frames} frames, not {FRAMES}")
    for kind in ("gif", "png", "svg", "pdf"):
        check(f'"{name}.{kind}"' in page and (book / f"{name}.{kind}").is_file(), f"{name}.{kind} is not shown")

states = {path: path.stat().st_mtime_ns for path in (book / "snapshots").glob("*.h5")}
check(len(states) == len(members), f"replays: {sorted(states)}")
lines = casebook(given.sgimp)
check(all(line.endswith("equal to the last bit (there already)") for line in lines), f"second call: {lines}")
check({path: path.stat().st_mtime_ns for path in states} == states, "the second call computes members again")

# A program that cannot compute one of them, whose states are gone; and a row that says something else.
picky = program.root / "picky"
refusal = f'echo "$*" | grep -q "realization {members[1]} " && exit 1'
picky.write_text(f'#!/bin/sh\n{refusal}\nexec {given.sgimp.resolve()} "$@"\n')
picky.chmod(picky.stat().st_mode | stat.S_IXUSR)
(book / "snapshots" / f"{LABEL}_r{members[1]:06d}.h5").unlink()
with h5py.File(directory / "ensemble.h5", "r+") as file:
    group = file["cases"][LABEL]
    group["height_max"][list(group["id"]).index(members[2])] += 0.25
lines = casebook(picky, expect=1)
check(lines[0].endswith("equal to the last bit (there already)"), f"the first member: {lines[0]}")
check("the program ends with exit code 1" in lines[1], f"not said: {lines[1]}")
check("differs: height_max" in lines[2], f"not said: {lines[2]}")
page = (book / "casebook.html").read_text()
check("the program ends with exit code 1" in page and "differs: height_max" in page, "the page does not say so")
program.clean()
