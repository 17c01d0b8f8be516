"""Paired experiments: cases that differ in exactly one thing, compared member by member, since the
same id has the same random numbers in each."""

from __future__ import annotations

from dataclasses import asdict
from itertools import combinations

import numpy as np

from .statistics import holm, paired_difference


def paired_experiments(cases: list, name: str, noise: dict) -> list:
    """Rows `first - second` for every two of the study `cases` that differ in one thing, `by`: acf,
    cov, or a key of `varied`; rows of the same thing together, p values adjusted among them (Holm).
    `noise`: standard deviation of the noise floor by label of the case."""
    groups = {}
    for first, second in combinations(cases, 2):
        keys = differing(first, second)
        if len(keys) == 1:
            groups.setdefault(keys[0], []).append((first, second))
    rows = []
    for by, found in groups.items():
        members = [_row(by, *pair, name, noise) for pair in found]
        for row, adjusted in zip(members, holm([row["p_value"] for row in members])):
            row["p_adjusted"] = float(adjusted)
        rows += members
    return rows


def differing(first, second) -> list:
    """The things in which two cases of a study differ."""
    keys = [key for key in ("acf", "cov") if _text(first, key) != _text(second, key)]
    names = dict.fromkeys([*first.varied, *second.varied])
    return keys + [key for key in names if first.varied.get(key) != second.varied.get(key)]


def _text(case, key):
    return case.acf if key == "acf" else f"{case.cov:.12g}"


def paired_values(first, second, name):
    """Values of the members that did not fail in either case, in order of id."""
    _, one, two = np.intersect1d(first.id, second.id, return_indices=True)
    good = first.ok[one] & second.ok[two]
    return first.column(name)[one][good], second.column(name)[two][good]


def _row(by, first, second, name, noise) -> dict:
    difference = paired_difference(*paired_values(first, second, name))
    floors = [noise.get(case.label, np.nan) for case in (first, second)]
    floor = float(np.max(floors))  # of the noisier one; not known if either is not
    return {
        "by": by,
        "first": first.label,
        "second": second.label,
        "noise": floor,
        "below_noise": bool(abs(difference.mean) < floor),  # False where either is not known
        **asdict(difference),
    }
