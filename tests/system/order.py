"""The order in which members finish is no part of the result: a journal whose records are shuffled, some of them lost
and some there twice, is completed byte-equal to a run on one rank, and no member is computed that is there."""

import random

from common import Journal, Program, arguments, check, check_equal, tried

given = arguments()
program = Program(given)
chance = random.Random(given.seed)
given.case = program.changed_case("realizations=160", "realizations=24")
program.run("whole", 0)
whole = Journal(program.root / "whole" / "journal.bin")
for ranks, lost, doubled in ((1, 0, 0), (2, 17, 0), (3, 30, 5), (5, 0, 9)):
    directory = program.root / f"on_{ranks}"
    directory.mkdir()
    kept = chance.sample(whole.records, len(whole.records) - lost)
    kept += chance.sample(kept, doubled)
    chance.shuffle(kept)
    (directory / "journal.bin").write_bytes(whole.header + b"".join(kept))
    program.run(directory.name, ranks)
    check_equal(program.root / "whole", directory, f"shuffled, {lost} lost, {doubled} twice")
    after = Journal(directory / "journal.bin")
    check(after.records[: len(kept)] == kept, "records that were there have changed")
    check(len(after.records) == len(kept) + lost, "members that were there were computed again")
tried("records of the journal in another order, some twice")
program.clean()
