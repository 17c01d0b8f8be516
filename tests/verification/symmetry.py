"""Scenes that are the same but for how they are written down must give the same result.

Usage: symmetry.py SGIMP_EXECUTABLE
A block bounces between different walls (elastic, 400 steps) and a column of sand collapses (160 steps); each
is run as it is and changed: mirrored, with x and y swapped, moved by whole cells, cut into two bodies, in
other units of length and mass. Points are matched by where they started. Prints the worst difference of each
change; exit code 1 if one is too large.

Where the bounds come from: units changed by powers of two change no digit of any number, so the results are
equal to the last bit unless the code holds a constant with a unit. All other changes alter roundings, 1e-16
at each step. Elastic motion lets them add up: 400 steps, places of 4 m against motions of 1 m and strains of
1e-3 make 1e-10 of each quantity. In sand a rounding grows with every grain that decides otherwise; over this
short time by far less than to the 1e-7 allowed. A mistake of a cell, a wall or a sign is of the order of 1.
"""

import copy
import sys
import tempfile
from pathlib import Path

import numpy as np
from runner import run_namelist

ELASTIC_BOUND = 1e-10
SAND_BOUND = 1e-7
SIDES = ("left", "right", "bottom", "top")
# Each scheme once, each smooth weighting function once. Not USL with domains (GIMP): a domain that reaches a
# node by no matter how little, u, takes a finite strain from it at once (force over mass as 1/u, slope as u),
# so that roundings decide; MUSL and USF take strains from velocities that know nothing of that force.
SOLVERS = (
    ("musl", "cpgimp", "flip"),
    ("usf", "gimp", "flip"),
    ("usl", "bspline", "flip"),
    ("musl", "gimp", "tpic"),
)
# All four walls differ; the body touches none and is nowhere in the middle.
BLOCK = {
    "low": [-1.0, -0.5],
    "high": [1.0, 0.75],
    "cell": 0.125,
    "walls": {
        "left": ("roller", 0),
        "right": ("fixed", 0),
        "bottom": ("frictional", 0.25),
        "top": ("frictional", 0.5),
    },
    "bodies": [{"low": [-0.625, -0.25], "size": [0.75, 0.5], "velocity": [1.5, 0.5]}],
    "gravity": [0.5, -2.0],
    "stresses": {"young": 1e5},
    "material": "model='linear_elastic', poisson=0.3",
    "density": 1000.0,
    "rates": {"damping": 0.0},
    "end": 1.5,
}
SAND = {
    "low": [-1.0, -0.5],
    "high": [1.0, 0.75],
    "cell": 0.125,
    "walls": {"left": ("roller", 0), "right": ("roller", 0), "bottom": ("fixed", 0), "top": ("free", 0)},
    "bodies": [{"low": [-1.0, -0.5], "size": [0.75, 1.0], "velocity": [0.0, 0.0]}],
    "gravity": [0.0, -9.81],
    "stresses": {"young": 1e6, "cohesion": 200.0, "residual_cohesion": 50.0, "tension_strength": 40.0},
    "material": "model='mohr_coulomb', poisson=0.3, friction_angle=34, dilation_angle=4, softening='linear',"
    " residual_friction_angle=30, softening_end=0.2",
    "density": 1450.0,
    "rates": {"damping": 0.5},
    "end": 0.25,
}


def write(scene, scheme, weighting, transfer):
    """The scene as a namelist."""
    walls = ", ".join(f"{side}='{scene['walls'][side][0]}'" for side in SIDES)
    walls += "".join(f", {s}_friction={w[1]}" for s, w in scene["walls"].items() if w[0] == "frictional")
    stresses = ", ".join(f"{key}={value!r}" for key, value in scene["stresses"].items())
    lines = [
        "&case name='symmetry' /",
        f"&grid x_min={scene['low'][0]!r}, x_max={scene['high'][0]!r}, y_min={scene['low'][1]!r},"
        f" y_max={scene['high'][1]!r}, cell_size={scene['cell']!r}, {walls} /",
        f"&material name='m', density={scene['density']!r}, {stresses}, {scene['material']} /",
        f"&loading gravity={scene['gravity'][0]!r},{scene['gravity'][1]!r},"
        f" damping={scene['rates']['damping']!r} /",
        f"&solver scheme='{scheme}', weighting='{weighting}', cfl=0.4, end_time={scene['end']!r}, settle=0 /",
        f"&output history_interval={scene['end']!r} /",
    ]
    for number, body in enumerate(scene["bodies"]):
        lines.append(
            f"&body name='b{number}', material='m', shape='rectangle',"
            f" x={body['low'][0]!r}, y={body['low'][1]!r},"
            f" width={body['size'][0]!r}, height={body['size'][1]!r},"
            f" velocity={body['velocity'][0]!r},{body['velocity'][1]!r} /"
        )
    return "\n".join(lines) + "\n"


def mirrored(scene):
    """x -> -x."""
    new = copy.deepcopy(scene)
    new["low"][0], new["high"][0] = -scene["high"][0], -scene["low"][0]
    new["walls"]["left"], new["walls"]["right"] = scene["walls"]["right"], scene["walls"]["left"]
    new["gravity"][0] *= -1
    for body in new["bodies"]:
        body["low"][0] = -body["low"][0] - body["size"][0]
        body["velocity"][0] *= -1
    return new, lambda s: reorder(s, [0, 1], [-1, 1], [0, 1, 2, 3], [1, 1, 1, -1])


def swapped(scene):
    """x <-> y."""
    new = copy.deepcopy(scene)
    for key in ("low", "high", "gravity"):
        new[key].reverse()
    for body in new["bodies"]:
        for key in ("low", "size", "velocity"):
            body[key].reverse()
    partner = {"left": "bottom", "bottom": "left", "right": "top", "top": "right"}
    new["walls"] = {side: scene["walls"][partner[side]] for side in SIDES}
    return new, lambda s: reorder(s, [1, 0], [1, 1], [1, 0, 2, 3], [1, 1, 1, 1])


def moved(scene):
    """By 24 cells to the right and 5 down."""
    new = copy.deepcopy(scene)
    shift = [24 * scene["cell"], -5 * scene["cell"]]
    for place in [new["low"], new["high"], *(body["low"] for body in new["bodies"])]:
        place[:] = [place[0] + shift[0], place[1] + shift[1]]
    return new, lambda s: (s[0] - shift, s[1] - shift, s[2], s[3])


def cut(scene):
    """Each body as two, cut between columns of points: blocks of points and the order of sums are others."""
    new = copy.deepcopy(scene)
    halves = []
    for body in new["bodies"]:
        left, right = copy.deepcopy(body), copy.deepcopy(body)
        left["size"][0] = 1.5 * scene["cell"]
        right["low"][0] += left["size"][0]
        right["size"][0] -= left["size"][0]
        halves += [right, left]
    new["bodies"] = halves
    return new, lambda s: s


def rescaled(scene, length, mass):
    """Lengths and densities times these factors, gravity as it is: times follow as the root of lengths."""
    new, time = copy.deepcopy(scene), length**0.5
    for place in [new["low"], new["high"], *(body[key] for body in new["bodies"] for key in ("low", "size"))]:
        place[:] = [length * value for value in place]
    for body in new["bodies"]:
        body["velocity"] = [time * value for value in body["velocity"]]
    new["cell"] *= length
    new["density"] *= mass
    new["stresses"] = {key: value * length * mass for key, value in scene["stresses"].items()}
    new["rates"] = {key: value / time for key, value in scene["rates"].items()}
    new["end"] *= time
    return new, lambda s: (s[0] / length, s[1] / length, s[2] / time, s[3] / (length * mass))


def reorder(state, axes, signs, components, stress_signs):
    """Turns the axes of a state back."""
    start, position, velocity, stress = state
    vectors = [array[:, axes] * signs for array in (start, position, velocity)]
    return (*vectors, stress[:, components] * stress_signs)


CHANGES = {
    "mirrored": mirrored,
    "x and y swapped": swapped,
    "moved by whole cells": moved,
    "cut into two bodies": cut,
    "length x 10": lambda scene: rescaled(scene, 10.0, 1.0),
    "mass x 7": lambda scene: rescaled(scene, 1.0, 7.0),
    "length x 16": lambda scene: rescaled(scene, 16.0, 1.0),
    "mass / 8": lambda scene: rescaled(scene, 1.0, 0.125),
}
EXACT = ("length x 16", "mass / 8")


def run(executable, directory, text):
    """Start, position, velocity and stress of the points at the end."""
    case = Path(directory) / "case.nml"
    case.write_text(text)
    result = run_namelist(executable, case, Path(directory) / "run")
    last = result.last
    return (result.first.position, last.position, last.velocity, last.stress), int(result.row["steps"])


def difference(one, other):
    """Largest difference of position, velocity and stress, each over its largest change or value."""
    # Ten digits of the places at the start tell points apart.
    order = [np.lexsort(np.round(state[0], 10).T) for state in (one, other)]
    a, b = ([array[o] for array in state] for state, o in zip((one, other), order, strict=True))
    sizes = [1.0, np.abs(a[1] - a[0]).max(), np.abs(a[2]).max(), np.abs(a[3]).max()]
    return max(np.abs(u - v).max() / size for u, v, size in zip(a, b, sizes, strict=True))


def main():
    """All changes of both scenes with all solvers."""
    executable = Path(sys.argv[1]).resolve()
    missed = 0
    with tempfile.TemporaryDirectory() as directory:
        for name, scene, bound in (("block", BLOCK, ELASTIC_BOUND), ("sand", SAND, SAND_BOUND)):
            for solver in SOLVERS:
                reference, steps = run(executable, directory, write(scene, *solver))
                for change, transform in CHANGES.items():
                    new, back = transform(scene)
                    state, new_steps = run(executable, directory, write(new, *solver))
                    worst = difference(reference, back(state))
                    allowed = 0.0 if change in EXACT else bound
                    bad = not worst <= allowed or steps != new_steps
                    missed += bad
                    print(
                        f"{name}, {', '.join(solver)}, {change}: difference {worst:.1e},"
                        f" allowed {allowed:.0e}, {new_steps} steps for {steps}{'  MISSED' if bad else ''}"
                    )
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
