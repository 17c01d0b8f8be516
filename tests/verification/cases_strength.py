"""Cases 2 and 3: stress paths of one element of Mohr-Coulomb and Drucker-Prager material."""

import numpy as np
from judge import close, small

ANGLE = np.radians(35.0)
PASSIVE = (1.0 + np.sin(ANGLE)) / (1.0 - np.sin(ANGLE))
# The return is exact, the path homogeneous. In single: eight roundings of 2^-23.
EXACT = (1e-8, "demand 1e-8: the return is exact, the path homogeneous"), (1e-6, "the same, and eight roundings")
DIGITS = "digits of the reference"


def invariants(stress):
    """I1 and sqrt(J2) of stresses [n, 4] (xx, yy, zz, xy)."""
    first = stress[:, :3].sum(axis=1)
    deviator = stress[:, :3] - first[:, None] / 3.0
    return first, np.sqrt(0.5 * (deviator**2).sum(axis=1) + stress[:, 3] ** 2)


def principal(stress):
    """Largest and smallest compressive stress, from (xx, yy, zz, xy) of each point."""
    centre, half = 0.5 * (stress[:, 0] + stress[:, 1]), 0.5 * (stress[:, 0] - stress[:, 1])
    radius = np.hypot(half, stress[:, 3])
    each = -np.stack([centre + radius, centre - radius, stress[:, 2]])
    return each.max(axis=0), each.min(axis=0)


def all_stresses(result):
    """Of all points in all states but the first."""
    return np.concatenate([state.stress for state in result.states[1:]])


def farthest(values, reference):
    """The value that is farthest from the reference."""
    return values[np.abs(values - reference).argmax()]


def element_compression(bench):
    """Case 2, confined compression; with cohesion only the states after first yield."""
    yield close("Kp = tan^2(45 + phi/2)", 3.690172, PASSIVE, 1e-7, DIGITS)
    stress = all_stresses(bench.run("element_compression"))
    major, minor = principal(stress)
    yield close("s1/s3 at yield, c = 0", PASSIVE, farthest(major / minor, PASSIVE), *bench.bound(*EXACT))
    yield close("Ka = s3/s1", 0.270990, farthest(minor / major, 0.270990), 3e-6, DIGITS)
    first, root = invariants(stress)
    ratio = np.sqrt(3.0) * root / (-first / 3.0)
    slope = 6.0 * np.sin(ANGLE) / (3.0 - np.sin(ANGLE))
    yield close("q/p' = 6 sin(phi)/(3 - sin(phi))", slope, farthest(ratio, slope), *bench.bound(*EXACT))
    yield close("q/p' of the list", 1.418326, slope, 1e-6, DIGITS)
    last = bench.run("element_compression", {"material.cohesion": 50.0}).last.stress
    major, minor = principal(last)
    allowed = PASSIVE * minor + 2.0 * 50.0 * np.sqrt(PASSIVE)
    yield close("s1/(Kp s3 + 2 c sqrt(Kp)), c = 50 Pa", 1.0, farthest(major / allowed, 1.0), *bench.bound(*EXACT))


def element_extension(bench):
    """Case 2, extension: the lower points, at the time when they have yielded and still carry stress."""
    states = bench.run("element_extension").states
    # The lower points yield at 2.75 s and carry nothing from 3.6 s on; the upper ones are through by 1.1 s.
    stress = np.concatenate([s.stress[s.stress[:, 1] < -1.0] for s in states if 2.8 < s.time < 3.5])
    major, minor = principal(stress)
    first, root = invariants(stress)
    ratio = np.sqrt(3.0) * root / (-first / 3.0)
    slope = 6.0 * np.sin(ANGLE) / (3.0 + np.sin(ANGLE))
    yield close("s1/s3 at yield", PASSIVE, farthest(major / minor, PASSIVE), *bench.bound(*EXACT))
    yield close("q/p' = 6 sin(phi)/(3 + sin(phi))", slope, farthest(ratio, slope), *bench.bound(*EXACT))
    yield close("q/p' of the list", 0.963029, slope, 1e-6, DIGITS)


def element_unconfined(bench):
    """Case 2, unconfined: slope between two states before yield: the constant force of damping drops out."""
    young, poisson, cohesion, rate = 1e7, 0.3, 1e-3, 1e-9
    states = bench.run("element_unconfined").states
    strength = 2.0 * cohesion * np.sqrt(PASSIVE)
    before = [s for s in states if s.time > 0.05 and (-s.stress[:, 1]).max() < 0.9 * strength]
    slopes = (before[0].stress[:, 1] - before[-1].stress[:, 1]) / (rate * (before[-1].time - before[0].time))
    modulus = young / (1.0 - poisson**2)
    single = (1e-3, "the stress is rounded in each of 15000 steps, by half of 2^-23: 9e-4 if all one way")
    yield close(
        "elastic slope E/(1 - nu^2), Pa", modulus, farthest(slopes, modulus), *bench.bound(EXACT[0], single)
    )
    major, minor = principal(states[-1].stress)
    limit = PASSIVE * minor + strength
    yield close("s1/(Kp s3 + 2 c sqrt(Kp))", 1.0, farthest(major / limit, 1.0), *bench.bound(*EXACT))
    why = "damping of the side that moves out: rho c_d v L = 3e-6 Pa beside 3.8e-3 Pa"
    yield small("s3 at the free side, Pa, over s1", minor.max(), major.max(), 1e-3, why)


def cones(bench):
    """Case 3: sqrt(J2)/|I1| at yield for every cone."""
    sine = np.sin(ANGLE)
    closed = {
        "plane_strain_associated": (0.181499, np.tan(ANGLE) / np.sqrt(9.0 + 12.0 * np.tan(ANGLE) ** 2)),
        "plane_strain": (0.191192, sine / 3.0),
        "outer": (0.272957, 2.0 * sine / (np.sqrt(3.0) * (3.0 - sine))),
        "inner": (0.185335, 2.0 * sine / (np.sqrt(3.0) * (3.0 + sine))),
    }
    for cone, (listed, formula) in closed.items():
        changes = {"material.model": "drucker_prager", "material.cone": cone}
        stress = all_stresses(bench.run("element_compression", changes))
        first, root = invariants(stress)
        yield close(f"{cone}: alpha", formula, farthest(-root / first, formula), 1e-6, "demand 1e-6")
        yield close(f"{cone}: alpha of the list", listed, formula, 3e-6, DIGITS)
