"""The pictures of which soil decides: correlation of the runout with the field over the body."""

from __future__ import annotations

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import Normalize, to_rgba

from .field_figures import bounding_box, cell_edges
from .samplers import find_lattice
from .style import INK, PROPERTY_TEXTS, styled

#: Orange where weak soil lets it run farther, purple where strong soil does; told apart by
#: colour-blind readers, and unlike the colours of the fields themselves.
COLOURS = "PuOr"
_GREY = "#D9DFE3"
#: Share of grey in the colour of a point that is not marked.
_VEIL = 0.75
#: Columns of blocks at most for a number in each.
_MOST_NUMBERED = 8


def shared_limit(maps: list) -> float:
    """The end of the one scale of all maps: their largest correlation, rounded up."""
    largest = [
        np.nanmax(np.abs(values), initial=0.0)
        for one in maps
        for values in (one.points.correlation, one.block_map.correlation)
    ]
    return float(np.ceil(10.0 * max(largest, default=1.0)) / 10.0) or 0.1


@styled
def soil_map_figure(one, limit: float):
    """Points, blocks, and the blocks of either half of the members, on the scale +- `limit`."""
    left, right, bottom, top = bounding_box(one.body)
    aspect = (top - bottom) / (right - left)
    figure, axes = plt.subplots(
        1,
        4,
        figsize=(11.5, 0.95 + 3.1 * min(max(aspect, 0.4), 1.6)),
        gridspec_kw={"width_ratios": [1.0, 1.0, 0.6, 0.6]},
    )
    scale = Normalize(-limit, limit)
    _draw_points(axes[0], one.body, one.points, scale)
    _draw_blocks(axes[1], one.blocks, one.block_map.correlation, scale, one.block_map.marked)
    _draw_blocks(axes[2], one.blocks, one.block_map.odd, scale)
    _draw_blocks(axes[3], one.blocks, one.block_map.even, scale)
    name = PROPERTY_TEXTS.get(one.spec.property, one.spec.property)
    titles = f"{name} at points", "means of blocks", "odd ids", "even ids"
    for axis, title in zip(axes, titles):
        axis.set_title(title)
        axis.grid(False)
        axis.set_aspect("equal")
        axis.set_xlim(left, right)
        axis.set_ylim(bottom, top)
        axis.set_xlabel("x [m]")
    axes[0].set_ylabel("y [m]")
    colours = matplotlib.cm.ScalarMappable(scale, COLOURS)
    bar = figure.colorbar(
        colours, ax=list(axes), label="correlation with runout [–]", pad=0.015, fraction=0.03,
        aspect=25, shrink=0.85,
    )  # fmt: skip
    bar.outline.set_edgecolor("#8795A1")
    return figure


def _draw_points(axis, points, found, scale):
    """Points that are not marked are veiled in grey."""
    colours = matplotlib.colormaps[COLOURS](scale(np.nan_to_num(found.correlation)))
    grey = np.array(to_rgba(_GREY))
    colours = np.where(found.marked[:, None], colours, _VEIL * grey + (1.0 - _VEIL) * colours)
    lattice = find_lattice(points)
    if lattice.is_lattice and min(len(lattice.x), len(lattice.y)) > 1:
        picture = np.ones((len(lattice.y), len(lattice.x), 4))
        picture[lattice.row, lattice.column] = colours
        x, y = cell_edges(lattice.x), cell_edges(lattice.y)
        axis.imshow(
            picture, extent=(x[0], x[-1], y[0], y[-1]), origin="lower", interpolation="none"
        )
    else:
        axis.scatter(points.x, points.y, c=colours, s=6, lw=0, rasterized=True)


def _draw_blocks(axis, blocks, correlation, scale, marked=None):
    """Blocks that are not marked, where that is known, are hatched; others have their number."""
    colours = matplotlib.colormaps[COLOURS]
    has_numbers = marked is not None and len(blocks.x_edges) - 1 <= _MOST_NUMBERED
    for k, (column, row) in enumerate(blocks.place):
        x, y = blocks.x_edges[column : column + 2], blocks.y_edges[row : row + 2]
        is_hatched = marked is not None and not marked[k]
        axis.add_patch(
            plt.Rectangle(
                (x[0], y[0]), x[1] - x[0], y[1] - y[0], fc=colours(scale(correlation[k])),
                ec="#B4BEC6" if is_hatched else "white", lw=0.4, hatch="////" if is_hatched else "",
            )
        )  # fmt: skip
        if has_numbers and marked[k]:
            axis.text(
                x.mean(), y.mean(), f"{correlation[k]:.2f}".replace("-", "−"),
                ha="center", va="center", fontsize=7.5,
                color="white" if abs(correlation[k]) > 0.75 * scale.vmax else INK,
            )  # fmt: skip
