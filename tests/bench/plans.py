"""Sampling plans: how much nearer the mean runout comes with the same number of members.

    plans.py SGIMP_EXECUTABLE [--case CASE] [--members 32] [--seeds 40] [--cell 0.25] [--scale 0.2 2.0] [--ranks 2]

For every plan and scale of fluctuation, ensembles of N members of CASE (input/paper/baseline.nml, SNX, COV 0.10, cells
as given) with as many seeds; prints the standard deviation over the seeds of the ensemble's mean of the 99.5 % runout
and of the field's mean, over those of `random`, and the members of `random` that would be as good, N/ratio^2. The ratio
of two standard deviations from S seeds each is known to about 1/sqrt(S).
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from launch import run_members

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "verification"))
from runner import write_changed  # noqa: E402

PLANS = ("random", "antithetic", "latin_hypercube")
COLUMNS = ("status", "runout_q995", "field_mean")


def means(options, plan, scale, seed, scratch):
    """Mean runout and mean of the fields of one ensemble."""
    changes = {
        "grid.cell_size": options.cell,
        "random_field.scale_x": scale,
        "random_field.scale_y": scale,
        "monte_carlo.realizations": options.members,
        "monte_carlo.noise_members": 1,
        "monte_carlo.seed": seed,
        "monte_carlo.sampling": plan,
        "study.acf": "snx",
        "study.cov": 0.1,
    }
    case = scratch / "case.nml"
    write_changed(options.case, changes, case)
    columns = run_members(options, case, scratch / f"{plan}_{scale}_{seed}", COLUMNS)
    members = next(columns[label] for label in columns if label != "deterministic")
    good = members["status"] == 0
    return members["runout_q995"][good].mean(), members["field_mean"].mean()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("executable", type=lambda name: Path(name).resolve())
    parser.add_argument("--case", type=Path, default=ROOT / "input" / "paper" / "baseline.nml")
    parser.add_argument("--members", type=int, default=32)
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--cell", type=float, default=0.25)
    parser.add_argument("--scale", type=float, nargs="+", default=[0.2, 2.0])
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--mpiexec", default="mpirun")
    options = parser.parse_args()
    print("| scale, m | plan | mean runout, m | its sd over seeds, m | over `random` | as good as | field's mean |")
    print("|---|---|---|---|---|---|---|")
    for scale in options.scale:
        plain = None
        for plan in PLANS:
            with tempfile.TemporaryDirectory() as scratch:
                found = np.array([means(options, plan, scale, 1 + k, Path(scratch)) for k in range(options.seeds)])
            sd = found.std(axis=0, ddof=1)
            plain = sd if plain is None else plain
            ratio = sd / plain
            print(
                f"| {scale} | {plan} | {found[:, 0].mean():.3f} | {sd[0]:.4f} | {ratio[0]:.2f} | "
                f"{options.members / ratio[0] ** 2:.0f} | {ratio[1]:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
