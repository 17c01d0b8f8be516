"""Cases 4, 6 and 11: free fall, rigid and affine motion, impact of two discs."""

import itertools

import numpy as np
from judge import close, note, small

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
    double = (1e-12, "rounding; demand 1e-12; worst of all weightings and schemes")
    single = (1e-4, "speed stops where c dt of what is missing is half a unit, 2.5e-5; on nodes and points, four times")
    yield small("v_n less discrete form, m/s", worst(off_speed), terminal, *bench.bound(double, single))
    placed = (1e-3, "16384 steps, each rounding a place of 64 m and more by up to 3.8e-6 m: 8e-4 if all one way")
    yield small("drop less discrete form, m", worst(off_drop), fallen[-1], *bench.bound(double, placed))
    double = (1e-12, "after 16 s exp(-c t) is 1e-14")
    yield close("terminal speed, m/s", terminal, ours[-1], *bench.bound(double, single))
    halved = bench.run("free_fall", {"solver.time_step": step / 2.0, "solver.end_time": 1.0})
    finer = halved.history["centre"][0, 1] - halved.history["centre"][-1, 1]
    double = (5e-6, "the reference has 6 digits; Euler is first order, so 2 drop(dt/2) - drop(dt) leaves dt^2 = 1e-6")
    single = (1e-4, "places 80 m from the corner rounded by 2e-6 m in each of 2048 steps, either way: twice 1e-4 m")
    extrapolated = 2.0 * finer - drop[n == 2**10][0]
    yield close("drop after 1 s, dt -> 0, m", 2.78441, extrapolated, *bench.bound(double, single))


def flying_disc(bench):
    """Case 6, translation: 20 cells along x and 15 along y leave no stress."""
    stresses, changes = [], []
    for weighting, scheme in itertools.product(WEIGHTINGS, SCHEMES):
        result = bench.run("flying_disc", {"solver.weighting": weighting, "solver.scheme": scheme})
        momentum = result.history["momentum"]
        stresses.append(np.abs(result.last.stress).max())
        changes.append(worst((momentum - momentum[0]).ravel()))
    why = "rounding of 432 steps dt on velocities of 5 m/s over cells of 1/4 m: 432 x {} x 5 x 4 x dt"
    double = (4e-15, why.format("2e-16"))
    single = (1e-5, why.format("1e-7") + ", 2e-6; usl with linear weights lets it grow")
    yield small("largest stress, Pa, over E", max(stresses), 1e6, *bench.bound(double, single))
    double = (1e-13, "sums over 804 points, each with a rounding of 1e-16")
    single = (1e-6, "velocities change by a rounding or some, 1e-7, as momentum goes to the nodes and back")
    yield small("change of momentum, kg/s", worst(changes), np.abs(momentum[0]).max(), *bench.bound(double, single))


def affine(bench):
    """Case 6, affine field: one step; points three cells and more from the edge of the block: their nodes
    have points all around, with every weighting."""
    step, lame, shear = 1e-3, 1e6 * 0.3 / (1.3 * 0.4), 1e6 / 2.6
    strain = np.array([0.3, 0.1, 0.0, 0.15]) * step
    exact = lame * (strain[0] + strain[1]) * np.array([1.0, 1.0, 1.0, 0.0]) + 2.0 * shear * strain
    errors = []
    for weighting, scheme in itertools.product(WEIGHTINGS, SCHEMES):
        result = bench.run("affine", {"solver.weighting": weighting, "solver.scheme": scheme})
        inside = (np.abs(result.first.position - 2.0) < 0.25).all(axis=1)
        errors.append(np.abs(result.last.stress[inside] - exact).max())
    why = "velocities of 2 m/s, with roundings of {}, differ by 0.1 m/s from node to node; some 50 roundings"
    bound = bench.bound((2e-13, why.format("4e-16")), (1e-4, why.format("2e-7")))
    yield small("stress less D : strain, Pa, over s_xx", max(errors), exact[0], *bound)


def spinning_disc(bench):
    """Case 6, rotation: one turn. What FLIP loses is second order in the size of a cell."""
    drift = {}
    for scheme, size in (("usl", 0.1), ("usl", 0.05), ("musl", 0.05)):
        changes = {"solver.scheme": scheme, "grid.cell_size": size}
        spin = bench.run("spinning_disc", changes).history["angular_momentum"]
        drift[scheme, size] = spin[-1] / spin[0] - 1.0
    exact = 0.5 * 1000.0 * np.pi
    yield close(
        "angular momentum at the start, kg m/s", exact, spin[0], 2e-3, "twice the error of the area, 0.1 %"
    )
    yield small("drift in a turn, usl, 20 cells a radius", drift["usl", 0.05], 1.0, 0.01, "demand 1 % a turn")
    yield small(
        "drift in a turn, musl, 20 cells a radius", drift["musl", 0.05], 1.0, 0.01, "demand 1 % a turn"
    )
    yield note("drift in a turn, usl, 10 cells a radius", drift["usl", 0.1], "too coarse for 1 %")


def two_discs(bench):
    """Case 11, neo-Hookean: kinetic and elastic energy together are kept. Rate-form elasticity has no energy
    function: the energy read off its stresses differs from the work done while the discs are squeezed."""
    history = bench.run("two_discs").history
    kinetic, energy = history["kinetic_energy"], history["kinetic_energy"] + history["elastic_energy"]
    momentum = 1000.0 * 0.04 * np.pi * np.hypot(0.1, 0.1)
    why = "area of a disc made of squares, 0.02 %"
    yield close("kinetic energy at the start, J/m", 2.513274, kinetic[0], 1e-3, why)
    bound = bench.bound(
        (1e-12, "demand: rounding, of the momentum of one disc"),
        (1e-6, "a rounding or some, 1e-7, of the momentum of one disc"),
    )
    yield small("momentum, kg/s", worst(history["momentum"].ravel()), momentum, *bound)
    why = "demand 1 %"
    yield small("change of total energy, worst, J/m", worst(energy - energy[0]), energy[0], 1e-2, why)
    yield small("change of total energy after parting, J/m", energy[-1] - energy[0], energy[0], 1e-2, why)
    yield note("least kinetic energy, J/m", kinetic.min(), "at the turning point: the rest is elastic")
    yield note("kinetic energy after parting, J/m", kinetic[-1], "the rest stays in vibration of the discs")
    rate = bench.run("two_discs", {"material.model": "linear_elastic"}).history
    total = rate["kinetic_energy"] + rate["elastic_energy"]
    yield note(
        "rate form: change of total energy, worst, share", worst(total / total[0] - 1.0), "no energy function"
    )
