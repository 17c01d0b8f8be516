"""Verdict on one run of the sweep, from its exit code, its messages and its files.

ok        it completed; every number of it is finite, within bounds and consistent, and no energy was created
failed    a named failure: exit code 4, and status, reason, step and point in ensemble.h5
refused   bad input, where the case is meant to be refused (exit code 2 and a message)
gained    it completed as if nothing had happened, but energy was created beyond the bound
broken    anything else: a signal, an internal error, a hang, a result that is not finite, a lost point
"""

import math
import re
from dataclasses import dataclass

import h5py
import numpy as np

# Created energy that a completed run may show, as a share of the energy that moved; nothing physical creates
# any. The elastic scenes of stable_cfl.py stay below 3 % at CFL 0.4, an unstable run gains many times this.
ENERGY_SLACK = 0.05


@dataclass(frozen=True)
class Rounding:
    """What rounding may do to the results of a precision."""

    # Of a sum of 400 masses, and of stresses at their yield surface.
    sums: float
    # Of stresses, as a share of the modulus: the tolerance of planes in sg_mohr_coulomb.
    trial: float
    # Of energies, as a share of the largest, and of modulus times volume: a strain is known to 1e-16 or, rounded in
    # each of some hundred steps, to 1e-6.
    energy: float
    strain: float


# Coordinates are up to 1e4 cells, whose places are known to 1e-12 cells or, in single, to 1e-3 only.
ROUNDINGS = {
    "double": Rounding(sums=1e-9, trial=1e-13, energy=1e-12, strain=1e-14),
    "single": Rounding(sums=5e-5, trial=5e-5, energy=1e-5, strain=1e-6),
}
# Profiles are stored in single precision.
SINGLE = 2e-6
# A centre may come so far, in cells, behind a wall before the program calls its point lost.
MARGIN = 0.5101

UNKNOWN_ALLOWED = {"settle_time", "failure_step", "failure_point", "failure_x", "failure_y"}


class Broken(Exception):
    """What is wrong, in words."""


def judge(case, code, message, directory):
    """(verdict, detail, numbers) of a run that ended with `code` (None: it was killed as too slow)."""
    numbers = {}
    try:
        if code is None:
            raise Broken("hang: killed by the time limit of the sweep")
        if re.search(r"Backtrace|Program received signal|Fortran runtime error|MPI_ABORT", message):
            raise Broken(f"crash: {first_line(message)}")
        if code not in (0, 2, 4):
            raise Broken(f"exit code {code}: {first_line(message)}")
        if code not in case["expect"]:
            raise Broken(f"exit code {code}, expected {case['expect']}: {first_line(message)}")
        if code == 2:
            if len(message.strip()) < 10:
                raise Broken("refused without a word")
            return "refused", first_line(message), numbers
        with h5py.File(directory / "ensemble.h5") as file:
            members = {label: read_member(group) for label, group in file["cases"].items()}
        failed = {label: member for label, member in members.items() if member["status"] != 0}
        for label, member in failed.items():
            check_failure(label, member, directory)
        if (code == 4) != bool(failed):
            raise Broken(f"exit code {code} with {len(failed)} failed members")
        for label, member in members.items():
            if label not in failed:
                check_member(case, label, member, directory, numbers)
        if failed:
            return "failed", "; ".join(sorted({member["reason"] for member in failed.values()})), numbers
    except Broken as error:
        return "broken", str(error), numbers
    except (OSError, KeyError, IndexError, ValueError) as error:
        return "broken", f"files that cannot be read: {type(error).__name__}: {error}", numbers
    if numbers["created"] > energy_bound(case["facts"], numbers):
        return "gained", f"created {numbers['created']:+.3g}, ledger {numbers['ledger']:+.3g}", numbers
    return "ok", "", numbers


def energy_bound(facts, numbers):
    """Created energy, as a share of what moves, that says nothing against a run.

    Velocity and stress are known half a step apart. A body of n cells across its shorter side swings with
    omega = pi c/(2 n h) or faster, so that kinetic + elastic energy reads wrong by omega dt/2 = pi CFL/(4 n)
    up and down even where it is kept; the rise between two readings is twice that. And stress in rate form
    (not that of neo-Hookean bodies) stores energy to first order in strain only.
    """
    compression = 0.0 if facts["model"] == "neo_hookean" else numbers["compression"]
    return ENERGY_SLACK + 0.5 * math.pi * facts["cfl"] / facts["cells"] + compression


def first_line(message):
    """The first line that says something."""
    lines = [line.strip() for line in message.splitlines() if line.strip()]
    return lines[0][:200] if lines else "no message"


def read_member(group):
    """The only row of a case as plain values, beside its profile."""
    if len(group["status"]) != 1:
        raise Broken(f"{len(group['status'])} rows instead of one")
    row = {}
    for name, data in group.items():
        if isinstance(data, h5py.Dataset):
            value = data[0]
            row[name] = value.decode() if isinstance(value, bytes) else value.item()
    row["profile"] = group["profile/height"][0]
    return row


def check_failure(label, member, directory):
    """A failure has a reason, a step and a point, and the log tells it."""
    if not member["reason"].strip():
        raise Broken(f"{label}: failed with status {member['status']} without a reason")
    in_stage = member["reason"].startswith("before time 0")
    has_step = member["failure_step"] >= 1 or in_stage
    if member["status"] not in (4, 6) and not (has_step and member["failure_point"] >= 1):
        raise Broken(f"{label}: failure without a step or a point: {member['reason']}")
    if member["reason"].split(":")[0] not in (directory / "run.log").read_text():
        raise Broken(f"{label}: the log does not tell the failure")


def check_member(case, label, member, directory, numbers):
    """Raises Broken unless the completed member is finite, bounded and consistent."""
    facts = case["facts"]
    has_angle = facts["model"] == "mohr_coulomb" and facts.get("one_material", True)
    for name, value in member.items():
        if name in UNKNOWN_ALLOWED or isinstance(value, str):
            continue
        if name.startswith("field_") and (not has_angle or label == "deterministic"):
            continue
        if not np.all(np.isfinite(value)):
            raise Broken(f"{label}: {name} of a member with status ok is {value}")
    rounding = ROUNDINGS[facts["precision"]]
    if abs(member["mass_error"]) > rounding.sums:
        raise Broken(f"{label}: mass_error {member['mass_error']:.3g}")
    path = directory / "snapshots" / f"{label}_r000001.h5"
    if not path.exists():
        raise Broken(f"{label}: no snapshots of a completed member")
    with h5py.File(path) as file:
        check_finite(label, file, has_angle)
        names = sorted(name for name in file if name.startswith("step_"))
        first, last = ({k: v[()] for k, v in file[name].items()} for name in (names[0], names[-1]))
        for name in names:
            if len(file[name]["volume"]) != len(first["volume"]):
                raise Broken(
                    f"{label}: {len(first['volume'])} points at first, {len(file[name]['volume'])} in {name}"
                )
        lowest = min(float((file[name]["volume"][()] / first["volume"]).min()) for name in names)
        history = {k: v[()] for k, v in file["history"].items()}
    check_state(label, facts, member, first, last)
    numbers["compression"] = max(numbers.get("compression", 0.0), 1.0 - lowest)
    check_energy(label, facts, member, history, last, numbers)


def check_finite(label, file, has_angle):
    """No number of the file is NaN or infinite, but for friction angles of materials without one."""

    def visit(name, item):
        if not isinstance(item, h5py.Dataset) or item.dtype.kind != "f":
            return
        if name.endswith("friction_angle") and not has_angle:
            return
        if not np.all(np.isfinite(item[()])):
            raise Broken(f"{label}: {name} of a member with status ok is not finite")

    file.visititems(visit)


def check_state(label, facts, member, first, last):
    """All points are there, in the grid, with a volume, and on the right side of their yield surface."""
    x_min, x_max, y_min, y_max = facts["grid"]
    x, y = last["position"].T
    margin = MARGIN * facts["cell"]
    if (
        x.min() < x_min - margin
        or x.max() > x_max + margin
        or y.min() < y_min - margin
        or y.max() > y_max + margin
    ):
        raise Broken(f"{label}: a point is outside the grid at the end of a completed run")
    if not last["volume"].min() > 0:
        raise Broken(f"{label}: a point has the volume {last['volume'].min():.3g}")
    rounding = ROUNDINGS[facts["precision"]]
    columns = (x >= x_min) & (x < x_max)
    start = first["volume"][columns].sum()
    found = member["profile"].sum(dtype=float) * facts["cell"]
    # Depths are at the initial density; the first state of a relaxed body is no longer at it.
    allowed = 0.5 if facts.get("relaxed") else SINGLE
    if abs(found - start) > allowed * start + rounding.sums * facts["cell"] ** 2:
        raise Broken(f"{label}: the profile holds {found:.9g} m2 of {start:.9g}")
    excess = yield_excess(facts, last)
    if excess > rounding.sums and facts.get("one_material", True):
        raise Broken(f"{label}: stress beyond the yield surface by {excess:.3g} of itself")


def yield_excess(facts, state):
    """Largest relative violation of the yield criterion; stresses out of the plane are not stored.

    A returned stress is as exact as the trial stress it came from, 1e-13 of it in sg_mohr_coulomb; a trial
    stress can be a fraction of the modulus.
    """
    rounding = ROUNDINGS[facts["precision"]]
    xx, yy, _, xy = state["stress"].T
    radius = np.hypot(0.5 * (xx - yy), xy)
    high, low = 0.5 * (xx + yy) + radius, 0.5 * (xx + yy) - radius
    size = np.abs(state["stress"]).max(axis=1) + rounding.trial / rounding.sums * facts["modulus"]
    if facts["model"] in ("von_mises", "tresca"):
        return float(np.max((radius - facts["strength"]) / (size + facts["strength"])))
    if facts["model"] != "mohr_coulomb":
        return 0.0
    first = (state["friction_angle"], facts["cohesion"])
    excess = cone_excess(*first, facts["tension"], high, low, size)
    if "residual" in facts:
        # Linear from softening_start to softening_end; points that start below the residual angle keep
        # theirs. Where strength drops within an elastic strain, that of the start of the step counts: either
        # will do here.
        residual_angle, residual_cohesion, start, end = facts["residual"]
        share = np.clip((state["plastic_strain"] - start) / (end - start), 0.0, 1.0)
        angle = first[0] + share * np.minimum(0.0, residual_angle - first[0])
        cohesion = first[1] + share * (residual_cohesion - first[1])
        excess = np.minimum(excess, cone_excess(angle, cohesion, facts["tension"], high, low, size))
    return float(excess.max())


def cone_excess(angle, cohesion, tension, high, low, size):
    """Violation of Mohr-Coulomb with a tension cut-off, relative to the stresses."""
    angle = np.radians(angle)
    cohesion = 2 * cohesion * np.cos(angle)
    cone = ((high - low) + (high + low) * np.sin(angle) - cohesion) / (2 * size + cohesion)
    return np.maximum(cone, (high - tension) / (size + tension))


def check_energy(label, facts, member, history, last, numbers):
    """Notes the energy that came from nowhere, as a share of the energy that moved.

    created   largest rise, from any earlier time on, of kinetic + elastic + potential energy with what
              damping took: plastic work and walls only lower it, and what prescribed velocities gave is
              taken off. A speed beyond what the energy of the run allows shows up here too.
    net       largest rise above the start
    ledger    growth from start to end with the work of stresses and walls: how far the account of the
              program is from closed
    """
    kinetic, elastic, potential = (history[f"{k}_energy"] for k in ("kinetic", "elastic", "potential"))
    change = potential - potential[0]
    # Differences of energies are exact to a rounding of the largest of them, and of modulus times volume.
    rounding = ROUNDINGS[facts["precision"]]
    floor = rounding.energy * (np.abs(potential).max() + kinetic.max() + elastic.max())
    floor += rounding.strain * facts["modulus"] * last["volume"].sum() + 1e-300
    taken = history["damping_work"] + history["wall_work"]
    scale = (
        max(kinetic.max(), np.abs(change).max(), elastic.max(), np.abs(taken).max()) + floor / ENERGY_SLACK
    )
    free = kinetic + elastic + change + history["damping_work"]
    if facts["model"] == "linear_elastic":
        # All work of the stresses is stored, and the other models have no such exact store in rate form.
        free = free + history["plastic_work"]
    if facts.get("boundary"):
        # Less what prescribed velocities gave; what walls take is not counted on, as their account can be off.
        free = free - np.cumsum(np.maximum(-np.diff(history["wall_work"], prepend=0.0), 0.0))
    balance = kinetic + elastic + change + taken + history["plastic_work"]
    created = float((free - np.minimum.accumulate(free)).max() / scale)
    net = float((free - free[0]).max() / scale)
    error = float(balance[-1] - balance[0]) / scale
    numbers["ledger"] = max(numbers.get("ledger", -math.inf), error)
    numbers["lost"] = min(numbers.get("lost", math.inf), error)
    numbers["reported"] = max(numbers.get("reported", -math.inf), member["energy_error"])
    numbers["created"] = max(numbers.get("created", -math.inf), created)
    numbers["net"] = max(numbers.get("net", -math.inf), net)
    numbers["steps"] = max(numbers.get("steps", 0), member["steps"])
    numbers["seconds"] = numbers.get("seconds", 0.0) + member["seconds"]
    numbers["swelling"] = float(last["volume"].max() / last["volume"].mean())
    numbers["speed"] = float(np.hypot(*last["velocity"].T).max())
