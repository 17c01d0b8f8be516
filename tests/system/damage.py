"""Files of a run that were cut off, damaged, lost or left over: the journal is repaired as far as it is whole, and what
is lost is computed again; a header that is damaged or of another version is refused and left alone; every other file
is written anew. The end is byte-equal to an undisturbed run, and no record that is whole is lost or computed again."""

import random
import shutil

from common import Journal, Program, arguments, check, check_equal, tried

given = arguments()
program = Program(given)
chance = random.Random(given.seed)
given.case = program.changed_case("realizations=160", "realizations=6")
program.run("whole", 2)
whole = program.root / "whole"
journal = Journal(whole / "journal.bin")
content = journal.content()
check(content == (whole / "journal.bin").read_bytes() and len(journal.records) == 15, "the journal is not understood")
begin, record = len(journal.header), len(journal.records[0])
directory = program.root / "damaged"


def prepare(damaged):
    """The complete run with another journal."""
    shutil.rmtree(directory, ignore_errors=True)
    shutil.copytree(whole, directory)
    (directory / "journal.bin").write_bytes(damaged)


def repaired(name, damaged, kept, said):
    """A run over a damaged journal, of which `kept` records are whole."""
    prepare(damaged)
    text = program.run(directory.name, 0)
    check(said in text, f"{name}: not said: {said}\n{text}")
    check_equal(whole, directory, name)
    after = (directory / "journal.bin").read_bytes()
    added = sum(len(one) for one in journal.records) - sum(len(one) for one in kept)
    lost = len(damaged) - begin - sum(len(one) for one in kept) if kept else 0
    if kept:
        check(all(one in after for one in kept), f"{name}: records that were whole are lost")
        check(len(after) in (len(damaged) + added, len(damaged) + added - lost), f"{name}: {len(after)} bytes")
    if said and kept:
        text = program.run(directory.name, 0)
        check(said not in text, f"{name}: said again after the repair\n{text}")
    tried(name)


def flip(offset, bits=1):
    """The journal with one bit flipped, or more of a byte."""
    return content[:offset] + bytes([content[offset] ^ bits]) + content[offset + 1 :]


def refused(name, damaged, said):
    """A journal that is not touched; in its place the right one goes on."""
    prepare(damaged)
    before = {path: path.read_bytes() for path in directory.iterdir()}
    text = program.run(directory.name, 0, expect=2)
    check(said in text and "--overwrite" in text, f"{name}: not said: {said}\n{text}")
    check({path: path.read_bytes() for path in directory.iterdir()} == before, f"{name}: files have changed")
    (directory / "journal.bin").write_bytes(content)
    check("15 members are there, 0 are missing" in program.run(directory.name, 0), f"{name}: members are lost")
    check_equal(whole, directory, name)
    tried(name)


def rewritten(name, act):
    """Another file is damaged: nothing is computed again."""
    prepare(content)
    act(directory / "ensemble.h5")
    check("15 members are there, 0 are missing" in program.run(directory.name, 0), f"{name}: members are lost")
    check_equal(whole, directory, name)
    check(sorted(path.name for path in directory.iterdir()) == sorted(path.name for path in whole.iterdir()), name)
    tried(name)


for cut in (7, 20, begin - 1):
    repaired("journal cut off in its header", content[:cut], [], "the end of the journal was cut off")
repaired("journal cut off after its header", content[:begin], [], "")
for inside in (1, 12, record - 1):
    number = chance.randrange(len(journal.records))
    cut = begin + number * record + inside
    repaired(
        "journal cut off in a record", content[:cut], journal.records[:number], "the end of the journal was cut off"
    )
repaired("journal cut off after a record", content[: begin + 4 * record], journal.records[:4], "")
for inside in (0, 4, 8, record - 1, 12, 28):
    number = chance.randrange(len(journal.records) - 1)
    kept = journal.records[:number] + journal.records[number + 1 :]
    # With another case (12) or id (28) it looks like another member, which is there: it is not told then.
    said = "" if inside in (12, 28) else "a damaged record of the journal is left out"
    repaired("record with a bad checksum", flip(begin + number * record + inside), kept, said)
first = begin + 3 * record
repaired(
    "several records overwritten",
    content[: first + 5] + bytes(2 * record) + content[first + 5 + 2 * record :],
    journal.records[:3] + journal.records[6:],
    "a damaged record of the journal is left out",
)
repaired("something else at the end of the journal", content + b"junk" * 30, journal.records, "was cut off: 120 bytes")
repaired("journal without a byte", b"", [], "")
for offset, said in ((0, "no journal of this program"), (12, "machine"), (8, "version"), (16, "version")):
    refused("journal of another program, machine or version", flip(offset), said)
refused("journal of zeros", bytes(len(content)), "no journal of this program")
for offset, bits in ((20, 1), (23, 127), (begin - 1, 1)):
    refused("header of the journal damaged", flip(offset, bits), "the header of journal.bin is damaged")
rewritten("ensemble.h5 cut off", lambda path: path.write_bytes(path.read_bytes()[:5000]))
rewritten("ensemble.h5 damaged", lambda path: path.write_bytes(chance.randbytes(20000)))
rewritten("ensemble.h5 without a byte", lambda path: path.write_bytes(b""))
rewritten("ensemble.h5 gone", lambda path: path.unlink())
rewritten("ensemble.h5.new left over", lambda path: path.with_name("ensemble.h5.new").write_bytes(b"half a file"))
rewritten("resolved.nml gone", lambda path: path.with_name("resolved.nml").unlink())
program.clean()
