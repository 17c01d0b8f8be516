"""Members that stand for the distribution of the runout of a case: those at its quantiles and the
farthest one. Real members, which can be looked at and computed again, not interpolated values."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .ensemble import most_variable
from .errors import PostError
from .importance import exceedance_quantile, weighted_probability

#: Probability of not running farther, by name; 'max' is the farthest member.
QUANTILES = {"P5": 0.05, "P50": 0.50, "P95": 0.95}
FARTHEST = "max"
#: Cases whose members are shown if none is named: a page of some hundred kilobytes each.
MOST_CASES = 5


@dataclass(frozen=True)
class QuantileMember:
    """One member of a case: `name` is one of QUANTILES or FARTHEST, `value` its runout in m."""

    case: str
    name: str
    id: int
    value: float


def quantile_members(case, runout: str, is_weighted: bool = False) -> list:
    """The QuantileMembers of a case by one definition of the runout, from the nearest to the
    farthest; empty if no member has ended well with a finite value.

    Without weights by nearest rank: the member of rank ceil(p n). Where several have the same
    runout, the one of the lowest id. A member that is several of them (of fewer than 20, the
    farthest is P95 too) is named by the last.

    With weights (importance sampling) the members at `exceedance_quantile`, of which only those
    are told where the plan draws (`Weighted.is_supported`); a plan for a rare event has none in the
    bulk. The farthest member is the farthest of those drawn."""
    known = case.ok & np.isfinite(case.column(runout))
    ids, values = case.id[known], case.column(runout)[known]
    if len(values) == 0:
        return []
    ordered = np.sort(values)
    found = {}
    for name, p in QUANTILES.items():
        if is_weighted:
            value = _weighted_quantile(values, case.column("log_weight")[known], p)
        else:
            value = ordered[math.ceil(p * len(ordered)) - 1]
        if math.isfinite(value):
            found[name] = value
    found[FARTHEST] = ordered[-1]
    members = {}
    for name, value in found.items():
        member = int(ids[values == value].min())
        members[member] = QuantileMember(case.label, name, member, float(value))
    return sorted(members.values(), key=lambda member: member.value)


def _weighted_quantile(values, log_weights, p: float) -> float:
    value = exceedance_quantile(values, log_weights, 1.0 - p)
    if not math.isfinite(value):
        return math.nan
    return value if weighted_probability(values, log_weights, value).is_supported else math.nan


def shown_cases(ensemble, label: str | None = None) -> list:
    """The case `label`, or those whose quantile members are worth a look: the most variable ones,
    where members differ by their soil and not by noise; without study cases the homogeneous ones.
    With the rows that statistics may use. PostError if no case is called `label`."""
    cases = ensemble.for_statistics()
    if label is not None:
        found = [case for case in cases if case.label == label]
        if not found:
            known = ", ".join(case.label for case in cases)
            raise PostError(f"no case is called '{label}': --study-case takes one of {known}")
        return found
    study = [case for case in cases if case.role == "study"]
    return most_variable(study or [case for case in cases if case.is_homogeneous], MOST_CASES)
