"""A file STOP, SIGUSR1, SIGTERM and a wall clock limit end a run with exit code 3 and the ids not run;
the same command completes it, byte-equal to an uninterrupted run."""

import os
import signal
import time

from common import Program, arguments, check, check_equal, state

program = Program(arguments())
begin = time.monotonic()
program.run("whole", 2)
whole = time.monotonic() - begin


def wait_for(path):
    """Until the run is at work."""
    limit = time.monotonic() + 20
    while not path.exists() and time.monotonic() < limit:
        time.sleep(0.02)


def stopped(name, act, ranks=2):
    """Starts, acts, and checks the end and the resumption."""
    directory = program.root / name
    process = program.start(name, ranks)
    wait_for(directory / "events.jsonl")
    time.sleep(0.2 * whole)
    asked = time.monotonic()
    act(directory, process)
    text, _ = process.communicate(timeout=60)
    check(process.returncode == 3, f"{name}: exit code {process.returncode}\n{text}")
    check(time.monotonic() - asked < 10, f"{name}: slow end")
    check("not run of" in text, f"{name}: ids not named\n{text}")
    check(state(directory) == "stopped", f"{name}: state {state(directory)}")
    program.run(name, 3)
    check_equal(program.root / "whole", directory, name)


stopped("file", lambda directory, process: (directory / "STOP").touch())
stopped("usr1", lambda directory, process: os.kill(process.pid, signal.SIGUSR1))
stopped("term", lambda directory, process: os.kill(process.pid, signal.SIGTERM), ranks=0)
# A second is what a run keeps for its own end: it must say so and not begin.
program.run("walltime", 2, "--walltime", "00:00:01", expect=3)
program.run("walltime", 1)
check_equal(program.root / "whole", program.root / "walltime", "walltime")
program.clean()
