"""A disk that is full, fails or may not be written, wherever a run writes (faulty_disk.c): the run ends with the right
code and says what is wrong, nothing that was in the journal is lost, and once the fault is removed the same command
ends byte-equal to an undisturbed run. Logs and standard output are no results: a run goes on without them."""

import random

from common import Journal, Program, arguments, check, check_equal, columns, ids, tried

FULL, ERROR, DENIED = "No space left on device", "Input/output error", "Permission denied"
given = arguments()
program = Program(given)
chance = random.Random(given.seed)
short = program.changed_case("realizations=160", "realizations=12", "short.nml")
given.case = program.root / "tiny.nml"
# Several lines of progress and rewrites of ensemble.h5 within a second.
given.case.write_text(short.read_text().replace("report_seconds=0.5", "report_seconds=0.05"))
program.run("whole", 2)
whole = program.root / "whole"
size = {name: (whole / name).stat().st_size for name in ("journal.bin", "ensemble.h5")}


def fault(path, kind, value):
    """Variables for faulty_disk.c."""
    return {"SGIMP_FAULT_PATH": path, f"SGIMP_FAULT_{kind}": str(value)}


def disturbed(name, path, kind, value, code, said, ranks=0, leave_out=(), **how):
    """A run with a fault at files whose path ends or begins with `path`, and the same without; the journal after the
    fault, and the members that ensemble.h5 told of then."""
    directory = program.root / f"{len(list(program.root.iterdir()))}_{name.replace(' ', '_')}"
    text = program.run(directory.name, ranks, expect=code, fault=fault(f"{directory.name}/{path}", kind, value), **how)
    check(said in text, f"{name}: not said: {said}\n{text}")
    before = Journal(directory / "journal.bin")
    told = ids(directory) if (directory / "ensemble.h5").exists() else set()
    check(told <= set(before.members()), f"{name}: ensemble.h5 tells more than the journal")
    program.run(directory.name, 0, **how)
    after = Journal(directory / "journal.bin")
    check(after.records[: len(before.records)] == before.records, f"{name}: records are lost")
    check(len(set(after.members())) == len(after.records), f"{name}: members are there twice")
    check_equal(whole, directory, name, leave_out)
    tried(name)
    return before, told


# Where the header ends, and somewhere in the records, also at the end of one.
whole_journal = Journal(whole / "journal.bin")
begin = len(whole_journal.header)
record = len(whole_journal.records[0])
disturbed("disk full at the first byte of the journal", "journal.bin", "BYTES", 0, 1, FULL)
disturbed("disk full in the header of the journal", "journal.bin", "BYTES", begin - 100, 1, FULL)
for k in range(3):
    cut = begin + chance.randrange(record, size["journal.bin"] - begin - record)
    kept, _ = disturbed(
        "disk full in a record of the journal", "journal.bin", "BYTES", cut, 1, FULL, ranks=(0, 3, 0)[k]
    )
    check(len(kept.content()) + len(kept.rest) == cut, "the shim did not fill the journal")
disturbed("disk full after a record of the journal", "journal.bin", "BYTES", begin + 4 * record, 1, FULL)
disturbed("disk full at the first ensemble.h5", "ensemble.h5", "BYTES", size["ensemble.h5"] // 4, 1, FULL)
disturbed("disk full before the first ensemble.h5", "ensemble.h5", "BYTES", 0, 1, FULL)
disturbed("disk full at a later ensemble.h5", "ensemble.h5", "BYTES", 3 * size["ensemble.h5"] // 2, 1, FULL)
disturbed("disk full at the start", "", "BYTES", 0, 1, FULL, ranks=2)
for _ in range(3):
    room = chance.randrange(size["ensemble.h5"], 2 * size["ensemble.h5"])
    disturbed("disk full for all files", "", "BYTES", room, 1, FULL)
disturbed("disk full for run.log and events.jsonl", "run.log", "BYTES", 100, 0, "complete")
# The first two come with the header.
kept, told = disturbed("sync of the journal fails", "journal.bin", "SYNC", 3, 1, ERROR)
check(len(told) < len(kept.records), "members are told of that were not synced")
disturbed("sync of ensemble.h5 fails", "ensemble.h5", "SYNC", 2, 1, ERROR)
disturbed("directory that may not be written", "", "OPEN", 1, 2, DENIED)
disturbed("ensemble.h5 that may not be written", "ensemble.h5", "OPEN", 1, 1, DENIED)

# Snapshots are extra: members are computed and kept, and their rows say what is missing.
snapshots = program.root / "snapshots.nml"
snapshots.write_text(given.case.read_text().replace("report_seconds", "snapshot_members=1,2, report_seconds"))
reasons = [name for name in columns(whole) if name.endswith("/reason")]
disturbed(
    "disk full at snapshots",
    "snapshots/",
    "BYTES",
    100000,
    0,
    "snapshots not written",
    leave_out=reasons,
    case=snapshots,
)

with (program.root / "output.txt").open("w") as output:
    program.run("output", 0, fault=fault("output.txt", "BYTES", 100), output=output)
check((program.root / "output.txt").stat().st_size <= 100, "the shim did not fill the disk")
check_equal(whole, program.root / "output", "standard output")
tried("disk full for standard output")

(program.root / "file").write_text("")
for directory in ("file", "file/below"):
    text = program.run(directory, 0, expect=2)
    check(f"cannot make the directory {program.root / directory}" in text, f"not named:\n{text}")
tried("a file where the directory should be")
program.clean()
