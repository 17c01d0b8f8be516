"""Cases of the stress sweep: a designed sample of the space of inputs, and a list of awkward ones by hand.

A case is a dictionary: name, groups (what it is counted under), text (its namelist), files (name -> text,
beside it), expect (exit codes that are right) and what the judge must know of it. Lengths in the design are
in cells, speeds in wave speeds, so that no case needs more than a few hundred steps, however stiff its
material.
"""

import itertools
import math

import numpy as np
from scipy.stats import qmc

SCHEMES = ("usf", "usl", "musl")
WEIGHTINGS = ("linear", "gimp", "cpgimp", "bspline")
MODELS = ("mohr_coulomb", "drucker_prager", "linear_elastic", "neo_hookean", "von_mises", "tresca")
ACFS = ("snx", "sqx", "smk", "csx", "bin")
METHODS = ("auto", "kronecker", "cholesky", "circulant")
CONES = ("plane_strain", "plane_strain_associated", "outer", "inner", "equal_area")

# Every combination once in 72 cases. Mohr-Coulomb comes first, so also first in a short sweep.
COMBINATIONS = tuple(itertools.product(MODELS, WEIGHTINGS, SCHEMES))

# The coordinates of the design, one number in [0, 1) each. Another one changes every case.
COORDINATES = (
    "friction dilation cohesion tension young poisson density strength cov scale acf field method "
    "distribution aspect area points cfl damping speed heading drop offset whole shape steps weight tilt "
    "left right bottom top friction_left friction_bottom margin_x margin_y cell origin geostatic flip settle "
    "softening residual softening_end dilation_end cone anti_locking spin boundary boundary_speed relaxation "
    "fixed_step shuffle transfer"
).split()

# Keys of softening, in the order in which the judge takes them.
RESIDUAL = ("residual_friction_angle", "residual_cohesion", "softening_start", "softening_end")

MOST_POINTS = 400
SPREAD = 1.0e-3


def design(count, seed):
    """Scrambled Sobol points [count, coordinates]: point i is the same whatever `count` is."""
    sampler = qmc.Sobol(len(COORDINATES), scramble=True, seed=seed)
    return sampler.random(1 << max(0, math.ceil(math.log2(max(count, 1)))))[:count]


def log_between(u, low, high):
    """Log-uniform from low (u = 0) to high (u = 1)."""
    return low * (high / low) ** u


def share(u, first, value):
    """`value` for the first share of u; None beyond, and then u stretched to [0, 1)."""
    return (value, 0.0) if u < first else (None, (u - first) / (1.0 - first))


def group(group_name, /, **keys):
    """Text of a namelist group; None leaves a key out."""

    def text(value):
        if isinstance(value, str):
            return f"'{value}'"
        if isinstance(value, list | tuple):
            return ",".join(text(v) for v in value)
        if isinstance(value, float | np.floating):
            return repr(float(value))
        return str(value)

    return f"&{group_name} " + ", ".join(f"{k}={text(v)}" for k, v in keys.items() if v is not None) + " /\n"


def wave_modulus(young, poisson):
    """Modulus of compression waves in Pa."""
    return young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))


def designed_case(index, u):
    """Case `index` from its point u of the design."""
    d = dict(zip(COORDINATES, map(float, u), strict=True))
    model, weighting, scheme = COMBINATIONS[index % len(COMBINATIONS)]
    material, facts = draw_material(model, d)
    cell = log_between(d["cell"], 0.02, 2.0)
    speed_of_sound = math.sqrt(facts["modulus"] / material["density"])
    body, grid, files, size = draw_geometry(d, cell, index)
    mach, rest = share(d["speed"], 0.4, 0.0)
    mach = log_between(rest, 1e-3, 1.0) if mach is None else mach
    heading = 2 * math.pi * d["heading"]
    body["velocity"] = (mach * speed_of_sound * math.cos(heading), mach * speed_of_sound * math.sin(heading))
    if d["spin"] > 0.85:
        # The rim at up to a fifth of the wave speed.
        body["angular_velocity"] = (d["spin"] - 0.925) / 0.075 * 0.2 * speed_of_sound / (cell * 5)
    loading = draw_loading(d, facts, material["density"], speed_of_sound, size[1] * cell, cell)
    cfl = 0.05 + 0.95 * d["cfl"]
    steps = (
        log_between(d["steps"] / 0.15, 1, 100)
        if d["steps"] < 0.15
        else 100 + 300 * (d["steps"] - 0.15) / 0.85
    )
    step = cfl * cell / (speed_of_sound * (1 + mach))
    end_time = step * max(1, round(steps))
    if loading.get("relaxation"):
        loading["relaxation_time"] = 0.3 * end_time
    one, rest = share(d["flip"], 0.7, 1.0)
    transfer = "tpic" if d["transfer"] > 0.7 and weighting != "linear" else "flip"
    no_settle, settle_rest = share(d["settle"], 0.6, 0.0)
    solver = {
        "weighting": weighting,
        "scheme": scheme,
        "transfer": transfer,
        "flip": None if transfer == "tpic" else rest if one is None else one,
        "anti_locking": "cell_average" if d["anti_locking"] > 0.7 else None,
        "cfl": cfl,
        "time_step": step if d["fixed_step"] > 0.92 else None,
        "end_time": end_time,
        "settle": log_between(settle_rest, 1e-4, 0.1) if no_settle is None else no_settle,
    }
    has_boundary = d["boundary"] > 0.88
    has_field = model == "mohr_coulomb" and d["field"] < 0.4 and material["friction_angle"] > 0.2
    # First: it lowers the dilation angle to what the field allows.
    field = draw_field(d, material, body, cell, index) if has_field else ""
    text = group("grid", **grid) + group("material", **material) + group("body", **body)
    text += group("loading", **loading) + group("solver", **solver) + field
    if has_boundary:
        text += group("boundary", **draw_boundary(d, grid, cell, speed_of_sound))
    # The circulant method says of some fields that it cannot embed them, before anything runs.
    expect = (0, 2, 4) if "circulant" in field else (0, 4)
    facts["transfer"] = transfer
    facts.update(
        scheme=scheme,
        weighting=weighting,
        cfl=cfl,
        cell=cell,
        cells=max(1.0, min(size)),
        grid=[grid[k] for k in ("x_min", "x_max", "y_min", "y_max")],
        gravity=loading["gravity"],
        boundary=has_boundary,
        field=has_field,
        relaxed="relaxation" in loading,
    )
    return finish(
        f"d{index:05d}", text, facts, [model, f"{scheme} {weighting}", band(cfl)], files, expect, end_time
    )


def finish(name, text, facts, groups, files, expect, end_time, history=20):
    """The whole case: name, output with a history, and a wall clock limit of a member as a net."""
    head = group("case", name=name)
    if "&output" not in text:
        text += group(
            "output",
            history_interval=end_time / history,
            snapshot_interval=end_time / 4,
            snapshot_members=1 if facts.get("field") else None,
        )
    if "&monte_carlo" not in text:
        realizations = 1 if facts.get("field") else None
        text += group("monte_carlo", realizations=realizations, noise_members=1, member_seconds=20.0)
    facts["end_time"] = end_time
    return {
        "name": name,
        "text": head + text,
        "facts": facts,
        "groups": groups,
        "files": files,
        "expect": expect,
    }


def band(cfl):
    """Group of the CFL number."""
    for low, high in ((0.0, 0.2), (0.2, 0.4), (0.4, 0.6), (0.6, 0.8), (0.8, 1.5)):
        if cfl <= high:
            return f"CFL {low:.1f} to {high:.1f}"
    return "CFL above"


def draw_material(model, d):
    """Keys of &material and what the judge needs of it."""
    zero, rest = share(d["poisson"], 0.1, 0.0)
    poisson = min(0.49, 0.54 * rest) if zero is None else zero
    keys = {
        "name": "m",
        "model": model,
        "density": 500.0 + 2500.0 * d["density"],
        "young": log_between(d["young"], 1e4, 1e9),
        "poisson": poisson,
    }
    facts = {"model": model, "modulus": wave_modulus(keys["young"], poisson), "density": keys["density"]}
    if model in ("von_mises", "tresca"):
        keys["undrained_strength"] = keys["young"] * log_between(d["strength"], 1e-5, 0.1)
        facts["strength"] = keys["undrained_strength"]
    if model not in ("mohr_coulomb", "drucker_prager"):
        return keys, facts
    friction = 0.1 + 59.9 * d["friction"]
    none, rest = share(d["dilation"], 0.4, 0.0)
    dilation = none if none is not None else friction * min(1.0, 1.4 * rest)
    none, rest = share(d["cohesion"], 0.5, 0.0)
    cohesion = none if none is not None else log_between(rest, 1.0, 1e5)
    none, rest = share(d["tension"], 0.5, 0.0)
    # Up to the apex, and less for a Drucker-Prager cone whose apex may lie lower.
    apex = cohesion / math.tan(math.radians(friction))
    tension = (
        none if none is not None else apex * min(1.0, 2 * rest) * (1.0 if model == "mohr_coulomb" else 0.5)
    )
    keys |= {
        "friction_angle": friction,
        "dilation_angle": dilation,
        "cohesion": cohesion,
        "tension_strength": tension,
    }
    if model == "drucker_prager":
        keys["cone"] = CONES[int(5 * d["cone"])]
    elif d["softening"] > 0.7:
        start = 0.1 * max(0.0, d["softening"] - 0.85)
        keys |= {
            "softening": "linear",
            "residual_friction_angle": friction * d["residual"],
            "residual_cohesion": cohesion * d["residual"] if d["residual"] > 0.3 else 0.0,
            "softening_start": start,
            "softening_end": start + log_between(d["softening_end"], 1e-4, 1.0),
        }
        facts["residual"] = [keys[k] for k in RESIDUAL]
    if model == "mohr_coulomb" and d["dilation_end"] > 0.7:
        keys["dilation_end"] = log_between((d["dilation_end"] - 0.7) / 0.3, 1e-4, 1.0)
    facts |= {"cohesion": cohesion, "tension": tension}
    return keys, facts


def draw_geometry(d, cell, index):
    """&body and &grid, the points file if there is one, and width and height of the body in cells."""
    points = 1 + int(5 * d["points"])
    area = log_between(d["area"], 1.0, MOST_POINTS / points**2)
    aspect = log_between(d["aspect"], 0.1, 10.0)
    width = math.sqrt(area / aspect)
    height = aspect * width
    if d["whole"] < 0.5:
        width, height = max(1, round(width)), max(1, round(height))
    at_wall, rest = share(d["offset"], 0.5, 0.0)
    left = 4 * rest if at_wall is None else at_wall
    on_ground, rest = share(d["drop"], 0.6, 0.0)
    lift = 3 * rest if on_ground is None else on_ground
    # No room between the body and the right or upper wall in 15 % of the cases each, if the cells fit.
    tight, rest_x = share(d["margin_x"], 0.15, 0.0)
    right = (2 * width + 2) * rest_x if tight is None else tight
    tight, rest_y = share(d["margin_y"], 0.15, 0.0)
    above = (height + 2) * rest_y if tight is None else tight
    near, rest = share(d["origin"], 0.5, 0.0)
    x_min = (
        cell * near
        if near is not None
        else cell * round(math.copysign(10 ** (4 * abs(2 * rest - 1)), rest - 0.5))
    )
    y_min = -x_min / 2
    kinds = (("roller", 0.35), ("fixed", 0.6), ("frictional", 0.85), ("free", 1.01))
    grid = {
        "x_min": x_min,
        "x_max": x_min + cell * math.ceil(left + width + right - 1e-9),
        "y_min": y_min,
        "y_max": y_min + cell * math.ceil(lift + height + above - 1e-9),
        "cell_size": cell,
    }
    for side in ("left", "right", "bottom", "top"):
        grid[side] = next(kind for kind, limit in kinds if d[side] < limit)
        if grid[side] == "frictional":
            grid[f"{side}_friction"] = (
                1.5 * d["friction_left" if side in ("left", "right") else "friction_bottom"]
            )
    x, y, w, h = x_min + left * cell, y_min + lift * cell, width * cell, height * cell
    body = {"name": "b", "material": "m", "points_per_cell": points}
    files = {}
    if d["shape"] < 0.6:
        body |= {"shape": "rectangle", "x": x, "y": y, "width": w, "height": h}
    elif d["shape"] < 0.75 and min(width, height) >= 1.5:
        radius = 0.5 * min(w, h)
        body |= {"shape": "disc", "x": x + radius, "y": y + radius, "radius": radius}
    elif d["shape"] < 0.9 and min(width, height) >= 1.5:
        body |= {"shape": "polygon", "vertices": (x, y, x + w, y, x + 0.6 * w, y + h, x, y + h)}
    elif d["shape"] < 0.9:
        body |= {"shape": "rectangle", "x": x, "y": y, "width": w, "height": h}
    else:
        del body["points_per_cell"]
        body |= {"shape": "points", "file": "points.csv"}
        files["points.csv"] = points_file(x, y, w, h, cell / points, index)
    return body, grid, files, (width, height)


def points_file(x, y, width, height, spacing, seed):
    """Points of one size on a jittered lattice."""
    random = np.random.default_rng(seed)
    columns, rows = max(1, round(width / spacing)), max(1, round(height / spacing))
    dx, dy = width / columns, height / rows
    w, h = min(dx, spacing) * random.uniform(0.5, 1.0), min(dy, spacing) * random.uniform(0.5, 1.0)
    lines = ["x,y,width,height"]
    for j, i in itertools.product(range(rows), range(columns)):
        px = x + (i + 0.5) * dx + 0.5 * (dx - w) * random.uniform(-1, 1)
        py = y + (j + 0.5) * dy + 0.5 * (dy - h) * random.uniform(-1, 1)
        lines.append(",".join(repr(float(v)) for v in (px, py, w, h)))
    return "\n".join(lines) + "\n"


def draw_loading(d, facts, density, speed_of_sound, height, cell):
    """&loading: earth's gravity, or one under which the body strains by a chosen share of itself."""
    earth, rest = share(d["weight"], 0.3, 9.81)
    gravity = log_between(rest, 1e-5, 0.3) * facts["modulus"] / (density * height) if earth is None else earth
    upright, rest = share(d["tilt"], 0.7, 0.0)
    tilt = math.radians(90.0 * rest - 45.0) if upright is None else upright
    none, rest = share(d["damping"], 0.4, 0.0)
    loading = {
        "gravity": (gravity * math.sin(tilt), -gravity * math.cos(tilt)),
        "damping": log_between(rest, 0.01, 20.0) if none is None else none,
    }
    if d["geostatic"] > 0.75 and tilt == 0.0 and facts["model"] != "neo_hookean":
        loading["initial_stress"] = "geostatic"
    if d["relaxation"] > 0.9:
        loading["relaxation"] = "gated" if d["relaxation"] > 0.95 else "open"
    return loading


def draw_boundary(d, grid, cell, speed_of_sound):
    """&boundary: the left column of nodes, or a strip of nodes at half height, moved or held."""
    speed = speed_of_sound * log_between(d["boundary_speed"], 1e-4, 0.1)
    kind = int(3 * (d["boundary"] - 0.88) / 0.12)
    middle = grid["y_min"] + cell * round(0.5 * (grid["y_max"] - grid["y_min"]) / cell)
    return {
        "name": "p",
        "x_min": grid["x_min"],
        "x_max": grid["x_min"] + cell if kind == 0 else grid["x_max"],
        "y_min": grid["y_min"] if kind == 0 else middle,
        "y_max": grid["y_max"] if kind == 0 else middle,
        "components": ("x", "y", "both")[kind],
        "velocity": (speed if kind == 0 else 0.0, -speed if kind == 1 else 0.0),
    }


def draw_field(d, material, body, cell, index):
    """&random_field: lengths from a tenth of a cell to ten times the width of the body."""
    friction = material["friction_angle"]
    lower = max(min(1.0, 0.5 * friction), min(material["dilation_angle"], 0.99 * friction))
    material["dilation_angle"] = min(material["dilation_angle"], lower)
    width = body.get("width", 5 * cell)
    return group(
        "random_field",
        property="friction_angle",
        material="m",
        distribution="lognormal" if d["distribution"] > 0.7 else "normal",
        mean=friction,
        cov=SPREAD + (0.5 - SPREAD) * d["cov"],
        acf=ACFS[int(5 * d["acf"])],
        scale_x=log_between(d["scale"], 0.1 * cell, 10 * width),
        scale_y=log_between(d["method"], 0.1 * cell, 10 * width),
        lower=lower,
        upper=70.0,
        method=METHODS[index % 4] if body["shape"] == "rectangle" else "auto",
    )
