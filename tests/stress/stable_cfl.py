"""Prints the highest CFL number at which each scheme and weighting stays stable.

Usage: stable_cfl.py EXE [--scenes NAME ...]

Three undamped scenes: an elastic block that vibrates on a roller, the same block that bounces off a floor it
can leave, and the column of the paper on a coarse grid. A ladder of CFL numbers is climbed from 0.1 on in
steps of 0.1 up to 1.5, the most that the program takes; the highest one below the first that fails is
printed. A run fails when it does not complete, or when kinetic + elastic + potential energy ever rises above
its start by more than 5 % of the energy that moves; the wall takes some 8 % at the first touch, which a run
must make up for before it counts as unstable. An unstable run does so within a few steps.
Beside it in brackets, at CFL 0.4: the largest rise of that energy from any earlier value, which is the error
of reading velocity and stress half a step apart as long as it does not grow.
"""

import argparse
import math
import sys
import tempfile
from pathlib import Path

from cases import SCHEMES, WEIGHTINGS, finish, group
from judge import ENERGY_SLACK, judge
from sweep import execute, write_case

# Weights and transfer of a column of the table; the others take flip.
METHODS = [*((weighting, "flip") for weighting in WEIGHTINGS), ("gimp", "tpic"), ("bspline", "tpic")]
LADDER = [round(0.1 * k, 1) for k in range(1, 16)]


def block(bottom):
    """An elastic block of 1 x 1 m, wave speed 36.7 m/s, moving down at 1 m/s for ten transits."""
    elastic = {"name": "m", "model": "linear_elastic", "density": 1000.0, "young": 1e6, "poisson": 0.3}
    return {
        "grid": {"x_max": 2.0, "y_max": 2.0, "cell_size": 0.125, **bottom},
        "material": elastic,
        "body": {"x": 0.5, "y": 0.0, "width": 1.0, "height": 1.0, "velocity": (0.0, -1.0)},
        "loading": {"gravity": (0.0, 0.0)},
        "end_time": 0.27,
    }


def column():
    """The paper's column, undamped, on cells of 0.5 m."""
    sand = {
        "name": "m",
        "model": "mohr_coulomb",
        "density": 1450.0,
        "young": 2.6e6,
        "poisson": 0.31,
        "friction_angle": 35.0,
    }
    return {
        "grid": {"x_max": 20.0, "y_max": 6.5, "cell_size": 0.5},
        "material": sand,
        "body": {"x": 0.0, "y": 0.0, "width": 5.0, "height": 5.0},
        "loading": {"gravity": (0.0, -9.81)},
        "end_time": 3.0,
    }


SCENES = {
    "vibrating": block({"bottom": "roller"}),
    "bouncing": block({"bottom": "frictional", "bottom_friction": 0.0}),
    "column": column(),
}


def make_case(name, scheme, method, cfl):
    """The case of a scene."""
    scene = SCENES[name]
    body = {"name": "b", "material": "m", "shape": "rectangle", "points_per_cell": 2, **scene["body"]}
    solver = {
        "weighting": method[0],
        "scheme": scheme,
        "transfer": method[1],
        "cfl": cfl,
        "end_time": scene["end_time"],
        "settle": 0.0,
    }
    text = group("grid", **scene["grid"]) + group("material", **scene["material"]) + group("body", **body)
    text += group("loading", **scene["loading"]) + group("solver", **solver)
    facts = {
        "model": scene["material"]["model"],
        "density": scene["material"]["density"],
        "modulus": scene["material"]["young"],
        "cohesion": 0.0,
        "tension": 0.0,
        "cfl": cfl,
        "cell": scene["grid"]["cell_size"],
        "cells": scene["body"]["width"] / scene["grid"]["cell_size"],
        "grid": [0.0, scene["grid"]["x_max"], 0.0, scene["grid"]["y_max"]],
        "gravity": scene["loading"]["gravity"],
    }
    return finish("stable", text, facts, [], {}, (0, 4), scene["end_time"], history=60)


def energies(executable, case):
    """The numbers of the judge; none when the run did not complete."""
    with tempfile.TemporaryDirectory(prefix="sgimp_stress_") as scratch:
        scratch = Path(scratch)
        write_case(case, scratch)
        code, message = execute([executable, "stable.nml", "--output", "out"], scratch)
        verdict, detail, numbers = judge(case, code, message, scratch / "out")
        if verdict == "broken":
            sys.exit(f"{detail}\n{case['text']}")
        return numbers


def climb(executable, scene, scheme, method):
    """Highest CFL number that is stable with all below it, and the rise of energy at 0.4."""
    highest = 0.0
    for cfl in LADDER:
        case = make_case(scene, scheme, method, cfl)
        numbers = energies(executable, case)
        if numbers.get("net", math.inf) > ENERGY_SLACK:
            break
        highest = cfl
    return highest, energies(executable, make_case(scene, scheme, method, 0.4)).get("created")


def main():
    """Prints the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("executable", type=Path)
    parser.add_argument("--scenes", nargs="*", default=list(SCENES), choices=list(SCENES))
    given = parser.parse_args()
    executable = str(given.executable.resolve())
    for scene in given.scenes:
        print(f"{scene:<12}" + "".join(f"{' '.join(method).removesuffix(' flip'):>18}" for method in METHODS))
        for scheme in SCHEMES:
            row = f"{scheme:<12}"
            for method in METHODS:
                highest, at_default = climb(executable, scene, scheme, method)
                text = "-" if at_default is None else f"{100 * at_default:.1f} %"
                row += f"{f'{highest:.1f} ({text})':>18}"
            print(row, flush=True)


if __name__ == "__main__":
    main()
