"""What it would cost to do the work that a scene can do without: paired runs with and without it.

    skips.py SGIMP_EXECUTABLE [--rounds 7] [--only column wide ...] [--instructions] [--precision single]

Runs in turn each scene as it is and with each word of `needless` that applies to it, or with other keys where work is
asked for by keys (histories, snapshots, random fields, a yield surface that nothing reaches). Prints a Markdown table:
processor time over that of the scene as it is, of the least times of all rounds, and the median of the ratios of the
rounds. With --instructions it is instructions counted by valgrind instead, on cells twice as wide for half the time; of
these one round is enough. That wants the preset portable, because valgrind knows no AVX-512.
"""

import argparse
import re
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "verification"))
from runner import change_keys, namelist_text, read_namelist

INPUT = Path(__file__).resolve().parents[2] / "input"
FIXED = {"solver.time_step": 5.0e-4}
ELASTIC = {"material.model": "linear_elastic", "material.friction_angle": None}
STRONG = {"material.friction_angle": 0, "material.cohesion": 1e30, "material.tension_strength": 1e30}
FINE = {"grid.cell_size": 0.03125, "solver.time_step": 5e-5}
PLAIN = {"output.history_interval": None, "output.snapshot_interval": None}
FIELD = (
    "&random_field material='sand', mean=35, cov=1e-20, acf='snx', scale_x=0.2, scale_y=0.2 /\n"
    "&monte_carlo realizations=1, noise_members=1 /\n"
)


def words(*names):
    """Variants that do needless work, by the word of each."""
    return {name: {"solver.needless": name} for name in names}


# Scene: case file, its changes, variants {name: changes; a text instead is added to the case}.
SCENES = {
    "column": (
        "paper/homogeneous_calibrated.nml",
        {"solver.end_time": 2.0},
        words("empty_nodes", "zero_weights", "gaps", "cracks", "dilation", "exact_return")
        | words("deformation", "plastic_strain", "velocity_gradient", "ledger")
        | {
            "history each 0.02 s": {"output.history_interval": 0.02},
            "snapshots each 0.2 s": {"output.snapshot_interval": 0.2},
        },
    ),
    # A replay writes nothing, and computes the one member with a field without homogeneous ones.
    "column, replayed": (
        "paper/homogeneous_calibrated.nml",
        {"solver.end_time": 2.0},
        {"field of cov 1e-20": FIELD},
    ),
    "column, fixed step": (
        "paper/homogeneous_calibrated.nml",
        {"solver.end_time": 2.0, "solver.scheme": "usl"} | FIXED,
        words("wave_speed"),
    ),
    "elastic": (
        "paper/homogeneous_calibrated.nml",
        {"solver.end_time": 2.0, "solver.scheme": "usl"} | FIXED | ELASTIC,
        words("wave_speed", "gaps", "deformation", "plastic_strain", "ledger")
        | {"yield surface out of reach": {"material.model": "mohr_coulomb"} | STRONG},
    ),
    "rubber": ("verification/manufactured.nml", {"solver.end_time": 0.06} | FINE, words("wave_speed", "ledger")),
    "wide": (
        "paper/homogeneous_calibrated.nml",
        {"solver.end_time": 0.1, "grid.x_max": 200, "grid.y_max": 50},
        words("empty_nodes"),
    ),
}


def arguments():
    """Parses the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("executable", type=lambda name: Path(name).resolve())
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--only", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--instructions", action="store_true")
    parser.add_argument("--precision", default="double", choices=("double", "single"))
    return parser.parse_args()


def write_case(options, scene, changes, path):
    """The case of a scene with its changes and those of a variant."""
    case, own, _ = SCENES[scene]
    groups = read_namelist(INPUT / case)
    groups = [group for group in groups if group[0] != "monte_carlo"]
    added = changes if isinstance(changes, str) else ""
    more = {} if added else changes
    change_keys(groups, PLAIN | own | {"solver.precision": options.precision} | more)
    if options.instructions:
        keys = dict(groups)
        for group, key, factor in (("grid", "cell_size", 2), ("solver", "end_time", 0.5)):
            keys[group][key] = repr(factor * float(keys[group][key]))
    path.write_text(namelist_text(groups) + added)


def processor_time(command):
    """Seconds of one run, of the user and of the system."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def count_instructions(command):
    """Of one run, by valgrind."""
    notes = Path(command[-1]).with_suffix(".callgrind")
    command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={notes}", *command]
    run = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True)
    return int(re.search(r"Collected : (\d+)", run.stderr).group(1))


def measure(options, scene, scratch):
    """Cost of each round by variant; '' is the scene as it is."""
    variants = {"": {}} | SCENES[scene][2]
    commands = {}
    for number, (name, changes) in enumerate(variants.items()):
        case = scratch / f"{scene.replace(', ', '_').replace(' ', '_')}_{number}.nml"
        write_case(options, scene, changes, case)
        commands[name] = [options.executable, case, "--output", case.with_suffix("")]
        if scene.endswith("replayed"):
            commands[name][2:2] = ["--realization", "1", "--study-case", "base" if changes else "deterministic"]
        else:
            commands[name].insert(2, "--overwrite")
    cost = {name: [] for name in variants}
    for _ in range(1 if options.instructions else options.rounds):
        for name, command in commands.items():
            cost[name].append((count_instructions if options.instructions else processor_time)(command))
    return cost


def main():
    """All scenes."""
    options = arguments()
    what = "instructions" if options.instructions else "processor time"
    print(f"| scene | work done needlessly | {what}, ratio of the least | median of the ratios | without it |")
    print("|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory(prefix="sgimp_skips_") as directory:
        for scene in options.only:
            cost = measure(options, scene, Path(directory))
            plain = cost.pop("")
            unit = f"{min(plain):.3g} s" if not options.instructions else f"{min(plain):.3g}"
            for name, costs in cost.items():
                paired = statistics.median(c / p for c, p in zip(costs, plain, strict=True))
                print(f"| {scene} | `{name}` | {min(costs) / min(plain):.4g} | {paired:.4g} | {unit} |", flush=True)


if __name__ == "__main__":
    main()
