"""Writes an ensemble.h5 as the program does, with numbers that a test knows."""

import h5py
import numpy as np

from sgimp_post.ensemble import FLOAT_COLUMNS, INTEGER_COLUMNS, RUNOUTS

COLUMNS_X = 40


def write_ensemble(directory, cases, state="complete", snapshots=(), **attributes):
    """`cases`: dictionaries with label, values (farthest point, m) and, if wanted, ids,
    failed (ids), planned, acf, cov, columns ({name: values}) and further attributes of the case
    (more); the first may be the homogeneous one. `attributes` are those of the root."""
    directory.mkdir(parents=True, exist_ok=True)
    with h5py.File(directory / "ensemble.h5", "w") as file:
        file.attrs.update(
            program="sgimp",
            version="0.1.0",
            git_hash="abc",
            git_dirty=0,
            compiler="GCC",
            host="node",
            ranks=2,
            started="2026-01-01T00:00:00Z",
            ended="",
            seed=2022,
            state=state,
            realizations=10,
            namelist="&case name='t' /",
            resolved_namelist="&case name='t' /",
        )
        file.attrs.update(attributes)
        geometry = file.create_group("geometry")
        geometry.attrs.update(toe=5.0, x_min=0.0, x_max=20.0, cell_size=0.5, point_spacing=0.25)
        for order, case in enumerate(cases, start=1):
            _write_case(file.create_group(f"cases/{case['label']}"), case, order)
    for label, member in snapshots:
        _write_snapshot(directory, label, member)
    return directory


def _write_case(group, case, order):
    values = np.asarray(case["values"], dtype=float)
    ids = np.asarray(case.get("ids", np.arange(1, len(values) + 1)), dtype=np.int64)
    failed = np.isin(ids, case.get("failed", ()))
    group.attrs.update(
        label=case["label"],
        acf=case.get("acf", ""),
        cov=case.get("cov", 0.0),
        mean=35.0,
        distribution="normal",
        scale_x=0.2,
        scale_y=0.2,
        order=order,
        is_homogeneous=int(case["label"] == "deterministic"),
        planned=case.get("planned", len(values)),
        **case.get("more", {}),
    )
    group["id"], group["status"] = ids, np.where(failed, 2, 0).astype(np.int32)
    own = case.get("columns", {})
    for name in FLOAT_COLUMNS:
        if name == "log_weight" and name not in own:
            continue  # as files of earlier versions
        column = (
            own[name]
            if name in own
            else (
                values * RUNOUTS_FACTOR.get(name, 0.0)
                if name in RUNOUTS
                else np.full(len(values), 0.5)
            )
        )
        group[name] = np.where(failed & (name != "failure_x"), np.nan, column)
        group[name].attrs["units"] = "m"
    for name in INTEGER_COLUMNS:
        group[name] = np.full(
            len(values), {"settled": 1, "steps": 100}.get(name, 0), dtype=np.int64
        )
    group["reason"] = ["point left the grid" if one else "" for one in failed]
    group["profile/x"] = 0.25 + 0.5 * np.arange(COLUMNS_X)
    group["profile/height"] = np.ones((len(values), COLUMNS_X), dtype=np.float32)


RUNOUTS_FACTOR = {
    "runout_max": 1.0,
    "runout_q995": 0.9,
    "runout_q99": 0.8,
    "runout_connected": 0.95,
}


def _write_snapshot(directory, label, member):
    (directory / "snapshots").mkdir(exist_ok=True)
    x, y = np.meshgrid(np.arange(8) * 0.25, np.arange(8) * 0.25)
    with h5py.File(directory / "snapshots" / f"{label}_r{member:06d}.h5", "w") as file:
        for step, stretch in ((0, 1.0), (100, 2.0)):
            group = file.create_group(f"step_{step:06d}")
            group["time"] = 0.01 * step
            group["position"] = np.column_stack([stretch * x.ravel(), y.ravel() / stretch])
            group["friction_angle"] = 35.0 + np.sin(x.ravel() * 9)


def sample(seed, count, mean=5.6, sd=0.2):
    """Normal values that stay the same."""
    return np.random.default_rng(seed).normal(mean, sd, count)
