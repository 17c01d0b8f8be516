"""What of a study case is soil and what is discretisation: each case against its homogeneous one,
whose members differ only in what means nothing physically."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from .ensemble import RUNOUTS
from .statistics import (
    describe,
    finite,
    outlier_probability,
    probability_above_mean,
    soil_share,
    welch_difference,
)

#: The nominal run is an outlier when its prediction t statistic, judged by the other homogeneous
#: runs, is beyond this two-sided probability.
OUTLIER = 0.001


def noise_floor(case) -> dict:
    """Of a homogeneous case (None: nothing is known), by runout: mean and spread in m; beside them
    the nominal run and the others without it, since one far run of eight decides what the noise
    floor is."""
    return {name: _floor(case, name) for name in RUNOUTS}


def _floor(case, name: str) -> dict:
    values = np.array([]) if case is None else case.values(name)
    others, nominal = np.array([]), np.nan
    if case is not None:
        others = finite(case.column(name)[(case.id != 1) & case.ok])
        first = finite(case.column(name)[(case.id == 1) & case.ok])
        nominal = float(first[0]) if len(first) else np.nan
    return {
        "nominal": nominal,
        "nominal_is_outlier": bool(outlier_probability(nominal, others) < OUTLIER),
        "others": asdict(describe(others)),
        **asdict(describe(values)),
    }


def against_floor(case, homogeneous) -> dict:
    """Of a study case, by runout: sd of the noise, share of the variance that is soil, shift of the
    mean against the deterministic value, P(S > deterministic value), and the share that runs
    farther than the nominal run alone."""
    return {name: _against(case, homogeneous, name) for name in RUNOUTS}


def _against(case, homogeneous, name: str) -> dict:
    values = case.values(name)
    noise = np.array([]) if homogeneous is None else homogeneous.values(name)
    nominal = np.array([])
    if homogeneous is not None:
        nominal = finite(homogeneous.column(name)[(homogeneous.id == 1) & homogeneous.ok])
    is_counted = len(nominal) and len(values)
    return {
        "noise_sd": describe(noise).sd,
        "soil_share": asdict(soil_share(values, noise)),
        "shift": asdict(welch_difference(values, noise)),
        "exceedance": asdict(probability_above_mean(values, noise)),
        "above_nominal": float(np.mean(values > nominal[0])) if is_counted else np.nan,
    }
