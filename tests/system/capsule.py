"""A member that fails leaves its first and last good state and a case file that replays the failure."""

import h5py
import numpy as np
from common import Program, arguments, check

program = Program(arguments())


def fail_and_replay(name, case, said):
    """Runs `case`, in which member 1 fails and says `said`; looks at its last good state and replays it."""
    program.run(name, 2, case=case, expect=4)
    with h5py.File(program.root / name / "ensemble.h5") as file:
        label = sorted(name for name in file["cases"] if name != "deterministic")[0]
        status, step = file[f"cases/{label}/status"][0], file[f"cases/{label}/failure_step"][0]
    check(status > 0, "no member failed")
    capsule = program.root / name / "failures" / f"{label}_r000001"
    with h5py.File(capsule.with_name(capsule.name + ".h5")) as file:
        states = sorted(name for name in file if name.startswith("step_"))
        check(int(states[-1][5:]) == step - 1, f"last state {states[-1]}, failure in step {step}")
        for quantity in ("position", "velocity", "stress"):
            finite = np.isfinite(file[states[-1]][quantity][:]).all()
            check(finite, f"{quantity} of the last good state is not finite")
        moved = file[states[-1]]["position"][:] != file[states[0]]["position"][:]
        check(step == 1 or moved.any(), "first and last state are the same")
    text = program.run(
        name + "_replayed",
        0,
        "--realization",
        "1",
        "--study-case",
        label,
        "--snapshots",
        case=capsule.with_name(capsule.name + ".nml"),
    )
    check(f"failure_step             {step}" in text, f"the replay does not fail in step {step}:\n{text}")
    check(said in text, f"the replay does not say '{said}':\n{text}")


# Eight times the limit of the time step: every member fails in a few steps.
program.given.case = program.changed_case("end_time=3", "end_time=3, time_step=0.08")
fail_and_replay("failing", program.given.case, "")
# The same, in the relaxation that comes before time 0.
relaxing = program.changed_case("damping=0.4", "damping=0.4, relaxation='gated', relaxation_time=5")
fail_and_replay("relaxing", relaxing, "before time 0, in the relaxation")
program.clean()
