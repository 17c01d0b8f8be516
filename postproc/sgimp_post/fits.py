"""Four two-parameter laws by maximum likelihood, and which of them the data prefer.

Gumbel is the law of largest values, Weibull that of smallest; lognormal and Weibull start at zero.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize, stats

from .statistics import finite

#: Parameters of each law.
PARAMETERS = 2
#: Fewest values a fit is made from: with two every law passes as well as any other.
FEWEST = 3
#: Laws closer than this in AIC cannot be told apart (Burnham and Anderson 2002, section 2.6).
UNDECIDED = 2.0

LAWS = {
    "normal": "Normal",
    "lognormal": "Lognormal",
    "gumbel": "Gumbel (max)",
    "weibull": "Weibull (min)",
}


@dataclass(frozen=True)
class Fit:
    law: str
    n: int
    k: int
    #: By name: mean, sd | log_mean, log_sd | location, scale | shape, scale.
    parameters: dict
    log_likelihood: float
    aic: float
    bic: float
    #: AIC above that of the best law, and the share of the evidence (Akaike weight).
    delta_aic: float = np.nan
    weight: float = np.nan
    #: Why there is no fit; empty if there is one.
    note: str = ""


def fit_laws(values) -> list:
    """One Fit a law, in the order of LAWS; a law that cannot be fitted has NaN and a note."""
    x = finite(values)
    fits = [_fit(law, x) for law in LAWS]
    known = [fit.aic for fit in fits if np.isfinite(fit.aic)]
    if not known:
        return fits
    best = min(known)
    total = sum(np.exp(-0.5 * (aic - best)) for aic in known)
    return [
        replace(
            fit, delta_aic=fit.aic - best, weight=float(np.exp(-0.5 * (fit.aic - best)) / total)
        )
        if np.isfinite(fit.aic)
        else fit
        for fit in fits
    ]


def best_fit(fits):
    """The law of the smallest AIC, or None. With two parameters each, BIC gives the same order."""
    known = [fit for fit in fits if np.isfinite(fit.aic)]
    return min(known, key=lambda fit: fit.aic) if known else None


def rivals(fits) -> list:
    """The laws that cannot be told from the best one."""
    return [fit for fit in fits if 0.0 < fit.delta_aic < UNDECIDED]


def distribution_of(fit: Fit):
    """The frozen scipy distribution of a fit."""
    p = fit.parameters
    if fit.law == "normal":
        return stats.norm(p["mean"], p["sd"])
    if fit.law == "lognormal":
        return stats.lognorm(p["log_sd"], 0.0, np.exp(p["log_mean"]))
    if fit.law == "gumbel":
        return stats.gumbel_r(p["location"], p["scale"])
    return stats.weibull_min(p["shape"], 0.0, p["scale"])


def _fit(law: str, x: np.ndarray) -> Fit:
    n = len(x)
    note = ""
    if n < FEWEST:
        note = f"needs {FEWEST} values or more"
    elif np.ptp(x) <= 1e-12 * np.max(np.abs(x)):
        note = "the values are all equal"
    elif law in ("lognormal", "weibull") and x.min() <= 0.0:
        note = "needs values above zero"
    if note:
        return Fit(law, n, PARAMETERS, {}, np.nan, np.nan, np.nan, note=note)
    fit = Fit(law, n, PARAMETERS, _estimate(law, x), np.nan, np.nan, np.nan)
    log_likelihood = float(np.sum(distribution_of(fit).logpdf(x)))
    if not np.isfinite(log_likelihood):
        return replace(fit, parameters={}, note="no maximum found")
    return replace(
        fit,
        log_likelihood=log_likelihood,
        aic=2.0 * PARAMETERS - 2.0 * log_likelihood,
        bic=PARAMETERS * float(np.log(n)) - 2.0 * log_likelihood,
    )


def _estimate(law: str, x: np.ndarray) -> dict:
    if law == "normal":
        mean, sd = stats.norm.fit(x)
        return {"mean": float(mean), "sd": float(sd)}
    if law == "lognormal":
        # The logarithms are normal; scipy's own search of the shape is exact to 1e-5 only.
        log_mean, log_sd = stats.norm.fit(np.log(x))
        return {"log_mean": float(log_mean), "log_sd": float(log_sd)}
    if law == "gumbel":
        centre, width = float(np.mean(x)), float(np.std(x))
        location, scale = stats.gumbel_r.fit((x - centre) / width, optimizer=_tight)
        return {"location": centre + width * float(location), "scale": width * float(scale)}
    # ln x has the standard deviation pi / (sqrt(6) shape): a start close to the maximum.
    unit = float(np.exp(np.mean(np.log(x))))
    start = np.pi / (np.sqrt(6.0) * float(np.std(np.log(x))))
    shape, _, scale = stats.weibull_min.fit(x / unit, start, floc=0.0, scale=1.0, optimizer=_tight)
    return {"shape": float(shape), "scale": unit * float(scale)}


def _tight(function, start, args=(), disp=0):
    """Nelder-Mead to rounding: scipy's default stops at 1e-4, which shows in AIC."""
    return optimize.fmin(
        function, start, args=args, disp=disp, xtol=1e-10, ftol=1e-12, maxiter=4000, maxfun=8000
    )
