"""Cases 12 and 13: sliding on a plane, and an infinite slope."""

import numpy as np
from judge import close, note, small

GRAVITY = 9.81


def tilted(degrees):
    """Key and value of gravity on a plane of this slope, which falls to the right."""
    angle = np.radians(degrees)
    return {"loading.gravity": (GRAVITY * np.sin(angle), -GRAVITY * np.cos(angle))}


def path(history):
    """How far the centre of mass has come along the plane."""
    return history["centre"][:, 0] - history["centre"][0, 0]


def frictional_plane(bench):
    """Case 12. With gravity switched on the elastic block bounces, and on average less friction acts than mu N. The
    law itself shows from rest, and with damping of 20/s and a PIC share of a half."""
    moved = path(bench.run("frictional_plane").history)[-1]
    yield close("way in 0.99 s, mu = 0.1, m", 1.987363, moved, 0.01, "demand 1 %")
    angle, damping = np.radians(30.0), 20.0
    for friction in (0.5, 0.6):
        changes = {"grid.bottom_friction": friction, "loading.damping": damping, "solver.flip": 0.5}
        history = bench.run("frictional_plane", changes).history
        time, way = history["time"], path(history)
        late = time > 0.5
        speed = np.polyfit(time[late], way[late], 1)[0]
        pull = GRAVITY * (np.sin(angle) - friction * np.cos(angle))
        if pull > 0.0:
            why = "demand 1 % of the way; here of the steady speed"
            yield close(f"mu = {friction}, damped: speed, m/s", pull / damping, speed, 0.01, why)
        else:
            why = "1 % of the speed without friction, g sin 30/20"
            free = GRAVITY * np.sin(angle) / damping
            yield small(f"mu = {friction} > tan 30, damped: speed, m/s", speed, free, 0.01, why)
    flight = bench.run("frictional_plane", {"loading.gravity": (0.0, GRAVITY), "grid.y_max": 8.0}).history
    rise = flight["centre"][-1, 1] - flight["centre"][0, 1]
    why = "explicit Euler is g dt t/2 ahead: dt/t = 0.1 %"
    yield close(
        "gravity away from the plane: rise, m", 0.5 * GRAVITY * flight["time"][-1] ** 2, rise, 2e-3, why
    )
    # Undamped, from rest under its weight: gravity that is switched on makes the elastic block bounce and rock.
    at_rest = {"loading.relaxation": "open", "loading.relaxation_time": 1.0}
    for friction in (0.5, 0.6):
        changes = {"grid.bottom_friction": friction}
        rigid = max(0.5 * GRAVITY * (np.sin(angle) - friction * np.cos(angle)) * 0.99**2, 0.0)
        moved = path(bench.run("frictional_plane", changes | at_rest).history)[-1]
        if rigid > 0.0:
            why = "it bends as it starts to slide: measured 1.1 %"
            yield close(f"mu = {friction}, at rest before: way, m", rigid, moved, 0.03, why)
        else:
            why = "1 % of the way without friction"
            free = 0.5 * GRAVITY * np.sin(angle) * 0.99**2
            yield small(f"mu = {friction} > tan 30, at rest before: way, m", moved, free, 0.01, why)
        moved = path(bench.run("frictional_plane", changes).history)[-1]
        why = f"gravity switched on; a rigid block comes {rigid:.3f} m far. The elastic one bounces and creeps"
        yield note(f"mu = {friction}: way, m", moved, why)


def slope_acceleration(bench, degrees, friction_angle, dilation_angle, **others):
    """Acceleration and last speed of the middle, above the lowest cell, which holds the shear of the base."""
    changes = {"material.friction_angle": friction_angle, "material.dilation_angle": dilation_angle}
    result = bench.run(
        "infinite_slope", tilted(degrees) | changes | {f"material.{k}": v for k, v in others.items()}
    )
    start = result.first.start
    middle = (np.abs(start[:, 0] - 40.0) < 5.0) & (start[:, 1] > 0.25)
    time = np.array([state.time for state in result.states])
    speed = np.array([state.velocity[middle, 0].mean() for state in result.states])
    return np.polyfit(time, speed, 1)[0], speed[-1]


def resistance(friction_angle, dilation_angle):
    """tan(phi*) of plane shear (Davis 1968)."""
    sine, psi = np.sin(np.radians(friction_angle)), np.radians(dilation_angle)
    return sine * np.cos(psi) / (1.0 - sine * np.sin(psi))


def infinite_slope(bench):
    """Case 13: the demanded accelerations hold for a material whose resistance in plane shear is tan 35."""
    listed = {36: 0.20901, 40: 1.04376}
    for degrees, value in listed.items():
        angle = np.radians(degrees)
        formula = GRAVITY * (np.sin(angle) - np.tan(np.radians(35.0)) * np.cos(angle))
        yield close(f"{degrees} deg: g (sin - tan 35 cos), m/s^2", value, formula, 3e-5, "digits of the list")
    for phi, psi, rest in ((35.0, 0.0, 29), (35.0, 35.0, 34)):
        friction, rise = resistance(phi, psi), np.tan(np.radians(psi))
        _, last = slope_acceleration(bench, rest, phi, psi)
        why = "3 % (demand) of the least acceleration of the list, for 1 s"
        yield small(f"psi = {psi:g}: speed after 1 s at {rest} deg, m/s", last, 0.20901, 0.03, why)
        for degrees in (36, 40):
            angle = np.radians(degrees)
            exact = GRAVITY * (np.sin(angle) - friction * np.cos(angle)) / (1.0 + friction * rise)
            ours, _ = slope_acceleration(bench, degrees, phi, psi)
            yield close(
                f"psi = {psi:g}: acceleration at {degrees} deg, m/s^2", exact, ours, 0.03, "demand 3 %"
            )
    sharp = float(np.degrees(np.arcsin(np.tan(np.radians(35.0)))))
    ours, _ = slope_acceleration(bench, 40, sharp, 0.0)
    yield close(
        "sin(phi) = tan 35, psi = 0: acceleration at 40 deg, m/s^2", 1.04376, ours, 0.03, "demand 3 %"
    )
    for young in (1e7, 3e7):
        ours, _ = slope_acceleration(bench, 36, sharp, 0.0, young=young)
        what = f"sin(phi) = tan 35, psi = 0, E = {young:g} Pa: acceleration at 36 deg, m/s^2"
        yield note(what, ours, "list: 0.20901, 2 % of g; waves in the slab change it")
