"""kill -9 at five random moments, each time resumed on another number of ranks: files open after each
kill, and the end is byte-equal to an uninterrupted run."""

import os
import random
import signal
import time

import h5py
from common import Program, arguments, check, check_equal, state

given = arguments()
program = Program(given)
chance = random.Random(given.seed)
begin = time.monotonic()
program.run("whole", 2)
whole = time.monotonic() - begin
killed = program.root / "killed"
kills = 0
for attempt in range(5):
    # A fifth of the whole each, so that all five hit a run at work.
    process = program.start("killed", 1 + attempt % 3)
    time.sleep(0.3 + chance.uniform(0.0, 0.3) * whole)
    if process.poll() is None:
        kills += 1
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    # mpirun puts each rank into a process group of its own: they end when they lose their parent.
    time.sleep(0.5)
    if (killed / "ensemble.h5").exists():
        h5py.File(killed / "ensemble.h5").close()
for _ in range(20):
    if "at work" not in program.start("killed", 3).communicate(timeout=250)[0]:
        break
    time.sleep(0.5)
program.run("killed", 3)
check(kills >= 2, f"only {kills} of five kills met a run at work")
check(state(killed) == "complete", "not complete")
check_equal(program.root / "whole", killed, "after kills")
print(f"{kills} kills, whole run {whole:.1f} s")
program.clean()
