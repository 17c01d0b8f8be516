"""A file STOP, signals (to the program, to one rank, to mpirun) and a wall clock limit end a run in time and cleanly:
exit code 3, the ids not run are named, and the run goes on, byte-equal to an uninterrupted one.

SIGUSR1 is what mpirun hands on. Of SIGTERM and SIGINT Open MPI makes, a second later, a SIGTERM to all ranks and, after
another second, a SIGKILL; its own exit code is then not 3, whatever the ranks say. The test gives busy machines two
seconds."""

import os
import signal
import time

from common import Journal, Program, arguments, await_end, check, check_equal, ids, ranks_of, state, tried, wait_until

given = arguments()
program = Program(given)
# No run of this case is complete before it is stopped; `realizations` is a total, so fewer do for the resumption.
endless = program.changed_case("realizations=160", "realizations=20000", "endless.nml")
given.case = program.changed_case("realizations=160", "realizations=40")
program.run("whole", 2)


def stopped(name, act, ranks=2, codes=(3,)):
    """Starts, acts, and checks the end and the resumption."""
    directory = program.root / name.replace(" ", "_")
    process = program.start(directory.name, ranks, case=endless)
    wait_until(lambda: len(Journal(directory / "journal.bin").records) > 20, "members")
    asked = time.monotonic()
    act(directory, process)
    text = await_end(process, 60)
    check(process.returncode in codes, f"{name}: exit code {process.returncode}\n{text}")
    check(time.monotonic() - asked < 10, f"{name}: slow end")
    check("not run of" in (directory / "run.log").read_text(), f"{name}: ids not named\n{text}")
    check(state(directory) == "stopped", f"{name}: state {state(directory)}")
    program.run(directory.name, 0 if ranks else 3)
    check_equal(program.root / "whole", directory, name)
    tried(name)


def one_rank(number):
    """Sends a signal to the last rank only."""
    return lambda directory, process: os.kill(max(ranks_of(process)), number)


def started(number):
    """Sends a signal to what was started."""
    return lambda directory, process: os.kill(process.pid, number)


stopped("file STOP", lambda directory, process: (directory / "STOP").touch())
stopped("SIGUSR1 to mpirun", started(signal.SIGUSR1))
os.environ["OMPI_MCA_odls_base_sigkill_timeout"] = "2"
not_zero = [code for code in range(-64, 256) if code != 0]
stopped("SIGTERM to mpirun", started(signal.SIGTERM), codes=not_zero)
stopped("SIGINT to mpirun", started(signal.SIGINT), codes=not_zero)
del os.environ["OMPI_MCA_odls_base_sigkill_timeout"]
stopped("SIGTERM to one rank", one_rank(signal.SIGTERM))
for number in (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1):
    stopped(f"{number.name} without mpirun", started(number), ranks=0)
# A second is what a run keeps for its own end: it must say so and not begin.
program.run("walltime", 2, "--walltime", "00:00:01", expect=3)
program.run("walltime", 1)
check_equal(program.root / "whole", program.root / "walltime", "walltime")
tried("--walltime before the first member")
text = program.run("middle", 2, "--walltime", "00:00:03", case=endless, expect=3)
done = ids(program.root / "middle")
check(0 < len(done) < 40000, f"{len(done)} members before the wall clock limit")
check("stopped by the wall clock limit" in text and "not run of" in text, f"ids not named\n{text}")
check(state(program.root / "middle") == "stopped", "not stopped")
program.run("middle", 3)
check_equal(program.root / "whole", program.root / "middle", "walltime in the middle")
tried("--walltime in the middle of a run")
program.clean()
