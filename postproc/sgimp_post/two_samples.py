"""Whether two samples of one quantity differ: in mean, in spread, in distribution. Members of the
same random numbers are compared pair by pair, others as independent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from .statistics import (
    FEWEST_FOR_SD,
    Difference,
    blocks,
    describe,
    finite,
    paired_difference,
    welch_difference,
)


@dataclass(frozen=True)
class TwoSamples:
    """`mean`: of second less first. `spread_p`: against equal spread; `distance`, `distance_p`:
    Kolmogorov-Smirnov's. NaN where there are too few values."""

    is_paired: bool
    n_first: int
    n_second: int
    mean_first: float
    mean_second: float
    mean: Difference
    sd_first: float
    sd_second: float
    spread_p: float
    distance: float
    distance_p: float
    #: Paired values are the same to the last bit.
    is_equal: bool


def compare(first, second, is_paired: bool, rng, shuffles: int) -> TwoSamples:
    """Of paired samples values in the same order; pairs count in which both are finite.

    Means: paired t, or Welch's. Spread: the same test of the distances from the medians (Brown and
    Forsythe, Journal of the American Statistical Association 69, 1974, 364-367; paired: Grambsch,
    Biometrika 81, 1994, 359-372), which does not ask for normal values. Distribution:
    Kolmogorov-Smirnov; paired, with the p value of `shuffles` random exchanges within pairs."""
    a, b = (np.asarray(x, dtype=float).reshape(-1) for x in (first, second))
    if is_paired:
        good = np.isfinite(a) & np.isfinite(b)
        a, b = a[good], b[good]
    a, b = finite(a), finite(b)
    difference = paired_difference if is_paired else welch_difference
    spread_p = np.nan
    if min(len(a), len(b)) >= FEWEST_FOR_SD:
        spread_p = difference(*(np.abs(x - np.median(x)) for x in (b, a))).p_value
    one, two = describe(a), describe(b)
    distance, distance_p = _distance(a, b, is_paired, rng, shuffles)
    return TwoSamples(
        is_paired,
        len(a),
        len(b),
        one.mean,
        two.mean,
        difference(b, a),
        one.sd,
        two.sd,
        spread_p,
        distance,
        distance_p,
        bool(is_paired and len(a) and np.array_equal(a, b)),
    )


def _distance(a, b, is_paired: bool, rng, shuffles: int):
    if min(len(a), len(b)) < 2:
        return np.nan, np.nan
    if not is_paired:
        found = stats.ks_2samp(a, b)
        return float(found.statistic), float(found.pvalue)
    exchanges = (
        rng.integers(0, 2, (size, len(a)), dtype=np.int32) * 2 - 1
        for size in blocks(shuffles, 2 * len(a))
    )
    distance = int(_largest_steps(a, b, np.ones((1, len(a)), dtype=np.int32))[0])
    as_large = sum(int(np.sum(_largest_steps(a, b, signs) >= distance)) for signs in exchanges)
    return distance / len(a), (1.0 + as_large) / (1.0 + shuffles)


def _largest_steps(a, b, signs) -> np.ndarray:
    """n times the distance of the distribution functions of n pairs, whole numbers [k], where the
    pairs with `signs` [k, n] of -1 are exchanged. If pairs are exchangeable, all are equally
    likely."""
    n = len(a)
    values = np.concatenate([a, b])
    order = np.argsort(values, kind="stable")
    side = np.where(order < n, 1, -1).astype(np.int32)
    is_last = np.append(np.diff(values[order]) > 0.0, True)  # of equal values
    steps = np.cumsum(side * signs[:, order % n], axis=1, dtype=np.int32)
    return np.max(np.abs(steps[:, is_last]), axis=1)
