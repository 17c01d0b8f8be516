"""Awkward cases by hand, each with the exit codes that are right for it.

The base is a block of 2 x 2 m on a grid of 8 x 4 m with cells of 0.5 m; a case says what differs. A key with
the value None is left out, a group with the value None too.
"""

import copy
import itertools

from cases import ACFS, METHODS, MODELS, RESIDUAL, SCHEMES, WEIGHTINGS, finish, group, wave_modulus

OK, NAMED, EITHER, REFUSED = (0,), (4,), (0, 4), (2,)

# No points that could leave it, and no named failure to hide behind.
CELL = 0.5

SAND = {
    "name": "m",
    "model": "mohr_coulomb",
    "density": 1500.0,
    "young": 1e6,
    "poisson": 0.3,
    "friction_angle": 30.0,
}

BASE = {
    "grid": {
        "x_min": 0.0,
        "x_max": 8.0,
        "y_min": 0.0,
        "y_max": 4.0,
        "cell_size": CELL,
        "left": "roller",
        "right": "roller",
        "bottom": "fixed",
        "top": "roller",
    },
    "material": SAND,
    "body": {
        "name": "b",
        "material": "m",
        "shape": "rectangle",
        "x": 0.0,
        "y": 0.0,
        "width": 2.0,
        "height": 2.0,
        "points_per_cell": 2,
    },
    "loading": {"gravity": (0.0, -9.81)},
    "solver": {"end_time": 0.5, "settle": 0.0},
}

FIELD = {"material": "m", "mean": 30.0, "cov": 0.3, "acf": "snx", "scale_x": 0.5, "scale_y": 0.5}


def variant(name, expect, files=None, extra="", **changes):
    """The base with changed groups: material=dict(young=1e3), boundary=dict(...); None takes a key out."""
    groups = copy.deepcopy(BASE)
    for key, change in changes.items():
        groups.setdefault(key, {}).update(change)
    text = "".join(group(key, **keys) for key, keys in groups.items()) + extra
    grid, material = groups["grid"], groups["material"]
    name = name.replace("+", "")
    facts = {
        "model": material["model"],
        "density": material["density"],
        # A refused case is not judged by its stresses; its modulus may be nonsense.
        "modulus": 0.0 if expect == REFUSED else wave_modulus(material["young"], material["poisson"]),
        "strength": material.get("undrained_strength", 0.0),
        "cohesion": material.get("cohesion", 0.0),
        "tension": material.get("tension_strength", 0.0),
        "cfl": groups["solver"].get("cfl", 0.4),
        "weighting": groups["solver"].get("weighting", "gimp"),
        "cell": grid["cell_size"],
        "cells": max(1.0, min(body_size(groups["body"])) / CELL),
        "grid": [grid[k] for k in ("x_min", "x_max", "y_min", "y_max")],
        "gravity": groups["loading"].get("gravity", (0.0, -9.81)),
        "boundary": "boundary" in groups,
        "field": "random_field" in groups,
        "one_material": "&material" not in extra,
    }
    if "softening" in material:
        facts["residual"] = [material.get(key, 0.0) for key in RESIDUAL]
    return finish(name, text, facts, ["by hand"], files or {}, expect, groups["solver"]["end_time"])


def body_size(body):
    """Width and height of a body in m; of one point where a file or a list of corners says it."""
    diameter = 2 * body.get("radius", CELL / 2)
    return [body[key] or diameter for key in ("width", "height")]


def model_keys(model):
    """&material of a model, from the sand."""
    keys = {"model": model}
    if model not in ("mohr_coulomb", "drucker_prager"):
        keys["friction_angle"] = None
    if model in ("von_mises", "tresca"):
        keys["undrained_strength"] = 5e3
    return keys


def edge_cases():
    """All of them."""
    makers = (
        sizes,
        places,
        times,
        steps,
        materials,
        loads,
        motions,
        walls,
        fields,
        several_bodies,
        point_files,
        odd_input,
    )
    cases = [case for maker in makers for case in maker()]
    names = [case["name"] for case in cases]
    assert len(set(names)) == len(names)
    return cases


def sizes():
    """One point, thin layers, slender columns."""
    for weighting, scheme in itertools.product(WEIGHTINGS, SCHEMES):
        solver = {"weighting": weighting, "scheme": scheme}
        single = {
            "x": 3.0,
            "y": 1.0,
            "width": CELL,
            "height": CELL,
            "points_per_cell": 1,
            "velocity": (1.0, -3.0),
        }
        yield variant(f"one_point_{weighting}_{scheme}", OK, body=single, solver=solver | {"end_time": 1.0})
    for power in (-1, -3, -6, -9, -12):
        thin = 10.0**power
        for weighting in WEIGHTINGS:
            solver = {"weighting": weighting, "end_time": 0.1}
            yield variant(f"layer_e{-power}_{weighting}", EITHER, body={"height": thin}, solver=solver)
            yield variant(
                f"sheet_e{-power}_{weighting}", EITHER, body={"width": thin, "x": 3.0}, solver=solver
            )
    tall = {"width": CELL, "height": 30.0, "points_per_cell": 2}
    yield variant("tall_column", EITHER, grid={"y_max": 32.0}, body=tall)
    yield variant("long_layer", OK, grid={"x_max": 64.0}, body={"width": 60.0, "height": 0.25})
    yield variant(
        "one_cell_grid", OK, grid={"x_max": CELL, "y_max": CELL}, body={"width": CELL, "height": CELL}
    )
    yield variant("full_grid", OK, grid={"x_max": 2.0, "y_max": 2.0})
    yield variant("ten_points_a_cell", OK, body={"width": 1.0, "height": 1.0, "points_per_cell": 10})
    yield variant("disc_under_spacing", OK, body=disc(3.0, 1.0, 0.01))
    sliver = {"shape": "polygon", "vertices": (1.0, 1.0, 3.0, 1.001, 1.0, 1.002), "x": None, "y": None}
    yield variant("sliver", (0, 2), body=sliver | {"width": None, "height": None})


def disc(x, y, radius):
    """Changes that make the body a disc."""
    return {"shape": "disc", "x": x, "y": y, "radius": radius, "width": None, "height": None}


def places():
    """Points on faces of cells, on the edge of the grid, and beyond it."""
    for weighting, scheme in itertools.product(WEIGHTINGS, SCHEMES):
        solver = {"weighting": weighting, "scheme": scheme}
        # One point a cell, shifted by half a cell: every centre lies on a node; a quarter with two points.
        nodes = {"x": 2.0 + CELL / 2, "y": CELL / 2, "points_per_cell": 1}
        quarters = {"x": 2.0 + CELL / 4, "y": CELL / 4}
        yield variant(f"on_nodes_{weighting}_{scheme}", OK, body=nodes, solver=solver)
        yield variant(f"on_faces_{weighting}_{scheme}", OK, body=quarters, solver=solver)
        top = {"y": 4.0 - 1e-12, "height": 1e-12, "x": 6.0, "points_per_cell": 1}
        yield variant(f"upper_face_{weighting}_{scheme}", EITHER, body=top, solver=solver)
        corner = {"x": 6.0, "y": 2.0, "velocity": (0.5, 0.5)}
        yield variant(
            f"upper_corner_{weighting}_{scheme}",
            OK,
            body=corner,
            loading={"gravity": (3.0, 9.81)},
            solver=solver,
        )
    free = {"left": "free", "right": "free", "bottom": "free", "top": "free"}
    for name, velocity in (
        ("left", (-8.0, 0.0)),
        ("right", (8.0, 0.0)),
        ("down", (0.0, -8.0)),
        ("up", (0.0, 8.0)),
    ):
        yield variant(
            f"leaves_{name}",
            NAMED,
            grid=free,
            body={"x": 3.0, "y": 1.0, "velocity": velocity},
            solver={"end_time": 2.0},
        )
    yield variant("wider_than_grid", REFUSED, body={"width": 9.0})
    yield variant("higher_than_grid", REFUSED, body={"height": 4.5})
    yield variant("left_of_grid", REFUSED, body={"x": -0.1})
    yield variant("beyond_by_rounding", OK, body={"x": 6.0 + 1e-13})
    far = {"x_min": 1e6, "x_max": 1e6 + 8.0, "y_min": -1e6, "y_max": -1e6 + 4.0}
    yield variant("far_away", OK, grid=far, body={"x": 1e6, "y": -1e6})
    # Here positions are known to a thousandth of a cell only: refused, failed or merely inexact, but no
    # crash.
    further = {"x_min": 1e12, "x_max": 1e12 + 8.0}
    yield variant("very_far_away", (0, 2, 4), grid=further, body={"x": 1e12})


def times():
    """Ends and intervals."""
    yield variant("one_step", OK, solver={"end_time": 0.005})
    yield variant("less_than_a_step", OK, solver={"end_time": 1e-9})
    yield variant("hardly_any_time", OK, solver={"end_time": 1e-300})
    yield variant("settle_high", OK, solver={"end_time": 5.0, "settle": 0.999})
    yield variant("nothing_happens", OK, loading={"gravity": (0.0, 0.0)}, solver={"settle": 1e-4})
    output = group("output", history_interval=1e-9, snapshot_interval=1e-9)
    yield variant("every_step_written", OK, extra=output, solver={"end_time": 0.1})
    output = group("output", history_interval=100.0, snapshot_interval=100.0)
    yield variant("nothing_in_between", OK, extra=output)
    limit = group("monte_carlo", member_seconds=0.05, noise_members=1)
    yield variant("time_limit", NAMED, extra=limit, solver={"end_time": 1e4})


def steps():
    """Time steps from tiny to impossible."""
    for cfl in (1e-3, 1.0, 1.5):
        yield variant(f"cfl_{cfl}", EITHER, solver={"cfl": cfl, "end_time": 0.02 if cfl < 0.1 else 0.5})
    for factor, expect in ((1, OK), (10, NAMED), (1e3, NAMED), (1e6, EITHER)):
        for scheme in SCHEMES:
            # The limit of the step is h/c = 0.0167 s.
            step = 0.4 * 0.0167 * factor
            solver = {"time_step": step, "end_time": 30 * step, "scheme": scheme}
            yield variant(f"step_times_{factor:g}_{scheme}", expect, solver=solver)
    yield variant("step_beyond_end", REFUSED, solver={"time_step": 1.0})
    # Damping alone is unstable where c_d dt > 2 (dt is 0.0067 s here); below 1 it only slows.
    for damping, expect in ((100.0, OK), (200.0, EITHER), (400.0, EITHER), (1e6, EITHER)):
        yield variant(f"damping_{damping:g}", expect, loading={"damping": damping})
    for flip in (0.0, 1e-6, 0.5, 0.999):
        yield variant(f"flip_{flip}", OK, solver={"flip": flip})


def materials():
    """Ends of the ranges of the properties."""
    for model in MODELS:
        keys = model_keys(model)
        yield variant(f"{model}_nearly_incompressible", EITHER, material=keys | {"poisson": 0.4999})
        yield variant(f"{model}_negative_poisson", EITHER, material=keys | {"poisson": -0.9})
        yield variant(f"{model}_soft", EITHER, material=keys | {"young": 1e3})
        yield variant(f"{model}_very_soft", EITHER, material=keys | {"young": 1.0}, solver={"end_time": 3.0})
        stiff = {"end_time": 1e-5}
        yield variant(f"{model}_stiff", OK, material=keys | {"young": 1e15}, solver=stiff)
        yield variant(f"{model}_light", OK, material=keys | {"density": 1e-6}, solver={"end_time": 1e-5})
        yield variant(f"{model}_heavy", EITHER, material=keys | {"density": 1e9}, solver={"end_time": 5.0})
    for friction in (0.0, 1e-6, 89.0, 89.999):
        for dilation in sorted({0.0, friction}):
            keys = {"friction_angle": friction, "dilation_angle": dilation}
            yield variant(f"friction_{friction}_{dilation}", EITHER, material=keys)
            yield variant(
                f"friction_{friction}_{dilation}_cohesive", EITHER, material=keys | {"cohesion": 1e3}
            )
            keys["model"] = "drucker_prager"
            yield variant(f"cone_{friction}_{dilation}", EITHER, material=keys)
    yield variant("dilation_above_friction", REFUSED, material={"dilation_angle": 31.0})
    yield variant("tension_beyond_apex", REFUSED, material={"cohesion": 1.0, "tension_strength": 1e5})
    for strength in (1e-6, 1e12):
        for model in ("von_mises", "tresca"):
            keys = model_keys(model) | {"undrained_strength": strength}
            yield variant(f"{model}_{strength:g}", EITHER, material=keys)
    softening = {"softening": "linear", "residual_friction_angle": 0.0, "cohesion": 1e4}
    for end in (1e-12, 1e-3, 10.0):
        yield variant(f"softens_by_{end:g}", EITHER, material=softening | {"softening_end": end})
        both = {"dilation_angle": 30.0, "dilation_end": end, "softening_end": end}
        yield variant(f"softens_and_dilates_by_{end:g}", EITHER, material=softening | both)
    yield variant(
        "dilates_while_it_softens",
        (0, 2),
        material=softening | {"softening_end": 1e-3, "dilation_angle": 30.0},
    )
    # The cut-off below the apex, pulled apart and thrown back.
    keys = {"cohesion": 1e3, "tension_strength": 0.0}
    body = {"x": 3.0, "y": 1.0, "velocity": (0.0, -10.0)}
    yield variant("cut_off_impact", EITHER, material=keys, body=body)


def loads():
    """Gravity and stress at the start."""
    for name, gravity in (
        ("huge", (0.0, -1e6)),
        ("up", (0.0, 9.81)),
        ("sideways", (9.81, 0.0)),
        ("none", (0.0, 0.0)),
    ):
        yield variant(f"gravity_{name}", EITHER, loading={"gravity": gravity})
    for weighting, scheme in itertools.product(WEIGHTINGS, SCHEMES):
        solver = {"weighting": weighting, "scheme": scheme}
        yield variant(
            f"geostatic_{weighting}_{scheme}",
            OK,
            grid={"x_max": 2.0, "top": "free"},
            material={"friction_angle": 40.0},
            loading={"initial_stress": "geostatic"},
            solver=solver,
        )
    yield variant(
        "geostatic_weak", OK, material={"friction_angle": 5.0}, loading={"initial_stress": "geostatic"}
    )
    tilted = {"initial_stress": "geostatic", "gravity": (1.0, -9.81)}
    yield variant("geostatic_tilted", REFUSED, loading=tilted)


def motions():
    """Impacts, throws, spins."""
    for model in MODELS:
        keys = model_keys(model)
        for mach in (0.1, 0.5, 1.0, 3.0):
            # Wave speed: 30 m/s.
            body = {"x": 3.0, "y": 1.0, "velocity": (0.0, -30.0 * mach)}
            yield variant(
                f"impact_{model}_{mach}", EITHER, material=keys, body=body, solver={"end_time": 0.2}
            )
        body = {"x": 6.0, "y": 0.0, "velocity": (30.0, 0.0)}
        yield variant(f"into_right_wall_{model}", EITHER, material=keys, body=body, solver={"end_time": 0.2})
        body = {"x": 3.0, "y": 1.0, "velocity": (20.0, 20.0)}
        yield variant(f"thrown_{model}", EITHER, material=keys, body=body, solver={"end_time": 1.0})
    yield variant(
        "very_fast", EITHER, body={"x": 3.0, "y": 1.0, "velocity": (1e6, 0.0)}, solver={"end_time": 1e-3}
    )
    yield variant("drop", OK, grid={"y_max": 40.0}, body={"x": 3.0, "y": 37.0}, solver={"end_time": 3.5})


def walls():
    """Kinds of walls, friction and prescribed velocities."""
    for kind in ("fixed", "roller", "frictional", "free"):
        for friction in (0.0, 0.5, 1e6) if kind == "frictional" else (None,):
            grid = {"bottom": kind, "bottom_friction": friction, "right": kind, "right_friction": friction}
            name = kind if friction is None else f"{kind}_{friction:g}"
            expect = EITHER if kind == "free" else OK
            yield variant(f"wall_{name}", expect, grid=grid, body={"x": 6.0, "velocity": (3.0, -3.0)})
    node = {"name": "p", "x_min": 0.0, "x_max": 0.0, "y_min": 0.0, "y_max": 4.0}
    for speed in (0.0, 1.0, 30.0, 300.0):
        yield variant(
            f"pushed_by_{speed:g}",
            EITHER,
            boundary=node | {"velocity": (speed, 0.0)},
            solver={"end_time": 0.2},
        )
    everything = node | {"x_max": 8.0, "velocity": (1.0, 0.0)}
    yield variant("all_nodes_driven", OK, boundary=everything, solver={"end_time": 0.2})
    yield variant("driven_into_wall", EITHER, boundary=everything, body={"x": 6.0}, solver={"end_time": 1.0})
    yield variant("box_without_nodes", REFUSED, boundary=node | {"x_min": 0.1, "x_max": 0.2})


def fields():
    """Random fields no one would ask for."""
    for acf, method in itertools.product(ACFS, METHODS):
        for name, scale in (("rough", 0.01 * CELL), ("smooth", 200.0)):
            keys = FIELD | {"acf": acf, "method": method, "scale_x": scale, "scale_y": scale}
            # A field that cannot be sampled is refused with a message, or fails by name.
            yield variant(
                f"field_{acf}_{method}_{name}", (0, 2, 4), random_field=keys, solver={"end_time": 0.05}
            )
    yield variant("field_wild", EITHER, random_field=FIELD | {"cov": 2.0, "lower": 0.01, "upper": 89.0})
    yield variant("field_faint", OK, random_field=FIELD | {"cov": 1e-12})
    yield variant("field_clipped", EITHER, random_field=FIELD | {"cov": 2.0, "lower": 29.9, "upper": 30.1})
    yield variant("field_streaks", OK, random_field=FIELD | {"scale_x": 1e4, "scale_y": 1e-4})


def several_bodies():
    """Bodies that meet, overlap and differ."""
    second = {
        "name": "b2",
        "material": "m",
        "shape": "rectangle",
        "x": 4.0,
        "y": 0.0,
        "width": 2.0,
        "height": 2.0,
    }
    meeting = group("body", **second, velocity=(-5.0, 0.0))
    yield variant("bodies_meet", OK, extra=meeting, body={"velocity": (5.0, 0.0)})
    yield variant("bodies_overlap", (0, 2, 4), extra=group("body", **(second | {"x": 1.0})))
    finer = group("body", **(second | {"x": 0.0, "y": 2.0, "height": 1.0, "width": 1.0}), points_per_cell=5)
    yield variant("finer_on_top", OK, extra=finer)
    for model in MODELS:
        keys = SAND | {"name": "m2", "young": 1e9, "density": 8000.0} | model_keys(model)
        block = group("body", **(second | {"material": "m2", "x": 0.0, "y": 2.0, "height": 1.0}))
        yield variant(
            f"stiff_{model}_on_sand",
            EITHER,
            extra=group("material", **keys) + block,
            solver={"end_time": 0.02},
        )


def point_files():
    """Points from a file, good and bad."""
    body = {"shape": "points", "file": "p.csv"} | dict.fromkeys(
        ("x", "y", "width", "height", "points_per_cell")
    )
    head = "x,y,width,height\n"
    good = {
        "one": "3,1,0.25,0.25\n",
        "speeds": "3,1,0.25,0.25,1,-2\n",
        "twice_the_same": "3,1,0.25,0.25\n3,1,0.25,0.25\n",
        "on_lower_edge": "3,0,0.25,0.25\n",
        "on_upper_edge": "3,4,0.25,0.25\n",
        "on_corner": "8,4,0.25,0.25\n0,0,0.25,0.25\n",
        "as_wide_as_a_cell": "3,1,0.5,0.5\n",
        "thin": "3,1,1e-9,0.5\n3.5,1,1e-9,0.5\n",
    }
    for name, lines in good.items():
        top = "x,y,width,height,vx,vy\n" if name == "speeds" else head
        # A centre on the edge of the grid may also be refused, since half of its point is outside.
        expect = (0, 2, 4) if name.startswith("on_") else OK
        yield variant(f"points_{name}", expect, files={"p.csv": top + lines}, body=body)
    bad = {
        "empty": "",
        "head_only": head,
        "no_head": "3,1,0.25,0.25\n",
        "nan": head + "nan,1,0.25,0.25\n",
        "infinite": head + "inf,1,0.25,0.25\n",
        "text": head + "a,b,c,d\n",
        "short_line": head + "3,1,0.25\n",
        "long_line": head + "3,1,0.25,0.25,7\n",
        "no_width": head + "3,1,0,0.25\n",
        "negative_width": head + "3,1,-0.25,0.25\n",
        "of_two_sizes": head + "3,1,0.5,0.5\n3.5,1,0.25,0.5\n",
        "outside": head + "9,1,0.25,0.25\n",
        "wider_than_a_cell": head + "3,1,0.75,0.25\n",
        "overflow": head + "1d400,1,0.25,0.25\n",
    }
    for name, text in bad.items():
        yield variant(f"points_bad_{name}", REFUSED, files={"p.csv": text}, body=body)
    yield variant("points_no_file", REFUSED, body=body)


def odd_input():
    """Values that must be refused by name."""
    for name, changes in {
        "nan": {"material": {"young": "nan"}},
        "no_cells": {"grid": {"cell_size": 0.0}},
        "inside_out": {"grid": {"x_max": -1.0}},
        "broken_cells": {"grid": {"x_max": 8.1}},
        "too_many_cells": {"grid": {"cell_size": 1e-9}},
        "no_density": {"material": {"density": 0.0}},
        "poisson_half": {"material": {"poisson": 0.5}},
        "no_time": {"solver": {"end_time": 0.0}},
        "cfl_two": {"solver": {"cfl": 2.0}},
        "unknown_weighting": {"solver": {"weighting": "gimpy"}},
        "no_points": {"body": {"points_per_cell": 0}},
        "negative_damping": {"loading": {"damping": -1.0}},
    }.items():
        yield variant(f"refused_{name}", REFUSED, **changes)
