"""Reads the states of members from DIR/snapshots."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

from .errors import PostError

_FILE = re.compile(r"^(?P<label>.+)_r(?P<id>\d+)\.h5$")
_STEP = re.compile(r"^step_(\d+)$")


@dataclass(frozen=True)
class State:
    """All points at one time: positions [np, 2] in m, friction angles [np] in degrees."""

    step: int
    time: float
    position: np.ndarray
    friction_angle: np.ndarray


@dataclass(frozen=True)
class Snapshot:
    label: str
    id: int
    #: None if no later state than the first one is in the file.
    final: State | None
    #: Columns of /history by name; empty if there is none.
    history: dict = field(default_factory=dict)


@dataclass(frozen=True)
class PointState:
    """All quantities of the points at one time as the program wrote them: positions [np, 2] in m;
    values by name, [np], [np, 2] (x, y) or [np, 4] (xx, yy, zz, xy); units by name."""

    step: int
    time: float
    position: np.ndarray
    values: dict
    units: dict


def find_snapshots(directory: Path) -> list:
    """(label, id, path) of every snapshot file, sorted; opens none."""
    found = []
    for path in sorted((Path(directory) / "snapshots").glob("*.h5")):
        match = _FILE.match(path.name)
        if match:
            found.append((match["label"], int(match["id"]), path))
    return sorted(found, key=lambda entry: entry[:2])


def read_snapshot(label: str, member: int, path: Path) -> Snapshot | None:
    """None for a file that cannot be read: a member may be writing it at this moment."""
    try:
        with h5py.File(path, "r") as file:
            steps = _steps(file)
            if not steps:
                return None
            last = steps[-1]
            final = _read_state(file, *last) if last[0] > 0 else None
            history = {}
            if "history" in file:
                history = {name: dataset[...] for name, dataset in file["history"].items()}
            return Snapshot(label, member, final, history)
    except (OSError, KeyError, ValueError, RuntimeError):
        return None


def list_steps(path: Path) -> list:
    """The steps whose states a file holds, sorted. PostError, naming the file, if it cannot be
    read."""
    try:
        with h5py.File(path, "r") as file:
            return [step for step, _ in _steps(file)]
    except (OSError, RuntimeError) as cause:
        raise _unreadable(path, cause) from cause


def read_point_states(path: Path, steps):
    """A PointState for each of these steps, one at a time. PostError, naming the file, where it
    does not hold them or not all of the same points."""
    try:
        with h5py.File(path, "r") as file:
            names = dict(_steps(file))
            for step in steps:
                yield _read_points(file[names[step]], step)
    except (OSError, KeyError, ValueError, RuntimeError) as cause:
        raise _unreadable(path, cause) from cause


def _steps(file: h5py.File) -> list:
    """(step, name of its group), sorted."""
    return sorted((int(m[1]), name) for name in file for m in [_STEP.match(name)] if m)


def _unreadable(path: Path, cause: Exception) -> PostError:
    return PostError(f"{path}: cannot be read ({' '.join(str(cause).split())})")


def _read_points(group: h5py.Group, step: int) -> PointState:
    values = {name: item[...] for name, item in group.items() if item.shape}
    units = {name: _text(group[name].attrs.get("units", "")) for name in values}
    position = values.pop("position")
    for name, array in {"position": position, **values}.items():
        widths = [(2,)] if name == "position" else [(), (2,), (4,)]
        if len(array) != len(position) or array.shape[1:] not in widths:
            raise ValueError(f"{group.name}/{name} has shape {array.shape}")
    return PointState(step, float(group["time"][()]), position, values, units)


def _text(value) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def _read_state(file: h5py.File, step: int, name: str) -> State:
    group = file[name]
    position = group["position"][...].astype(float)
    if position.ndim != 2 or position.shape[1] != 2:
        raise ValueError("position is not [np, 2]")
    time = float(np.ravel(group["time"][...])[0]) if "time" in group else np.nan
    angle = (
        group["friction_angle"][...].astype(float).reshape(-1)
        if "friction_angle" in group
        else np.full(len(position), np.nan)
    )
    keep = np.isfinite(position).all(axis=1)
    if len(angle) != len(position) or not keep.any():
        raise ValueError("no points, or not one friction angle a point")
    return State(step, time, position[keep], angle[keep])
