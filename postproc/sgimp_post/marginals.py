"""From the Gaussian field to the property and back: F^-1(Phi(z)) and its inverse, each tail by its
own function so that no digit is lost to 1 - p."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import optimize, special, stats

from .errors import PostError

LAWS = (
    "normal",
    "lognormal",
    "truncated_normal",
    "beta",
    "gamma",
    "gumbel",
    "weibull",
    "uniform",
)
#: Laws whose bounds are the ends of the law; the others are set to the bound where they pass it.
BOUNDED = ("truncated_normal", "beta")
#: The Gaussian is cut off here in integrals: the noise itself stays within 8.2.
_REACH = 8.3
_NODES = 96


@dataclass(frozen=True)
class Marginal:
    """One law a point: `mean`, `sd` [n] (before clipping; of the parent of truncated_normal)."""

    distribution: str
    mean: np.ndarray
    sd: np.ndarray
    lower: float
    upper: float

    def __post_init__(self):
        if self.distribution not in LAWS:
            raise PostError(
                f"no distribution is called '{self.distribution}' (known: {', '.join(LAWS)})"
            )
        object.__setattr__(self, "mean", np.asarray(self.mean, dtype=float))
        object.__setattr__(self, "sd", np.asarray(self.sd, dtype=float))

    @property
    def is_clipping(self) -> bool:
        return self.distribution not in BOUNDED

    def select(self, keep) -> Marginal:
        """The laws of some of the points."""
        return Marginal(self.distribution, self.mean[keep], self.sd[keep], self.lower, self.upper)

    def unclipped(self, z):
        """Value at the Gaussian z [..., n] before the bounds are applied."""
        return _QUANTILES[self.distribution](self, np.asarray(z, dtype=float))

    def values(self, z):
        """Value at the Gaussian z [..., n]."""
        value = self.unclipped(z)
        return np.clip(value, self.lower, self.upper) if self.is_clipping else value

    def clipped(self, z):
        """Mask of what is set to a bound."""
        value = self.unclipped(z)
        return ((value < self.lower) | (value > self.upper)) & self.is_clipping

    def gaussian(self, value):
        """z at which the law has this value: the inverse of `values` within the bounds."""
        value = np.asarray(value, dtype=float)
        if self.distribution == "normal":
            return (value - self.mean) / self.sd
        if self.distribution == "lognormal":
            location, spread = self._lognormal()
            with np.errstate(divide="ignore", invalid="ignore"):
                return (np.log(value) - location) / spread
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            p, q = _PROBABILITIES[self.distribution](self, value)
            return np.where(p <= q, special.ndtri(p), -special.ndtri(q))

    def slope(self, z):
        """d value/dz = phi(z)/f(value)."""
        z = np.asarray(z, dtype=float)
        if self.distribution == "normal":
            return self.sd + 0.0 * z
        if self.distribution == "lognormal":
            return self._lognormal()[1] * self.unclipped(z)
        normal = np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)
        if self.distribution == "beta":  # from the distance to the nearer end, not from the value
            a, b = self._beta()
            t, rest = _beta_parts(self, z)
            log_density = special.xlogy(a - 1.0, t) + special.xlogy(b - 1.0, rest)
            return normal * (self.upper - self.lower) / np.exp(log_density - special.betaln(a, b))
        return normal / self._density(self.unclipped(z))

    def _density(self, value):
        if self.distribution == "truncated_normal":
            a, b = self._ends()
            return stats.norm.pdf(value, self.mean, self.sd) / _between(a, b)
        if self.distribution == "gamma":
            shape, scale = self._gamma()
            return stats.gamma.pdf(value, shape, scale=scale)
        if self.distribution == "gumbel":
            location, scale = self._gumbel()
            return stats.gumbel_r.pdf(value, location, scale)
        if self.distribution == "weibull":
            shape, scale = self._weibull()
            return stats.weibull_min.pdf(value, shape, scale=scale)
        return 1.0 / (2.0 * np.sqrt(3.0) * self.sd) + 0.0 * value

    def moments(self, location=0.0, variance=1.0):
        """Mean, variance and clipped share of the value where z is normal with this mean and
        variance [n]; by quadrature between the bounds, which is exact to rounding."""
        n = np.broadcast(self.mean, location, variance).shape
        rows = [np.broadcast_to(v, n).ravel() for v in (self.mean, self.sd, location, variance)]
        rows, inverse = np.unique(np.column_stack(rows), axis=0, return_inverse=True)
        law = Marginal(self.distribution, *rows[:, :2].T, self.lower, self.upper)
        middle, spread = rows[:, 2], np.sqrt(np.maximum(rows[:, 3], 0.0))
        low, high = middle - _REACH * spread, middle + _REACH * spread
        share = np.zeros(len(rows))
        shares = np.zeros((2, len(rows)))
        if self.is_clipping:
            with np.errstate(divide="ignore", invalid="ignore"):
                cuts = [
                    _cut(law, bound, sign) for bound, sign in ((self.lower, -1), (self.upper, 1))
                ]
                shares[0] = special.ndtr((cuts[0] - middle) / spread)
                shares[1] = special.ndtr((middle - cuts[1]) / spread)
            shares = np.where(spread > 0.0, shares, 0.0)
            share = shares.sum(axis=0)
            low, high = np.clip(cuts[0], low, high), np.clip(cuts[1], low, high)
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        z = 0.5 * (low + high) + 0.5 * (high - low) * nodes[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.where(spread > 0.0, (z - middle) / spread, 0.0)
            density = np.exp(-0.5 * u**2) / np.sqrt(2.0 * np.pi)
            density = np.where(spread > 0.0, density * 0.5 * (high - low) / spread, 0.0)
        w = weights[:, None] * density
        value = law.values(z)
        reference = law.values(middle)
        ends = [
            np.where(shares[k] > 0.0, bound - reference, 0.0)
            for k, bound in enumerate((self.lower, self.upper))
        ]
        first = (w * (value - reference)).sum(axis=0) + (shares * ends).sum(axis=0)
        second = (w * (value - reference) ** 2).sum(axis=0) + (shares * np.square(ends)).sum(axis=0)
        inverse = np.ravel(inverse)
        pick = [v[inverse].reshape(n) for v in (reference + first, second - first**2, share)]
        return pick[0], np.maximum(pick[1], 0.0), pick[2]

    # Parameters of the laws from mean and standard deviation.

    def _lognormal(self):
        spread = np.sqrt(np.log1p((self.sd / self.mean) ** 2))
        return np.log(self.mean) - 0.5 * spread**2, spread

    def _ends(self):
        return (self.lower - self.mean) / self.sd, (self.upper - self.mean) / self.sd

    def _beta(self):
        length = self.upper - self.lower
        m, v = (self.mean - self.lower) / length, (self.sd / length) ** 2
        k = m * (1.0 - m) / v - 1.0
        return m * k, (1.0 - m) * k

    def _gamma(self):
        return (self.mean / self.sd) ** 2, self.sd**2 / self.mean

    def _gumbel(self):
        scale = self.sd * np.sqrt(6.0) / np.pi
        return self.mean - np.euler_gamma * scale, scale

    def _weibull(self):
        cov, inverse = np.unique(self.sd / self.mean, return_inverse=True)
        shape = np.array([_weibull_shape(one) for one in cov.tolist()])
        shape = shape[np.ravel(inverse)].reshape(np.shape(self.mean))
        return shape, self.mean / special.gamma(1.0 + 1.0 / shape)


def _cut(law, bound, sign):
    """z beyond which the law passes the bound; infinite where it never does."""
    if not np.isfinite(bound):
        return np.full(len(law.mean), sign * np.inf)
    z = law.gaussian(bound)
    # A bound outside the support of the law has no z: the law never comes so far.
    return np.where(np.isnan(z), sign * np.inf, z)


def _between(a, b):
    """Phi(b) - Phi(a) for a < b, without cancellation."""
    flip = a > 0.0
    return np.where(flip, special.ndtr(-a) - special.ndtr(-b), special.ndtr(b) - special.ndtr(a))


def _weibull_shape(cov: float) -> float:
    def excess(k):
        return special.gammaln(1.0 + 2.0 / k) - 2.0 * special.gammaln(1.0 + 1.0 / k) - target

    target = np.log1p(cov**2)
    return optimize.brentq(excess, 0.05, 1.0e4, xtol=1e-15, rtol=4.0 * np.finfo(float).eps)


def _log_ndtr(z):
    """log Phi(z); SciPy's own takes the logarithm of a number near 1 for z of 1 to 6."""
    return np.where(z > 0.0, np.log1p(-special.ndtr(-np.abs(z))), special.log_ndtr(z))


def _truncated_quantile(law, z):
    a, b = law._ends()
    whole = _between(a, b)
    p = special.ndtr(a) + special.ndtr(z) * whole
    q = special.ndtr(-b) + special.ndtr(-z) * whole
    x = np.where(p <= q, special.ndtri(p), -special.ndtri(q))
    return np.clip(law.mean + law.sd * x, law.lower, law.upper)


def _truncated_probability(law, value):
    a, b = law._ends()
    x, whole = (value - law.mean) / law.sd, _between(a, b)
    return _between(a, x) / whole, _between(x, b) / whole


def _beta_quantile(law, z):
    t, rest = _beta_parts(law, z)
    length = law.upper - law.lower
    return np.where(z <= 0.0, law.lower + length * t, law.upper - length * rest)


def _beta_parts(law, z):
    """Quantile on [0, 1] and its distance from 1, the smaller probability telling both."""
    a, b = law._beta()
    low = stats.beta.ppf(special.ndtr(np.minimum(z, 0.0)), a, b)
    high = stats.beta.ppf(special.ndtr(-np.maximum(z, 0.0)), b, a)
    return np.where(z <= 0.0, low, 1.0 - high), np.where(z <= 0.0, 1.0 - low, high)


def _beta_probability(law, value):
    a, b = law._beta()
    length = law.upper - law.lower
    return (
        special.betainc(a, b, np.clip((value - law.lower) / length, 0.0, 1.0)),
        special.betainc(b, a, np.clip((law.upper - value) / length, 0.0, 1.0)),
    )


def _gamma_quantile(law, z):
    shape, scale = law._gamma()
    low = special.gammaincinv(shape, special.ndtr(np.minimum(z, 0.0)))
    high = special.gammainccinv(shape, special.ndtr(-np.maximum(z, 0.0)))
    return scale * np.where(z <= 0.0, low, high)


def _gamma_probability(law, value):
    shape, scale = law._gamma()
    x = np.maximum(value, 0.0) / scale
    return special.gammainc(shape, x), special.gammaincc(shape, x)


def _gumbel_quantile(law, z):
    location, scale = law._gumbel()
    return location - scale * np.log(-_log_ndtr(z))


def _gumbel_probability(law, value):
    location, scale = law._gumbel()
    exponent = -np.exp(-(value - location) / scale)
    return np.exp(exponent), -np.expm1(exponent)


def _weibull_quantile(law, z):
    shape, scale = law._weibull()
    return scale * (-_log_ndtr(-z)) ** (1.0 / shape)


def _weibull_probability(law, value):
    shape, scale = law._weibull()
    exponent = -((np.maximum(value, 0.0) / scale) ** shape)
    return -np.expm1(exponent), np.exp(exponent)


def _uniform_probability(law, value):
    half = np.sqrt(3.0) * law.sd
    x = np.clip((value - law.mean) / half, -1.0, 1.0)
    return 0.5 * (1.0 + x), 0.5 * (1.0 - x)


def _lognormal_quantile(law, z):
    location, spread = law._lognormal()
    return np.exp(location + spread * z)


_QUANTILES = {
    "normal": lambda law, z: law.mean + law.sd * z,
    "lognormal": _lognormal_quantile,
    "truncated_normal": _truncated_quantile,
    "beta": _beta_quantile,
    "gamma": _gamma_quantile,
    "gumbel": _gumbel_quantile,
    "weibull": _weibull_quantile,
    "uniform": lambda law, z: law.mean + np.sqrt(3.0) * law.sd * special.erf(z / np.sqrt(2.0)),
}
_PROBABILITIES = {
    "truncated_normal": _truncated_probability,
    "beta": _beta_probability,
    "gamma": _gamma_probability,
    "gumbel": _gumbel_probability,
    "weibull": _weibull_probability,
    "uniform": _uniform_probability,
}
