"""Four two-parameter laws by maximum likelihood, and which of them the data prefer.

Gumbel is the law of largest values, Weibull that of smallest; lognormal and Weibull start at zero.

Each law is one of location and scale on a line of its own: x for normal and Gumbel, ln x for
lognormal (normal there), -ln x for Weibull (Gumbel there). So two estimators do for four laws, and
what is distributed the same whatever the parameters can be simulated with location 0 and scale 1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import special, stats

from .statistics import finite

#: Parameters of each law.
PARAMETERS = 2
#: Fewest values a fit is made from: with two every law passes as well as any other.
FEWEST = 3
#: Laws closer than this in AIC cannot be told apart (Burnham and Anderson 2002, section 2.6).
UNDECIDED = 2.0
#: Newton's steps are quadratic: behind one so small, relative to the scale, nothing is left but
#: rounding. Halving a bracket to there takes 37 steps.
_CONVERGED = 1e-11
_MOST_STEPS = 100

LAWS = {
    "normal": "Normal",
    "lognormal": "Lognormal",
    "gumbel": "Gumbel (max)",
    "weibull": "Weibull (min)",
}

#: The law on the line of each.
FAMILIES = {"normal": "normal", "lognormal": "normal", "gumbel": "gumbel", "weibull": "gumbel"}


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


def on_line(law: str, x) -> np.ndarray:
    """The values on the line on which the law has a location and a scale."""
    if law in ("normal", "gumbel"):
        return np.asarray(x, dtype=float)
    return np.log(x) if law == "lognormal" else -np.log(x)


def estimate_on_line(law: str, y):
    """(location, scale) of greatest likelihood, each [...], of samples `y` [..., n] on the line of
    the law; scale 0 or NaN where the values of a sample are all equal."""
    return (np.mean(y, axis=-1), np.std(y, axis=-1)) if _is_normal(law) else _gumbel(y)


def standardised(y, location, scale) -> np.ndarray:
    """Samples [..., n] in units of the scale [...], from the location [...] on."""
    return (y - np.asarray(location)[..., None]) / np.asarray(scale)[..., None]


def log_likelihood(law: str, y, location, scale) -> np.ndarray:
    """Of the values x whose images on the line of the law are `y` [..., n]."""
    z = standardised(y, location, scale)
    terms = -0.5 * (z**2 + np.log(2.0 * np.pi)) if _is_normal(law) else -z - np.exp(-z)
    if law == "lognormal":  # dy/dx = 1/x
        terms = terms - y
    elif law == "weibull":
        terms = terms + y
    return np.sum(terms, axis=-1) - y.shape[-1] * np.log(scale)


def log_probabilities(law: str, z):
    """(ln F, ln(1 - F)) of the law with location 0 and scale 1 on its line."""
    if _is_normal(law):
        return special.log_ndtr(z), special.log_ndtr(-z)
    power = -np.exp(-z)
    with np.errstate(divide="ignore"):
        return power, np.log(-np.expm1(power))


def draw_on_line(law: str, rng, size) -> np.ndarray:
    """Random numbers of the law with location 0 and scale 1 on its line."""
    return rng.standard_normal(size) if _is_normal(law) else rng.gumbel(size=size)


def place_on_line(law: str, probability):
    """Where on its line the law with location 0 and scale 1 has the quantile of x of this
    probability. The line of Weibull runs against x."""
    if _is_normal(law):
        return special.ndtri(probability)
    p = np.asarray(probability, dtype=float)
    return -np.log(-np.log1p(-p)) if law == "weibull" else -np.log(-np.log(p))


def from_line(law: str, y):
    """The values x whose images on the line of the law are `y`."""
    if law in ("normal", "gumbel"):
        return y
    return np.exp(y) if law == "lognormal" else np.exp(-y)


def _is_normal(law: str) -> bool:
    return FAMILIES[law] == "normal"


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
    y = on_line(law, x)
    location, scale = estimate_on_line(law, y)
    value = float(log_likelihood(law, y, location, scale))
    return Fit(
        law,
        n,
        PARAMETERS,
        _named(law, float(location), float(scale)),
        value,
        aic=2.0 * PARAMETERS - 2.0 * value,
        bic=PARAMETERS * float(np.log(n)) - 2.0 * value,
    )


def _named(law: str, location: float, scale: float) -> dict:
    if law == "normal":
        return {"mean": location, "sd": scale}
    if law == "lognormal":
        return {"log_mean": location, "log_sd": scale}
    if law == "gumbel":
        return {"location": location, "scale": scale}
    return {"shape": 1.0 / scale, "scale": float(np.exp(-location))}


def _gumbel(y):
    """The scale b solves b = mean(y) - sum(y w)/sum(w), w = exp(-y/b), whose one root lies between
    0 and mean(y) - min(y): Newton's steps, halves of what encloses the root where they leave it.
    The location is -b ln mean(w)."""
    y = np.asarray(y, dtype=float)
    low = y.min(axis=-1)
    above = y - low[..., None]  # no weight overflows, and the least value has weight 1
    reach = above.mean(axis=-1)
    lower, upper = np.zeros_like(reach), reach
    scale = np.minimum(np.sqrt(6.0) / np.pi * above.std(axis=-1), reach)
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(_MOST_STEPS):
            w = np.exp(-above / scale[..., None])
            total = w.sum(axis=-1)
            centre = (above * w).sum(axis=-1) / total
            spread = (above**2 * w).sum(axis=-1) / total - centre**2
            excess = scale - reach + centre
            lower = np.where(excess < 0.0, scale, lower)
            upper = np.where(excess > 0.0, scale, upper)
            following = scale - excess / (1.0 + spread / scale**2)
            is_inside = (following > lower) & (following < upper)
            following = np.where(is_inside, following, 0.5 * (lower + upper))
            following = np.where(excess == 0.0, scale, following)
            change = np.abs(following - scale)
            scale = following
            if not np.any(change > _CONVERGED * scale):
                break
        w = np.exp(-above / scale[..., None])
        return low - scale * np.log(w.mean(axis=-1)), scale
