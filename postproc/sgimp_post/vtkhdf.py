"""Points at several times as a VTKHDF file, which ParaView and pyvista open. Follows version 2.0 of
the format (docs.vtk.org, "VTKHDF File Format"): PolyData with one vertex a point, and `Steps`."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from .errors import PostError

_VERSION = (2, 0)
#: All four must be there, in this order of the columns of CellOffsets.
_TOPOLOGIES = ("Vertices", "Lines", "Polygons", "Strips")
#: Where the components of a plane go: vectors x, y, z; symmetric tensors as ParaView orders them,
#: XX, YY, ZZ, XY, YZ, XZ. The others are zero.
_WIDTH = {2: 3, 4: 6}
#: Points a chunk of compressed data.
_CHUNK = 32768


def write_vtkhdf(path: Path, states, count: int, label: str, member: int) -> None:
    """`states()` yields `count` states (PointState) of the same points. Units are attributes of
    the arrays; label and member are attributes of the file."""
    with h5py.File(path, "w") as file:
        file.attrs["label"] = label
        file.attrs["realization"] = np.int64(member)
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array(_VERSION, dtype=np.int64)
        root.attrs["Type"] = np.bytes_("PolyData")
        arrays, points, first = {}, None, None
        times = []
        for k, state in enumerate(states()):
            if first is None:
                first = state
                points = _make(root, "Points", state.position, count)
                data = root.create_group("PointData")
                for name, values in state.values.items():
                    arrays[name] = _make(data, name, values, count)
                    arrays[name].attrs["units"] = state.units[name]
            _check_same(path, first, state)
            _fill(points, k, state.position)
            for name, values in state.values.items():
                _fill(arrays[name], k, values)
            times.append(state.time)
        size = len(first.position)
        _write_vertices(root, size)
        _write_steps(root, np.array(times), size, list(arrays))


def _check_same(path: Path, first, state) -> None:
    shapes = [{n: v.shape for n, v in one.values.items()} for one in (first, state)]
    if len(first.position) != len(state.position) or shapes[0] != shapes[1]:
        raise PostError(
            f"{path.stem}: steps {first.step} and {state.step} have different points or arrays"
        )


def _make(group: h5py.Group, name: str, values: np.ndarray, count: int) -> h5py.Dataset:
    """An array for `count` times the rows of `values`."""
    width = tuple(_WIDTH[n] for n in values.shape[1:])
    rows = len(values)
    chunks = (max(1, min(rows, _CHUNK)), *width)
    return group.create_dataset(
        name,
        (count * rows, *width),
        values.dtype,
        chunks=chunks,
        compression="gzip",
        compression_opts=1,
        shuffle=True,
    )


def _fill(dataset: h5py.Dataset, k: int, values: np.ndarray) -> None:
    rows = slice(k * len(values), (k + 1) * len(values))
    if values.ndim == 1:
        dataset[rows] = values
    else:
        dataset[rows, : values.shape[1]] = values


def _write_vertices(root: h5py.Group, size: int) -> None:
    """Each point is a vertex, at all times: written once."""
    root["NumberOfPoints"] = np.array([size], dtype=np.int64)
    for name in _TOPOLOGIES:
        cells = size if name == "Vertices" else 0
        group = root.create_group(name)
        group["NumberOfCells"] = np.array([cells], dtype=np.int64)
        group["NumberOfConnectivityIds"] = np.array([cells], dtype=np.int64)
        group["Offsets"] = np.arange(cells + 1, dtype=np.int64)
        group["Connectivity"] = np.arange(cells, dtype=np.int64)


def _write_steps(root: h5py.Group, times: np.ndarray, size: int, names: list) -> None:
    """Points and arrays of a step follow those of the step before; the one part and its vertices
    serve them all."""
    count = len(times)
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(count)
    steps["Values"] = times
    steps["NumberOfParts"] = np.ones(count, dtype=np.int64)
    steps["PartOffsets"] = np.zeros(count, dtype=np.int64)
    steps["PointOffsets"] = size * np.arange(count, dtype=np.int64)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((count, len(_TOPOLOGIES)), dtype=np.int64)
    offsets = steps.create_group("PointDataOffsets")
    for name in names:
        offsets[name] = size * np.arange(count, dtype=np.int64)
