"""The paper's figures as this run has them, what the paper prints marked on each: diamonds, and
dotted lines and bands. Runouts in dm."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from .autocorrelation import Correlation, rho
from .ensemble import RUNOUTS
from .figures import configuration_figure, draw_histogram, mark_deterministic
from .fits import LAWS, distribution_of, fit_laws
from .paper import BLOCK, DECIMETRES, NO_SHARE, gumbel_of, is_baseline
from .printed import ACFS, BASELINE, COVS, MEANS, NUMBERS, TABLE_5
from .statistics import describe, running
from .study_figures import draw_against_cov
from .style import INK, LAW_STYLES, OTHER, acf_colour, acf_text, styled

#: What is printed.
_PRINTED = {"marker": "D", "ms": 5.5, "mfc": "white", "mew": 1.3, "ls": "", "zorder": 4}
_DOTTED = {"color": "#8A1C1C", "lw": 1.2, "ls": ":"}
_LAGS = np.linspace(0.0, 2.0, 401)


@styled
def correlation_figure():
    """Fig. 2: the functions over the lag in scales of fluctuation."""
    figure, axis = plt.subplots(figsize=(6.4, 3.6))
    for acf in ACFS:
        axis.plot(_LAGS, rho(acf, _LAGS), color=acf_colour(acf), lw=1.6, label=acf_text(acf))
    spacing = NUMBERS["radius"].value / NUMBERS["scale"].value
    for k in range(1, int(_LAGS[-1] / spacing) + 1):
        axis.axvline(k * spacing, color="#C5CDD3", lw=0.6, zorder=0)
    axis.axhline(0.0, color="#8795A1", lw=0.8)
    axis.set_xlim(0.0, _LAGS[-1])
    axis.set_xlabel("lag over scale of fluctuation [–]")
    axis.set_ylabel("autocorrelation [–]")
    axis.legend()
    return figure


@styled
def surface_figure():
    """Fig. 3: the products over both lags, as lines of equal correlation."""
    figure, axes = plt.subplots(1, len(ACFS), figsize=(11.5, 2.75), sharex=True, sharey=True)
    lag = np.linspace(-1.0, 1.0, 101)
    levels = np.round(np.arange(-0.1, 1.01, 0.1), 1)
    angle = np.linspace(0.0, 2.0 * np.pi, 100)
    for axis, acf in zip(axes, ACFS):
        values = Correlation(acf, 1.0, 1.0).at(*np.meshgrid(np.abs(lag), np.abs(lag)))
        drawn = axis.contourf(lag, lag, values, levels, cmap="cividis")
        # Through the points half a scale away along the axes: the line of an isotropic function.
        axis.plot(0.5 * np.cos(angle), 0.5 * np.sin(angle), color="#FFFFFF", lw=1.3, ls=(0, (3, 2)))
        axis.contour(lag, lag, values, [rho(acf, 0.5)], colors="#FF8C42", linewidths=1.5)
        axis.set_title(acf_text(acf), color=acf_colour(acf), fontweight="bold")
        axis.set_aspect("equal")
        axis.grid(False)
        axis.set_xlabel("lag x over scale [–]")
    axes[0].set_ylabel("lag y over scale [–]")
    figure.colorbar(drawn, ax=list(axes), label="autocorrelation [–]", pad=0.01)
    return figure


@styled
def front_figure(history: dict, origin: str, homogeneous: dict, toe: float):
    """Fig. 7: runout of the homogeneous column over time, in the run `origin`."""
    figure, axis = plt.subplots(figsize=(7.2, 3.3))
    time = history["time"]
    lines = (("front_max", "runout_max", OTHER), ("front_q995", "runout_q995", "#D55E00"))
    for name, key, tint in lines:
        if name in history:
            axis.plot(
                time, DECIMETRES * (history[name] - toe), color=tint, lw=1.6, label=RUNOUTS[key]
            )
    mark_deterministic(axis, homogeneous, vertical=False)
    axis.axhline(NUMBERS["homogeneous"].value, label="printed: 60.03 dm, 1.4 s, 4.2 s", **_DOTTED)
    for key in ("fast_from", "rest"):
        axis.axvline(NUMBERS[key].value, **_DOTTED)
    axis.set_xlim(0.0, float(time[-1]))
    axis.set_ylim(bottom=0.0)
    axis.set_xlabel("time [s]")
    axis.set_ylabel("runout [dm]")
    axis.set_title(f"Lines: nominal run of {origin}; band: homogeneous runs beside the members")
    axis.legend(loc="center right")
    return figure


def deposit_figure(snapshot, geometry, low: float, high: float):
    """Figs. 7 and 9: final deposit of a member, a printed range of fronts (dm from the left wall)
    marked on it; None where there is no final state."""
    if snapshot.final is None:
        return None
    figure = configuration_figure(snapshot.final, geometry)
    axis = figure.axes[0]
    left, right = axis.get_xlim()
    axis.set_xlim(left, max(right, high / DECIMETRES + 0.2))
    for place in dict.fromkeys((low, high)):
        axis.axvline(place / DECIMETRES, **_DOTTED)
    return figure


@styled
def convergence_figure(cases, name: str):
    """Fig. 10: running mean and standard deviation of the baseline, with 95 % bands."""
    figure, axes = plt.subplots(1, 2, figsize=(11.5, 3.5))
    spans = ([], [])
    for case in cases:
        curve = running(case.values(name))
        tint = acf_colour(case.acf)
        for axis, span, key in zip(axes, spans, ("mean", "sd")):
            value, low, high = (getattr(curve, key + end) for end in ("", "_low", "_high"))
            axis.fill_between(curve.count, low, high, color=tint, alpha=0.10, lw=0)
            axis.plot(curve.count, value, color=tint, lw=1.4, label=acf_text(case.acf))
            settled = curve.count >= min(20, len(case.values(name)))
            span += [*low[settled], *high[settled]]
    for axis, span, word in zip(axes, spans, ("mean", "standard deviation")):
        span = np.array(span)[np.isfinite(span)]
        if len(span) and np.ptp(span) > 0.0:
            axis.set_ylim(span.min() - 0.05 * np.ptp(span), span.max() + 0.05 * np.ptp(span))
        axis.axvline(NUMBERS["converged"].value, label="printed: 700", **_DOTTED)
        axis.axvline(BLOCK, color="#8795A1", lw=1.0, ls="--", label="N of Table 5")
        axis.set_xlabel("realizations")
        axis.set_ylabel(f"{word} of the runout [dm]")
        axis.set_xlim(left=0)
    _legend_below(figure, axes[0])
    return figure


@styled
def histogram_figure(cases, name: str, homogeneous: dict):
    """Fig. 11: histograms of the baseline with the four laws."""
    figure, axes = plt.subplots(
        1, len(cases), figsize=(11.5, 3.0), sharex=True, sharey=True, squeeze=False
    )
    ends = [np.percentile(case.values(name), [0.2, 99.8]) for case in cases]
    for axis, case in zip(axes[0], cases):
        values, tint = case.values(name), acf_colour(case.acf)
        draw_histogram(axis, values, fit_laws(values), tint, homogeneous)
        axis.axvline(values.mean(), color=tint, lw=1.8)
        axis.axvline(MEANS[case.acf], label="printed mean", **_DOTTED)
        axis.set_xlim(np.min(ends) - 1.0, max(np.max(ends), max(MEANS.values())) + 1.0)
        axis.set_title(f"{acf_text(case.acf)}, n = {len(values)}", color=tint, fontweight="bold")
        axis.set_xlabel("runout [dm]")
        axis.set_ylabel("density [1/dm]" if axis is axes[0, 0] else "")
        if axis.get_legend():
            axis.get_legend().remove()
    axes[0, 0].plot([], [], color="#8795A1", lw=1.8, label="mean, colour of the function")
    _legend_below(figure, axes[0, 0])
    return figure


@styled
def density_figure(cases, name: str, homogeneous: dict, implied: list):
    """Fig. 12: Gumbel's law of each function beside the paper's, and means with standard
    deviations beside the paper's."""
    figure, axes = plt.subplots(1, 2, figsize=(11.5, 3.7), width_ratios=[1.6, 1.0])
    own = {row["acf"]: row for row in implied}
    printed = {acf: gumbel_of(MEANS[acf], own[acf]["sd"]) for acf in ACFS}
    ends = [law.ppf([0.005, 0.995]) for law in printed.values()]
    ends += [[values.min(), values.max()] for values in (case.values(name) for case in cases)]
    x = np.linspace(np.min(ends) - 1.0, np.max(ends) + 1.0, 700)
    for acf, law in printed.items():
        axes[0].plot(x, law.pdf(x), color=acf_colour(acf), lw=1.1, ls=":")
    for case in cases:
        fit = next(fit for fit in fit_laws(case.values(name)) if fit.law == "gumbel")
        if not fit.note:
            tint = acf_colour(case.acf)
            axes[0].plot(
                x, distribution_of(fit).pdf(x), color=tint, lw=1.5, label=acf_text(case.acf)
            )
    axes[0].plot([], [], color=INK, lw=1.1, ls=":", label="the paper's (mean, Table 5)")
    mark_deterministic(axes[0], homogeneous)
    axes[0].axvline(NUMBERS["homogeneous"].value, label="printed: 60.03 dm", **_DOTTED)
    axes[0].set_xlim(x[0], x[-1])
    axes[0].set_ylim(bottom=0.0)
    axes[0].set_xlabel("runout [dm]")
    axes[0].set_ylabel("density [1/dm]")
    axes[0].legend(loc="upper right")
    for k, acf in enumerate(ACFS):
        axes[1].errorbar(
            k + 0.14,
            MEANS[acf],
            own[acf]["sd"],
            color=acf_colour(acf),
            lw=1.1,
            capsize=3,
            **_PRINTED,
        )
    for case in cases:
        got, k = describe(case.values(name)), ACFS.index(case.acf)
        axes[1].errorbar(
            k - 0.14,
            got.mean,
            np.nan_to_num(got.sd),  # of one member there is none
            color=acf_colour(case.acf),
            lw=1.6,
            capsize=3,
            marker="o",
            ms=5,
        )
    mark_deterministic(axes[1], homogeneous, vertical=False)
    axes[1].set_xticks(range(len(ACFS)), [acf_text(acf) for acf in ACFS])
    axes[1].set_ylabel("runout, mean ± sd [dm]")
    axes[1].set_title("filled: here; diamonds: the paper", fontsize=9)
    return figure


@styled
def cov_figure(rows: list, floors: dict, implied: list):
    """Fig. 13: mean and standard deviation against the COV, by four definitions of the runout."""
    figure, axes = plt.subplots(2, len(RUNOUTS), figsize=(11.5, 5.6), sharex=True)
    for column, (name, words) in enumerate(RUNOUTS.items()):
        own = [row for row in rows if row["runout"] == name and row["n"]]
        for axis, key in zip(axes[:, column], ("mean", "sd")):
            draw_against_cov(
                axis, own, lambda row, key=key: [row[key + e] for e in ("", "_low", "_high")]
            )
        mark_deterministic(axes[0, column], floors[name], vertical=False)
        if np.isfinite(floors[name]["sd"]):
            axes[1, column].axhline(
                floors[name]["sd"], color=INK, lw=1.1, ls=(0, (4, 2)), label="noise floor"
            )
        axes[0, column].set_title(words)
        axes[0, column].set_xlabel("")
        axes[1, column].set_xlabel("COV of the friction angle [–]")
        axes[1, column].set_ylim(bottom=0.0)
        axes[1, column].set_xticks(COVS)
    for axis, points in ((axes[0, 0], MEANS), (axes[1, 0], {r["acf"]: r["sd"] for r in implied})):
        for k, acf in enumerate(ACFS):
            axis.plot(BASELINE - 0.014 + 0.0018 * k, points[acf], color=acf_colour(acf), **_PRINTED)
    axes[0, 0].plot([], [], color=INK, label="printed", **_PRINTED)
    axes[0, 0].set_ylabel("mean runout [dm]")
    axes[1, 0].set_ylabel("standard deviation [dm]")
    axes[0, 0].set_xlim(BASELINE - 0.02, 0.16)
    _legend_below(figure, axes[0, 0])
    return figure


@styled
def exceedance_figure(rows: list):
    """Fig. 14: share that runs farther than the homogeneous mean, with both doubts."""
    figure, axes = plt.subplots(1, len(RUNOUTS), figsize=(11.5, 3.5), sharex=True, sharey=True)
    for axis, (name, words) in zip(axes, RUNOUTS.items()):
        own = [row for row in rows if row["runout"] == name and row["n"]]
        draw_against_cov(
            axis, own, lambda row: [row["share" + end] for end in ("", "_low", "_high")]
        )
        axis.axhspan(*NO_SHARE, color=INK, alpha=0.18, lw=0, label="no effect")
        span = NUMBERS["exceeding"].value
        axis.axhspan(
            *span, xmax=0.4, color=_DOTTED["color"], alpha=0.12, lw=0, label="printed: 55 to 68 %"
        )
        for key, acf, cov in (("exceeding_smk", "smk", 0.05), ("exceeding_csx", "csx", 0.15)):
            axis.plot(cov - 0.007, NUMBERS[key].value, color=acf_colour(acf), **_PRINTED)
        axis.set_title(words)
        axis.set_xticks(COVS)
        axis.set_xlabel("COV of the friction angle [–]")
    axes[0].plot([], [], color=INK, label="printed: SMK 39 %, CSX 74 %", **_PRINTED)
    axes[0].set_ylabel("P(runout > homogeneous mean)")
    axes[0].set_ylim(0.0, 1.0)
    axes[0].set_xlim(BASELINE - 0.02, 0.16)
    _legend_below(figure, axes[0])
    return figure


@styled
def law_figure(blocks: list):
    """Table 5: AIC of the laws over that of Gumbel's, a dot a hundred members; below zero a law is
    better than Gumbel's."""
    figure, axes = plt.subplots(1, len(ACFS), figsize=(11.5, 3.0), sharey=True)
    laws = [law for law in LAWS if law != "gumbel"]
    for axis, acf in zip(axes, ACFS):
        own = [block for block in blocks if block["acf"] == acf]
        for k, law in enumerate(laws):
            shade = LAW_STYLES[law][0]
            y = [block[f"aic_over_gumbel_{law}"] for block in own]
            x = k + 0.22 * (np.arange(len(y)) / max(len(y) - 1, 1) - 0.5)
            axis.plot(x, y, "o", color=shade, ms=4, alpha=0.7)
            printed = TABLE_5[acf][law][0] - TABLE_5[acf]["gumbel"][0]
            axis.plot(k + 0.3, printed, color=shade, **_PRINTED)
        axis.axhline(0.0, color=INK, lw=1.1, ls=(0, (4, 2)))
        axis.set_xticks(range(len(laws)), [LAWS[law].split()[0] for law in laws])
        axis.set_title(
            f"{acf_text(acf)}, {len(own)} hundreds", color=acf_colour(acf), fontweight="bold"
        )
        axis.set_xlim(-0.5, len(laws) - 0.4)
        axis.margins(y=0.1)
    axes[0].set_yscale("symlog", linthresh=10.0)
    axes[0].set_ylabel("AIC − AIC of Gumbel [–]")
    return figure


@styled
def sensitivity_figure(sensitivity: dict, name: str):
    """Shift of the mean, ratio of the spreads and exceedance of each case of another run."""
    rows = [
        r
        for r in sensitivity["rows"]
        if r["runout"] == name and r["role"] == "study" and r["n"] > 1
    ]
    if not rows:
        return None
    figure, axes = plt.subplots(1, 3, figsize=(11.5, 3.2))
    draw_against_cov(axes[0], rows, lambda row: [row["shift" + e] for e in ("", "_low", "_high")])
    draw_against_cov(axes[1], rows, lambda row: [row["sd_ratio"]] * 3)
    draw_against_cov(
        axes[2], rows, lambda row: [row["share_there" + e] for e in ("", "_low", "_high")]
    )
    for axis, level in zip(axes, (0.0, 1.0)):
        axis.axhline(level, color=INK, lw=1.1, ls=(0, (4, 2)))
    axes[2].axhspan(*NO_SHARE, color=INK, alpha=0.18, lw=0)
    for axis in axes:
        axis.set_xticks(COVS)
        axis.set_xlabel("COV of the friction angle [–]")
    axes[0].set_ylabel("shift of the mean [dm]")
    axes[1].set_ylabel("ratio of the standard deviations")
    axes[2].set_ylabel("P(runout > homogeneous mean)")
    axes[2].set_ylim(0.0, 1.0)
    axes[1].legend()
    return figure


def baseline_of(cases: list, name: str) -> list:
    """The cases of the baseline that have any value."""
    return [case for case in cases if is_baseline(case) and len(case.values(name))]


def _legend_below(figure, axis) -> None:
    handles, labels = axis.get_legend_handles_labels()
    figure.supxlabel(" ", fontsize=14)  # room for it
    figure.legend(handles, labels, loc="lower center", ncol=len(handles))
