"""What there is to see of a member: its random field, rebuilt from the seed, and its last state, of
the sweep's own snapshots or of a replay."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .errors import PostError
from .namelist import read_namelist, resolved_text
from .random_fields import read_random_fields
from .samplers import Points
from .snapshots import find_snapshots, list_steps, read_point_states

#: Where `sgimp-post casebook DIR` leaves its replays, within DIR.
CASEBOOK = "casebook"
#: The property that every state holds.
FRICTION_ANGLE = "friction_angle"


@dataclass(frozen=True)
class Field:
    """A property at points, values [n] in the units of the states. `property`, `name` and `units`
    are what `style.axis_label` takes."""

    property: str
    name: str
    units: str
    points: Points
    values: np.ndarray


def varied_property(ensemble) -> str:
    """The property that the first random field varies, as states name it; the friction angle where
    there is none, or the namelist cannot be read."""
    try:
        groups = read_namelist(*resolved_text(ensemble))
    except PostError:
        groups = []
    keys = next((keys for name, keys in groups if name == "random_field"), {})
    return _state_name(str(keys.get("property", FRICTION_ANGLE)))


def _state_name(name: str) -> str:
    """States have the friction angle where its tangent is varied."""
    return name.replace("tan_", "")


class FieldRebuild:
    """Rebuilds the first random field of members of a run, where that can be done."""

    def __init__(self, directory: Path):
        try:
            self._fields = read_random_fields(directory)
        except PostError:  # the run is older than the record of its fields
            self._fields = None

    def of(self, case, ids) -> dict:
        """Field by id at the initial places of the points; empty for homogeneous ground, imported
        fields, and fields that are not recorded or too dear to rebuild."""
        fields = self._fields
        if fields is None or case.is_homogeneous or not case.has_recorded_fields:
            return {}
        spec = fields.specs[0]
        if spec.is_too_dense:
            return {}
        try:
            found = fields.values(case, np.array(ids)).get(spec.name)
        except PostError:  # another field is imported, or measurements are gone
            found = None
        if found is None:
            return {}
        units = spec.units
        if spec.property == "tan_friction_angle":
            found, units = np.rad2deg(np.arctan(found)), "degree"
        names = _state_name(spec.property), _state_name(spec.name)
        return {one: Field(*names, units, spec.points, row) for one, row in zip(ids, found)}


def last_field(directory: Path, case, member: int, quantity: str) -> Field | None:
    """A quantity of a member at the last places of its points, from DIR/snapshots or the replays of
    the casebook; None where neither has a state that can be read (a sweep may be writing it)."""
    for home in (Path(directory), Path(directory) / CASEBOOK):
        for label, number, path in find_snapshots(home):
            if (label, number) != (case.label, member):
                continue
            try:
                steps = [step for step in list_steps(path) if step > 0]
                state = next(read_point_states(path, steps[-1:]), None)
            except PostError:
                continue
            if state is not None:
                return _field_of(state, quantity, case.geometry.point_spacing or 0.0)
    return None


def _field_of(state, quantity: str, spacing: float) -> Field | None:
    keep = np.isfinite(state.position).all(axis=1)
    if quantity not in state.values or not keep.any():
        return None
    x, y = state.position[keep].T
    size = np.full(len(x), spacing)
    units = state.units[quantity]
    return Field(quantity, quantity, units, Points(x, y, size, size), state.values[quantity][keep])
