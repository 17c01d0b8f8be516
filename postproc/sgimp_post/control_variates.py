"""Control variates: what is known of the mean of a cheap companion corrects an expensive mean.

Everything is one regression. Of n independent members the value y and q controls x are known; of
the controls also estimates e of their means, with covariance matrix V (0 where a mean is known
exactly). With the slopes b of least squares

    estimate = mean(y) + b (e - mean(x)),
    error^2  = s^2 (1/n + d' S^-1 d) + b' V b,      d = e - mean(x),

s^2 the variance of the residuals with n - 1 - q degrees of freedom, S the centred cross products of
x. The term with d is the price of estimating b (Cochran, Sampling Techniques, 3rd ed. 1977,
sections 7.3 and 12.6; Lavenberg and Welch, Management Science 27, 1981, 322-335). If the control is
the same member on a coarser grid, known for M members of which the n are a part, V = s_x^2/M, which
for large n is the nested two-level estimator with the variance s_y^2/n (1 - r^2 (1 - n/M)). The
interval is Student's t with degrees of freedom by Welch and Satterthwaite from those of the two
terms.

Members must be independent: sampling='random'."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from .statistics import CONFIDENCE, FEWEST_FOR_SD, _z, kurtosis, sd_error, wilson

#: Fewest pairs a slope is estimated from.
FEWEST = 8
#: Added to the residual squares of indicators: half a pair in which fine and coarse differ, so that
#: pairs that happen to agree are not taken for pairs that always do (as the half of Jeffreys'
#: prior for a share). Without it the interval holds a P of 0.05 in 90 to 93 % of cases, with a
#: whole pair in 97 to 99 %.
HALF_A_PAIR = 0.5


@dataclass(frozen=True)
class Controls:
    """Controls of n members [n, q] with estimates [q] of their means, the covariance [q, q] of
    these, and the number of members `count` that they come from (infinite if exact)."""

    values: np.ndarray
    means: np.ndarray
    covariance: np.ndarray
    count: float

    def joined(self, other: Controls) -> Controls:
        """Both, of the same members, with estimates that are independent."""
        q, p = self.values.shape[1], other.values.shape[1]
        covariance = np.zeros((q + p, q + p))
        covariance[:q, :q], covariance[q:, q:] = self.covariance, other.covariance
        return Controls(
            np.hstack([self.values, other.values]),
            np.concatenate([self.means, other.means]),
            covariance,
            min(self.count, other.count),
        )


@dataclass(frozen=True)
class Estimate:
    """An estimate with its interval. `correlation` is the multiple one of the n values with their
    controls, `variance_ratio` the variance of the plain mean of the same n over that of this
    estimate. NaN where there are too few members or nothing to regress on."""

    n: int
    count: float
    value: float
    low: float
    high: float
    error: float
    plain: float
    plain_error: float
    correlation: float

    @property
    def variance_ratio(self) -> float:
        return (self.plain_error / self.error) ** 2 if self.error > 0.0 else np.nan


def paired_controls(paired, everyone) -> Controls:
    """One control: its values [n] in the pairs, and of all M members."""
    paired, everyone = np.asarray(paired, dtype=float), np.asarray(everyone, dtype=float)
    variance = np.var(everyone, ddof=1) / len(everyone) if len(everyone) > 1 else np.nan
    return Controls(
        paired[:, None], np.array([everyone.mean()]), np.array([[variance]]), len(everyone)
    )


def exact_controls(values, mean: float) -> Controls:
    """One control [n] whose mean is known exactly."""
    values = np.asarray(values, dtype=float)
    return Controls(values[:, None], np.array([mean]), np.zeros((1, 1)), np.inf)


def controlled_mean(
    y, controls: Controls, confidence: float = CONFIDENCE, more_residual: float = 0.0
) -> Estimate:
    """The mean of y [n] by the formulas above. `more_residual` is added to the residual sum of
    squares."""
    y, x = np.asarray(y, dtype=float), controls.values
    n, q = x.shape
    if n < FEWEST + q or np.ptp(y) == 0.0 or np.any(np.ptp(x, axis=0) == 0.0):
        return _unknown(n, controls.count)
    centred, middle = x - x.mean(axis=0), y.mean()
    slope, *_ = np.linalg.lstsq(centred, y - middle, rcond=None)
    free = n - 1 - q
    squares = float(np.sum((y - middle - centred @ slope) ** 2))
    residual = (squares + more_residual) / free
    d = controls.means - x.mean(axis=0)
    own = residual * (1.0 / n + d @ np.linalg.pinv(centred.T @ centred) @ d)
    theirs = float(slope @ controls.covariance @ slope)
    value = float(middle + slope @ d)
    error = np.sqrt(own + theirs)
    plain = float(np.var(y, ddof=1))
    terms = own**2 / free + (theirs**2 / (controls.count - 1.0) if theirs else 0.0)
    freedom = (own + theirs) ** 2 / terms if terms > 0.0 else np.inf
    half = float(stats.t.ppf(0.5 + 0.5 * confidence, freedom)) * error
    r2 = max(0.0, 1.0 - squares / (plain * (n - 1)))
    return Estimate(
        n,
        controls.count,
        value,
        value - half,
        value + half,
        float(error),
        float(middle),
        float(np.sqrt(plain / n)),
        float(np.sqrt(r2)),
    )


def controlled_probability(
    fine, paired, everyone, threshold: float, confidence: float = CONFIDENCE
) -> Estimate:
    """P(Y > threshold) with the indicator of C > t as control. t is the coarse value that lies as
    many standard deviations above the coarse mean as the threshold above the fine mean. Any fixed t
    would do: the slope makes the best of it, a bad one gains nothing. This t depends on the sample,
    but tends to a fixed one, which leaves the estimate consistent and its error to first order
    alone (indicators of half-lines are a Donsker class: van der Vaart, Asymptotic Statistics,
    1998, section 19.4). The interval is Wilson's for as many independent members as would have this
    error (Korn and Graubard, Survey Methodology 24, 1998, 193-201), n at least and M at most."""
    y, c, all_c = (np.asarray(v, dtype=float) for v in (fine, paired, everyone))
    above = (y > threshold).astype(float)
    spread = np.std(y, ddof=1) if len(y) > 1 else 0.0
    if spread == 0.0:
        return _unknown(len(y), len(all_c))
    t = all_c.mean() + np.std(all_c, ddof=1) * (threshold - y.mean()) / spread
    got = controlled_mean(above, paired_controls(c > t, all_c > t), confidence, HALF_A_PAIR)
    if not np.isfinite(got.value):  # no member or no twin beyond, or all: the twins tell nothing
        plain = wilson(int(above.sum()), len(y), confidence)
        error = np.sqrt(plain.value * (1.0 - plain.value) / len(y))
        return Estimate(
            len(y), len(all_c), plain.value, plain.low, plain.high, error, plain.value, error, 0.0
        )
    return _as_share(got, len(y), len(all_c), confidence)


def _as_share(got: Estimate, n: int, most: float, confidence: float) -> Estimate:
    p = min(1.0, max(0.0, got.value))
    count = p * (1.0 - p) / got.error**2 if got.error > 0.0 else most
    count = min(max(count, n), most)
    share = wilson(p * count, count, confidence)
    return Estimate(
        got.n,
        got.count,
        p,
        share.low,
        share.high,
        got.error,
        got.plain,
        got.plain_error,
        got.correlation,
    )


def controlled_sd(fine, paired, everyone, confidence: float = CONFIDENCE) -> Estimate:
    """The standard deviation, by the mean of n/(n - 1) (Y - mean(Y))^2 with (C - mean(C))^2, the
    mean of all M, as control. The interval is that of `sd_interval` with its error multiplied by
    sqrt(error^2/plain error^2) of the two second moments; error and plain error here are those of
    the logarithm of the variance times half the value (delta method). The kurtosis is the larger of
    those of Y and of all C: a small sample seldom shows its tail."""
    y, c, all_c = (np.asarray(v, dtype=float) for v in (fine, paired, everyone))
    n = len(y)
    if n < FEWEST_FOR_SD or len(all_c) < 2:
        return _unknown(n, len(all_c))
    middle = all_c.mean()
    got = controlled_mean(
        (y - y.mean()) ** 2 * n / (n - 1.0),
        paired_controls((c - middle) ** 2, (all_c - middle) ** 2),
        confidence,
    )
    if not got.value > 0.0:
        return _unknown(n, len(all_c))
    c_factor, error = sd_error(n, max(kurtosis(y), kurtosis(all_c)), confidence)
    shrunk = error * got.error / got.plain_error
    # c corrects the skewness of ln s^2, which shrinks with its variance.
    factor = c_factor ** (0.5 * (shrunk / error) ** 2)
    value, half = float(np.sqrt(got.value)), 0.5 * _z(confidence) * shrunk
    return Estimate(
        n,
        got.count,
        value,
        value * factor * float(np.exp(-half)),
        value * factor * float(np.exp(half)),
        0.5 * value * shrunk,
        float(np.std(y, ddof=1)),
        0.5 * value * error,
        got.correlation,
    )


def _unknown(n: int, count: float) -> Estimate:
    return Estimate(n, count, *[np.nan] * 7)


# What a twin is worth, and how many of each to run.


def predicted_gain(correlation: float, cost_ratio: float) -> float:
    """Variance of the plain mean over that of the two-level one at equal core-hours and the best
    allocation, (sqrt(1 - r^2) + sqrt(r^2/w))^-2; w is the cost of a fine member over that of its
    twin. Below 1: the twin costs more than it brings."""
    r2 = correlation**2
    return (np.sqrt(1.0 - r2) + np.sqrt(r2 / cost_ratio)) ** -2.0


def realised_gain(estimate: Estimate, cost_ratio: float) -> float:
    """The same for the numbers that were run: the n fine members and M twins cost as much as
    n + M/w fine ones."""
    members = estimate.n + estimate.count / cost_ratio
    return estimate.variance_ratio * estimate.n / members


def best_ratio(correlation: float, cost_ratio: float) -> float:
    """Twins a fine member, M/n. In units of s_y^2 the variance is V = (1 - r^2)/n + r^2/M, in units
    of a twin the cost is K = w n + M. Setting the derivatives of V + a K to zero gives
    (1 - r^2)/n^2 = a w and r^2/M^2 = a, so M/n = sqrt(w r^2/(1 - r^2)); 1 at least, as each
    fine member needs its own twin."""
    r2 = min(correlation**2, 1.0 - 1e-12)
    return max(1.0, float(np.sqrt(cost_ratio * r2 / (1.0 - r2))))


def allocate_for_half_width(
    sd: float, correlation: float, cost_ratio: float, half_width: float,
    confidence: float = CONFIDENCE,
):  # fmt: skip
    """(n, M) at which the interval of the mean is +- half_width:
    n = (z s/h)^2 ((1 - r^2) + r^2 n/M)."""
    ratio, r2 = best_ratio(correlation, cost_ratio), correlation**2
    n = (_z(confidence) * sd / half_width) ** 2 * ((1.0 - r2) + r2 / ratio)
    return _whole(n, ratio)


def allocate_for_cost(correlation: float, cost_ratio: float, fine_members: float):
    """(n, M) that cost as much as so many fine members: n = budget/(1 + (M/n)/w)."""
    ratio = best_ratio(correlation, cost_ratio)
    n = int(fine_members / (1.0 + ratio / cost_ratio))
    return n, max(n, int((fine_members - n) * cost_ratio))


def _whole(n: float, ratio: float):
    fine = max(FEWEST + 1, int(np.ceil(n)))
    return fine, max(fine, int(np.ceil(n * ratio)))
