"""What no scheme and no weighting function may lose or make: mass, momentum, angular momentum, energy.

Usage: conservation.py SGIMP_EXECUTABLE [--precision single]
Small scenes are written here and run with every scheme and every weighting function; prints one line for each
quantity missed and one for the worst of each; exit code 1 if one is missed.

Where the bounds come from:
  mass              exact: points keep theirs; in single precision each is rounded by up to 6e-8.
  momentum          rounding, VERIFICATION case 11: 1e-12 of the sum of m |v|. Weights add up to 1 and their
                    slopes to 0, so internal forces cancel whatever the scheme. In single precision 1e-5, a
                    hundred roundings.
  friction          Coulomb at every node of a wall bounds the tangential impulse by mu times the normal one,
                    and points take exactly the impulse that nodes got: to rounding as above.
  reaction          force times time step is the momentum that points gained in it: to rounding.
  angular momentum  the place of a node is not the centre of the mass it stands for; what that loses is of
                    second order in the cell, so half the cell has to leave a quarter. Allowed is a third,
                    since the edge of a disc of points is a staircase.
  energy            explicit steps do not conserve it. USL only loses it (Bardenhagen 2002); MUSL and USF make
                    a little in a collision of soft discs at 8 cells a diameter, most with hat functions, as
                    their slopes jump between cells. ENERGY has twice what was measured when this was written,
                    as a share of the peak of kinetic energy. What it is there to find is far larger: walls
                    that held a rebounding block for its momentum but not for its strain made 0.8.
  plate's work      what a block that is pressed slowly stores and moves with is at most what the plate gave, FLIP
                    or PIC; PRESSED has twice what was measured (1.1 %: velocity and stress are half a step apart).
"""

import argparse
import itertools
import sys
import tempfile
from pathlib import Path

import numpy as np
from runner import run_namelist

ROUNDING = {"double": 1e-12, "single": 1e-5}
MASS_ROUNDING = {"double": 0.0, "single": 1e-7}
FREE = "left='free', right='free', bottom='free', top='free'"
# Two soft discs that graze each other, one of them spinning.
DISCS = f"""
&grid x_min=-0.2, x_max=1.2, y_min=-0.2, y_max=1.2, cell_size=0.05, {FREE} /
&material name='m', model='linear_elastic', density=1000, young=1000, poisson=0.3 /
&body name='a', material='m', shape='disc', x=0.3, y=0.35, radius=0.2,
      velocity=0.1,0.1, angular_velocity=-0.4 /
&body name='b', material='m', shape='disc', x=0.7, y=0.65, radius=0.2, velocity=-0.1,-0.1 /
&loading gravity=0,0 /
&solver {{solver}}, cfl=0.4, end_time=2, settle=0 /
&output history_interval=0.02 /
"""
# A block falls on a wall that it can leave again, slides and bounces.
BLOCK = """
&grid x_min=0, x_max=2, y_min=0, y_max=1, cell_size=0.0625,
      left='free', right='free', bottom='frictional', top='free', bottom_friction=0.3 /
&material name='m', model='neo_hookean', density=1000, young=1e5, poisson=0.3 /
&body name='a', material='m', shape='rectangle', x=0.25, y=0.125, width=0.5, height=0.25, velocity=0.5,0 /
&loading gravity=0,-9.81 /
&solver {solver}, cfl=0.4, end_time=0.8, settle=0 /
&output history_interval=0.005 /
"""
SAND = """
&grid x_min=0, x_max=3, y_min=0, y_max=1.25, cell_size=0.125,
      left='roller', right='roller', bottom='fixed', top='free' /
&material name='m', model='mohr_coulomb', density=1450, young=1e6, poisson=0.3,
      friction_angle=33, dilation_angle=3 /
&body name='a', material='m', shape='rectangle', x=0, y=0, width=0.75, height=1 /
&loading gravity=0,-9.81 /
&solver {solver}, cfl=0.4, end_time=0.8, settle=0 /
&output history_interval=0.01 /
"""
# A plate pushes a free block; a row of history for every step.
PUSHED = f"""
&grid x_min=0, x_max=2, y_min=0, y_max=1, cell_size=0.0625, {FREE} /
&material name='m', model='linear_elastic', density=1000, young=1e5, poisson=0.3 /
&body name='a', material='m', shape='rectangle', x=0.5, y=0.25, width=0.5, height=0.25 /
&boundary name='plate', x_min=0, x_max=0.5, y_min=0, y_max=1, components='both', velocity=0.2,0.1 /
&loading gravity=0,0 /
&solver {{solver}}, time_step=1e-3, end_time=0.2, settle=0 /
&output history_interval=5e-4 /
"""
# A plate presses a block on the floor, slowly.
PRESSED = """
&grid x_min=0, x_max=2, y_min=0, y_max=2, cell_size=0.125, left='free', right='free', bottom='fixed', top='free' /
&material name='m', model='neo_hookean', density=1000, young=1e5, poisson=0.3 /
&body name='a', material='m', shape='rectangle', x=0.5, y=0, width=1, height=1 /
&boundary name='plate', x_min=0, x_max=2, y_min=0.9375, y_max=2, components='both', velocity=0,-0.2 /
&loading gravity=0,0 /
&solver {solver}, cfl=0.4, end_time=0.5, settle=0 /
&output history_interval=0.02 /
"""
SPIN = f"""
&grid x_min=0, x_max=1, y_min=0, y_max=1, cell_size={{cell}}, {FREE} /
&material name='m', model='neo_hookean', density=1000, young=1e4, poisson=0.3 /
&body name='a', material='m', shape='disc', x=0.5, y=0.5, radius=0.2, angular_velocity=2 /
&loading gravity=0,0 /
&solver {{solver}}, cfl=0.4, end_time=3.14, settle=0 /
&output history_interval=0.05 /
"""
SCHEMES = ("usf", "usl", "musl")
WEIGHTINGS = ("linear", "gimp", "cpgimp", "bspline")
# Hat functions with stress last divide by the mass of nodes that a point has just reached: free surfaces run
# away (Bardenhagen 2002), which is why MUSL exists.
UNSTABLE = [("usl", "linear")]
# TPIC only loses energy, with every scheme.
PASSIVE = 0.001
ENERGY = {
    "discs": {"usl": 0.001, "musl": 0.03, "usf": 0.04, "usf linear": 0.09},
    "block": {"usl": 0.001, "musl": 0.02, "usf": 0.02},
    "sand": {"usl": 0.001, "musl": 0.001, "usf": 0.001},
}
MOST_OF_PRESSED = 0.02


class Runner:
    """Runs scenes with one executable in one precision."""

    def __init__(self, executable, directory, precision):
        self.executable, self.directory, self.precision = executable, Path(directory), precision

    def __call__(self, scene, solver, **changes):
        """Runs a scene in which {solver} and the like are replaced."""
        solver = f"precision='{self.precision}', {solver}"
        case = self.directory / "case.nml"
        case.write_text("&case name='conservation' /" + scene.format(solver=solver, **changes))
        return run_namelist(self.executable, case, self.directory / "run", (0, 4))


def mass_of(result, density):
    """Total mass in kg/m: all points start undeformed."""
    return density * result.first.volume.sum()


def momentum_scale(result, density):
    """Sum of m |v| at the start and at the end, the larger."""
    speeds = [np.linalg.norm(state.velocity, axis=1) for state in (result.first, result.last)]
    return density * max(np.sum(result.first.volume * speed) for speed in speeds)


def energy_rise(history):
    """Largest rise of kinetic + elastic + potential energy above its start, over the peak of kinetic."""
    total = history["kinetic_energy"] + history["elastic_energy"] + history["potential_energy"]
    return (total - total[0]).max() / history["kinetic_energy"].max()


def energy_bound(scene, scheme, weighting):
    """Allowed rise of energy."""
    bounds = ENERGY[scene]
    return bounds.get(f"{scheme} {weighting}", bounds[scheme])


def judge_discs(result, rounding):
    """Nothing from outside acts on the discs."""
    momentum = result.history["momentum"]
    yield "momentum", np.abs(momentum - momentum[0]).max() / momentum_scale(result, 1000), rounding


def judge_block(result, rounding):
    """The wall pushes up and against the motion, and friction stays below mu times the push."""
    momentum, time = result.history["momentum"], result.history["time"]
    scale, weight = momentum_scale(result, 1000), 9.81 * mass_of(result, 1000)
    tangential = momentum[0, 0] - momentum[:, 0]
    normal = momentum[:, 1] - momentum[0, 1] + weight * time
    yield "impulse of friction beyond Coulomb's", (tangential - 0.3 * normal).max() / scale, rounding
    yield "pull of the wall", -np.diff(normal).min() / scale, rounding
    # It has slid and been pushed at all: a wall that does nothing would pass the lines above.
    yield "share of the sliding that friction left", momentum[-1, 0] / momentum[0, 0], 0.9


def judge_sand(result, rounding):
    """Plastic flow takes work and never gives it back."""
    history = result.history
    work = np.diff(history["plastic_work"])
    # What is taken for plastic work is the work of stresses less the change of elastic energy: to rounding.
    yield "plastic work given back", -work.min() / history["kinetic_energy"].max(), 1e-9
    yield (
        "energy that was dissipated (left over)",
        1 - history["plastic_work"][-1] / -np.diff(history["potential_energy"][[0, -1]]).item(),
        0.75,
    )


def judge_pushed(result, rounding):
    """Momentum is what the plate gave."""
    momentum, reaction = result.history["momentum"], result.history["reaction"]
    gain = momentum[1:] - momentum[:-1] - reaction[1:] * np.diff(result.history["time"])[:, None]
    yield "momentum without reaction", np.abs(gain).max() / np.abs(momentum).max(), rounding
    yield "share of the plate's speed not reached", 1 - momentum[-1, 0] / (0.2 * mass_of(result, 1000)), 0.9


def judge_all(run):
    """Yields (name, quantity, value, allowed) of all scenes."""
    rounding, mass_rounding = ROUNDING[run.precision], MASS_ROUNDING[run.precision]
    scenes = {"discs": (DISCS, judge_discs), "block": (BLOCK, judge_block), "sand": (SAND, judge_sand)}
    methods = [*((w, "flip") for w in WEIGHTINGS), *((w, "tpic") for w in WEIGHTINGS[1:])]
    for scheme, (weighting, transfer) in itertools.product(SCHEMES, methods):
        solver = f"scheme='{scheme}', weighting='{weighting}', transfer='{transfer}'"
        for name, (scene, judge) in scenes.items():
            if (scheme, weighting) in UNSTABLE and name != "sand":
                continue
            # A failed member misses too.
            result = run(scene, solver)
            label = f"{name}, {scheme}, {weighting}, {transfer}"
            yield label, "status", result.row["status"], 0
            yield label, "mass", abs(result.row["mass_error"]), mass_rounding
            rise = energy_rise(result.history)
            bound = PASSIVE if transfer == "tpic" else energy_bound(name, scheme, weighting)
            yield label, "energy made", rise, bound
            for quantity, value, allowed in judge(result, rounding):
                yield label, quantity, value, allowed
        result = run(PUSHED, solver)
        for quantity, value, allowed in judge_pushed(result, rounding):
            yield f"pushed, {scheme}, {weighting}, {transfer}", quantity, value, allowed
    for scheme, flip in itertools.product(SCHEMES, (1.0, 0.99, 0.0)):
        history = run(PRESSED, f"scheme='{scheme}', flip={flip}").history
        label = f"pressed, {scheme}, flip {flip}"
        yield label, "energy beyond the plate's work", history["energy_error"].max(), MOST_OF_PRESSED
        stored = -history["elastic_energy"][-1] / history["wall_work"][-1]
        yield label, "share of the plate's work not stored", 1 - stored, 0.1
    for extra in ("flip=0.9", "anti_locking='cell_average'"):
        result = run(DISCS, f"scheme='musl', weighting='gimp', {extra}")
        for quantity, value, allowed in judge_discs(result, rounding):
            yield f"discs, {extra}", quantity, value, allowed
    for transfer in ("flip", "tpic"):
        drift = []
        for cell in (0.05, 0.025):
            solver = f"scheme='usl', weighting='gimp', transfer='{transfer}'"
            spin = run(SPIN, solver, cell=cell).history["angular_momentum"]
            drift.append(np.abs(spin / spin[0] - 1).max())
        label = f"spin, usl, gimp, {transfer}"
        yield label, "angular momentum lost with half the cell, of that lost", drift[1] / drift[0], 1 / 3


def main():
    """Runs and judges all scenes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("executable", type=lambda name: Path(name).resolve())
    parser.add_argument("--precision", choices=ROUNDING, default="double")
    options = parser.parse_args()
    missed, worst = 0, {}
    with tempfile.TemporaryDirectory() as directory:
        for name, quantity, value, allowed in judge_all(Runner(options.executable, directory, options.precision)):
            key = (name.split(",")[0], quantity)
            if value > worst.get(key, (-np.inf,))[0]:
                worst[key] = (value, allowed, name)
            if not value <= allowed:
                missed += 1
                print(f"{name}: {quantity}: {value:.2e}, allowed {allowed:.0e}  MISSED")
    for (scene, quantity), (value, allowed, name) in worst.items():
        print(f"{scene}: {quantity}: worst {value:.2e} ({name}), allowed {allowed:.0e}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
