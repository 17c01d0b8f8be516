"""kill -9 at twenty random moments, of one rank alone, of mpirun alone and of all at once, each time resumed on another
number of ranks. After each kill all ranks are gone, what journal and ensemble.h5 told before is there, and no member is
there twice; the end is byte-equal to an uninterrupted run."""

import json
import os
import random
import signal
import time

from common import Journal, Program, arguments, await_end, check, check_equal, ids, ranks_of, state, tried, wait_until

KILLS = 20
RANKS = (2, 3, 1, 5)


def alive(pid):
    """Whether a process is there and still runs."""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def strike(process, kind, chance):
    """Kills a part of the run; the ranks, which must be gone soon, and whether there was anything to kill."""
    ranks = ranks_of(process)
    victims = {"rank": chance.sample(ranks, min(1, len(ranks))), "mpirun": [process.pid], "all": [process.pid, *ranks]}
    if process.poll() is not None or not ranks:
        return ranks, False
    for victim in victims[kind]:
        try:
            os.kill(victim, signal.SIGKILL)
        except ProcessLookupError:
            pass
    return ranks, True


def look(directory, before):
    """The journal after a kill: all that it held `before` is in it, and all that was told of it."""
    journal = Journal(directory / "journal.bin")
    check(journal.records[: len(before)] == before, "records of the journal are gone")
    members = journal.members()
    check(len(set(members)) == len(members), "a member is in the journal twice")
    if (directory / "ensemble.h5").exists():
        check(ids(directory) <= set(members), "ensemble.h5 tells of members that are not in the journal")
    if (directory / "events.jsonl").exists():
        lines = (directory / "events.jsonl").read_text().splitlines()
        told = [json.loads(line).get("done", 0) for line in lines if line.endswith("}")]
        check(max(told, default=0) <= len(members), "progress tells of members that are not in the journal")
    return journal.records


def main():
    """Kills and resumes; a directory that is complete is compared, and a new one begun."""
    given = arguments()
    program = Program(given)
    chance = random.Random(given.seed)
    program.run("whole", 2)
    counts = dict.fromkeys(("rank", "mpirun", "all"), 0)
    number, records = 1, []
    for attempt in range(4 * KILLS):
        kind = min(counts, key=counts.get)
        directory = program.root / f"killed_{number}"
        number_of_ranks = RANKS[attempt % len(RANKS)]
        process = program.start(directory.name, number_of_ranks)
        # Open MPI hangs when a rank is killed before the last one was started.
        wait_until(lambda one=process, n=number_of_ranks: len(ranks_of(one)) == n or one.poll() is not None, "ranks")
        time.sleep(chance.uniform(0.0, 1.0))
        ranks, struck = strike(process, kind, chance)
        text = await_end(process, 60)
        wait_until(lambda those=ranks: not any(map(alive, those)), "ranks to end")
        # Killed in its last moment, a run may have been complete.
        hit = process.returncode != 0
        check(struck or not hit, f"exit code {process.returncode} without a kill\n{text}")
        records = look(directory, records)
        counts[kind] += hit
        if sum(counts.values()) == KILLS:
            break
        if not hit:
            check_equal(program.root / "whole", directory, f"directory {number}")
            number, records = number + 1, []
    check(sum(counts.values()) == KILLS, f"only {counts} kills met a run at work")
    program.run(directory.name, 3)
    look(directory, records)
    check(state(directory) == "complete", "not complete")
    check_equal(program.root / "whole", directory, "after kills")
    print(f"kills: {counts}, in {number} directories")
    tried("kill -9 of one rank")
    tried("kill -9 of mpirun")
    tried("kill -9 of all processes")
    program.clean()


main()
