"""`sgimp-post merge`: directories of job arrays that ran disjoint ranges of ids of one
configuration become one, in which `sgimp CASE.nml --output DIR` can go on."""

from __future__ import annotations

import shutil
import sys
import tempfile
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import h5py
import numpy as np

from .ensemble import FILE_NAME, Ensemble, read_ensemble
from .errors import PostError
from .id_ranges import format_ids
from .journal import FILE_NAME as JOURNAL_NAME
from .journal import Journal, read_journal, write_journal
from .namelist import differing_keys, identity_by_key

#: Where members of the same configuration may still differ: told, not refused.
PROGRAM = ("version", "git_hash", "git_dirty", "compiler", "compiler_flags", "libraries")
#: Differing keys that are named.
_MOST_KEYS = 20
#: The dataset of a case that is not a column of its members.
_SHARED = "profile/x"


@dataclass(frozen=True)
class Part:
    """One directory: its results, its journal with records of known cases, each member once, and
    the ids [label] of either."""

    ensemble: Ensemble
    journal: Journal
    ids: dict

    @property
    def directory(self) -> Path:
        return self.ensemble.directory

    @property
    def attributes(self) -> dict:
        return self.ensemble.attributes


def run(options) -> int:
    """Exit code 0; PostError for whatever does not fit, before anything is written."""
    if len(options.directories) < 2:
        raise PostError("merge: two directories or more are needed")
    out = Path(options.out)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise PostError(f"{out}: is there already (merge writes a new directory)")
    parts = [_read_part(Path(directory)) for directory in options.directories]
    for part in parts[1:]:
        _check_same(parts[0], part)
        _check_datasets(parts[0], part)
    _check_disjoint(parts)
    for line in _warnings(parts):
        print(f"sgimp-post: warning: {line}", file=sys.stderr)
    _write(parts, out)
    for line in _told(parts, out):
        print(line)
    return 0


def _read_part(directory: Path) -> Part:
    ensemble = read_ensemble(directory)
    if not ensemble.attributes.get("identity"):
        raise PostError(
            f"{directory / FILE_NAME}: does not say what its results depend on (no attribute"
            " identity): the run is of an earlier version of the program"
        )
    journal = read_journal(directory / JOURNAL_NAME)
    labels = {case.order: case.label for case in ensemble.cases}
    kept = {}
    for record in journal.records:  # the first record of a member counts, as in the program
        if record.case in labels:
            kept.setdefault((record.case, record.id), record)
    ids = {case.label: set(case.id.tolist()) for case in ensemble.cases}
    for case, member in kept:
        ids[labels[case]].add(member)
    return Part(ensemble, replace(journal, records=list(kept.values())), ids)


def _check_same(first: Part, other: Part) -> None:
    """PostError with the keys by which the results of two parts differ."""
    one, two = (identity_by_key(part.attributes["identity"]) for part in (first, other))
    found = [f"{key}: {old} -> {new}" for key, old, new in differing_keys(one, two)]
    sizes = [part.attributes.get("realizations") for part in (first, other)]
    if first.attributes.get("sampling") == "latin_hypercube" and sizes[0] != sizes[1]:
        found.append(
            f"&monte_carlo realizations: {sizes[0]} -> {sizes[1]}"
            " (a Latin hypercube has a fixed size)"
        )
    if found:
        more = len(found) - _MOST_KEYS
        found = found[:_MOST_KEYS] + ([f"and {more} more"] if more > 0 else [])
        raise PostError(
            f"{first.directory} and {other.directory} are different runs. What differs:\n"
            + "\n".join(found)
        )
    plans = [[(case.order, case.label) for case in p.ensemble.cases] for p in (first, other)]
    if plans[0] != plans[1]:
        raise PostError(f"{first.directory} and {other.directory} have different cases")
    if first.journal.columns != other.journal.columns:
        raise PostError(
            f"the journals of {first.directory} and {other.directory} have"
            f" {first.journal.columns} and {other.journal.columns} columns: they are of different"
            " versions of the program"
        )


def _check_datasets(first: Part, other: Part) -> None:
    """PostError where the cases of two parts do not hold the same columns."""
    paths = [part.directory / FILE_NAME for part in (first, other)]
    with h5py.File(paths[0], "r") as one, h5py.File(paths[1], "r") as two:
        for case in first.ensemble.cases:
            groups = [file["cases"][case.label] for file in (one, two)]
            names = [set(_dataset_names(group)) for group in groups]
            if names[0] != names[1]:
                raise PostError(
                    f"case {case.label} of {first.directory} and {other.directory} has different"
                    f" datasets ({', '.join(sorted(names[0] ^ names[1]))}): they are of different"
                    " versions of the program"
                )
            if _SHARED in names[0]:
                x = [group[_SHARED][...] for group in groups]
                if not np.array_equal(*x):
                    raise PostError(
                        f"case {case.label} of {first.directory} and {other.directory} differs in"
                        f" {_SHARED}"
                    )


def _check_disjoint(parts: list) -> None:
    found = []
    for one, two in combinations(parts, 2):
        for label, ids in one.ids.items():
            common = ids & two.ids[label]
            if common:
                found.append(
                    f"{one.directory} and {two.directory} both have {format_ids(list(common))} of"
                    f" {label}"
                )
    if found:
        raise PostError("members overlap:\n" + "\n".join(found))


def _warnings(parts: list):
    for name in PROGRAM:
        values = [str(part.attributes.get(name, "")) for part in parts]
        for part, value in zip(parts[1:], values[1:]):
            if value != values[0]:
                yield (
                    f"{name} of {parts[0].directory} is '{values[0]}', of {part.directory}"
                    f" '{value}': members need not be equal to the last bit"
                )
    for part in parts:
        if part.journal.damaged:
            yield f"{part.directory / JOURNAL_NAME}: {part.journal.damaged} damaged bytes left out"


def _told(parts: list, out: Path):
    for part in parts:
        if not part.ensemble.is_complete:
            yield f"{part.directory} is {part.ensemble.state}"
    count = 0
    for case in parts[0].ensemble.cases:
        there = set().union(*(part.ensemble.case(case.label).id.tolist() for part in parts))
        count += len(there)
        waiting = set().union(*(part.ids[case.label] for part in parts)) - there
        if waiting:
            yield (
                f"only in the journal until the program goes on: {format_ids(list(waiting))} of"
                f" {case.label}"
            )
        missing = set(range(1, _planned(parts, case.label) + 1)) - there - waiting
        if missing:
            yield f"not run of {case.label}: {format_ids(list(missing))}"
    for folder in ("snapshots", "failures"):
        kept = [
            str(part.directory / folder) for part in parts if (part.directory / folder).is_dir()
        ]
        if kept:
            yield "left where they are: " + ", ".join(kept)
    yield f"{count} members of {len(parts[0].ensemble.cases)} cases in {out}"


def _planned(parts: list, label: str) -> int:
    """Members of a case in the whole plan. A part that its stop rule ended planned fewer."""
    cases = [part.ensemble.case(label) for part in parts]
    return max(max(case.planned, int(case.id.max(initial=0))) for case in cases)


def _write(parts: list, out: Path) -> None:
    """All files under a temporary name beside `out`, which takes its place at the end."""
    scratch = None
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=f".{out.name}.", dir=out.parent))
        first = parts[0]
        with h5py.File(scratch / FILE_NAME, "w") as file:
            _write_ensemble(file, parts)
        records = [record for part in parts for record in part.journal.records]
        records.sort(key=lambda record: (record.case, record.id))
        write_journal(scratch / JOURNAL_NAME, replace(first.journal, records=records))
        resolved = first.directory / "resolved.nml"
        text = resolved.read_bytes() if resolved.is_file() else first.journal.text
        (scratch / "resolved.nml").write_bytes(text)
        scratch.chmod(0o755)
        if out.exists():
            out.rmdir()
        scratch.rename(out)
    except OSError as cause:
        raise PostError(f"{out}: cannot be written ({cause.strerror or cause})") from cause
    finally:
        if scratch is not None and scratch.exists():
            shutil.rmtree(scratch)


def _write_ensemble(file: h5py.File, parts: list) -> None:
    sources = [h5py.File(part.directory / FILE_NAME, "r") for part in parts]
    try:
        for name, value in sources[0].attrs.items():
            file.attrs[name] = value
        file.attrs.update(_merged_attributes(parts))
        for name in sources[0]:
            if name not in ("cases", "parts"):
                sources[0].copy(name, file)
        _keep_parts(file, parts, sources)
        for case in parts[0].ensemble.cases:
            groups = [source["cases"][case.label] for source in sources]
            target = file.create_group(f"cases/{case.label}")
            target.attrs.update(groups[0].attrs)
            target.attrs["planned"] = np.int32(_planned(parts, case.label))
            if "stop_rule_met" in target.attrs:
                target.attrs["stop_rule_met"] = np.int32(0)
            _write_rows(target, groups)
    finally:
        for source in sources:
            source.close()


def _merged_attributes(parts: list) -> dict:
    texts = [part.attributes for part in parts]
    asked = [part.ensemble.asked for part in parts]
    planned = max(_planned(parts, case.label) for case in parts[0].ensemble.cases)
    everyone = np.arange(1, planned + 1)
    union = np.unique(np.concatenate([everyone if ids is None else ids for ids in asked]))
    is_all = np.isin(everyone, union).all()
    return {
        "state": "complete" if all(part.ensemble.is_complete for part in parts) else "stopped",
        "members": "" if is_all else format_ids(union),
        "started": min(str(text.get("started", "")) for text in texts),
        "ended": max(str(text.get("ended", "")) for text in texts),
        "realizations": np.int32(max(int(text.get("realizations", 0)) for text in texts)),
    }


def _keep_parts(file: h5py.File, parts: list, sources: list) -> None:
    """What each part says of itself, as /parts/1, /parts/2, ...; of a part that was merged itself,
    what its parts say."""
    target = file.create_group("parts")
    for part, source in zip(parts, sources):
        if "parts" in source:
            for name in source["parts"]:
                source.copy(f"parts/{name}", target, str(len(target) + 1))
            continue
        group = target.create_group(str(len(target) + 1))
        group.attrs.update(source.attrs)
        group.attrs["directory"] = str(part.directory)


def _write_rows(target: h5py.Group, groups: list) -> None:
    """The datasets of a case, rows of all parts in the order of their ids. Parts without rows have
    datasets without shape or type."""
    filled = [group for group in groups if group["id"].size] or groups[:1]
    order = np.argsort(np.concatenate([group["id"][...] for group in filled]), kind="stable")
    for name in _dataset_names(filled[0]):
        source = filled[0][name]
        values = source[...]
        if name != _SHARED:
            values = np.concatenate([group[name][...] for group in filled])[order]
        dataset = target.create_dataset(name, data=values, dtype=source.dtype)
        dataset.attrs.update(source.attrs)


def _dataset_names(group: h5py.Group) -> list:
    names = []
    group.visititems(lambda n, item: names.append(n) if isinstance(item, h5py.Dataset) else None)
    return names
