"""The pictures of a study: many cases in one figure."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from .ensemble import RUNOUTS
from .figures import draw_bars, draw_exceedance, mark_deterministic
from .fits import LAWS, best_fit, distribution_of, fit_laws
from .style import INK, LAW_STYLES, acf_colour, colour, styled

#: Small multiples side by side.
MOST_COLUMNS = 5


@styled
def multiples_figure(cases, name: str, deterministic: dict):
    """A histogram of each case on one pair of axes, with the law of the smallest AIC: a row a
    coefficient of variation and a column an autocorrelation function where these are all that
    differs, else in the order of the plan."""
    places, (rows, columns) = _places(cases)
    figure, axes = plt.subplots(
        rows,
        columns,
        figsize=(11.5, 1.55 * rows + 0.7),
        sharex=True,
        sharey="row",
        squeeze=False,
    )
    for axis in axes.flat:
        axis.axis("off")
    values = {case.label: case.values(name) for case in cases}
    low = min(x.min() for x in values.values())
    high = max(x.max() for x in values.values())
    for case, place in zip(cases, places):
        axis, x = axes[place], values[case.label]
        axis.axis("on")
        draw_bars(axis, x, colour(case))
        best = best_fit(fit_laws(x))
        if best:
            shade, dash = LAW_STYLES[best.law]
            at = np.linspace(low, high, 150)
            axis.plot(at, distribution_of(best).pdf(at), color=shade, ls=dash, lw=1.1)
        mark_deterministic(axis, deterministic)
        law = f", {LAWS[best.law]}" if best else ""
        axis.set_title(f"{case.label}{law}", fontsize=8)
        axis.tick_params(labelsize=7)
    for row in axes:
        row[0].set_ylabel("density [1/m]", fontsize=8)
    for axis in axes[-1]:
        axis.set_xlabel("runout [m]", fontsize=8)
    return figure


def _places(cases):
    """(row, column) of each case, and the numbers of rows and columns."""
    covs = sorted({case.cov for case in cases})
    acfs = list(dict.fromkeys(case.acf for case in cases))
    places = [(covs.index(case.cov), acfs.index(case.acf)) for case in cases]
    if len(set(places)) == len(cases) and len(covs) > 1 and len(acfs) <= MOST_COLUMNS:
        return places, (len(covs), len(acfs))
    columns = min(MOST_COLUMNS, len(cases))
    return [divmod(k, columns) for k in range(len(cases))], (-(-len(cases) // columns), columns)


@styled
def comparison_figure(cases, name, deterministic):
    """Exceedance of all cases in one axis."""
    figure, axis = plt.subplots(figsize=(8.4, 4.2))
    draw_exceedance(axis, cases, name, deterministic)
    axis.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    axis.set_xlabel(f"runout, {RUNOUTS[name]} [m]")
    return figure


def draw_against_cov(axis, cases, estimate):
    """`estimate(case)`, a value with the ends of its interval, a line an autocorrelation function;
    `cases`: dictionaries with acf and cov."""
    acfs = sorted({case["acf"] for case in cases})
    for k, acf in enumerate(acfs):
        rows = sorted((case for case in cases if case["acf"] == acf), key=lambda case: case["cov"])
        x = np.array([row["cov"] for row in rows]) + 0.0012 * (k - 0.5 * (len(acfs) - 1))
        y, low, high = np.array([estimate(row) for row in rows], dtype=float).T
        known = np.isfinite(y)
        x, y, low, high = x[known], y[known], low[known], high[known]
        tint, span = acf_colour(acf), np.nan_to_num(np.abs([y - low, high - y]))
        axis.errorbar(
            x, y, span, color=tint, marker="o", ms=4, capsize=2, lw=1.3, label=acf.upper()
        )
    axis.set_xlabel("coefficient of variation")


@styled
def study_figure(summary: dict):
    """Mean, standard deviation and exceedance probability against the coefficient of variation
    (Figs. 13 and 14 of the paper), one line an autocorrelation function."""
    name, floor = summary["primary"], summary["deterministic"][summary["primary"]]
    figure, axes = plt.subplots(1, 3, figsize=(11.5, 3.3))
    cases = summary["cases"]
    for axis, value in ((axes[0], "mean"), (axes[1], "sd")):
        keys = (value, f"{value}_low", f"{value}_high")
        draw_against_cov(
            axis, cases, lambda case, keys=keys: [case["runouts"][name][k] for k in keys]
        )
    draw_against_cov(
        axes[2], cases, lambda case: [case["exceedance"][k] for k in ("value", "low", "high")]
    )
    mark_deterministic(axes[0], floor, vertical=False)
    if np.isfinite(floor["sd"]):
        axes[1].axhline(floor["sd"], color=INK, lw=1.1, ls=(0, (4, 2)), label="noise floor")
    axes[0].set_ylabel(f"mean runout, {RUNOUTS[name]} [m]")
    axes[1].set_ylabel("standard deviation [m]")
    axes[1].set_ylim(bottom=0)
    axes[2].set_ylabel("P(runout > homogeneous mean)")
    axes[2].set_ylim(0, 1)
    axes[1].legend()
    return figure


@styled
def soil_figure(summary: dict):
    """Share of the variance that is soil, of each case by each definition of the runout."""
    cases = summary["cases"]
    figure, axes = plt.subplots(
        1, len(RUNOUTS), figsize=(11.5, 0.9 + 0.22 * len(cases)), sharex=True, sharey=True
    )
    y = -np.arange(len(cases))
    for axis, (name, words) in zip(axes, RUNOUTS.items()):
        shares = [case["against_floor"][name]["soil_share"] for case in cases]
        value, low, high = (
            np.clip([share[key] for share in shares], 0.0, 1.0) for key in ("value", "low", "high")
        )
        tints = [acf_colour(case["acf"]) for case in cases]
        axis.hlines(y, low, high, color=tints, lw=2.2, alpha=0.55)
        axis.scatter(value, y, color=tints, s=18, zorder=3)
        axis.set_title(words)
        axis.set_xlabel("share of the variance")
    axes[0].set_yticks(y, [case["label"] for case in cases])
    axes[0].set_xlim(-0.02, 1.02)
    axes[0].set_ylim(0.6 - len(cases), 0.6)
    return figure
