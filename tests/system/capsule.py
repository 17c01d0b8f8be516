"""A member that fails leaves its first and last good state and a case file that replays the failure."""

import h5py
import numpy as np
from common import Program, arguments, check

program = Program(arguments())
# Eight times the limit of the time step: every member fails in a few steps.
case = program.changed_case("end_time=3", "end_time=3, time_step=0.08")
program.run("failing", 2, case=case, expect=4)
with h5py.File(program.root / "failing" / "ensemble.h5") as file:
    label = sorted(name for name in file["cases"] if name != "deterministic")[0]
    status, step = file[f"cases/{label}/status"][0], file[f"cases/{label}/failure_step"][0]
check(status > 0, "no member failed")
capsule = program.root / "failing" / "failures" / f"{label}_r000001"
with h5py.File(capsule.with_name(capsule.name + ".h5")) as file:
    states = sorted(name for name in file if name.startswith("step_"))
    check(int(states[-1][5:]) == step - 1, f"last state {states[-1]}, failure in step {step}")
    for name in ("position", "velocity", "stress"):
        check(np.isfinite(file[states[-1]][name][:]).all(), f"{name} of the last good state is not finite")
text = program.run(
    "replayed",
    0,
    "--realization",
    "1",
    "--study-case",
    label,
    "--snapshots",
    case=capsule.with_name(capsule.name + ".nml"),
)
check(f"failure_step             {step}" in text, f"the replay does not fail in step {step}:\n{text}")
program.clean()
