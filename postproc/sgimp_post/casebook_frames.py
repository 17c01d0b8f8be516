"""What the frames of a casebook show: states at common times, and the scales that they share.
Numbers only; the pictures are in casebook_figures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .errors import PostError
from .snapshots import list_steps, read_point_states

DISPLACEMENT, PLASTIC_STRAIN = "displacement", "plastic strain"
#: Share of the points that lie beyond either end of a scale: single ones would stretch it.
_BEYOND = 0.005


@dataclass(frozen=True)
class Quantity:
    """What points are coloured by, over the scale from `low` to `high`; `property`, `name` and
    `units` are what `style.axis_label` takes."""

    property: str
    units: str
    low: float
    high: float

    @property
    def name(self) -> str:
        return self.property

    @property
    def is_uniform(self) -> bool:
        """The same everywhere and always, but for the jitter of homogeneous ground (1e-6)."""
        return self.high - self.low <= 1e-4 * abs(self.high)


@dataclass(frozen=True)
class Track:
    """The states of one replay: their steps and times in s [n], the ranges of its points in m, the
    scales of its quantities, and the step in which its points have come half of their way (mean
    displacement)."""

    path: Path
    steps: np.ndarray
    times: np.ndarray
    x: tuple
    y: tuple
    quantities: list
    half_way: int


def point_values(state, name: str) -> np.ndarray:
    """[np] of a PointState: the magnitude of the displacement, or an array of the state."""
    if name == DISPLACEMENT:
        return np.hypot(*state.values["displacement"].T)
    return state.values[name.replace(" ", "_")]


def survey(path: Path, varied: str) -> Track:
    """Reads all states once. `varied` is the property that the ground varies. PostError, naming the
    file, where it cannot be read or lacks it."""
    times, way, corners, scales, units = [], [], [], [], {}
    names = (varied, DISPLACEMENT, PLASTIC_STRAIN)
    steps = list_steps(path)
    for state in read_point_states(path, steps):
        try:
            values = [point_values(state, name) for name in names]
        except KeyError as cause:
            raise PostError(f"{path}: step {state.step} has no {cause}") from cause
        position = state.position[np.isfinite(state.position).all(axis=1)]
        if len(position) == 0:
            raise PostError(f"{path}: step {state.step} has no points")
        times.append(state.time)
        way.append(float(np.nanmean(values[1])))
        corners.append([position.min(axis=0), position.max(axis=0)])
        scales.append([np.nanquantile(one, [_BEYOND, 1.0 - _BEYOND]) for one in values])
        units = {name: state.units.get(name.replace(" ", "_"), "") for name in names}
    if not steps:
        raise PostError(f"{path}: holds no state")
    (left, bottom), (right, top) = np.min(corners, axis=0)[0], np.max(corners, axis=0)[1]
    low, high = np.min(scales, axis=0)[:, 0], np.max(scales, axis=0)[:, 1]
    low[1:] = 0.0  # of what begins at nothing and only grows
    half = int(np.flatnonzero(np.array(way) >= 0.5 * way[-1])[0])
    return Track(
        path,
        np.array(steps),
        np.array(times),
        (float(left), float(right)),
        (float(bottom), float(top)),
        [
            Quantity(name, units[name], float(low[k]), float(high[k]))
            for k, name in enumerate(names)
        ],
        steps[half],
    )


def shared_quantities(tracks: list) -> list:
    """Quantities over the scales that hold those of all tracks, without those that are the same
    everywhere (homogeneous ground, nothing plastic); the displacement is always there."""
    found = []
    for same in zip(*(track.quantities for track in tracks)):
        low, high = min(one.low for one in same), max(one.high for one in same)
        quantity = Quantity(same[0].property, same[0].units, low, high)
        if not quantity.is_uniform or quantity.property == DISPLACEMENT:
            found.append(quantity)
    return found


def frame_times(tracks: list, count: int) -> np.ndarray:
    """`count` times from the start to the end of the longest track, in s: the same for all members
    of a case, so that their animations go side by side."""
    return np.linspace(0.0, max(track.times[-1] for track in tracks), count)


def frame_steps(track: Track, times) -> list:
    """The step of the state nearest to each time; the last one from the end of the track on."""
    distance = np.abs(track.times[None, :] - np.asarray(times)[:, None])
    return track.steps[distance.argmin(axis=1)].tolist()
