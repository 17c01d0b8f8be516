"""How far a fitted law can be trusted, by the bootstrap: whether the values can be of that law,
how often another one would have been chosen, and between which bounds its quantiles lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .fits import (
    FAMILIES,
    best_fit,
    draw_on_line,
    estimate_on_line,
    fit_laws,
    from_line,
    log_likelihood,
    log_probabilities,
    on_line,
    place_on_line,
    standardised,
)
from .statistics import CONFIDENCE, LEVEL, blocks, finite

PROBABILITIES = (0.95, 0.99, 0.999)
#: Fewest values for a bootstrap.
FEWEST_FOR_BOOTSTRAP = 8
_TAILS = (0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE)


@dataclass(frozen=True)
class Quantile:
    """Of the chosen law. `low`, `high`: as if the law were certain; `choice_low`, `choice_high`:
    with the choice made anew in each resample. `beyond`: how many of the values are larger."""

    probability: float
    value: float
    low: float
    high: float
    choice_low: float
    choice_high: float
    beyond: int


@dataclass(frozen=True)
class LawChoice:
    """`fits` as of `fit_laws`. By law, for those that could be fitted: Anderson-Darling's
    `statistic`, its `p_value`, and in which share of the resamples the law is the best one,
    `wins`; empty for fewer than FEWEST_FOR_BOOTSTRAP values. `law`: the chosen one, or ''."""

    fits: list
    statistic: dict
    p_value: dict
    wins: dict
    law: str
    quantiles: list

    @property
    def is_refuted(self) -> bool:
        """The members speak against the chosen law."""
        return bool(self.p_value.get(self.law, 1.0) < LEVEL)


@dataclass(frozen=True)
class _Simulated:
    """Estimates [samples] from samples of location 0 and scale 1, and their statistics."""

    location: np.ndarray
    scale: np.ndarray
    statistic: np.ndarray


def anderson_darling(law: str, y, location, scale) -> np.ndarray:
    """A^2 = -n - sum (2 i - 1)/n (ln F(y_i) + ln(1 - F(y_(n+1-i)))) of samples `y` [..., n] on the
    line of the law, values in order; it weighs the tails (Anderson and Darling 1954)."""
    n = y.shape[-1]
    below, above = log_probabilities(law, standardised(np.sort(y, axis=-1), location, scale))
    weights = (2.0 * np.arange(1, n + 1) - 1.0) / n
    return -n - np.sum(weights * (below + above[..., ::-1]), axis=-1)


def choose_law(values, samples: int, rng, probabilities=PROBABILITIES) -> LawChoice:
    """The law of the smallest AIC, with `samples` bootstrap samples of each kind.

    Goodness of fit: samples of the fitted law, each fitted again, since A^2 is smaller where the
    parameters are those of the sample (Stute, Gonzalez Manteiga and Presedo Quindimil, Metrika 40,
    1993, 243-256; Babu and Rao, Sankhya 66, 2004, 63-74); p = (1 + number as large)/(1 + samples).
    On their lines the laws have location and scale, so nothing depends on the parameters and the
    test holds its level for every n.

    Interval of a quantile q with estimates u + b z: u + b z - b t, t the quantiles of
    (u* + b* z - z)/b* over the same samples, whose distribution does not depend on u and b either:
    exact but for the number of samples. With the choice: percentiles over resamples of the values,
    of the quantile of whichever law is best there."""
    x = finite(values)
    fits = fit_laws(x)
    best = best_fit(fits)
    laws = [fit.law for fit in fits if not fit.note]
    if not best:
        nothing = [Quantile(p, *[np.nan] * 5, 0) for p in probabilities]
        return LawChoice(fits, {}, {}, {}, "", nothing)
    lines = {law: on_line(law, x) for law in laws}
    estimates = {law: estimate_on_line(law, lines[law]) for law in laws}
    location, scale = estimates[best.law]
    at = place_on_line(best.law, np.asarray(probabilities))
    middle = location + scale * at
    bounds = np.full((4, len(at)), np.nan)
    statistic, p_value, wins = {}, {}, {}
    if len(x) >= FEWEST_FOR_BOOTSTRAP:
        families = dict.fromkeys(FAMILIES[law] for law in laws)
        simulated = {family: _simulate(family, len(x), samples, rng) for family in families}
        for law in laws:
            statistic[law] = float(anderson_darling(law, lines[law], *estimates[law]))
            as_large = np.count_nonzero(simulated[FAMILIES[law]].statistic >= statistic[law])
            p_value[law] = (1.0 + as_large) / (1.0 + samples)
        drawn = simulated[FAMILIES[best.law]]
        pivot = (drawn.location[:, None] + (drawn.scale[:, None] - 1.0) * at) / drawn.scale[:, None]
        ends = middle - scale * np.quantile(pivot, _TAILS, axis=0)
        winners, chosen = _choose_again(x, laws, samples, rng, probabilities)
        wins = {law: float(np.mean(winners == k)) for k, law in enumerate(laws)}
        bounds = np.vstack(
            [np.sort(from_line(best.law, ends), axis=0), np.quantile(chosen, _TAILS, axis=0)]
        )
    found = from_line(best.law, middle)
    quantiles = [
        Quantile(p, float(found[k]), *map(float, bounds[:, k]), int(np.sum(x > found[k])))
        for k, p in enumerate(probabilities)
    ]
    return LawChoice(fits, statistic, p_value, wins, best.law, quantiles)


def _simulate(law: str, n: int, samples: int, rng) -> _Simulated:
    found = []
    for size in blocks(samples, n):
        y = draw_on_line(law, rng, (size, n))
        location, scale = estimate_on_line(law, y)
        found.append((location, scale, anderson_darling(law, y, location, scale)))
    return _Simulated(*map(np.concatenate, zip(*found)))


def _choose_again(x, laws, samples: int, rng, probabilities):
    """Of resamples of `x`: number of the best of `laws` [samples], and its quantiles [samples, p].
    A resample of equal values alone, which has no law, is drawn again."""
    winners, quantiles = [], []
    for size in blocks(samples, len(x)):
        drawn = x[rng.integers(0, len(x), (size, len(x)))]
        while np.any(equal := np.ptp(drawn, axis=-1) == 0.0):
            drawn[equal] = x[rng.integers(0, len(x), (np.count_nonzero(equal), len(x)))]
        likelihoods, found = [], []
        for law in laws:
            y = on_line(law, drawn)
            location, scale = estimate_on_line(law, y)
            likelihoods.append(log_likelihood(law, y, location, scale))
            at = place_on_line(law, np.asarray(probabilities))
            found.append(from_line(law, location[:, None] + scale[:, None] * at))
        best = np.argmax(likelihoods, axis=0)  # two parameters each: as AIC
        winners.append(best)
        quantiles.append(np.stack(found)[best, np.arange(size)])
    return np.concatenate(winners), np.concatenate(quantiles)
