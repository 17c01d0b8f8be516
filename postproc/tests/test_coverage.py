"""How often each 95 % interval of the report holds the truth, over synthetic ensembles whose truth
is known in closed form. `python test_coverage.py 4000` prints the table of docs/statistics.md."""

import sys
import zlib

import numpy as np
import pytest
from scipy import stats

from sgimp_post.control_variates import (
    controlled_mean,
    controlled_probability,
    controlled_sd,
    exact_controls,
    paired_controls,
)
from sgimp_post.importance import weighted_mean, weighted_probability, weighted_sd
from sgimp_post.law_choice import choose_law
from sgimp_post.statistics import (
    describe,
    paired_difference,
    probability_above,
    probability_above_mean,
    sd_interval,
    soil_share,
    welch_difference,
)

ENSEMBLES = 1000
#: Three standard errors of a share of 0.95 in 1000 ensembles are 0.021.
PROMISED = (0.93, 0.97)
#: For those that fall short of the promise or are on the safe side, as the docstrings say.
SHORT, SAFE = (0.88, 0.95), (0.94, 0.995)

#: Standard laws and their standard deviation: the farthest point of a column is nearly Gumbel.
LAWS = {"normal": (stats.norm, 1.0), "Gumbel": (stats.gumbel_r, np.pi / np.sqrt(6.0))}


def draw(rng, law, *shape):
    return rng.standard_normal(shape) if law == "normal" else rng.gumbel(size=shape)


def mean(rng, law, n):
    got = describe(draw(rng, law, n))
    return got.mean_low, LAWS[law][0].mean(), got.mean_high


def sd(rng, law, n):
    low, high = sd_interval(draw(rng, law, n))
    return low, LAWS[law][1], high


def law_quantile(rng, law, n, is_chosen_again):
    """5 m with a spread of 0.2: coefficient of variation as of a runout."""
    got = choose_law(5.0 + 0.2 * draw(rng, law, n), 199, rng, (0.99,)).quantiles[0]
    low, high = (got.choice_low, got.choice_high) if is_chosen_again else (got.low, got.high)
    return low, 5.0 + 0.2 * LAWS[law][0].ppf(0.99), high


def sd_by_chi_square(rng, law, n):
    spread = np.std(draw(rng, law, n), ddof=1)
    low, high = (np.sqrt((n - 1) / stats.chi2.ppf(p, n - 1)) for p in (0.975, 0.025))
    return spread * low, LAWS[law][1], spread * high


def share(rng, p, n):
    got = probability_above(rng.random(n), 1.0 - p)
    return got.low, p, got.high


def paired(rng, law, n):
    """Differences of means of two correlated samples."""
    common, one, two = draw(rng, law, 3, n)
    got = paired_difference(3.0 * common + one + 0.2, 3.0 * common + two)
    return got.low, 0.2, got.high


def shift(rng, law, n, homogeneous):
    got = welch_difference(1.5 + 3.0 * draw(rng, law, n), draw(rng, "normal", homogeneous))
    return got.low, 1.5 + 3.0 * LAWS[law][0].mean(), got.high


def soil(rng, law, noise, n, homogeneous):
    got = soil_share(2.0 * draw(rng, law, n), draw(rng, noise, homogeneous))
    return got.low, 1.0 - (LAWS[noise][1] / (2.0 * LAWS[law][1])) ** 2, got.high


def above_mean(rng, n, homogeneous, noise):
    """Runouts of 5.65 +- 0.2 m against a deterministic 5.6 m that is a mean of a few runs."""
    got = probability_above_mean(rng.normal(5.65, 0.2, n), rng.normal(5.6, noise, homogeneous))
    return got.low, stats.norm.sf(-0.25), got.high


def pairs(rng, law, r, n, m):
    """Fine values [n], their twins [n], all twins [m]; r is the correlation of the Gaussians."""
    coarse, rest = rng.standard_normal((2, m))
    fine = r * coarse + np.sqrt(1.0 - r**2) * rest
    if law != "normal":
        fine, coarse = (LAWS[law][0].ppf(stats.norm.cdf(z)) for z in (fine, coarse))
    return fine[:n], coarse[:n], coarse


def two_level_mean(rng, law, r, n, m):
    fine, twins, everyone = pairs(rng, law, r, n, m)
    got = controlled_mean(fine, paired_controls(twins, everyone))
    return got.low, LAWS[law][0].mean(), got.high


def two_level_sd(rng, law, r, n, m):
    got = controlled_sd(*pairs(rng, law, r, n, m))
    return got.low, LAWS[law][1], got.high


def two_level_share(rng, law, r, n, m, p):
    got = controlled_probability(*pairs(rng, law, r, n, m), LAWS[law][0].isf(p))
    return got.low, p, got.high


def field_mean(rng, n):
    """A control of known mean, on which the value depends not quite linearly."""
    x, rest = rng.standard_normal((2, n))
    got = controlled_mean(x + 0.2 * x**2 + rest, exact_controls(35.0 + x, 35.0))
    return got.low, 0.2, got.high


def twin_and_field_mean(rng, n, m):
    x, small, rest = rng.standard_normal((3, m))
    coarse = x + small
    fine = 0.8 * x + small + 0.3 * rest
    controls = paired_controls(coarse[:n], coarse).joined(exact_controls(35.0 + x[:n], 35.0))
    got = controlled_mean(fine[:n], controls)
    return got.low, 0.0, got.high


def rare(rng, p, n, strength):
    """S = a.xi of independent normal xi, drawn around `strength` times the most likely point."""
    a = np.array([1.0, -0.5, 0.25, 2.0, 0.1])
    a /= np.linalg.norm(a)
    limit = stats.norm.isf(p)
    centre = strength * limit * a
    xi = rng.standard_normal((n, len(a))) + centre
    log_weight = -xi @ centre + 0.5 * centre @ centre
    got = weighted_probability(xi @ a, log_weight, limit)
    return got.low, p, got.high


def weighted_moment(rng, estimate, truth, n):
    xi = rng.standard_normal(n) + 0.3
    got = estimate(xi, -0.3 * xi + 0.045)
    return got.low, truth, got.high


#: Name in the document: function, its arguments, band.
INTERVALS = {
    "mean, t, normal, N = 50": (mean, ("normal", 50), PROMISED),
    "mean, t, Gumbel, N = 50": (mean, ("Gumbel", 50), PROMISED),
    "sd, Bonett, normal, N = 8": (sd, ("normal", 8), PROMISED),
    "sd, Bonett, normal, N = 50": (sd, ("normal", 50), PROMISED),
    "sd, Bonett, normal, N = 1000": (sd, ("normal", 1000), PROMISED),
    "sd, Bonett, Gumbel, N = 50": (sd, ("Gumbel", 50), SHORT),
    "sd, Bonett, Gumbel, N = 200": (sd, ("Gumbel", 200), PROMISED),
    "sd, Bonett, Gumbel, N = 1000": (sd, ("Gumbel", 1000), PROMISED),
    "P(S > s) = 0.6, Wilson, N = 100": (share, (0.6, 100), PROMISED),
    "P(S > s) = 0.05, Wilson, N = 200": (share, (0.05, 200), PROMISED),
    "paired difference, t, Gumbel, N = 50": (paired, ("Gumbel", 50), PROMISED),
    "shift, Welch, normal, 100 against 8": (shift, ("normal", 100, 8), PROMISED),
    "shift, Welch, Gumbel, 100 against 8": (shift, ("Gumbel", 100, 8), PROMISED),
    "soil share, normal, noise normal, 100 against 8": (
        soil, ("normal", "normal", 100, 8), PROMISED),
    "soil share, Gumbel, noise normal, 100 against 8": (
        soil, ("Gumbel", "normal", 100, 8), PROMISED),
    "soil share, Gumbel, noise Gumbel, 100 against 8": (soil, ("Gumbel", "Gumbel", 100, 8), SHORT),
    "P(S > mean of 8), both, noise sd 0.05 m, N = 100": (above_mean, (100, 8, 0.05), PROMISED),
    "P(S > mean of 8), both, noise sd 0.15 m, N = 1000": (above_mean, (1000, 8, 0.15), PROMISED),
    "two-level mean, normal, r = 0.95, 50 of 400": (
        two_level_mean, ("normal", 0.95, 50, 400), PROMISED),
    "two-level mean, Gumbel, r = 0.99, 200 of 2000": (
        two_level_mean, ("Gumbel", 0.99, 200, 2000), PROMISED),
    "two-level sd, normal, r = 0.95, 50 of 400": (
        two_level_sd, ("normal", 0.95, 50, 400), PROMISED),
    "two-level sd, Gumbel, r = 0.95, 200 of 2000": (
        two_level_sd, ("Gumbel", 0.95, 200, 2000), PROMISED),
    "two-level P = 0.5, normal, r = 0.95, 50 of 400": (
        two_level_share, ("normal", 0.95, 50, 400, 0.5), PROMISED),
    "two-level P = 0.1, Gumbel, r = 0.95, 200 of 2000": (
        two_level_share, ("Gumbel", 0.95, 200, 2000, 0.1), PROMISED),
    "two-level P = 0.05, Gumbel, r = 0.99, 100 of 1000": (
        two_level_share, ("Gumbel", 0.99, 100, 1000, 0.05), SAFE),
    "mean with field mean, N = 50": (field_mean, (50,), PROMISED),
    "mean with twin and field mean, 50 of 400": (twin_and_field_mean, (50, 400), PROMISED),
    "importance sampling, P = 1e-2, N = 300": (rare, (1e-2, 300, 1.0), PROMISED),
    "importance sampling, P = 1e-3, N = 300, shift too small": (
        rare, (1e-3, 300, 0.7), PROMISED),
    "importance sampling, P = 1e-4, N = 300": (rare, (1e-4, 300, 1.0), PROMISED),
    "importance sampling, P = 1e-4, N = 1000, shift too large": (
        rare, (1e-4, 1000, 1.3), PROMISED),
    "importance sampling, mean, mild weights, N = 1000": (
        weighted_moment, (weighted_mean, 0.0, 1000), PROMISED),
    "importance sampling, sd, mild weights, N = 1000": (
        weighted_moment, (weighted_sd, 1.0, 1000), PROMISED),
}  # fmt: skip


def soil_by_f(rng, law, noise, n, homogeneous):
    got = soil_share(2.0 * draw(rng, law, n), draw(rng, noise, homogeneous))
    return got.normal_low, 1.0 - (LAWS[noise][1] / (2.0 * LAWS[law][1])) ** 2, got.normal_high


def above_mean_as_exact(rng, n, homogeneous, noise):
    values, reference = rng.normal(5.65, 0.2, n), rng.normal(5.6, noise, homogeneous)
    got = probability_above(values, reference.mean())
    return got.low, stats.norm.sf(-0.25), got.high


#: What is not used, and why: the largest share of ensembles in which it holds.
LEFT_OUT = {
    "sd, chi-square, Gumbel, N = 100": (sd_by_chi_square, ("Gumbel", 100), 0.88),
    "soil share, F, Gumbel, noise Gumbel, 100 against 8": (
        soil_by_f, ("Gumbel", "Gumbel", 100, 8), 0.92),
    "soil share, F, Gumbel, noise Gumbel, 100 against 20": (
        soil_by_f, ("Gumbel", "Gumbel", 100, 20), 0.89),
    "P(S > mean of 8), Wilson alone, noise sd 0.05 m, N = 100": (
        above_mean_as_exact, (100, 8, 0.05), 0.92),
    "P(S > mean of 8), Wilson alone, noise sd 0.15 m, N = 1000": (
        above_mean_as_exact, (1000, 8, 0.15), 0.6),
}  # fmt: skip

#: 99 % quantiles of the law that was chosen (law, N, whether with the choice made anew).
RESAMPLED = {
    f"99 % quantile, {'with the choice' if anew else 'law certain'}, {law}, N = {n}": (law, n, anew)
    for law, n in (("Gumbel", 50), ("Gumbel", 200), ("normal", 200))
    for anew in (False, True)
}
#: Bootstraps take their time.
RESAMPLED_ENSEMBLES = 200


def coverage(name, function, arguments, ensembles):
    """Share of the ensembles whose interval holds the truth; an interval that is not known does
    not."""
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    hits = 0
    for _ in range(ensembles):
        low, truth, high = function(rng, *arguments)
        hits += bool(low <= truth <= high)
    return hits / ensembles


@pytest.mark.parametrize("name", INTERVALS)
def test_intervals_hold_as_often_as_they_say(name):
    function, arguments, (least, most) = INTERVALS[name]
    assert least <= coverage(name, function, arguments, ENSEMBLES) <= most


@pytest.mark.parametrize("name", [name for name, (_, n, _) in RESAMPLED.items() if n == 50])
def test_quantiles_of_few_values_fall_short_as_documented(name):
    """84 and 86 % in docs/statistics.md, within three standard errors (0.025 of 200)."""
    share = coverage(name, law_quantile, RESAMPLED[name], RESAMPLED_ENSEMBLES)
    assert share == pytest.approx(0.85, abs=0.085)


@pytest.mark.parametrize("name", LEFT_OUT)
def test_what_is_not_used_holds_less_often(name):
    function, arguments, most = LEFT_OUT[name]
    assert coverage(name, function, arguments, ENSEMBLES) <= most


def test_both_intervals_of_a_standard_deviation_hold_for_normal_values():
    assert coverage("chi-square", sd_by_chi_square, ("normal", 100), ENSEMBLES) >= 0.93
    assert coverage("Bonett", sd, ("normal", 100), ENSEMBLES) >= 0.93


if __name__ == "__main__":
    COUNT = int(sys.argv[1]) if len(sys.argv) > 1 else ENSEMBLES
    print("| interval | holds |\n|---|---|")
    for NAME, (FUNCTION, ARGUMENTS, _) in {**INTERVALS, **LEFT_OUT}.items():
        print(
            f"| {NAME} | {100.0 * coverage(NAME, FUNCTION, ARGUMENTS, COUNT):.1f} % |", flush=True
        )
    for NAME, ARGUMENTS in RESAMPLED.items():
        HELD = coverage(NAME, law_quantile, ARGUMENTS, COUNT // 2)
        print(f"| {NAME} | {100.0 * HELD:.1f} % |", flush=True)
