"""Autocorrelation functions of the Gaussian fields, at points and as averages over cells. Written
from the formulas, not from the program, so that the one can be held against the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import special

from .errors import PostError

ACF_NAMES = ("snx", "sqx", "smk", "csx", "bin", "matern32", "matern52", "matern", "spherical")

#: Lags, in scales of fluctuation, at which a function has a kink besides 0.
_KINKS = {"bin": 1.0, "spherical": 4.0 / 3.0}
#: Nodes of Gauss and Legendre a piece, and the longest piece in scales of fluctuation. Every rho is
#: analytic between its kinks with its nearest singularity more than a piece away, or (matern) a
#: power of the lag, which the substitution t = u^4 turns into one high enough for the rule.
_NODES = 24
_LONGEST_PIECE = 0.5
#: Lags equal to this share of the scale are one lag: rho then differs by less than 1e-12.
_SAME_LAG = 1e-13


def rho(acf: str, t, smoothness: float = 0.5):
    """Correlation at the lag t >= 0 in scales of fluctuation: 2 * integral over t >= 0 is 1."""
    t = np.asarray(t, dtype=float)
    if acf == "snx":
        return np.exp(-2.0 * t)
    if acf == "sqx":
        return np.exp(-np.pi * t**2)
    if acf in ("smk", "matern32"):
        return (1.0 + 4.0 * t) * np.exp(-4.0 * t)
    if acf == "csx":
        return np.exp(-t) * np.cos(t)
    if acf == "bin":
        return np.maximum(1.0 - t, 0.0)
    if acf == "matern52":
        z = 16.0 / 3.0 * t
        return (1.0 + z + z**2 / 3.0) * np.exp(-z)
    if acf == "matern":
        return _matern(t, smoothness)
    if acf == "spherical":
        r = np.minimum(0.75 * t, 1.0)
        return 1.0 - 1.5 * r + 0.5 * r**3
    raise PostError(
        f"no autocorrelation function is called '{acf}' (known: {', '.join(ACF_NAMES)})"
    )


def _matern(t, nu):
    z = 2.0 * np.sqrt(np.pi) * np.exp(special.gammaln(nu + 0.5) - special.gammaln(nu)) * t
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        scale = np.exp((1.0 - nu) * np.log(2.0) - special.gammaln(nu) + nu * np.log(z) - z)
        value = scale * special.kve(nu, z)
    # Where K overflows, z is so small against nu that the series of K has only its finite part.
    series, term = np.ones_like(z), np.ones_like(z)
    for k in range(1, 12):
        if k >= nu:
            break
        term = -term * 0.25 * z**2 / (k * (nu - k))
        series = series + term
    return np.where(np.isfinite(value) & (z > 0.0), value, series)


def average_correlation(acf, lag, a, b, scale, smoothness=0.5):
    """Covariance of two averages of the unit field along one axis, over the lengths a and b whose
    centres are `lag` apart (arrays of one shape, in m): the integral of rho(lag + s) k(s)/(a b)
    with k(s) the overlap of the lengths shifted by s. A length of 0 is a point."""
    shape = np.broadcast(lag, a, b).shape
    rows = [np.broadcast_to(np.abs(v), shape).ravel() for v in (lag, a, b)]
    keys = np.round(np.column_stack(rows) / (_SAME_LAG * scale))
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    values = [
        _average_pair(acf, *(row[k] for row in rows), scale, smoothness) for k in first.tolist()
    ]
    return np.asarray(values)[np.ravel(inverse)].reshape(shape)


def _average_pair(acf, lag, a, b, scale, smoothness):
    reach, core, low = 0.5 * (a + b), 0.5 * abs(a - b), min(a, b)
    if reach == 0.0:
        return float(rho(acf, lag / scale, smoothness))
    kinks = [0.0]
    if acf in _KINKS:
        kinks += [_KINKS[acf] * scale, -_KINKS[acf] * scale]
    ends = {-reach, -core, core, reach} | {kink - lag for kink in kinks}
    ends = np.array(sorted(end for end in ends if -reach <= end <= reach))
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    nodes, weights = 0.5 * (nodes + 1.0), 0.5 * weights
    total = 0.0
    for left, right in zip(ends[:-1], ends[1:]):
        count = max(1, int(np.ceil((right - left) / (_LONGEST_PIECE * scale))))
        cuts = np.linspace(left, right, count + 1)
        for begin, end in zip(cuts[:-1], cuts[1:]):
            length = end - begin
            if abs(begin + lag) <= 1e-14 * scale:  # the lag 0 at the left end of the piece
                t, w = length * nodes**4, 4.0 * length * nodes**3 * weights
                s, distance = begin + t, t
            elif abs(end + lag) <= 1e-14 * scale:
                t, w = length * nodes**4, 4.0 * length * nodes**3 * weights
                s, distance = end - t, t
            else:
                s, w = begin + length * nodes, length * weights
                distance = np.abs(s + lag)
            # With a length of 0 the overlap over it is 1 within the other length.
            overlap = np.clip((reach - np.abs(s)) / low, 0.0, 1.0) if low > 0.0 else 1.0
            total += float(np.sum(w * overlap * rho(acf, distance / scale, smoothness)))
    return total / max(a, b)


@dataclass(frozen=True)
class Correlation:
    """Of the Gaussian field between two places; scales in m, the bedding's angle in degrees. With a
    `cell` (width, height) in m it is the covariance of averages over such cells."""

    acf: str
    scale_x: float
    scale_y: float
    form: str = "product"
    rotation: float = 0.0
    smoothness: float = 0.5
    cell: tuple = (0.0, 0.0)

    @property
    def is_separable(self) -> bool:
        """A function of dx times one of dy; SQX is, as a function of the distance, too."""
        return (self.form == "product" or self.acf == "sqx") and self.rotation == 0.0

    def at(self, dx, dy):
        """Between places dx, dy apart."""
        if self.is_separable:
            return self.along_axis(0, dx) * self.along_axis(1, dy)
        if any(self.cell):
            raise PostError("averages over cells are for fields of the product form, not turned")
        dx, dy = np.asarray(dx, dtype=float), np.asarray(dy, dtype=float)
        angle = np.deg2rad(self.rotation)
        cos, sin = np.cos(angle), np.sin(angle)
        tx = np.abs(cos * dx + sin * dy) / self.scale_x
        ty = np.abs(cos * dy - sin * dx) / self.scale_y
        if self.form == "radial":
            return rho(self.acf, np.hypot(tx, ty), self.smoothness)
        return rho(self.acf, tx, self.smoothness) * rho(self.acf, ty, self.smoothness)

    def along_axis(self, axis: int, lag):
        """The factor of x (axis 0) or y (1)."""
        scale, size = (self.scale_x, self.scale_y)[axis], self.cell[axis]
        if size == 0.0:
            return rho(self.acf, np.abs(lag) / scale, self.smoothness)
        return average_correlation(self.acf, lag, size, size, scale, self.smoothness)

    @property
    def variance(self) -> float:
        """Of a value: 1, or what averaging leaves of it."""
        return float(self.at(0.0, 0.0))
