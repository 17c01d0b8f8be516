"""`sgimp-post fields`: the audit of a run's random fields, their export, and the comparison with
what the program wrote itself."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import asdict
from pathlib import Path

import h5py
import numpy as np
from scipy.spatial import cKDTree

from . import field_figures
from .errors import PostError
from .field_audit import audit, audit_rows, one_of_each_acf
from .random_fields import read_random_fields
from .samplers import SAME_POINT
from .snapshots import find_snapshots
from .style import Gallery
from .tables import null_for_nan

#: Members of an audit if none are named: enough to see an error of the standard deviation of 1 %
#: in the baseline case, in seconds.
MEMBERS = 200


def run(options) -> int:
    """Exit code: 0; 1 where the audit finds a fault or the comparison a difference."""
    if options.members is not None and options.members < 1:
        raise PostError("--members must be at least 1")
    fields = read_random_fields(options.directory)
    if fields is None or not fields.cases:
        print(f"{options.directory}: a deterministic run: there is no random field")
        return 0
    if options.against:
        return compare(fields, options.against, options.tolerance)
    if options.csv or options.h5:
        export(fields, options)
        return 0
    return write_audit(fields, options)


def write_audit(fields, options) -> int:
    """audit.json, audit.csv and the figures; prints the table and the verdict."""
    if fields.tilt:
        raise PostError(
            "members of importance sampling are drawn from shifted fields and weighted: there is no"
            " law that they should follow (--csv, --h5 and --against rebuild them)"
        )
    left_out = [case.label for case in fields.study_cases if not case.has_recorded_fields]
    if left_out:
        total = len(fields.study_cases)
        print(f"left out, as the record is of other fields: {len(left_out)} of {total} study cases")
    numbers = audit(fields, options.members or MEMBERS)
    directory = Path(options.out) if options.out else fields.directory / "fields"
    checks = [{**asdict(check), "inside": check.inside} for check in numbers["checks"]]
    try:
        directory.mkdir(parents=True, exist_ok=True)
        content = null_for_nan({**numbers, "checks": checks})
        (directory / "audit.json").write_text(json.dumps(content, indent=1), encoding="utf-8")
        with open(directory / "audit.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(checks[0]) if checks else ["case"])
            writer.writeheader()
            writer.writerows(checks)
        _draw(fields, numbers, directory)
    except OSError as cause:
        raise PostError(f"{directory}: cannot be written ({cause.strerror})") from cause
    for line in _table(numbers):
        print(line)
    print(numbers["verdict"])
    print(directory)
    return 1 if numbers["faults"] else 0


def _table(numbers):
    """Lines for the terminal: one a case and field."""
    width = max(18, *(len(entry["case"]) for entry in numbers["fields"]))
    yield (
        f"{'case':<{width}} {'field':<18} {'N':>5} {'mean':>11} {'target':>11} {'sd':>10}"
        f" {'target':>10} {'clipped':>9} {'inside':>9}  method"
    )
    for row in audit_rows(numbers):
        yield (
            f"{row['case']:<{width}} {row['field']:<18} {row['members']:>5}"
            f" {row['mean']:>11.5g} {row['mean_target']:>11.5g} {row['sd']:>10.4g}"
            f" {row['sd_target']:>10.4g} {row['clipped']:>9.2e}"
            f" {row['inside']:>9}  {row['method']}"
        )
    yield from numbers["notes"]


def _draw(fields, numbers, directory) -> None:
    for spec in fields.specs:
        entries = [entry for entry in numbers["fields"] if entry["field"] == spec.name]
        if not entries:
            continue
        by_acf = one_of_each_acf(entries)
        cases = {case.label: case for case in fields.cases}
        rows = []
        for entry in by_acf:
            case = cases[entry["case"]]
            ids = np.arange(1, min(field_figures.SHOWN_MEMBERS, entry["members"]) + 1)
            rows.append((case, entry["acf"], fields.values(case, ids)[spec.name]))
        drawn = {
            "maps": field_figures.maps_figure(spec, rows),
            "quantiles": field_figures.quantile_figure(spec, entries),
        }
        if any(curve["lag"] for entry in entries for curve in entry["correlation"]):
            drawn["correlation"] = field_figures.correlation_figure(by_acf)
        gallery = Gallery()
        for kind, figure in drawn.items():
            gallery.add(f"{kind}_{_file_name(spec.name)}", figure)
        gallery.write(directory)


def _file_name(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name)


def export(fields, options) -> None:
    """One member as CSV (x, y and a column a field), or members as HDF5 in the layout of
    `sgimp --write-fields`."""
    case = _study_case(fields, options.study_case)
    if options.realization is not None:
        if not 1 <= options.realization <= max(case.planned, 1):
            raise PostError(
                f"--realization {options.realization}: case {case.label} has 1 to {case.planned}"
            )
        ids = np.array([options.realization])
    elif options.csv:
        raise PostError("--csv holds one member: name it with --realization")
    else:
        ids = np.arange(1, min(options.members or MEMBERS, case.planned) + 1)
    values = fields.values(case, ids)
    path = options.csv or options.h5
    try:
        if options.csv:
            _write_csv(path, fields, values)
        else:
            _write_hdf5(path, fields, case, ids, values)
    except OSError as cause:
        raise PostError(f"{path}: cannot be written ({cause})") from cause
    print(path)


def _study_case(fields, label):
    if label is None and len(fields.cases) == 1:
        return fields.cases[0]
    known = {case.label: case for case in fields.cases}
    if label not in known:
        named = f"no study case is called '{label}'" if label else "several study cases"
        raise PostError(f"{named}: --study-case takes one of {', '.join(known)}")
    return known[label]


def _write_csv(path, fields, values) -> None:
    """A block of rows a field where they cover different points, empty where a field is not."""
    specs = [spec for spec in fields.specs if spec.name in values]
    names = [spec.name for spec in specs]
    first = specs[0].points
    together = all(
        np.array_equal(spec.points.x, first.x) and np.array_equal(spec.points.y, first.y)
        for spec in specs
    )
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["x", "y", *names])
        if together:
            columns = [first.x, first.y, *(values[name][0] for name in names)]
            writer.writerows([f"{value:.17g}" for value in row] for row in zip(*columns))
            return
        for k, spec in enumerate(specs):
            for row in zip(spec.points.x, spec.points.y, values[spec.name][0]):
                cells = [f"{value:.17g}" for value in row]
                rest = [""] * (len(specs) - k - 1)
                writer.writerow([*cells[:2], *[""] * k, cells[2], *rest])


def _write_hdf5(path, fields, case, ids, values) -> None:
    with h5py.File(path, "w") as file:
        file.attrs["program"] = "sgimp-post"
        file[f"cases/{case.label}/id"] = ids
        for spec in fields.specs:
            if spec.name not in values:
                continue
            file[f"cases/{case.label}/{spec.name}"] = values[spec.name]
            file[f"cases/{case.label}/{spec.name}"].attrs["units"] = spec.units
            file[f"points/{spec.name}/x"] = spec.points.x
            file[f"points/{spec.name}/y"] = spec.points.y


def compare(fields, path: Path, tolerance: float) -> int:
    """The rebuild against an export of the program, or against the first steps in a snapshots
    directory; prints the largest relative differences. 1 where one is above the tolerance."""
    path = Path(path)
    found = _against_snapshots(fields, path) if path.is_dir() else _against_export(fields, path)
    worst, compared = 0.0, 0
    for label, name, members, difference in found:
        good = difference <= tolerance
        print(
            f"{'ok    ' if good else 'failed'} {label} {name}: {members}"
            f" {'member' if members == 1 else 'members'}, largest relative difference"
            f" {difference:.2e}"
        )
        worst = max(worst, difference) if np.isfinite(difference) else np.inf
        compared += members
    if compared == 0:
        raise PostError(f"{path}: nothing to compare: no field of this run is in it")
    print(f"largest relative difference {worst:.2e}, tolerance {tolerance:.0e}")
    return 0 if worst <= tolerance else 1


def relative_difference(actual, expected) -> float:
    """Largest |a - b|/|b|; where b is 0, over the mean |b|. Infinite for what is not a number."""
    actual, expected = np.asarray(actual, dtype=float), np.asarray(expected, dtype=float)
    size = np.abs(expected)
    size = np.where(size > 0.0, size, max(float(size.mean()), 1e-300))
    difference = np.abs(actual - expected) / size
    return float(difference.max()) if np.isfinite(difference).all() else np.inf


def _against_export(fields, path):
    cases = {case.label: case for case in fields.cases}
    specs = {spec.name: spec for spec in fields.specs}
    try:
        with h5py.File(path, "r") as file:
            for label, group in file["cases"].items():
                if label not in cases:
                    continue
                ids = np.atleast_1d(group["id"][...]).astype(int)
                names = [name for name in group if name in specs and not specs[name].file]
                for part in np.array_split(ids, max(1, len(ids) // 200)):
                    rebuilt = fields.values(cases[label], part) if names else {}
                    rows = np.flatnonzero(np.isin(ids, part))
                    for name in names:
                        _require_places(path, file, specs[name])
                        actual = np.atleast_2d(group[name][...])[rows]
                        if actual.shape != rebuilt[name].shape:
                            raise PostError(
                                f"{path}: {label}/{name} has shape {actual.shape}, expected"
                                f" {rebuilt[name].shape}"
                            )
                        yield label, name, len(part), relative_difference(actual, rebuilt[name])
    except (OSError, KeyError) as cause:
        raise PostError(f"{path}: not an export of fields ({cause})") from cause


def _require_places(path, file, spec) -> None:
    if f"points/{spec.name}" not in file:
        return
    group, p = file[f"points/{spec.name}"], spec.points
    x, y = group["x"][...], group["y"][...]
    extent = max(np.ptp(p.x), np.ptp(p.y), 1e-300)
    same = len(x) == p.count and max(np.abs(x - p.x).max(), np.abs(y - p.y).max()) <= 1e-9 * extent
    if not same:
        raise PostError(f"{path}: points/{spec.name} are not those in ensemble.h5")


def _against_snapshots(fields, directory):
    """Points of the first step of each member are found by their place."""
    cases = {case.label: case for case in fields.cases}
    for label, member, path in find_snapshots_in(directory):
        if label not in cases:
            continue
        try:
            with h5py.File(path, "r") as file:
                name = "step_000000"
                if name not in file:
                    continue
                step = {key: file[name][key][...] for key in file[name]}
        except (OSError, KeyError) as cause:
            raise PostError(f"{path}: cannot be read ({cause})") from cause
        rebuilt = fields.values(cases[label], np.array([member]))
        tree = cKDTree(step["position"])
        taken = {}
        for spec in reversed(fields.specs):  # where several cover a point, the last one counts
            key = spec.property.replace("tan_", "")
            if key not in step or spec.name not in rebuilt:
                continue
            distance, point = tree.query(np.column_stack([spec.points.x, spec.points.y]))
            extent = max(np.ptp(spec.points.x), np.ptp(spec.points.y), 1e-300)
            if distance.max() > SAME_POINT * extent:
                raise PostError(f"{path}: the points are not those of field {spec.name}")
            free = ~np.isin(point, taken.get(key, []))
            taken[key] = np.r_[taken.get(key, []), point]
            if not free.any():
                continue
            value = rebuilt[spec.name][0]
            if spec.property == "tan_friction_angle":
                value = np.rad2deg(np.arctan(value))
            difference = relative_difference(step[key][point[free]], fields.as_kept(value)[free])
            yield f"{label} r{member:06d}", spec.name, 1, difference


def find_snapshots_in(directory: Path) -> list:
    """Of DIR/snapshots, given as DIR or as the directory itself."""
    directory = Path(directory)
    return find_snapshots(directory) or find_snapshots(directory.parent)
