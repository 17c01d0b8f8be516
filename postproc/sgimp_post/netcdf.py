"""An ensemble as one netCDF-4 file, that is HDF5 with dimension scales, written with h5py alone."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from .ensemble import FLOAT_COLUMNS, INTEGER_COLUMNS, RUNOUTS, STATUS_TEXTS, Ensemble

_LONG_NAMES = {
    **{name: f"runout from the initial toe, {words}" for name, words in RUNOUTS.items()},
    "height_max": "height of the highest point of the deposit",
    "height_wall": "depth of the deposit in the first column of cells",
    "settle_time": "time at which the mass came to rest",
    "kinetic_energy_end": "kinetic energy at the end",
    "kinetic_energy_ratio": "kinetic energy at the end over its largest value",
    "energy_error": "error of the energy balance",
    "mass_error": "error of the mass balance",
    "field_mean": "mean of the first random field over the points",
    "field_min": "least value of the first random field",
    "field_max": "largest value of the first random field",
    "field_clipped": "share of the points set to a bound of the first random field",
    "seconds": "computing time",
    "failure_x": "x of the point that failed",
    "failure_y": "y of the point that failed",
    "log_weight": "logarithm of the weight of importance sampling",
    "settled": "came to rest before the end (1) or not (0)",
    "wall_touched": "reached the end of the grid (1) or not (0)",
    "steps": "time steps",
    "failure_step": "time step of the failure",
    "failure_point": "number of the point that failed",
}

#: Of a case as a whole: long name, units; those of the mean are of the property that varies.
_CASE_NUMBERS = {
    "cov": ("coefficient of variation of the random field", "1"),
    "mean": ("mean of the random field", ""),
    "scale_x": ("scale of fluctuation along x", "m"),
    "scale_y": ("scale of fluctuation along y", "m"),
}
_CASE_TEXTS = {
    "acf": "autocorrelation function",
    "distribution": "distribution of the random field",
    "role": "study, homogeneous (noise floor) or control (twin on coarser cells)",
    "noise_case": "homogeneous case that is the noise floor of this one",
    "control_of": "case of which this one is the twin on coarser cells",
}
#: Of integers that are not known, as in the program.
_UNKNOWN = -1


def write_netcdf(path: Path, ensemble: Ensemble, cases: list) -> None:
    """Variables [case, member] and `height` [case, member, x]. Cases need not have the same members
    or cells: the dimensions hold all of them, and what a case has not is NaN, -1 or ''."""
    members = np.unique(np.concatenate([case.id for case in cases]))
    with h5py.File(path, "w") as file:
        for name, value in ensemble.attributes.items():
            file.attrs[name] = value
        labels = np.array([case.label for case in cases], dtype=object)
        axes = [
            _dimension(file, "case", labels, "study case"),
            _dimension(file, "member", members, "realization", "1"),
        ]
        _write_cases(file, axes[:1], cases)
        rows = [np.searchsorted(members, case.id) for case in cases]
        shape = (len(cases), len(members))

        def gather(columns, empty, dtype):
            table = np.full(shape, empty, dtype=dtype)
            for k, (row, values) in enumerate(zip(rows, columns)):
                table[k, row] = values
            return table

        status = gather([case.status for case in cases], _UNKNOWN, np.int32)
        variable = _variable(file, "status", status, axes, "how the member ended", "1")
        variable.attrs["flag_values"] = np.array(list(STATUS_TEXTS), dtype=np.int32)
        variable.attrs["flag_meanings"] = " ".join(
            text.replace(" ", "_") for text in STATUS_TEXTS.values()
        )
        for name in (*FLOAT_COLUMNS, *INTEGER_COLUMNS):
            columns = [case.column(name) for case in cases]
            is_integer = name in INTEGER_COLUMNS
            empty, dtype = (_UNKNOWN, np.int64) if is_integer else (np.nan, np.float64)
            table = gather(columns, empty, dtype)
            _variable(file, name, table, axes, _LONG_NAMES[name], _units(cases, name))
        reason = gather([case.reason for case in cases], "", object)
        _variable(file, "reason", reason, axes, "why the member failed")
        _write_profiles(file, axes, cases, rows)


def _units(cases: list, name: str) -> str:
    """Of a column; '' if no case says."""
    return next(filter(None, (case.units[name] for case in cases)), "")


def _write_cases(file: h5py.File, axes: list, cases: list) -> None:
    for name, (words, units) in _CASE_NUMBERS.items():
        values = np.array([getattr(case, name) for case in cases])
        _variable(file, name, values, axes, words, units)
    for name, words in _CASE_TEXTS.items():
        values = np.array([getattr(case, name) for case in cases], dtype=object)
        _variable(file, name, values, axes, words)
    planned = np.array([case.planned for case in cases], dtype=np.int64)
    _variable(file, "planned", planned, axes, "members planned", "1")


def _write_profiles(file: h5py.File, axes: list, cases: list, rows: list) -> None:
    """Depths at the cell centres of all cases together."""
    profiled = [case for case in cases if case.profile_x is not None]
    if not profiled:
        return
    x = np.unique(np.concatenate([case.profile_x for case in profiled]))
    height = np.full((*(len(axis) for axis in axes), len(x)), np.nan, dtype=np.float32)
    for k, (case, row) in enumerate(zip(cases, rows)):
        if case.profile_x is not None:
            column = np.searchsorted(x, case.profile_x)
            height[k, row[:, None], column[None, :]] = case.profile_height
    axes = [*axes, _dimension(file, "x", x, "cell centre", "m")]
    _variable(file, "height", height, axes, "depth of the final deposit", "m")


def _dimension(file: h5py.File, name: str, values, long_name: str, units: str = "") -> h5py.Dataset:
    """A dimension with its coordinates."""
    dataset = _dataset(file, name, values, long_name, units)
    dataset.make_scale(name)
    return dataset


def _variable(file, name: str, values, axes: list, long_name: str, units: str = "") -> h5py.Dataset:
    dataset = _dataset(file, name, values, long_name, units)
    if values.dtype.kind in "if":
        empty = np.nan if values.dtype.kind == "f" else _UNKNOWN
        dataset.attrs["_FillValue"] = np.array([empty], dtype=values.dtype)
    for k, axis in enumerate(axes):
        dataset.dims[k].attach_scale(axis)
    return dataset


def _dataset(file, name: str, values, long_name: str, units: str) -> h5py.Dataset:
    dtype = h5py.string_dtype() if values.dtype == object else values.dtype
    dataset = file.create_dataset(name, data=values, dtype=dtype)
    dataset.attrs["long_name"] = long_name
    if units:
        dataset.attrs["units"] = units
    return dataset
