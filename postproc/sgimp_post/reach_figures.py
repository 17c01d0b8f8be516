"""The pictures of the reach: surfaces of the deposit, and the probability of a depth along x."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Rectangle

from .reach import known_profiles
from .style import INK, acf_colour, acf_text, styled

_DEPTH_LINES = ("-", "--", ":")


@styled
def reach_figure(entry, homogeneous=None):
    """Surfaces of one case above, P(so deep or deeper at x) below, on the same x. `homogeneous`:
    the case without soil that is drawn beside it, as the median of its members."""
    figure, (top, bottom) = plt.subplots(
        2, 1, figsize=(8.4, 5.4), sharex=True, gridspec_kw={"height_ratios": [1.0, 1.25]}
    )
    tint = acf_colour(entry.acf)
    _draw_surfaces(top, entry, homogeneous, tint)
    for one, dash in zip(entry.depths, _DEPTH_LINES):
        _draw_curve(bottom, entry, one, tint, dash, f"{one.depth:.3g} m: {one.words}")
    _finish_curves(bottom, [entry])
    bottom.set_ylabel("P(depth at x), 95 % [–]")
    _legend(bottom, loc="upper left", bbox_to_anchor=(1.01, 1.0), title="this deep or deeper")
    for axis in (top, bottom):
        _mark_toe(axis, entry)
    start, end = entry.x[0], _ends([entry])[1]
    top.set_xlim(start, end + 0.03 * (end - start))
    return figure


@styled
def overview_figure(found):
    """P(so deep or deeper at x) of all cases for the least depth where it falls from one to zero,
    one panel a coefficient of variation."""
    covs = sorted({float(np.nan_to_num(entry.cov)) for entry in found})
    columns = min(3, len(covs))
    rows = -(-len(covs) // columns)
    figure, axes = plt.subplots(
        rows, columns, figsize=(11.5, 3.0 * rows + 0.5), sharex=True, sharey=True, squeeze=False
    )
    for axis, cov in zip(axes.flat, covs):
        mine = [entry for entry in found if np.nan_to_num(entry.cov) == cov]
        for entry in mine:
            same = [e.label for e in mine if e.acf == entry.acf]
            dash = _DEPTH_LINES[min(same.index(entry.label), 2)]
            text = acf_text(entry.acf) if len(same) == 1 else entry.label
            _draw_curve(
                axis, entry, entry.depths[0], acf_colour(entry.acf), dash, text, len(mine) <= 3
            )
        axis.set_title(f"COV {cov:g}" if cov > 0.0 else "")
    for axis in axes.flat[len(covs) :]:
        axis.axis("off")
    _finish_curves(axes[0, 0], found)
    axes[0, 0].set_xlim(*_ends(found))
    for axis in axes[-1]:
        axis.set_xlabel("x [m]")
    for axis in axes[:, 0]:
        axis.set_ylabel(f"P({found[0].depths[0].depth:.3g} m deep at x) [–]")
    _legend(axes[0, 0], loc="lower left")
    return figure


def _draw_surfaces(axis, entry, homogeneous, tint):
    g = entry.geometry
    if None not in (g.toe, g.initial_width, g.initial_height):
        axis.add_patch(
            Rectangle(
                (g.toe - g.initial_width, 0.0), g.initial_width, g.initial_height,
                fc="none", ec="#8795A1", lw=0.9, label="box of the body before",
            )
        )  # fmt: skip
        axis.set_ylim(0.0, 1.04 * g.initial_height)
    if entry.surfaces is not None:
        low, middle, high = entry.surfaces
        axis.fill_between(entry.x, low, high, color=tint, alpha=0.30, lw=0, label="5 to 95 %")
        axis.plot(entry.x, middle, color=tint, lw=1.4, label="median")
    same = None if homogeneous is None else known_profiles(homogeneous)
    if same is not None and same.count and same.profile_height.shape[1] == len(entry.x):
        middle = np.median(same.profile_height, axis=0)
        axis.plot(entry.x, middle, color=INK, lw=1.1, ls=(0, (4, 2)), label="homogeneous")
    axis.set_ylim(bottom=0.0)
    axis.set_ylabel("depth [m]")
    axis.set_title(f"{entry.label}, {entry.n} members")
    _legend(axis, loc="upper left", bbox_to_anchor=(1.01, 1.0))


def _draw_curve(axis, entry, one, tint, dash, text, with_band=True):
    """From the left end to the last column that a member reached."""
    drawn = one.probability > 0.0
    if not drawn.any():
        return
    shown = slice(0, np.flatnonzero(drawn)[-1] + 1)
    if with_band:
        low, high = np.maximum(one.low[shown], 0.01 / entry.n), one.high[shown]
        axis.fill_between(entry.x[shown], low, high, color=tint, alpha=0.18, lw=0)
    # Zero has no logarithm: a gap.
    p = np.where(drawn, one.probability, np.nan)[shown]
    axis.plot(
        entry.x[shown], p, color=tint, ls=dash, lw=1.4, label=text, marker=".", ms=3.5,
        markevery=np.flatnonzero(p < 1.0).tolist(),
    )  # fmt: skip


def _finish_curves(axis, found):
    axis.set_yscale("log")
    axis.set_ylim(0.5 / max(entry.n for entry in found), 1.4)
    axis.set_xlabel("x [m]")


def _legend(axis, **place):
    """Of what was drawn, if anything was."""
    if axis.get_legend_handles_labels()[0]:
        axis.legend(**place)


def _mark_toe(axis, entry):
    if entry.geometry.toe is not None:
        axis.axvline(entry.geometry.toe, color=INK, lw=0.8, ls=":")


def _ends(found):
    """From the first column that not all members of each case fill to the last that any of them
    reached, by the least depth, with a column beside."""
    starts, ends = [], []
    for entry in found:
        p = entry.depths[0].probability
        ends += entry.x[p > 0.0][-1:].tolist()
        starts += entry.x[p == p.max()][-1:].tolist()
    x = found[0].x
    width = x[1] - x[0] if len(x) > 1 else 1.0
    return min(starts, default=x[0]) - width, max(ends, default=x[-1]) + width
