"""Maximum likelihood against closed forms."""

import numpy as np
import pytest

from sgimp_post.fits import best_fit, fit_laws

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


def test_gumbel_and_weibull_solve_their_likelihood_equations():
    fits = by_law(VALUES)
    scale = fits["gumbel"].parameters["scale"]
    weights = np.exp(-VALUES / scale)
    assert scale == pytest.approx(
        VALUES.mean() - np.sum(VALUES * weights) / weights.sum(), rel=1e-6
    )
    location = fits["gumbel"].parameters["location"]
    assert location == pytest.approx(-scale * np.log(weights.mean()), rel=1e-6)
    shape = fits["weibull"].parameters["shape"]
    powers = VALUES**shape
    slope = np.sum(powers * np.log(VALUES)) / powers.sum() - np.log(VALUES).mean()
    assert 1 / shape == pytest.approx(slope, rel=1e-6)
    assert fits["weibull"].parameters["scale"] == pytest.approx(
        powers.mean() ** (1 / shape), rel=1e-6
    )


def test_bic_less_aic_is_two_ln_n_less_four():
    for fit in fit_laws(VALUES):
        assert fit.bic - fit.aic == pytest.approx(2 * np.log(len(VALUES)) - 4, abs=1e-9)


def test_gumbel_estimates_scatter_as_theory_says():
    """n var(location)/beta^2 = 1.108665 and n var(beta)/beta^2 = 0.607927; 150 samples of 200 give
    each to 12 % (one standard error of a variance, sqrt(2/150)), so 40 % is beyond three."""
    rng = np.random.default_rng(3)
    got = [by_law(rng.gumbel(5.0, 0.5, 200))["gumbel"].parameters for _ in range(150)]
    location = 200 * np.var([one["location"] for one in got]) / 0.25
    scale = 200 * np.var([one["scale"] for one in got]) / 0.25
    assert location == pytest.approx(1.108665, rel=0.4)
    assert scale == pytest.approx(0.607927, rel=0.4)


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
