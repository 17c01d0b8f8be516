"""The pictures of the audit: fields as maps, correlation against target, QQ plots."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from .samplers import find_lattice
from .style import INK, acf_colour, acf_text, axis_label, styled

#: Members whose fields are drawn.
SHOWN_MEMBERS = 4

_COV_MARKERS = ("o", "s", "^", "D", "v")
_DOTS = {"marker": "o", "ls": "", "ms": 3.4, "mec": INK, "mfc": "white", "mew": 0.9}


@styled
def maps_figure(spec, rows):
    """One row a case, `rows` = [(case, acf, values [members, n])]: the first members' fields
    (Fig. 8 of the paper)."""
    label, factor = axis_label(spec, float(np.mean(spec.mean)))
    everything = np.concatenate([values.ravel() for _, _, values in rows]) / factor
    low, high = np.quantile(everything, [0.005, 0.995])
    if high <= low:
        low, high = low - 1.0, high + 1.0
    box = bounding_box(spec.points)
    aspect = (box[3] - box[2]) / (box[1] - box[0])
    if aspect <= 0.5:  # two wide ones fill the page
        rows = [(case, acf, values[:2]) for case, acf, values in rows]
    columns = max(len(values) for _, _, values in rows)
    width = 2.15 if aspect > 0.5 else 5.2
    figure, axes = plt.subplots(
        len(rows),
        columns,
        figsize=(1.5 + width * columns, 0.75 + (0.1 + 0.93 * width * min(aspect, 2.0)) * len(rows)),
        squeeze=False,
        sharex=True,
        sharey=True,
    )
    for r, (line, (case, acf, values)) in enumerate(zip(axes, rows)):
        for axis in line[len(values) :]:
            axis.set_visible(False)
        for k, (axis, one) in enumerate(zip(line, values)):
            axis.grid(False)
            drawn = draw_map(axis, spec.points, one / factor, low, high)
            axis.set_aspect("equal")
            axis.set_xlim(box[0], box[1])
            axis.set_ylim(box[2], box[3])
            for side in ("top", "right"):
                axis.spines[side].set_visible(True)
            if r == 0:
                axis.set_title(f"member {k + 1}")
            if r == len(rows) - 1:
                axis.set_xlabel("x [m]")
        line[0].set_ylabel("y [m]")
        line[0].annotate(
            f"{acf_text(acf)}\nCOV {case.cov:g}"
            if spec.has_cov and spec.index == 1
            else acf_text(acf),
            (0.0, 0.5),
            (-42, 0),  # a share of the axis would not stay what the layout has made room for
            xycoords="axes fraction",
            textcoords="offset points",
            rotation=90,
            ha="center",
            va="center",
            color=acf_colour(acf),
            fontweight="bold",
        )
    bar = figure.colorbar(
        drawn, ax=list(axes.ravel()), label=label, extend="both", pad=0.015, aspect=35,
        fraction=0.03,
    )  # fmt: skip
    bar.outline.set_edgecolor("#8795A1")
    return figure


def bounding_box(points):
    half_x, half_y = 0.5 * points.width.max(), 0.5 * points.height.max()
    return (
        points.x.min() - half_x,
        points.x.max() + half_x,
        points.y.min() - half_y,
        points.y.max() + half_y,
    )


def draw_map(axis, points, values, low, high):
    lattice = find_lattice(points)
    style = {"cmap": "RdYlBu_r", "vmin": low, "vmax": high, "rasterized": True}
    if lattice.is_lattice and min(len(lattice.x), len(lattice.y)) > 1:
        picture = np.full((len(lattice.y), len(lattice.x)), np.nan)
        picture[lattice.row, lattice.column] = values
        return axis.pcolormesh(
            cell_edges(lattice.x), cell_edges(lattice.y), picture, shading="flat", **style
        )
    return axis.scatter(points.x, points.y, c=values, s=6, lw=0, **style)


def cell_edges(line):
    middle = 0.5 * (line[1:] + line[:-1])
    return np.r_[2.0 * line[0] - middle[0], middle, 2.0 * line[-1] - middle[-1]]


@styled
def correlation_figure(entries):
    """Target and estimate with its 95 % band, a column a function, a row a direction; `entries` of
    one field, one for each autocorrelation function."""
    rows = len(entries[0]["correlation"])
    figure, axes = plt.subplots(
        2 * rows,
        len(entries),
        figsize=(max(4.2, 0.8 + 2.4 * len(entries)), 0.4 + 3.2 * rows),
        squeeze=False,
        sharey="row",
        gridspec_kw={"height_ratios": [2.2, 1.0] * rows},
    )
    least = 0.0
    for column, entry in enumerate(entries):
        shade = acf_colour(entry["acf"])
        for row, curve in enumerate(entry["correlation"]):
            main, rest = axes[2 * row, column], axes[2 * row + 1, column]
            value, target = np.array(curve["value"]), np.array(curve["target"])
            half = np.array(curve["high"]) - value
            main.axhline(0.0, color="#8795A1", lw=0.8)
            main.plot(curve["curve_lag"], curve["curve"], color=shade, lw=1.6, label="target")
            on_curve = np.interp(curve["lag"], curve["curve_lag"], curve["curve"])
            if np.abs(on_curve - target).max() > 0.02:  # the pairs lie beside the direction
                main.plot(
                    curve["lag"], target, "_", ms=10, mew=1.8, color=shade, label="target at pairs"
                )
            main.plot(curve["lag"], value, label="members", **_DOTS)
            rest.axhline(0.0, color=shade, lw=1.6)
            rest.fill_between(
                curve["lag"], -half, half, color=shade, alpha=0.2, lw=0, label="95 % band"
            )
            rest.plot(curve["lag"], value - target, **_DOTS)
            main.tick_params(labelbottom=False)
            rest.set_xlabel(f"lag {curve['direction']} [m]")
            for axis in (main, rest):
                axis.set_xlim(0.0, max(curve["curve_lag"]))
            least = min(least, float(np.nanmin(curve["curve"], initial=0.0)))
            if row == 0:
                main.set_title(acf_text(entry["acf"]), color=shade, fontweight="bold")
            if column == 0:
                main.set_ylabel("correlation [–]")
                rest.set_ylabel("members\n− target [–]")
    for row in range(rows):
        axes[2 * row, 0].set_ylim(min(-0.08, 1.15 * least), 1.05)
    axes[0, -1].legend(loc="upper right")
    axes[1, -1].legend(loc="upper right")
    figure.align_ylabels(axes[:, 0])
    return figure


@styled
def quantile_figure(spec, entries):
    """Pooled quantiles of the values against those of the law after clipping, and below their
    difference with its 95 % band; a column a function, a marker a coefficient of variation."""
    columns, covs = [], []
    for entry in entries:
        columns += [] if entry["acf"] in columns else [entry["acf"]]
        covs += [] if entry["cov"] in covs else [entry["cov"]]
    figure, axes = plt.subplots(
        2,
        len(columns),
        figsize=(max(4.2, 0.8 + 2.4 * len(columns)), 4.3),
        squeeze=False,
        sharex=True,
        sharey="row",
        gridspec_kw={"height_ratios": [2.0, 1.0]},
    )
    label, factor = axis_label(spec, float(np.mean(spec.mean)))
    unit = label[label.rindex("[") :]
    if entries[0]["qq"]["is_score"]:
        label, unit, factor = "normal score [sd]", "[sd]", 1.0
    for entry in entries:
        k = covs.index(entry["cov"])
        main, rest = axes[:, columns.index(entry["acf"])]
        shade = acf_colour(entry["acf"])
        target, sample, low, high = (
            np.array(entry["qq"][key], dtype=float) / factor
            for key in ("target", "sample", "low", "high")
        )
        dots = {
            "marker": _COV_MARKERS[k % len(_COV_MARKERS)],
            "ls": "",
            "ms": 3.2,
            "mec": shade,
            "mew": 0.7,
            "mfc": shade if k == 0 else "white",
            "markevery": _spread_out(target),
        }
        main.plot(target, target, color=INK, lw=0.9, ls=(0, (4, 2)), zorder=1)
        text = f"COV {entry['cov']:g}" if spec.has_cov and spec.index == 1 else "members"
        main.plot(target, sample, label=text, **dots)
        rest.fill_between(target, low - target, high - target, color=shade, alpha=0.2, lw=0)
        rest.plot(target, sample - target, **dots)
    for k, acf in enumerate(columns):
        axes[0, k].set_title(acf_text(acf), color=acf_colour(acf), fontweight="bold")
        axes[1, k].axhline(0.0, color=INK, lw=0.9, ls=(0, (4, 2)), zorder=1)
    axes[0, 0].legend(loc="upper left")
    axes[0, 0].set_ylabel(f"quantile of the members {unit}")
    axes[1, 0].set_ylabel(f"members\n− law {unit}")
    figure.align_ylabels(axes[:, 0])
    figure.supxlabel(f"quantile of the law, {label}; bands: 95 %", fontsize=9)
    return figure


def _spread_out(target, count=28):
    """Places of quantiles that are evenly spread over the axis, the outermost ones too."""
    wanted = np.linspace(target[0], target[-1], count)
    return np.unique(np.abs(target[:, None] - wanted).argmin(axis=0)).tolist()
