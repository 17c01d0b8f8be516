"""Cases 4, 6 and 11: free fall, rigid and affine motion, impact of two discs."""

import itertools

import numpy as np
from judge import close, small

SCHEMES = ("usf", "usl", "musl")
WEIGHTINGS = ("linear", "gimp", "cpgimp", "bspline")


def worst(values):
    """The value farthest from 0."""
    return max(values, key=abs)


def free_fall(bench):
    """Case 4: against the discrete form in every scheme, and against the limit dt -> 0 by extrapolation."""
    gravity, damping, step = 9.81, 2.0, 2.0**-10
    terminal = gravity / damping
    off_speed, off_drop = [], []
    for weighting, scheme in itertools.product(WEIGHTINGS, SCHEMES):
        result = bench.run("free_fall", {"solver.weighting": weighting, "solver.scheme": scheme})
        n = np.rint(result.history["time"] / step).astype(int)
        speed = terminal * (1.0 - (1.0 - damping * step) ** np.arange(n[-1] + 1))
        fallen = step * np.cumsum(speed)
        ours = -result.history["momentum"][:, 1] / 1000.0
        drop = result.history["centre"][0, 1] - result.history["centre"][:, 1]
        off_speed.append(worst(ours - speed[n]))
        off_drop.append(worst(drop - fallen[n]))
    why = "rounding; demand 1e-12; worst of all weightings and schemes"
    yield small("v_n less discrete form, m/s", worst(off_speed), terminal, 1e-12, why)
    yield small("drop less discrete form, m", worst(off_drop), fallen[-1], 1e-12, why)
    yield close("terminal speed, m/s", terminal, ours[-1], 1e-12, "after 16 s exp(-c t) is 1e-14")
    halved = bench.run("free_fall", {"solver.time_step": step / 2.0, "solver.end_time": 1.0})
    finer = halved.history["centre"][0, 1] - halved.history["centre"][-1, 1]
    why = "the reference has 6 digits; Euler is first order, so 2 drop(dt/2) - drop(dt) leaves dt^2 = 1e-6"
    yield close("drop after 1 s, dt -> 0, m", 2.78441, 2.0 * finer - drop[n == 2**10][0], 5e-6, why)


def flying_disc(bench):
    """Case 6, translation: 20 cells along x and 15 along y leave no stress."""
    stresses, changes = [], []
    for weighting, scheme in itertools.product(WEIGHTINGS, SCHEMES):
        result = bench.run("flying_disc", {"solver.weighting": weighting, "solver.scheme": scheme})
        momentum = result.history["momentum"]
        stresses.append(np.abs(result.last.stress).max())
        changes.append(worst((momentum - momentum[0]).ravel()))
    why = "rounding of 432 steps dt on velocities of 5 m/s over cells of 1/4 m: 432 x 2e-16 x 5 x 4 x dt"
    yield small("largest stress, Pa, over E", max(stresses), 1e6, 4e-15, why)
    why = "sums over 804 points, each with a rounding of 1e-16"
    yield small("change of momentum, kg/s", worst(changes), np.abs(momentum[0]).max(), 1e-13, why)


def affine(bench):
    """Case 6, affine field: one step; points two cells and more from the edge of the block."""
    step, lame, shear = 1e-3, 1e6 * 0.3 / (1.3 * 0.4), 1e6 / 2.6
    strain = np.array([0.3, 0.1, 0.0, 0.15]) * step
    exact = lame * (strain[0] + strain[1]) * np.array([1.0, 1.0, 1.0, 0.0]) + 2.0 * shear * strain
    errors = []
    for weighting, scheme in itertools.product(WEIGHTINGS, SCHEMES):
        result = bench.run("affine", {"solver.weighting": weighting, "solver.scheme": scheme})
        place = result.first.position
        inside = (np.abs(place - 2.0) < 0.5).all(axis=1)
        errors.append(np.abs(result.last.stress[inside] - exact).max())
        print(weighting, scheme, errors[-1] / exact.max(), inside.sum())
    why = "rounding: velocities of 2 m/s differ by 0.1 m/s from node to node"
    yield small("stress less D : strain, Pa, over s_xx", max(errors), exact[0], 1e-12, why)


def spinning_disc(bench):
    """Case 6, rotation: three turns."""
    for weighting, scheme in itertools.product(WEIGHTINGS, SCHEMES):
        history = bench.run("spinning_disc", {"solver.weighting": weighting, "solver.scheme": scheme}).history
        spin = history["angular_momentum"]
        print(weighting, scheme, spin[0], spin[-1] / spin[0] - 1.0, history["kinetic_energy"][[0,-1]],history["elastic_energy"][[0,-1]])
    yield close("angular momentum at the start", 0.5 * 1000 * np.pi, spin[0], 1e-2, "area")


def two_discs(bench):
    """Case 11. Rate-form elasticity has no energy function: at the turning point, 12 % strain, the energy read off
    the stresses differs from the work done; what is kept throughout is kinetic energy plus that work."""
    history = bench.run("two_discs").history
    kinetic, energy = history["kinetic_energy"], history["kinetic_energy"] + history["elastic_energy"]
    balance = energy + history["dissipated"]
    largest = 1000.0 * 0.04 * np.pi * np.hypot(0.1, 0.1)
    yield close(
        "kinetic energy at the start, J/m", 2.513274, kinetic[0], 1e-3, "area of a disc made of squares"
    )
    yield small(
        "momentum, kg/s",
        worst(history["momentum"].ravel()),
        largest,
        1e-12,
        "demand: rounding, of one disc's",
    )
    yield close(
        "kinetic energy + work of stresses, worst",
        energy[0],
        worst(balance - balance[0]) + balance[0],
        1e-2,
        "demand: total energy 1 %",
    )
    yield close(
        "kinetic + elastic energy after separation", energy[0], energy[-1], 1e-2, "demand: total energy 1 %"
    )
