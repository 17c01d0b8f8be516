"""The picture of the members that stand for a case: the ground of each and where it came to
rest."""

from __future__ import annotations

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Rectangle

from .field_figures import bounding_box, draw_map
from .style import INK, OTHER, axis_label, styled

#: Red strong, blue weak; grey what is not a number. Few shades: of noise in 256 colours a picture
#: takes twice the bytes and shows no more.
FIELD_COLOURS = matplotlib.colormaps["RdYlBu_r"].resampled(8).with_extremes(bad="#B4BEC6")
#: A field whose spread is below this share of its mean is homogeneous ground with its jitter
#: (1e-6), in one colour and without a bar.
UNIFORM = 1e-4

#: Inches: most width of the picture and height of a row, what is not drawn on beside and between.
_WIDTH, _HEIGHT, _MARGIN, _GAP = 7.0, 1.9, 1.6, 0.30


@styled
def member_figure(case, members, fields: dict, deposits: dict):
    """One row a member of `members` (QuantileMember). Left the random field at the initial places
    of the points (Field, by id in `fields`), missing if no member has one. Right the deposit: the
    points of its last state (Field, by id in `deposits`), else the stored profile, over the body as
    it was (its bounding box). The dashed line is the front. None without members."""
    if not members:
        return None
    fields, deposits = (
        {m.id: found[m.id] for m in members if found.get(m.id) is not None}
        for found in (fields, deposits)
    )
    x, y = _extent(case, members, deposits)
    box = bounding_box(next(iter(fields.values())).points) if fields else None
    if box:
        y = min(y[0], box[2]), max(y[1], box[3])
    widths = [box[1] - box[0], x[1] - x[0]] if box else [x[1] - x[0]]
    scale = min((_WIDTH - _MARGIN) / sum(widths), _HEIGHT / (y[1] - y[0]))  # inches a metre
    figure, axes = plt.subplots(
        len(members),
        len(widths),
        figsize=(
            _MARGIN + scale * sum(widths),
            0.45 + (scale * (y[1] - y[0]) + _GAP) * len(members),
        ),
        squeeze=False,
        sharex="col",
        sharey=True,
        gridspec_kw={"width_ratios": widths},
    )
    colours = _colours(list((fields or deposits).values()))
    for line, member in zip(axes, members):
        if box:
            _draw_field(line[0], fields.get(member.id), colours)
            line[0].set_xlim(box[0], box[1])
        _draw_deposit(line[-1], case, member, deposits.get(member.id), colours, 72.0 * scale)
        line[-1].set_xlim(x)
        line[-1].set_ylim(y)
        line[-1].set_title(f"{member.name}: member {member.id}, {member.value:.3f} m")
    for axis in axes.flat:
        axis.set_aspect("equal")
        axis.grid(False)
    for axis in axes[-1]:
        axis.set_xlabel("x [m]")
    for axis in axes[:, 0]:
        axis.set_ylabel("y [m]")
    if colours:
        figure.colorbar(colours["mappable"], ax=list(axes.flat), label=colours["label"],
                        extend="both", pad=0.01, aspect=30, fraction=0.03)  # fmt: skip
    return figure


def _extent(case, members, deposits):
    """Limits of x and y that hold the bodies, fronts and deposits, in m."""
    g = case.geometry
    toe, base = g.toe or 0.0, g.y_min or 0.0
    right = [toe + member.value for member in members]
    left, top = [toe - (g.initial_width or 0.0)], [base + (g.initial_height or 0.0)]
    for member in members:
        depth = profile_of(case, member.id)
        if depth is not None and (depth > 0.0).any():
            right.append(case.profile_x[depth > 0.0].max())
            left.append(case.profile_x[depth > 0.0].min())
            top.append(base + depth.max())
    for deposit in deposits.values():
        right.append(deposit.points.x.max())
        left.append(deposit.points.x.min())
        top.append(deposit.points.y.max())
    margin = 0.02 * max(max(right) - min(left), 1e-3)
    return (min(left), max(right) + margin), (base, max(*top, base + margin) + margin)


def profile_of(case, member: int):
    """Depth [nx] of the final deposit of a member in m; None if it is not known."""
    if case.profile_height is None:
        return None
    depth = case.profile_height[case.id == member][0]
    return depth if np.isfinite(depth).all() else None


def _colours(fields) -> dict:
    """The scale that these fields share: mappable, label and the factor of its unit; empty for
    homogeneous ground."""
    if not fields:
        return {}
    values = np.concatenate([field.values[np.isfinite(field.values)] for field in fields])
    if len(values) == 0 or np.ptp(values) <= UNIFORM * np.abs(values).mean():
        return {}
    low, high = np.quantile(values, [0.005, 0.995])
    label, factor = axis_label(fields[0], float(np.mean(values)))
    norm = matplotlib.colors.Normalize(low / factor, high / factor)
    return {
        "mappable": matplotlib.cm.ScalarMappable(norm, FIELD_COLOURS),
        "label": label,
        "factor": factor,
    }


def _draw_field(axis, field, colours):
    if field is None:
        _say(axis, "no field")
        return
    norm = colours["mappable"].norm if colours else None
    low, high = (norm.vmin, norm.vmax) if norm else (0.0, 1.0)
    drawn = draw_map(axis, field.points, field.values / colours.get("factor", 1.0), low, high)
    drawn.set_cmap(FIELD_COLOURS)


def _draw_deposit(axis, case, member, deposit, colours, points_per_metre):
    g = case.geometry
    depth = profile_of(case, member.id)
    base = g.y_min or 0.0
    if deposit is not None:
        draw_points(axis, deposit, colours, points_per_metre)
    elif depth is not None:
        _draw_profile(axis, case.profile_x, base, depth)
    else:
        _say(axis, "no profile and no state of this member")
    draw_outline(axis, g)
    if g.toe is not None:
        axis.axvline(g.toe + member.value, color=INK, lw=1.0, ls=(0, (4, 2)))


def _draw_profile(axis, x, base, depth):
    """Columns around x [nx], of which those without deposit are not drawn."""
    covered = np.flatnonzero(depth > 0.0)
    if len(covered) == 0:
        return
    drawn = slice(covered[0], covered[-1] + 1)
    half = 0.5 * (x[1] - x[0]) if len(x) > 1 else 0.5
    edges = np.append(x[drawn] - half, x[drawn][-1] + half)
    axis.stairs(base + depth[drawn], edges, baseline=base, fill=True, color=OTHER, alpha=0.45)


def draw_points(axis, field, colours, points_per_metre):
    """A point cloud, rasterized: a picture in a picture instead of thousands of marks."""
    size = float(np.max(field.points.width, initial=0.0)) * points_per_metre
    tint = {"color": OTHER}
    if colours:
        mappable = colours["mappable"]
        values = field.values / colours["factor"]
        tint = {"c": values, "cmap": mappable.cmap, "norm": mappable.norm, "plotnonfinite": True}
    axis.scatter(
        field.points.x,
        field.points.y,
        s=max(0.9 * size**2, 0.3),
        marker="s",
        lw=0,
        rasterized=True,
        **tint,
    )


def draw_outline(axis, geometry):
    """Bounding box of the body as it was, where the file says it."""
    g = geometry
    if None in (g.toe, g.initial_width, g.initial_height):
        return
    corner = g.toe - g.initial_width, g.y_min or 0.0
    axis.add_patch(
        Rectangle(corner, g.initial_width, g.initial_height, fill=False, ec=INK, lw=0.9, ls=":")
    )


def _say(axis, words: str):
    axis.text(0.5, 0.5, words, ha="center", va="center", transform=axis.transAxes)
