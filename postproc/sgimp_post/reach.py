"""How far the deposit reaches and how deep it lies: from the profiles of the members, the depth of
the final deposit at its initial density in columns of one cell.

P(depth at x) is pointwise in x. A distance is that of the right end of the farthest column of a
member that is so deep, one number a member: no curve is inverted for it, and it is known to one
column. Both run from the initial toe towards +x, as the runouts do; what a deposit does to the left
of the body shows in the curves alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from .importance import weighted_probability
from .statistics import CONFIDENCE, wilson

#: Probabilities whose distance is told.
PROBABILITIES = (0.5, 0.1, 0.05, 0.01)
#: Depths as shares of the initial height: what is in the way of feet, and of walls.
SHARES_OF_HEIGHT = (0.02, 0.10)
#: Of the surfaces.
QUANTILES = (5.0, 50.0, 95.0)
#: A part in 1e5 for the single precision of the profile, as in the program's connected front: a
#: depth is a multiple of that of one point, and so may be the depth that is asked for.
_ROUNDING = 1e-5


@dataclass(frozen=True)
class Distance:
    """The farthest distance from the toe, in m, that a member reaches so deep with a probability.
    NaN where the members are too few for the value or an end of its interval."""

    probability: float
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class DepthReach:
    """Where the deposit is `depth` m deep or deeper. `probability`, `low`, `high`: at each column,
    [nx], with a pointwise band. `beyond`: probability of any such column at x or farther, [nx];
    `beyond_half`: half-width of the band that holds it at all x at once (Dvoretzky, Kiefer and
    Wolfowitz with the constant of Massart 1990); NaN for weighted members."""

    depth: float
    words: str
    probability: np.ndarray
    low: np.ndarray
    high: np.ndarray
    beyond: np.ndarray
    beyond_half: float
    distances: list


@dataclass(frozen=True)
class Reach:
    """Of one case with `n` members of known profile. `surfaces`: depths [3, nx] that the shares
    QUANTILES of the members do not pass at each x; None for weighted members."""

    label: str
    acf: str
    cov: float
    n: int
    wall_touched: int
    geometry: object
    x: np.ndarray
    surfaces: np.ndarray | None
    depths: list


def known_profiles(case):
    """The case with the members alone that did not fail and whose profile is known."""
    if case.profile_height is None:
        return case.select(np.zeros(case.count, dtype=bool))
    return case.select(case.ok & np.isfinite(case.profile_height).all(axis=1))


def reaches(ensemble) -> list:
    """One entry a study case with two known profiles or more; of the homogeneous cases where there
    is no study case."""
    cases = ensemble.for_statistics()
    shown = [case for case in cases if case.role == "study"] or [
        case for case in cases if case.is_homogeneous
    ]
    found = [reach(case, ensemble.is_weighted) for case in shown]
    return [entry for entry in found if entry is not None]


def reach(case, is_weighted: bool = False) -> Reach | None:
    """None for fewer than two known profiles."""
    known = known_profiles(case)
    if known.count < 2:
        return None
    depths = known.profile_height
    log_weights = known.column("log_weight") if is_weighted else None
    return Reach(
        case.label,
        case.acf,
        case.cov,
        known.count,
        int(np.count_nonzero(known.column("wall_touched") == 1)),
        case.geometry,
        known.profile_x,
        None if is_weighted else np.percentile(depths, QUANTILES, axis=0),
        [
            _depth_reach(known, depth, words, log_weights)
            for depth, words in depths_of_interest(case.geometry, _width(known.profile_x))
        ],
    )


def depths_of_interest(geometry, column_width: float) -> list:
    """(depth in m, words): one layer of points, the least that is a deposit and not single grains,
    and those SHARES_OF_HEIGHT that are deeper. Where the spacing of the points is not known: half a
    column."""
    layer = geometry.point_spacing or 0.5 * column_width
    found = [(layer, "one layer of points")]
    for share in SHARES_OF_HEIGHT:
        depth = share * (geometry.initial_height or 0.0)
        if depth > found[-1][0] * (1.0 + _ROUNDING):
            found.append((depth, f"{100 * share:.0f} % of the initial height"))
    return found


def _depth_reach(case, depth: float, words: str, log_weights) -> DepthReach:
    x, n = case.profile_x, case.count
    is_deep = case.profile_height >= depth * (1.0 - _ROUNDING)
    ends = x + 0.5 * _width(x)
    last = is_deep.shape[1] - 1 - np.argmax(is_deep[:, ::-1], axis=1)
    fronts = np.where(is_deep.any(axis=1), ends[last], -np.inf)
    toe = case.geometry.toe
    if log_weights is None:
        shares = [wilson(int(count), n) for count in np.count_nonzero(is_deep, axis=0)]
        rows = np.array([(share.value, share.low, share.high) for share in shares])
        beyond = np.mean(fronts[:, None] >= ends, axis=0)
        half = float(np.sqrt(0.5 * np.log(2.0 / (1.0 - CONFIDENCE)) / n))
    else:
        rows = np.array([_weighted(column, log_weights) for column in is_deep.T])
        beyond, half = np.full(len(x), np.nan), np.nan
    distances = []
    if toe is not None:
        for p in PROBABILITIES:
            if log_weights is None:
                distances.append(distance(fronts - toe, p))
            else:
                distances.append(weighted_distance(fronts - toe, log_weights, p))
    return DepthReach(depth, words, *rows.T, beyond, half, distances)


def distance(fronts, probability: float, confidence: float = CONFIDENCE) -> Distance:
    """The largest d with P(front >= d) >= `probability`, with the interval of two order statistics
    (binomial; David and Nagaraja, Order Statistics, 3rd ed., 2003, section 7.1). It holds for every
    law, and more often than it says where many fronts end in the same column."""
    sorted_ = np.sort(fronts)[::-1]
    n, tail = len(sorted_), 0.5 * (1.0 - confidence)
    rank = int(np.ceil(n * probability - 1e-9))  # n times a probability of two digits is inexact
    upper = int(stats.binom.ppf(tail, n, probability))
    lower = int(stats.binom.ppf(1.0 - tail, n, probability)) + 1
    return Distance(
        probability,
        *(
            _at(sorted_, k, is_told)
            for k, is_told in (
                (rank, n * probability >= 1.0 - 1e-9),
                (lower, lower <= n),
                (upper, upper >= 1),
            )
        ),
    )


def weighted_distance(fronts, log_weights, probability: float) -> Distance:
    """The same from members of importance sampling. The ends are the farthest fronts whose lower
    and upper bounds of P(front >= d) pass `probability`; told where that is supported."""
    ends = np.unique(fronts[np.isfinite(fronts)])
    rows = [_weighted(fronts >= end, log_weights) for end in ends]
    found = []
    for k in range(3):
        reached = [end for end, row in zip(ends, rows) if row[k] >= probability]
        # Where all that is told is reached, what is farther may be as well; a lower end stays one.
        is_passed = k == 1 or any(row[k] < probability for row in rows)
        found.append(float(max(reached)) if reached and is_passed else np.nan)
    return Distance(probability, *found)


def _weighted(is_true, log_weights) -> tuple:
    """Probability with its interval; NaN where too few members tell. What is true of all members
    that are drawn has no estimate from their weights, as of those few that it is not true of."""
    got = weighted_probability(is_true, log_weights, 0.5)
    return (got.value, got.low, got.high) if got.is_supported else (np.nan,) * 3


def _at(sorted_, rank: int, is_told: bool) -> float:
    value = float(sorted_[rank - 1]) if is_told else np.nan
    return value if np.isfinite(value) else np.nan


def _width(x) -> float:
    return float(x[1] - x[0]) if len(x) > 1 else 0.0


def tables(found: list) -> dict:
    """Rows of the CSV files by name."""
    return {
        "reach.csv": [
            {
                "case": entry.label,
                "n": entry.n,
                "depth": one.depth,
                "depth_words": one.words,
                "probability": d.probability,
                "distance": d.value,
                "low": d.low,
                "high": d.high,
            }
            for entry in found
            for one in entry.depths
            for d in one.distances
        ],
        "reach_curves.csv": [
            {
                "case": entry.label,
                "depth": one.depth,
                "x": x,
                "probability": p,
                "low": low,
                "high": high,
                "beyond": beyond,
                "beyond_half": one.beyond_half,
            }
            for entry in found
            for one in entry.depths
            for x, p, low, high, beyond in zip(
                *(c.tolist() for c in (entry.x, one.probability, one.low, one.high, one.beyond))
            )
        ],
        "surfaces.csv": [
            {"case": entry.label, "x": x, "p05": low, "median": median, "p95": high}
            for entry in found
            if entry.surfaces is not None
            for x, low, median, high in zip(entry.x.tolist(), *entry.surfaces.tolist())
        ],
    }
