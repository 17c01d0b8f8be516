"""The pictures of the report that come from the columns of the ensemble."""

from __future__ import annotations

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from scipy import stats

from .ensemble import RUNOUTS
from .fits import LAWS, best_fit, distribution_of, fit_laws
from .importance import weighted_probability
from .statistics import describe, exceedance, finite, running
from .style import INK, LAW_STYLES, OTHER, colour, styled

#: Values up to which each one has its tick below the histogram; a tick takes 230 bytes of SVG.
MOST_TICKS = 200

#: Bins of a histogram at most. Freedman and Diaconis count range over spread: one far value among
#: values close together would ask for millions.
MOST_BINS = 100

#: Order statistics drawn against the quantiles of the laws.
MOST_QUANTILES = 80


@styled
def case_figure(case, name: str, deterministic: dict):
    """Running mean and standard deviation, histogram with the four laws, quantiles against those
    of the laws, exceedance."""
    values = case.values(name)
    figure, axes = plt.subplots(2, 2, figsize=(9.6, 6.4))
    (first, second), (third, fourth) = axes
    fits = fit_laws(values)
    _running(first, values, colour(case), deterministic)
    draw_histogram(second, values, fits, colour(case), deterministic)
    _quantiles(third, values, fits)
    draw_exceedance(fourth, [case], name, deterministic)
    for axis in (second, fourth):
        axis.set_xlabel(f"runout, {RUNOUTS[name]} [m]")
    for axis, title in zip(axes.flat, ("Convergence", "Distribution", "Quantiles", "Exceedance")):
        axis.set_title(title)
    return figure


def mark_deterministic(axis, deterministic: dict, vertical: bool = True):
    """The homogeneous mean with the noise floor, mean +- one standard deviation, as a band."""
    mean, sd = deterministic["mean"], deterministic["sd"]
    if not np.isfinite(mean):
        return
    line, span = (axis.axvline, axis.axvspan) if vertical else (axis.axhline, axis.axhspan)
    line(mean, color=INK, lw=1.1, ls=(0, (4, 2)), label="homogeneous")
    if np.isfinite(sd) and sd > 0:
        span(mean - sd, mean + sd, color=INK, alpha=0.10, lw=0, label="noise floor ±1 sd")


def draw_histogram(axis, values, fits, tint, deterministic):
    if len(values) == 0:
        axis.text(0.5, 0.5, "no values yet", ha="center", transform=axis.transAxes)
        return
    margin = 0.25 * max(np.ptp(values), 1e-3)
    draw_bars(axis, values, tint)
    if len(values) <= MOST_TICKS:
        axis.plot(values, np.zeros_like(values), "|", color=tint, ms=7, alpha=0.6)
    x = np.linspace(values.min() - margin, values.max() + margin, 300)
    for fit in fits:
        if fit.note:
            continue
        shade, dash = LAW_STYLES[fit.law]
        axis.plot(x, distribution_of(fit).pdf(x), color=shade, ls=dash, lw=1.4, label=LAWS[fit.law])
    mark_deterministic(axis, deterministic)
    axis.set_ylabel("density [1/m]")
    if axis.get_legend_handles_labels()[0]:
        axis.legend(loc="upper left", bbox_to_anchor=(0.0, -0.22), ncol=3)


def _quantiles(axis, values, fits):
    """Order statistics against the quantiles of each law at (k - 1/2)/n. The band is where 95 % of
    samples of the law with the smallest AIC have each of them: its probability is Beta(k,
    n - k + 1)."""
    n = len(values)
    rank = np.unique(np.linspace(1, n, min(n, MOST_QUANTILES)).round().astype(int))
    observed = np.sort(values)[rank - 1]
    best = best_fit(fits)
    for fit in fits:
        if fit.note:
            continue
        shade, dash = LAW_STYLES[fit.law]
        x = distribution_of(fit).ppf((rank - 0.5) / n)
        axis.plot(x, observed, color=shade, ls=dash, lw=1.4, label=LAWS[fit.law])
        if fit is best:
            low, high = (
                distribution_of(fit).ppf(stats.beta.ppf(p, rank, n - rank + 1))
                for p in (0.025, 0.975)
            )
            axis.fill_between(x, low, high, color=shade, alpha=0.12, lw=0, label="95 % of samples")
    if best:
        ends = [observed[0], observed[-1]]
        axis.plot(ends, ends, color=INK, lw=0.8)
        axis.legend(loc="upper left", bbox_to_anchor=(0.0, -0.22), ncol=3)
    axis.set_xlabel("quantile of the law [m]")
    axis.set_ylabel("quantile of the members [m]")


def draw_bars(axis, values, tint):
    """A histogram of densities in one outline; its bins by Freedman and Diaconis from 30 values on,
    MOST_BINS at most."""
    reach = np.ptp(values)
    # numpy refuses to cut a range of a few roundings into bins.
    if reach <= 1e-12 * np.max(np.abs(values)):
        margin = 0.25 * max(reach, 1e-3)
        density, edges = np.histogram(
            values, 10, (values.min() - margin, values.max() + margin), density=True
        )
    else:
        density, edges = np.histogram(values, _bin_count(values), density=True)
    axis.stairs(density, edges, fill=True, color=tint, alpha=0.30)
    axis.stairs(density, edges, color=tint, lw=0.7)


def _bin_count(values) -> int:
    if len(values) < 30:
        return max(3, min(10, len(values) // 2))
    low, high = np.percentile(values, [25, 75])
    width = 2.0 * (high - low) / len(values) ** (1 / 3)
    reach = np.ptp(values)
    return max(1, int(np.ceil(reach / width))) if width * MOST_BINS > reach else MOST_BINS


def _running(axis, values, tint, deterministic):
    curve = running(values)
    if len(curve.count) == 0:
        return
    axis.fill_between(curve.count, curve.mean_low, curve.mean_high, color=tint, alpha=0.18, lw=0)
    axis.plot(curve.count, curve.mean, color=tint, lw=1.5, label="mean, 95 %")
    if np.isfinite(deterministic["mean"]):
        axis.axhline(deterministic["mean"], color=INK, lw=1.1, ls=(0, (4, 2)))
    final = describe(values)
    room = 4.0 * (final.sd if np.isfinite(final.sd) and final.sd > 0 else 0.05)
    axis.set_ylim(final.mean - room, final.mean + room)
    axis.set_xlabel("realizations")
    axis.set_ylabel("mean [m]")
    twin = axis.twinx()
    twin.grid(False)
    twin.spines["right"].set_visible(True)
    twin.fill_between(curve.count, curve.sd_low, curve.sd_high, color="#8795A1", alpha=0.15, lw=0)
    twin.plot(curve.count, curve.sd, color="#52616B", lw=1.2, ls="--", label="sd, 95 % (right)")
    if np.isfinite(final.sd):
        twin.set_ylim(0, 3.5 * max(final.sd, 1e-6))
    twin.set_ylabel("standard deviation [m]")
    handles = axis.get_legend_handles_labels(), twin.get_legend_handles_labels()
    axis.legend(
        handles[0][0] + handles[1][0],
        handles[0][1] + handles[1][1],
        loc="upper left",
        bbox_to_anchor=(0.0, -0.22),
        ncol=2,
    )


def draw_exceedance(axis, cases, name, deterministic):
    smallest = 1.0
    # Cases that differ in another key of the study than acf and cov: thinner and thinner lines.
    others = list(dict.fromkeys(str(case.varied) for case in cases))
    for case in cases:
        curve = exceedance(case.values(name))
        if len(curve.x) == 0:
            continue
        drawn = curve.probability > 0
        if drawn.any():
            smallest = min(smallest, curve.probability[drawn].min())
        tint = colour(case)
        if len(cases) <= 3:
            axis.fill_between(
                curve.x, np.maximum(curve.low, 1e-6), curve.high, color=tint, alpha=0.15, lw=0
            )
        dash = {0.1: "--", 0.15: ":"}.get(round(case.cov, 3), "-")
        axis.plot(
            curve.x[drawn],
            curve.probability[drawn],
            color=tint,
            ls=dash,
            lw=max(0.6, 1.8 - 0.5 * others.index(str(case.varied))),
            label=case.label,
        )
    axis.set_yscale("log")
    axis.set_ylim(0.5 * smallest, 1.3)
    axis.set_ylabel("P(runout > x), Wilson 95 %")
    mark_deterministic(axis, deterministic)
    axis.legend(loc="upper left", bbox_to_anchor=(0.0, -0.22), ncol=2)


@styled
def weighted_figure(cases, name: str, deterministic: dict):
    """P(runout > x) from the weights of importance sampling, where enough members lie beyond x."""
    figure, axis = plt.subplots(figsize=(8.4, 4.2))
    for case in cases:
        good = case.ok
        values, log_weights = case.column(name)[good], case.column("log_weight")[good]
        at = np.unique(finite(values))
        at = at[np.unique(np.linspace(0, len(at) - 1, 160).round().astype(int))]
        rows = [weighted_probability(values, log_weights, x) for x in at]
        keep = np.array([row.is_supported for row in rows], dtype=bool)
        p, low, high = (
            np.array([getattr(row, key) for row in rows])[keep] for key in ("value", "low", "high")
        )
        axis.fill_between(at[keep], low, high, color=colour(case), alpha=0.15, lw=0)
        axis.plot(at[keep], p, color=colour(case), lw=1.5, label=case.label)
    axis.set_yscale("log")
    axis.set_ylabel("P(runout > x), 95 %")
    axis.set_xlabel(f"runout, {RUNOUTS[name]} [m]")
    mark_deterministic(axis, deterministic)
    axis.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


@styled
def configuration_figure(state, geometry):
    """The points of a state (State), coloured by friction angle: red strong, blue weak (Figs. 7 and
    9 of the paper)."""
    left, bottom = state.position.min(axis=0)
    right, top = state.position.max(axis=0)
    spacing = geometry.point_spacing or (top - bottom) / 80 or 1.0
    width, height = right - left + spacing, top - bottom + spacing
    figure, axis = plt.subplots(figsize=(11.5, 1.15 + 9.6 * height / width))
    angles = state.friction_angle[np.isfinite(state.friction_angle)]
    # Homogeneous ground (to within the jitter of its strength) has one colour and no bar.
    is_uniform = len(angles) == 0 or float(np.ptp(angles)) < 1e-2
    tint = {"color": OTHER}
    if not is_uniform:
        middle, spread = float(np.mean(angles)), 3.0 * float(np.std(angles))
        tint = {
            "c": state.friction_angle,
            "cmap": matplotlib.colormaps["RdYlBu_r"].with_extremes(bad="#B4BEC6"),
            "plotnonfinite": True,
            "vmin": middle - spread,
            "vmax": middle + spread,
        }
    size = 11.5 * 72 * 0.84 / width * spacing
    drawn = axis.scatter(
        *state.position.T, s=max(size**2 * 0.9, 0.3), marker="s", lw=0, rasterized=True, **tint
    )
    axis.set_aspect("equal")
    axis.set_xlim(left - 0.02 * width, left + 1.02 * width)
    axis.set_ylim(bottom - 0.01 * height, bottom + 1.02 * height)
    axis.grid(False)
    axis.set_xlabel("x [m]")
    axis.set_ylabel("y [m]")
    axis.set_title(f"t = {state.time:.2f} s")
    if not is_uniform:
        figure.colorbar(drawn, ax=axis, label="friction angle [°]", shrink=0.9, pad=0.01)
    return figure
