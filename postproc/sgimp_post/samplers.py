"""Gaussian fields from white noise by the three methods of the program, rebuilt with NumPy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from .autocorrelation import Correlation
from .errors import PostError

#: As the program: coordinates closer than this share of the extent are the same.
_SAME_COORDINATE = 1e-9
#: As the program: points lie on a lattice if it has at most so many sites a point.
_MOST_SITES_PER_POINT = 16
#: Share of a scale of fluctuation within which a measurement is at a point.
SAME_PLACE = 1e-9
#: Share of the extent of a field within which two points are the same.
SAME_POINT = 1e-7
#: Eigenvalues of a recorded ring below minus this share of the largest are no rounding.
_ROUNDING = 1e-10


@dataclass(frozen=True)
class Points:
    """Places of a field's values, [n], and the size of their domains, in m."""

    x: np.ndarray
    y: np.ndarray
    width: np.ndarray
    height: np.ndarray

    @property
    def count(self) -> int:
        return len(self.x)


@dataclass(frozen=True)
class Lattice:
    """The tensor grid through all points: distinct x [nx], y [ny]; column and row of each point."""

    x: np.ndarray
    y: np.ndarray
    column: np.ndarray
    row: np.ndarray

    @property
    def is_lattice(self) -> bool:
        return len(self.x) * len(self.y) <= _MOST_SITES_PER_POINT * len(self.column)

    @property
    def order(self) -> np.ndarray:
        """The points in lattice order, x fastest."""
        return np.lexsort((np.arange(len(self.row)), self.column, self.row))


def find_lattice(points: Points) -> Lattice:
    extent = max(np.ptp(points.x), np.ptp(points.y))
    x, column = _distinct(points.x, _SAME_COORDINATE * extent)
    y, row = _distinct(points.y, _SAME_COORDINATE * extent)
    return Lattice(x, y, column, row)


def _distinct(values, tolerance):
    kept = []
    for value in np.unique(values).tolist():
        if not kept or value - kept[-1] > tolerance:
            kept.append(value)
    kept = np.array(kept)
    return kept, np.searchsorted(kept, values, side="right") - 1


def even_spacing(coordinates):
    """Spacing of evenly spaced coordinates with gaps (0 for one), and the place of each from 0."""
    if len(coordinates) < 2:
        return 0.0, np.zeros(len(coordinates), dtype=int)
    extent = coordinates[-1] - coordinates[0]
    spacing = extent / np.rint(extent / np.diff(coordinates).min())
    steps = (coordinates - coordinates[0]) / spacing
    if np.abs(steps - np.rint(steps)).max() > 1e-6:
        raise PostError("method 'circulant' is recorded, but the points are not evenly spaced")
    return spacing, np.rint(steps).astype(int)


def create_sampler(method: str, correlation: Correlation, points: Points, jitter=(0.0,), ring=None):
    """By the method, the jitter and the ring that the program recorded."""
    jitter = np.atleast_1d(np.asarray(jitter, dtype=float))
    if method == "kronecker":
        if not correlation.is_separable:
            raise PostError("method 'kronecker' is recorded for a field that is no product")
        return KroneckerSampler(correlation, points, jitter)
    if method == "cholesky":
        return CholeskySampler(correlation, points, float(jitter[-1]))
    if method == "circulant":
        return CirculantSampler(correlation, points, ring)
    raise PostError(f"no method is called '{method}' (known: kronecker, cholesky, circulant)")


class KroneckerSampler:
    """X = L_x Xi L_y^T on the lattice."""

    def __init__(self, correlation, points, jitter):
        self.correlation, self.lattice = correlation, find_lattice(points)
        lattice = self.lattice
        self.factor_x = _factor(_line_matrix(correlation, 0, lattice.x), float(jitter[0]))
        self.factor_y = _factor(_line_matrix(correlation, 1, lattice.y), float(jitter[-1]))
        self.count = len(lattice.x) * len(lattice.y)

    def sample(self, noise):
        """Fields [N, n] from noise [N, count]."""
        field = self.factor_y @ self._sites(noise) @ self.factor_x.T
        return field[:, self.lattice.row, self.lattice.column]

    def _sites(self, noise):
        return noise.reshape(-1, len(self.lattice.y), len(self.lattice.x))

    def product_with(self, other):
        """Covariance at each point of this field and another of the same noise."""
        along = np.einsum("ij,ij->i", self.factor_x, other.factor_x)
        across = np.einsum("ij,ij->i", self.factor_y, other.factor_y)
        return along[self.lattice.column] * across[self.lattice.row]

    def place(self, x, y):
        """Where a datum at (x, y) counts."""
        return x, y

    def extend(self, x, y):
        """B as a function of the noise, [N, count] -> [N, data], and B B^T, for data at x, y."""
        parts = []
        lines = (x, self.lattice.x, self.factor_x), (y, self.lattice.y, self.factor_y)
        for axis, (at, line, factor) in enumerate(lines):
            mixed = self.correlation.along_axis(axis, line[:, None] - at[None, :])
            solved = linalg.solve_triangular(factor, mixed, lower=True)
            # On a line of points the factor has the row already, with its jitter.
            scale = (self.correlation.scale_x, self.correlation.scale_y)[axis]
            nearest = np.abs(line[:, None] - at[None, :]).argmin(axis=0)
            on_line = np.abs(line[nearest] - at) <= SAME_PLACE * scale
            solved[:, on_line] = factor[nearest[on_line]].T
            parts.append(solved)
        along, across = parts

        def project(noise):
            return np.einsum("nji,id,jd->nd", self._sites(noise), along, across, optimize=True)

        return project, (along.T @ along) * (across.T @ across)


class CholeskySampler:
    """z = L xi, points in lattice order where they lie on a lattice."""

    def __init__(self, correlation, points, jitter):
        self.correlation = correlation
        lattice = find_lattice(points)
        self.order = np.arange(points.count)
        x, y = points.x, points.y
        if lattice.is_lattice:
            self.order = lattice.order
            x, y = lattice.x[lattice.column], lattice.y[lattice.row]
        self.x, self.y = x[self.order], y[self.order]
        self.count = points.count
        self.factor = _factor(self._matrix(), jitter)

    def _matrix(self):
        if not self.correlation.is_separable:
            return self.correlation.at(
                self.x[:, None] - self.x[None, :], self.y[:, None] - self.y[None, :]
            )
        matrix = np.ones((self.count, self.count))
        for axis, coordinates in enumerate((self.x, self.y)):
            line, which = np.unique(coordinates, return_inverse=True)
            matrix *= _line_matrix(self.correlation, axis, line)[np.ix_(which, which)]
        return matrix

    def sample(self, noise):
        field = np.empty_like(noise)
        field[:, self.order] = noise @ self.factor.T
        return field

    def product_with(self, other):
        value = np.empty(self.count)
        value[self.order] = np.einsum("ij,ij->i", self.factor, other.factor)
        return value

    def place(self, x, y):
        return x, y

    def extend(self, x, y):
        mixed = self.correlation.at(self.x[:, None] - x[None, :], self.y[:, None] - y[None, :])
        solved = linalg.solve_triangular(self.factor, mixed, lower=True)
        dx, dy = self.x[:, None] - x[None, :], self.y[:, None] - y[None, :]
        nearest = (dx**2 + dy**2).argmin(axis=0)
        data = np.arange(len(x))
        at_point = (np.abs(dx[nearest, data]) <= SAME_PLACE * self.correlation.scale_x) & (
            np.abs(dy[nearest, data]) <= SAME_PLACE * self.correlation.scale_y
        )
        solved[:, at_point] = self.factor[nearest[at_point]].T
        return lambda noise: noise @ solved, solved.T @ solved


class CirculantSampler:
    """X = H sqrt(S/(mx my)) Xi on rings of mx x my sites, cut down to the points."""

    def __init__(self, correlation, points, ring):
        self.correlation, self.lattice = correlation, find_lattice(points)
        self.points = points
        self.spacing, self.places, lengths = [], [], []
        for axis, line in enumerate((self.lattice.x, self.lattice.y)):
            spacing, place = even_spacing(line)
            shortest = max(2 * int(place.max()), 1)
            length = shortest if ring is None else int(np.ravel(ring)[axis])
            if length < shortest:
                raise PostError(f"a ring of {length} sites is recorded, {shortest} are the least")
            self.spacing.append(spacing)
            self.places.append(place)
            lengths.append(length)
        self.ring = tuple(lengths)
        self.count = lengths[0] * lengths[1]
        self.root = self._root()

    def _root(self):
        """sqrt(S/(mx my)), [my, mx]."""
        mx, my = self.ring
        if self.correlation.is_separable:
            spectra = [
                ring_spectrum(self.correlation, axis, self.ring[axis], self.spacing[axis])
                for axis in (0, 1)
            ]
            return np.sqrt(spectra[1] / my)[:, None] * np.sqrt(spectra[0] / mx)
        spectrum = plane_spectrum(self.correlation, self.ring, self.spacing)
        return np.sqrt(spectrum / (mx * my))

    def sample(self, noise):
        row, column = self.places[1][self.lattice.row], self.places[0][self.lattice.column]
        return np.concatenate([self._transform(part)[:, row, column] for part in _chunks(noise)])

    def _transform(self, noise):
        mx, my = self.ring
        field = noise.reshape(-1, my, mx) * self.root
        if not self.correlation.is_separable:
            field = np.fft.fft2(field)
            return field.real - field.imag
        for axis in (1, 2):
            field = np.fft.fft(field, axis=axis)
            field = field.real - field.imag
        return field

    def product_with(self, other):
        if other.ring != self.ring:
            return None
        return np.full(self.points.count, np.sum(self.root * other.root))

    def place(self, x, y):
        """The nearest site of the lattice."""
        return tuple(
            line[0] + spacing * at
            for line, spacing, at in zip(
                (self.lattice.x, self.lattice.y), self.spacing, self._sites(x, y)
            )
        )

    def _sites(self, x, y):
        sites = []
        for line, spacing, place, at in zip(
            (self.lattice.x, self.lattice.y), self.spacing, self.places, (x, y)
        ):
            step = np.rint((at - line[0]) / spacing) if spacing > 0.0 else 0.0 * at
            sites.append(np.clip(step, 0, place.max()).astype(int))
        return sites

    def extend(self, x, y):
        """The ring's own values at the sites; nothing is left that the noise does not fix."""
        column, row = self._sites(x, y)

        def project(noise):
            return np.concatenate(
                [self._transform(part)[:, row, column] for part in _chunks(noise)]
            )

        return project, None


def ring_spectrum(correlation, axis, length, spacing):
    """Eigenvalues [length] of the correlation matrix of one ring."""
    lag = np.minimum(np.arange(length), length - np.arange(length)) * spacing
    return _positive(np.fft.fft(correlation.along_axis(axis, lag)).real)


def plane_spectrum(correlation, ring, spacing):
    """The same [my, mx] of a torus whose correlation is no product: signed shortest lags, and the
    mean of both signs half way round."""
    mx, my = ring
    signed = [_signed_lags(mx, spacing[0]), _signed_lags(my, spacing[1])]
    total = 0.0
    for dx in signed[0]:
        for dy in signed[1]:
            total = total + 0.25 * correlation.at(dx[None, :], dy[:, None])
    return _positive(np.fft.fft2(total).real)


def _signed_lags(length, spacing):
    """Twice the lags round the ring, the one half way round with either sign."""
    k = np.arange(length)
    lag = np.where(2 * k > length, k - length, k) * spacing
    other = np.where(2 * k == length, -lag, lag)
    return lag, other


def _positive(spectrum):
    if spectrum.min() < -_ROUNDING * spectrum.max():
        raise PostError(
            f"the recorded ring has an eigenvalue of {spectrum.min():.3g}: not a valid embedding"
        )
    return np.maximum(spectrum, 0.0)


def _line_matrix(correlation, axis, line):
    return correlation.along_axis(axis, np.abs(line[:, None] - line[None, :]))


def _factor(matrix, jitter):
    """Lower Cholesky factor with the recorded jitter on the diagonal."""
    matrix[np.diag_indices_from(matrix)] += jitter
    try:
        return np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError as cause:
        raise PostError(
            f"a correlation matrix is singular to rounding here (recorded jitter {jitter:.1e})"
        ) from cause


def _chunks(noise, numbers=2_000_000):
    """Parts of the members, so that the rings of all are not in memory at once."""
    step = max(1, numbers // noise.shape[1])
    return [noise[k : k + step] for k in range(0, len(noise), step)]
