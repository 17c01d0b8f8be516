"""Maximum likelihood against closed forms."""

import numpy as np
import pytest

from sgimp_post.fits import (
    LAWS,
    best_fit,
    distribution_of,
    draw_on_line,
    estimate_on_line,
    fit_laws,
    from_line,
    log_probabilities,
    on_line,
    place_on_line,
)

VALUES = np.random.default_rng(1).lognormal(1.7, 0.2, 200)


def by_law(values):
    """The fits by name."""
    return {fit.law: fit for fit in fit_laws(values)}


def test_normal_and_lognormal_are_the_closed_forms():
    fits = by_law(VALUES)
    assert fits["normal"].parameters["mean"] == pytest.approx(VALUES.mean(), rel=1e-8)
    assert fits["normal"].parameters["sd"] == pytest.approx(VALUES.std(), rel=1e-8)
    logs = np.log(VALUES)
    assert fits["lognormal"].parameters["log_mean"] == pytest.approx(logs.mean(), rel=1e-8)
    assert fits["lognormal"].parameters["log_sd"] == pytest.approx(logs.std(), rel=1e-8)
    n, variance = len(VALUES), VALUES.var()
    expected = -0.5 * n * (np.log(2 * np.pi * variance) + 1)
    assert fits["normal"].log_likelihood == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize(
    "values", [VALUES, np.r_[VALUES, 90.0], 1e3 + 1e-3 * VALUES, 1e6 * VALUES, VALUES[:3]]
)
def test_gumbel_and_weibull_solve_their_likelihood_equations(values):
    """The equations as they stand in the books, with weights of the values themselves."""
    fits = by_law(values)
    scale, location = fits["gumbel"].parameters["scale"], fits["gumbel"].parameters["location"]
    weights = np.exp(-(values - values.min()) / scale)
    expected = values.mean() - np.sum(values * weights) / weights.sum()
    assert expected == pytest.approx(scale, abs=1e-8 * values.std())
    assert np.mean(np.exp(-(values - location) / scale)) == pytest.approx(1.0, abs=1e-8)
    shape, unit = fits["weibull"].parameters["shape"], fits["weibull"].parameters["scale"]
    logs = np.log(values)
    powers = np.exp(shape * (logs - logs.max()))
    slope = np.sum(powers * logs) / powers.sum() - logs.mean()
    assert slope * shape == pytest.approx(1.0, abs=1e-8)
    assert np.mean(np.exp(shape * (logs - np.log(unit)))) == pytest.approx(1.0, abs=1e-8)


def test_likelihoods_are_those_of_scipy():
    for fit in fit_laws(VALUES):
        expected = np.sum(distribution_of(fit).logpdf(VALUES))
        assert fit.log_likelihood == pytest.approx(expected, rel=1e-12)


def test_many_samples_at_once_are_each_of_them():
    samples = np.random.default_rng(2).lognormal(1.7, 0.2, (5, 40))
    for law in LAWS:
        y = on_line(law, samples)
        many = np.column_stack(estimate_on_line(law, y))
        each = [estimate_on_line(law, row) for row in y]
        assert many == pytest.approx(np.array(each), rel=1e-12)


def test_lines_lead_to_the_quantiles_and_probabilities_of_scipy():
    p = np.array([1e-6, 0.05, 0.5, 0.999])
    for fit in fit_laws(VALUES):
        location, scale = estimate_on_line(fit.law, on_line(fit.law, VALUES))
        x = from_line(fit.law, location + scale * place_on_line(fit.law, p))
        assert x == pytest.approx(distribution_of(fit).ppf(p), rel=1e-12)
        below, above = log_probabilities(fit.law, place_on_line(fit.law, p))
        if fit.law == "weibull":
            below, above = above, below
        assert np.exp(below) == pytest.approx(p, rel=1e-10)
        assert np.exp(above) == pytest.approx(1.0 - p, rel=1e-10)


def test_bic_less_aic_is_two_ln_n_less_four():
    for fit in fit_laws(VALUES):
        assert fit.bic - fit.aic == pytest.approx(2 * np.log(len(VALUES)) - 4, abs=1e-9)


@pytest.mark.parametrize("law", ["gumbel", "weibull"])
def test_estimates_scatter_as_theory_says(law):
    """n var(location)/beta^2 = 1.108665, n var(beta)/beta^2 = 6/pi^2 = 0.607927, and the
    covariance 6 (1 - gamma)/pi^2 = 0.257022; 4000 samples of 500 give a variance to 2.2 %
    (sqrt(2/4000)): 9 % is four standard errors."""
    rng = np.random.default_rng(3)
    x = from_line(law, 1.5 + 0.2 * draw_on_line(law, rng, (4000, 500)))
    location, scale = estimate_on_line(law, on_line(law, x))
    assert 500 * np.var(location) / 0.04 == pytest.approx(1.108665, rel=0.09)
    assert 500 * np.var(scale) / 0.04 == pytest.approx(0.607927, rel=0.09)
    product = 500 * np.cov(location, scale)[0, 1] / 0.04
    assert product == pytest.approx(0.257022, abs=4 * np.sqrt(1.108665 * 0.607927 / 4000) * 1.1)


@pytest.mark.parametrize("values", [[], [5.0], [5.0, 5.1], [5.0] * 9])
def test_too_few_or_equal_values_have_a_note(values):
    assert all(fit.note for fit in fit_laws(values))
    assert best_fit(fit_laws(values)) is None


@pytest.mark.parametrize("low", [0.0, -1.0])
def test_values_not_above_zero_leave_the_laws_on_the_whole_line(low):
    fits = by_law(np.r_[low, VALUES])
    assert "above zero" in fits["lognormal"].note and "above zero" in fits["weibull"].note
    assert not fits["normal"].note and not fits["gumbel"].note


def test_weights_are_shares_and_the_best_law_has_the_largest():
    fits = fit_laws(VALUES)
    assert sum(fit.weight for fit in fits) == pytest.approx(1.0, abs=1e-12)
    best = max(fits, key=lambda fit: fit.weight)
    assert best_fit(fits) == best and best.delta_aic == 0.0
    for fit in fits:
        ratio = np.exp(0.5 * (best.aic - fit.aic))
        assert fit.weight / best.weight == pytest.approx(ratio, rel=1e-12)
