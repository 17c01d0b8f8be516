"""The factor of safety of a c-phi slope, by strength reduction, against limit analysis and limit equilibrium."""

import numpy as np
from judge import close, note

FRICTION_ANGLE, COHESION, UNIT_WEIGHT = 30.0, 10e3, 2038.7 * 9.81
HEIGHT, FACE = 10.0, np.radians(45.0)


def stability_number(friction_angle):
    """Least gamma H/c of the log spirals through the toe of the slope (Chen 1975, level crest)."""
    tangent = np.tan(np.radians(friction_angle))
    first, last = np.meshgrid(np.radians(np.arange(1.0, 90.0, 0.25)), np.radians(np.arange(60.0, 150.0, 0.25)))
    growth = np.exp((last - first) * tangent)
    height = np.sin(last) * growth - np.sin(first)
    crest = np.cos(first) - np.cos(last) * growth - height / np.tan(FACE)
    spiral = (
        (3.0 * tangent * np.cos(last) + np.sin(last)) * growth**3 - 3.0 * tangent * np.cos(first) - np.sin(first)
    ) / (3.0 * (1.0 + 9.0 * tangent**2))
    above = crest * (2.0 * np.cos(first) - crest) * np.sin(first) / 6.0
    before = growth * (np.sin(last - first) - crest * np.sin(last))
    before *= (np.cos(first) - crest + np.cos(last) * growth) / 6.0
    driving = spiral - above - before
    resisting = (growth**2 - 1.0) / (2.0 * tangent)
    possible = (last > first) & (crest > 0.0) & (height > 0.0) & (driving > 0.0)
    return np.min(np.where(possible, resisting * height / np.where(possible, driving, 1.0), np.inf))


def reduced(factor):
    """Friction angle in degrees and cohesion in Pa of the strength divided by `factor`."""
    return np.degrees(np.arctan(np.tan(np.radians(FRICTION_ANGLE)) / factor)), COHESION / factor


def bisected(slides, low=1.0, high=1.4, width=0.01):
    """The factor from which on `slides(factor)` holds, in the middle of an interval narrower than `width`."""
    while high - low > width:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if slides(middle) else (middle, high)
    return 0.5 * (low + high)


def limit_analysis():
    """Factor of safety of the log spiral: the factor at which gamma H/c is the stability number."""

    def slides(factor):
        friction_angle, cohesion = reduced(factor)
        return UNIT_WEIGHT * HEIGHT / cohesion > stability_number(friction_angle)

    return bisected(slides, width=1e-4)


def strength_reduction(bench, is_associated, **others):
    """Factor of safety of the program: a slope slides when a point comes 0.1 m far within 3 s of its release. One
    that lacks a hundredth of its strength comes some 0.2 m far; what stands moves by less than 1 mm."""

    def slides(factor):
        friction_angle, cohesion = reduced(factor)
        changes = {
            "material.friction_angle": friction_angle,
            "material.cohesion": cohesion,
            "material.dilation_angle": friction_angle if is_associated else 0.0,
        }
        result = bench.run("slope_stability", changes | {f"grid.{key}": value for key, value in others.items()})
        way = np.linalg.norm(result.last.displacement - result.first.displacement, axis=1)
        return way.max() > 0.1

    return bisected(slides)


def slope_stability(bench):
    """The bound holds for psi = phi; without dilation the resistance is less, and less with finer cells."""
    bound = limit_analysis()
    yield close("log spiral against limit equilibrium", 1.204, bound, 0.003, "circles of slices are no bound")
    ours = strength_reduction(bench, is_associated=True)
    why = "half of the 6 % with cells of 0.5 m (order 1), and the interval of the bisection"
    yield close("factor of safety, psi = phi", bound, ours, 0.04, why)
    for cell in (0.5, 0.25):
        ours = strength_reduction(bench, is_associated=False, cell_size=cell)
        yield note(f"factor of safety, psi = 0, cells of {cell} m", ours, f"{ours / bound - 1.0:+.1%} of the bound")
    ours = strength_reduction(bench, is_associated=True, cell_size=0.5)
    yield note("factor of safety, psi = phi, cells of 0.5 m", ours, f"{ours / bound - 1.0:+.1%} of the bound")
