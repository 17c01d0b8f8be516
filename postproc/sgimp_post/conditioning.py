"""Fields that know measurements: z_c(x) = z(x) + c(x, data) G^-1 (z_d - z(x_d) - e_d)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

#: Variance of a datum that the points leave open, below which it is rounding: the datum lies on a
#: point.
OPEN_VARIANCE = 1e-12


@dataclass(frozen=True)
class Data:
    """Measurements of one field, [d]: places in m, values and the standard deviations of their
    errors in the unit of the property."""

    x: np.ndarray
    y: np.ndarray
    value: np.ndarray
    error: np.ndarray

    @property
    def count(self) -> int:
        return len(self.x)


def pivoted_factor(matrix, tolerance=OPEN_VARIANCE):
    """S [d, d] with S S^T the matrix, pivoted; columns beyond the rank are 0."""
    matrix = np.array(matrix, dtype=float, order="F")
    if matrix.size == 0 or np.diag(matrix).max() <= tolerance:
        return np.zeros_like(matrix)
    factor, pivots, rank, _ = linalg.lapack.dpstrf(matrix, tol=tolerance, lower=1)
    factor = np.tril(factor)
    factor[:, rank:] = 0.0
    result = np.empty_like(factor)
    result[pivots - 1] = factor
    return result


def weights_of_data(gram, misfit):
    """G^-1 misfit, [d, N]; of the least norm where data repeat each other."""
    try:
        return linalg.cho_solve(linalg.cho_factor(gram, lower=True), misfit)
    except linalg.LinAlgError:
        return np.linalg.lstsq(gram, misfit, rcond=None)[0]
