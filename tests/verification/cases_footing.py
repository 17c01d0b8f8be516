"""Case 15: the limit pressure of a strip footing, with and without the remedy for locking."""

import numpy as np
from judge import between, note

STRENGTH, HALF_WIDTH = 1000.0, 1.0
LIMIT = (2.0 + np.pi) * STRENGTH


def pressure(result):
    """Mean reaction over the last fifth of the run, per width, in Pa."""
    force = -result.history["reaction"][:, 1]
    return force[-len(force) // 5 :].mean() / HALF_WIDTH


def footing(bench):
    """Prandtl: (2 + pi) c. The nodes at the edge widen the footing by up to half a cell each side: +3 % here."""
    why = "demand of the case; half a cell of width is 3 %"
    yield between("pressure, Pa", 0.98 * LIMIT, 1.05 * LIMIT, pressure(bench.run("footing")), why)
    coarse = {"grid.cell_size": 0.125}
    yield note("pressure with cells of 0.125 m, Pa", pressure(bench.run("footing", coarse)), "grid")
    locked = pressure(bench.run("footing", {"solver.anti_locking": "none"}))
    yield note("pressure without the remedy, Pa", locked, f"locking: {locked / LIMIT - 1:+.0%} of the limit")
