"""Estimates with their intervals. Plain arrays in, numbers out; what cannot be estimated is NaN."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

CONFIDENCE = 0.95
#: Below this p value, adjusted for the number of comparisons, a finding is none of chance.
LEVEL = 0.05
#: Fewest values for an interval of the standard deviation.
FEWEST_FOR_SD = 8
#: Numbers held at once.
_BLOCK = 2_000_000


@dataclass(frozen=True)
class Description:
    """Of one sample. Interval of the mean by Student's t, of the standard deviation by
    `sd_interval`."""

    n: int
    mean: float
    mean_low: float
    mean_high: float
    sd: float
    sd_low: float
    sd_high: float
    minimum: float
    p05: float
    median: float
    p95: float
    maximum: float

    @property
    def half_width(self) -> float:
        return 0.5 * (self.mean_high - self.mean_low)


@dataclass(frozen=True)
class Proportion:
    """Share of `n` with Wilson's score interval."""

    count: int
    n: int
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Ratio:
    value: float
    low: float
    high: float
    normal_low: float
    normal_high: float


@dataclass(frozen=True)
class Difference:
    """A difference of means with its t interval and the two-sided p value against zero."""

    n: int
    mean: float
    low: float
    high: float
    p_value: float


@dataclass(frozen=True)
class ExceedanceOfMean:
    """P(S > m) where m is itself the mean of a few runs. `share` is counted against that mean as if
    it were exact; `at_high` and `at_low` are the shares above the two ends of its t interval;
    `low`, `high` is the interval with both uncertainties."""

    share: Proportion
    at_high: float
    at_low: float
    low: float
    high: float


@dataclass(frozen=True)
class Running:
    """Mean and standard deviation of the first k values, for each k in `count`, with bands."""

    count: np.ndarray
    mean: np.ndarray
    mean_low: np.ndarray
    mean_high: np.ndarray
    sd: np.ndarray
    sd_low: np.ndarray
    sd_high: np.ndarray


@dataclass(frozen=True)
class Exceedance:
    """P(S > x) at values x of the sample, with a pointwise Wilson band."""

    x: np.ndarray
    probability: np.ndarray
    low: np.ndarray
    high: np.ndarray


def blocks(samples: int, n: int):
    """Numbers of samples of `n` values each that are held at once; they add up to `samples`."""
    most = max(1, _BLOCK // n)
    for first in range(0, samples, most):
        yield min(most, samples - first)


def finite(values) -> np.ndarray:
    values = np.asarray(values, dtype=float).reshape(-1)
    return values[np.isfinite(values)]


def describe_pairs(ids, values, confidence: float = CONFIDENCE) -> Description:
    """The mean of antithetic members with its interval: of the means of the pairs (1, 2), (3, 4)
    and so on that are whole and finite, which are independent where their members are not."""
    known = {int(i): float(v) for i, v in zip(ids, values) if np.isfinite(v)}
    pairs = [0.5 * (v + known[i + 1]) for i, v in known.items() if i % 2 == 1 and i + 1 in known]
    return describe(pairs, confidence)


def describe(values, confidence: float = CONFIDENCE) -> Description:
    x = finite(values)
    n = len(x)
    if n == 0:
        return Description(0, *[np.nan] * 11)
    mean, sd = float(np.mean(x)), (float(np.std(x, ddof=1)) if n > 1 else np.nan)
    half = t_factor(n, confidence) * sd / np.sqrt(n)
    low, high = sd_interval(x, confidence)
    p05, median, p95 = (float(q) for q in np.percentile(x, [5, 50, 95]))
    return Description(
        n,
        mean,
        mean - half,
        mean + half,
        sd,
        low,
        high,
        float(x.min()),
        p05,
        median,
        p95,
        float(x.max()),
    )


def kurtosis(values) -> float:
    """n sum (x - m)^4 / (sum (x - mean)^2)^2 of five values or more that are not all equal, with
    the mean m of what is left when a share 1/(2 sqrt(n - 4)) is cut off at either end (Bonett
    2006), whole values only; infinite otherwise. Not less than 1."""
    x = finite(values)
    n = len(x)
    squares = float(np.sum((x - x.mean()) ** 2)) if n > 4 else 0.0
    if squares == 0.0:
        return np.inf
    cut = int(min(n / (2.0 * np.sqrt(n - 4.0)), (n - 1) // 2))
    middle = np.partition(x, (cut, n - cut - 1))[cut : n - cut].mean()
    return float(n * np.sum((x - middle) ** 4) / squares**2)


def sd_error(n: int, kurtosis_: float, confidence: float = CONFIDENCE):
    """(c, standard error of ln s^2) of Bonett (2006): c = n/(n - z),
    error = c sqrt((kurtosis - (n - 3)/n)/(n - 1))."""
    c = n / (n - _z(confidence))
    return c, c * np.sqrt((kurtosis_ - (n - 3.0) / n) / (n - 1.0))


def sd_interval(values, confidence: float = CONFIDENCE):
    """Interval of the standard deviation of values of any law with a fourth moment:
    exp(ln(c s^2) +- z error), of variances (Bonett, Approximate confidence interval for standard
    deviation of nonnormal distributions, Computational Statistics & Data Analysis 50, 2006,
    775-782). NaN for fewer than FEWEST_FOR_SD values; no width where all are equal."""
    x = finite(values)
    n = len(x)
    if n < FEWEST_FOR_SD:
        return np.nan, np.nan
    sd = float(np.std(x, ddof=1))
    if np.ptp(x) == 0.0:
        return sd, sd
    c, error = sd_error(n, kurtosis(x), confidence)
    half = 0.5 * _z(confidence) * error
    return float(sd * np.sqrt(c) * np.exp(-half)), float(sd * np.sqrt(c) * np.exp(half))


def variance_ratio(first, second, confidence: float = CONFIDENCE) -> Ratio:
    """var(first)/var(second) of independent samples. `low`, `high`: by the F distribution with the
    degrees of freedom d = 2 n/(kurtosis - (n - 3)/(n - 1)) that the kurtosis of a sample leaves it,
    n - 1 at most (after Shoemaker, Fixing the F test for equal variances, The American Statistician
    57, 2003, 105-114); `normal_low`, `normal_high`: with n - 1, exact for normal values alone."""
    a, b = finite(first), finite(second)
    if len(a) < 2 or len(b) < 2 or np.ptp(b) == 0.0:
        return Ratio(*[np.nan] * 5)
    value = float(np.var(a, ddof=1) / np.var(b, ddof=1))
    bounds = []
    for d, e in ((_freedom(a), _freedom(b)), (len(a) - 1, len(b) - 1)):
        bounds += [value / stats.f.ppf(0.5 + 0.5 * sign * confidence, d, e) for sign in (1, -1)]
    return Ratio(value, *map(float, bounds))


def _freedom(x) -> float:
    n = len(x)
    excess = kurtosis(x) - (n - 3.0) / (n - 1.0)
    return min(n - 1.0, 2.0 * n / excess) if np.isfinite(excess) else n - 1.0


def wilson(count: int, n: int, confidence: float = CONFIDENCE) -> Proportion:
    if n == 0:
        return Proportion(0, 0, np.nan, np.nan, np.nan)
    z2 = _z(confidence) ** 2
    centre = (count + 0.5 * z2) / (n + z2)
    half = float(np.sqrt(z2 * (count * (n - count) / n + 0.25 * z2))) / (n + z2)
    low = centre - half if count > 0 else 0.0  # exact at the ends, where rounding would show
    high = centre + half if count < n else 1.0
    return Proportion(int(count), int(n), count / n, float(low), float(high))


def probability_above(values, threshold: float, confidence: float = CONFIDENCE) -> Proportion:
    """Share of values greater than `threshold`; of none if the threshold is not known."""
    x = finite(values)
    if not np.isfinite(threshold):
        return wilson(0, 0)
    return wilson(int(np.count_nonzero(x > threshold)), len(x), confidence)


def probability_above_mean(values, reference, confidence: float = CONFIDENCE) -> ExceedanceOfMean:
    """P(S > mean of the law of `reference`). The two distances of each end, Wilson's and that of
    the threshold, are added as squares (the MOVER of Zou and Donner, Statistics in Medicine 27,
    2008, 1693-1702)."""
    x, mean = finite(values), describe(reference, confidence)
    share = probability_above(x, mean.mean, confidence)
    if not share.n or not np.isfinite(mean.mean_high):
        return ExceedanceOfMean(share, *[np.nan] * 4)
    at_high, at_low = (float(np.mean(x > end)) for end in (mean.mean_high, mean.mean_low))
    low = share.value - np.hypot(share.value - share.low, share.value - at_high)
    high = share.value + np.hypot(share.high - share.value, at_low - share.value)
    return ExceedanceOfMean(share, at_high, at_low, max(0.0, float(low)), min(1.0, float(high)))


def soil_share(values, noise, confidence: float = CONFIDENCE) -> Ratio:
    """Share of the variance of `values` that is not that of `noise`: 1 - var(noise)/var(values),
    with the intervals of `variance_ratio`. Below zero where the noise spreads more."""
    r = variance_ratio(noise, values, confidence)
    return Ratio(1.0 - r.value, 1.0 - r.high, 1.0 - r.low, 1.0 - r.normal_high, 1.0 - r.normal_low)


def paired_difference(first, second, confidence: float = CONFIDENCE) -> Difference:
    """Mean of `first - second` over pairs in which both are finite."""
    d = finite(np.asarray(first, dtype=float) - np.asarray(second, dtype=float))
    n = len(d)
    if n < 2:
        return Difference(n, float(d.mean()) if n else np.nan, np.nan, np.nan, np.nan)
    mean, error = float(d.mean()), float(np.std(d, ddof=1)) / np.sqrt(n)
    half = t_factor(n, confidence) * error
    if error == 0.0:
        p_value = 1.0 if mean == 0.0 else 0.0
    else:
        p_value = float(2.0 * stats.t.sf(abs(mean) / error, n - 1))
    return Difference(n, mean, mean - half, mean + half, p_value)


def outlier_probability(value: float, others) -> float:
    """Two-sided probability that one more value of the normal population of `others` lies as far
    from their mean as `value` (t statistic of a prediction); 1 where that cannot be judged."""
    x = finite(others)
    if len(x) < 3 or not np.isfinite(value) or np.ptp(x) == 0.0:
        return 1.0
    error = float(np.std(x, ddof=1)) * np.sqrt(1.0 + 1.0 / len(x))
    return float(2.0 * stats.t.sf(abs(value - x.mean()) / error, len(x) - 1))


def welch_difference(first, second, confidence: float = CONFIDENCE) -> Difference:
    """Difference of the means of two independent samples of unequal variance."""
    a, b = finite(first), finite(second)
    if len(a) == 0 or len(b) == 0:
        return Difference(0, np.nan, np.nan, np.nan, np.nan)
    mean, n = float(a.mean() - b.mean()), len(a) + len(b)
    if len(a) < 2 or len(b) < 2:
        return Difference(n, mean, np.nan, np.nan, np.nan)
    va, vb = np.var(a, ddof=1) / len(a), np.var(b, ddof=1) / len(b)
    error = float(np.sqrt(va + vb))
    if error == 0.0:
        return Difference(n, mean, mean, mean, 1.0 if mean == 0.0 else 0.0)
    freedom = (va + vb) ** 2 / (va**2 / (len(a) - 1) + vb**2 / (len(b) - 1))
    half = float(stats.t.ppf(0.5 + 0.5 * confidence, freedom)) * error
    return Difference(
        n, mean, mean - half, mean + half, float(2.0 * stats.t.sf(abs(mean) / error, freedom))
    )


def proportion_difference(first: Proportion, second: Proportion) -> Difference:
    """Difference of two independent shares, with the interval that Newcombe (1998, method 10) makes
    of their Wilson intervals; no p value."""
    mean = first.value - second.value
    below = np.hypot(first.value - first.low, second.high - second.value)
    above = np.hypot(first.high - first.value, second.value - second.low)
    return Difference(first.n + second.n, mean, float(mean - below), float(mean + above), np.nan)


def holm(p_values) -> np.ndarray:
    """p values adjusted for the number of comparisons (Holm 1979); NaN stays and is not counted."""
    p = np.asarray(p_values, dtype=float)
    adjusted = np.full(p.shape, np.nan)
    known = np.flatnonzero(np.isfinite(p))
    ranked = known[np.argsort(p[known], kind="stable")]
    factors = len(ranked) - np.arange(len(ranked))
    adjusted[ranked] = np.minimum(1.0, np.maximum.accumulate(factors * p[ranked]))
    return adjusted


def benjamini_hochberg(p_values) -> np.ndarray:
    """p values adjusted so that of those up to a level, that share at most is false on average
    (Benjamini and Hochberg 1995); NaN stays and is not counted."""
    p = np.asarray(p_values, dtype=float)
    adjusted = np.full(p.shape, np.nan)
    known = np.flatnonzero(np.isfinite(p))
    ranked = known[np.argsort(p[known], kind="stable")]
    factors = len(ranked) / np.arange(1.0, len(ranked) + 1.0)
    least = np.minimum.accumulate((factors * p[ranked])[::-1])[::-1]
    adjusted[ranked] = np.minimum(1.0, least)
    return adjusted


def correlation_interval(r: float, n: int, confidence: float = CONFIDENCE):
    """Fisher's: tanh(artanh(r) +- z/sqrt(n - 3)); NaN for three pairs or fewer."""
    if n < 4:
        return np.nan, np.nan
    middle, half = np.arctanh(np.clip(r, -1.0 + 1e-12, 1.0 - 1e-12)), _z(confidence)
    half /= np.sqrt(n - 3.0)
    return float(np.tanh(middle - half)), float(np.tanh(middle + half))


def running(values, confidence: float = CONFIDENCE, points: int = 120) -> Running:
    """At most `points` counts, evenly spread; always the first two and the last."""
    x = finite(values)
    n = len(x)
    count = np.unique(np.linspace(1, n, min(n, points)).round().astype(int)) if n else np.array([])
    count = count[count >= 1].astype(int)
    if len(count) == 0:
        return Running(count, *[np.array([])] * 6)
    shift = float(np.mean(x))  # against cancellation
    total, squares = np.cumsum(x - shift)[count - 1], np.cumsum((x - shift) ** 2)[count - 1]
    mean = total / count
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.maximum(squares - count * mean**2, 0.0) / (count - 1)
        sd = np.where(count > 1, np.sqrt(variance), np.nan)
        half = t_factor(count, confidence) * sd / np.sqrt(count)
    low, high = np.array([sd_interval(x[:k], confidence) for k in count]).T
    return Running(count, mean + shift, mean + shift - half, mean + shift + half, sd, low, high)


def exceedance(values, confidence: float = CONFIDENCE, points: int = 160) -> Exceedance:
    x = np.sort(finite(values))
    n = len(x)
    if n == 0:
        return Exceedance(*[np.array([])] * 4)
    # Even in rank, and every one of the upper tail, which the logarithmic axis spreads out.
    index = np.unique(
        np.r_[
            np.linspace(0, n - 1, min(n, points)).round().astype(int), np.arange(max(0, n - 25), n)
        ]
    )
    shares = [probability_above(x, x[k], confidence) for k in index]
    return Exceedance(
        x[index],
        np.array([s.value for s in shares]),
        np.array([s.low for s in shares]),
        np.array([s.high for s in shares]),
    )


def t_factor(n, confidence: float):
    n = np.asarray(n, dtype=float)
    factor = stats.t.ppf(0.5 + 0.5 * confidence, np.where(n > 1, n - 1, np.nan))
    return float(factor) if factor.ndim == 0 else factor


def _z(confidence: float) -> float:
    return float(stats.norm.ppf(0.5 + 0.5 * confidence))
