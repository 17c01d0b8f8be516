"""The estimates of `control_variates` for the cases of an ensemble: each study case with its twin
on coarser cells, and with the mean of its own field, whose expectation is known."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from .control_variates import (
    best_ratio,
    controlled_mean,
    controlled_probability,
    controlled_sd,
    exact_controls,
    paired_controls,
    predicted_gain,
    realised_gain,
)
from .errors import PostError
from .random_fields import random_fields_of

#: Keys of a study that leave the points and the law at each of them alone: how values go together
#: in the field, how the ground is loaded, and how it is computed.
HARMLESS_KEYS = {
    *("scale_x", "scale_y", "rotation", "smoothness", "form", "method"),
    *("damping", "scheme", "weighting", "transfer", "flip", "cfl", "time_step", "end_time"),
    *("settle", "precision", "anti_locking", "threads"),
}


def control_estimates(ensemble, cases: list, name: str, thresholds: dict) -> list:
    """One entry a study case that has a twin or a field mean of known expectation: cost, gain and
    the best allocation, and the estimates of `name` by quantity and control. `thresholds`: s of
    P(S > s) by label."""
    twins = {case.control_of: case for case in cases if case.role == "control"}
    expected = expected_field_means(ensemble)
    found = []
    for case in (case for case in cases if case.role == "study"):
        mean = expected.get(case.label, np.nan)
        twin = twins.get(case.label)
        if twin is None and not np.isfinite(mean):
            continue
        found.append(_entry(case, twin, name, mean, thresholds.get(case.label, np.nan)))
    return [entry for entry in found if entry["rows"]]


def _entry(case, twin, name, expected, threshold) -> dict:
    entry = {"case": case.label, "twin": "", "expected_field_mean": expected, "rows": []}
    good = case.ok & np.isfinite(case.column(name))
    field_mean = case.column("field_mean")
    if np.isfinite(expected):
        keep = good & np.isfinite(field_mean)
        controls = exact_controls(field_mean[keep], expected)
        _add(
            entry, "mean", "field mean", controlled_mean(case.column(name)[keep], controls), np.inf
        )
    if twin is None:
        return entry
    theirs = twin.ok & np.isfinite(twin.column(name))
    _, mine, other = np.intersect1d(case.id[good], twin.id[theirs], return_indices=True)
    y, c = case.column(name)[good][mine], twin.column(name)[theirs][other]
    everyone = twin.column(name)[theirs]
    if len(y) == 0:
        return entry
    seconds = [one.column("seconds")[one.ok] for one in (case, twin)]
    cost_ratio = float(np.nanmean(seconds[0]) / np.nanmean(seconds[1]))
    controls = paired_controls(c, everyone)
    got = controlled_mean(y, controls)
    entry.update(
        twin=twin.label,
        seconds=float(np.nanmean(seconds[0])),
        cost_ratio=cost_ratio,
        correlation=got.correlation,
        sd=float(np.std(y, ddof=1)) if len(y) > 1 else np.nan,
        predicted_gain=float(predicted_gain(got.correlation, cost_ratio)),
        best_ratio=best_ratio(got.correlation, cost_ratio),
    )
    _add(entry, "mean", "twin", got, cost_ratio)
    if np.isfinite(expected) and np.isfinite(field_mean[good][mine]).all():
        both = controls.joined(exact_controls(field_mean[good][mine], expected))
        _add(entry, "mean", "twin and field mean", controlled_mean(y, both), cost_ratio)
    _add(entry, "sd", "twin", controlled_sd(y, c, everyone), cost_ratio)
    if np.isfinite(threshold):
        got = controlled_probability(y, c, everyone, threshold)
        _add(entry, "exceedance", "twin", got, cost_ratio, threshold)
    return entry


def _add(entry, quantity, control, estimate, cost_ratio, threshold=np.nan):
    """A row, if there is an estimate."""
    if not np.isfinite(estimate.value):
        return
    entry["rows"].append(
        {
            "quantity": quantity,
            "control": control,
            "threshold": threshold,
            **asdict(estimate),
            "variance_ratio": estimate.variance_ratio,
            "gain": float(realised_gain(estimate, cost_ratio))
            if np.isfinite(cost_ratio)
            else estimate.variance_ratio,
        }
    )


def expected_field_means(ensemble) -> dict:
    """By label, the exact expectation of the column field_mean: the mean of the marginal law of the
    first field, set to its bounds and given the measurements, over its points. Only where the mean
    of a member, rebuilt, is the one on record, as a study may have moved the points or the law; or
    where there are no measurements and the study has moved neither."""
    try:
        fields = random_fields_of(ensemble)
    except PostError:
        return {}
    if fields is None or not fields.specs:
        return {}
    spec, found = fields.specs[0], {}
    if spec.file or spec.is_too_dense:
        return {}
    for case in ensemble.cases:
        if case.role != "study" or not case.ok.any():
            continue
        try:
            if not case.has_recorded_fields:
                if not fields.has_data and _is_harmless(case):
                    found[case.label] = _mean_of_law(fields, spec, case)
                continue
            first = int(np.flatnonzero(case.ok)[0])
            if fields.is_on_record(case, first):
                found[case.label] = _mean_of_law(fields, spec, case)
        except PostError:
            continue
    return found


def _is_harmless(case) -> bool:
    return {name.rpartition(".")[2] for name in case.varied} <= HARMLESS_KEYS


def _mean_of_law(fields, spec, case) -> float:
    mean, _, _ = fields.law(spec, case).moments(*fields.expectation(spec, case))
    return float(np.mean(mean))
