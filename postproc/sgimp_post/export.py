"""`sgimp-post export`: snapshots for ParaView (VTKHDF) or as CSV, the ensemble for xarray."""

from __future__ import annotations

import os
import shutil
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from .ensemble import read_ensemble
from .errors import PostError
from .id_ranges import format_ids, parse_ids
from .netcdf import write_netcdf
from .snapshots import find_snapshots, list_steps, read_point_states
from .vtkhdf import write_vtkhdf

#: Components by their number.
_COMPONENTS = {2: ("x", "y"), 4: ("xx", "yy", "zz", "xy")}


def run(options) -> int:
    """Prints the files it wrote and returns 0. PostError for whatever is not there or would be
    overwritten; no file is left then."""
    directory = Path(options.directory)
    if not directory.is_dir():
        raise PostError(f"{directory}: no such directory")
    out = options.out or directory / "export"
    if options.form == "netcdf":
        writers = _ensemble_writer(options, directory)
    else:
        writers = _snapshot_writers(options, directory)
    taken = [name for name in writers if (out / name).exists()]
    if taken and not options.overwrite:
        more = f" and {len(taken) - 1} more" if len(taken) > 1 else ""
        raise PostError(f"{out / taken[0]}{more}: there already (--overwrite replaces it)")
    _write_all(writers, out)
    for name in writers:
        print(out / name)
    return 0


def _ensemble_writer(options, directory: Path) -> dict:
    if options.step is not None:
        raise PostError("--step belongs to --vtkhdf and --csv")
    ensemble = read_ensemble(directory)
    if not any(case.count for case in ensemble.cases):
        raise PostError(f"{directory}: no member is done yet")
    labels = [case.label for case in ensemble.cases]
    there = [(case.label, member) for case in ensemble.cases for member in case.id.tolist()]
    chosen = _choose(options, directory, labels, there, "rows")
    cases = [
        case.select(np.array([(case.label, member) in chosen for member in case.id.tolist()], bool))
        for case in ensemble.cases
        if options.study_case in (None, case.label)
    ]
    return {"ensemble.nc": partial(write_netcdf, ensemble=ensemble, cases=cases)}


def _snapshot_writers(options, directory: Path) -> dict:
    """A function that writes to a path, by the name of the file."""
    found = find_snapshots(directory)
    if not found:
        raise PostError(
            f"{directory}: no snapshots here (&output snapshot_members or snapshot_interval, or"
            " sgimp --realization I --snapshots, make some)"
        )
    labels = list(dict.fromkeys(label for label, _, _ in found))
    there = [(label, member) for label, member, _ in found]
    chosen = _choose(options, directory, labels, there, "snapshots")
    writers = {}
    for label, member, path in found:
        if (label, member) not in chosen:
            continue
        steps = _chosen_steps(path, options.step)
        if options.form == "csv":
            for step in steps:
                name = f"{path.stem}_step_{step:06d}.csv"
                writers[name] = partial(_write_csv, source=path, step=step)
        else:
            states = partial(read_point_states, path, steps)
            writers[f"{path.stem}.vtkhdf"] = partial(
                write_vtkhdf, states=states, count=len(steps), label=label, member=member
            )
    return writers


def _choose(options, directory: Path, labels: list, there: list, what: str) -> set:
    """Those (label, id) that are asked for. Every id must be there in one case at least: members
    of which snapshots are kept differ from case to case."""
    if options.study_case not in (None, *labels):
        raise PostError(
            f"{directory}: no {what} of a case '{options.study_case}': --study-case takes one of"
            f" {', '.join(labels)}"
        )
    chosen = {entry for entry in there if options.study_case in (None, entry[0])}
    if options.members is not None:
        asked = parse_ids(options.members, "--members")
        ids = np.array(sorted(member for _, member in chosen), dtype=np.int64)
        missing = np.setdiff1d(asked, ids)
        if not len(asked):
            raise PostError("--members: names no member")
        if len(missing):
            raise PostError(
                f"{directory}: no {what} of member {format_ids(missing)}"
                f" (there are {format_ids(ids) or 'none'})"
            )
        chosen = {entry for entry in chosen if entry[1] in asked.tolist()}
    return chosen


def _chosen_steps(path: Path, asked: str | None) -> list:
    steps = list_steps(path)
    if not steps:
        raise PostError(f"{path}: holds no states")
    if asked is None:
        return steps
    if asked in ("first", "last"):
        return [steps[0] if asked == "first" else steps[-1]]
    if not (asked.isascii() and asked.isdigit()):
        raise PostError(f"--step: '{asked}' is not 'first', 'last' or the number of a step")
    if int(asked) not in steps:
        raise PostError(f"{path}: no step {int(asked)} (there are {', '.join(map(str, steps))})")
    return [int(asked)]


def _write_csv(path: Path, source: Path, step: int) -> None:
    """One line a point; `time` is the same in all of them, so that files may be joined."""
    (state,) = read_point_states(source, [step])
    names, columns = ["time", "x", "y"], [np.full(len(state.position), state.time)]
    columns += list(state.position.T)
    for name, values in state.values.items():
        if values.ndim == 1:
            names.append(name)
            columns.append(values)
        else:
            names += [f"{name}_{part}" for part in _COMPONENTS[values.shape[1]]]
            columns += list(values.T)
    text = ",".join(names)
    np.savetxt(path, np.column_stack(columns), "%.17g", ",", header=text, comments="")


def _write_all(writers: dict, out: Path) -> None:
    """All files under a temporary name within `out`; they take their places when all are there."""
    made = scratch = None
    try:
        if not out.exists():
            out.mkdir(parents=True)
            made = out
        scratch = Path(tempfile.mkdtemp(prefix=".export.", dir=out))
        for name, write in writers.items():
            write(scratch / name)
        made = None
        for name in writers:
            os.replace(scratch / name, out / name)
    except (OSError, RuntimeError) as cause:
        raise PostError(f"{out}: cannot be written ({cause})") from cause
    finally:
        if scratch is not None:
            shutil.rmtree(scratch)
        if made is not None:
            made.rmdir()
