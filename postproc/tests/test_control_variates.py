"""Control variates and importance sampling against closed forms; how often their intervals hold is
in test_coverage.py."""

import h5py
import numpy as np
import pytest
from scipy import optimize, stats
from synthetic import write_ensemble
from synthetic_fields import lattice_points, write_run

from sgimp_post.cli import main
from sgimp_post.control_variates import (
    allocate_for_cost,
    allocate_for_half_width,
    best_ratio,
    controlled_mean,
    controlled_probability,
    controlled_sd,
    exact_controls,
    paired_controls,
    predicted_gain,
    realised_gain,
)
from sgimp_post.ensemble import read_ensemble
from sgimp_post.importance import (
    effective_size,
    exceedance_quantile,
    weighted_mean,
    weighted_probability,
)
from sgimp_post.random_fields import read_random_fields
from sgimp_post.two_level import expected_field_means


def twins(seed, r, n, m):
    """Fine values [n], coarse ones of the same members, coarse ones of all m."""
    coarse, rest = np.random.default_rng(seed).standard_normal((2, m))
    fine = 5.0 + 0.2 * (r * coarse + np.sqrt(1.0 - r**2) * rest)
    return fine[:n], 4.0 + 0.3 * coarse[:n], 4.0 + 0.3 * coarse


def test_the_mean_is_that_of_the_regression_line():
    """At the mean of all twins, by polyfit; the error by hand."""
    y, c, everyone = twins(1, 0.9, 30, 200)
    got = controlled_mean(y, paired_controls(c, everyone))
    slope, start = np.polyfit(c, y, 1)
    assert got.value == pytest.approx(start + slope * everyone.mean(), rel=1e-12)
    rest = np.sum((y - start - slope * c) ** 2) / 28
    away = (everyone.mean() - c.mean()) ** 2 / np.sum((c - c.mean()) ** 2)
    error = rest * (1 / 30 + away) + slope**2 * everyone.var(ddof=1) / 200
    assert got.error == pytest.approx(np.sqrt(error), rel=1e-12)
    assert got.correlation == pytest.approx(np.corrcoef(y, c)[0, 1], rel=1e-9)


def test_variance_of_the_nested_estimator():
    """Over 2000 pilots of 100 of 1000: s^2/n (1 - r^2 (1 - n/M)); the standard error of a variance
    from 2000 values is 3.2 %, the estimated slope adds 1 %."""
    r, n, m = 0.9, 100, 1000
    found = [
        controlled_mean(y, paired_controls(c, everyone)).value
        for y, c, everyone in (twins(seed, r, n, m) for seed in range(2000))
    ]
    expected = 0.2**2 / n * (1.0 - r**2 * (1.0 - n / m))
    assert np.var(found) == pytest.approx(expected, rel=4 * 0.032 + 0.01)


def test_twins_without_more_members_change_nothing():
    y, c, _ = twins(2, 0.9, 40, 40)
    got = controlled_mean(y, paired_controls(c, c))
    assert got.value == pytest.approx(y.mean(), rel=1e-12)


def test_a_value_that_is_its_control_has_the_error_of_the_control():
    _, c, everyone = twins(3, 0.9, 40, 400)
    got = controlled_mean(2.0 * c + 1.0, paired_controls(c, everyone))
    assert got.value == pytest.approx(2.0 * everyone.mean() + 1.0, rel=1e-12)
    assert got.error == pytest.approx(2.0 * everyone.std(ddof=1) / 20.0, rel=1e-9)
    exact = controlled_mean(2.0 * c + 1.0, exact_controls(c, 4.0))
    assert exact.value == pytest.approx(9.0, rel=1e-12)


def test_the_threshold_of_the_twins_does_not_bias_an_exceedance():
    """Mean of 1000 estimates of P = 0.1; their spread tells the error of that mean (4 of it)."""
    threshold = 5.0 + 0.2 * stats.norm.isf(0.1)
    found = [
        controlled_probability(*twins(seed, 0.95, 100, 1000), threshold).value
        for seed in range(1000)
    ]
    assert np.mean(found) == pytest.approx(0.1, abs=4 * np.std(found) / np.sqrt(1000))
    assert np.std(found) < 0.75 * np.sqrt(0.09 / 100)


def test_an_exceedance_beyond_all_members_is_that_of_the_plain_members():
    got = controlled_probability(*twins(5, 0.95, 50, 500), 9.0)
    z2 = stats.norm.ppf(0.975) ** 2
    assert (got.value, got.low, got.correlation) == (0.0, 0.0, 0.0)
    assert got.high == pytest.approx(z2 / (50 + z2))


def test_twins_improve_a_standard_deviation():
    found = [controlled_sd(*twins(seed, 0.95, 100, 1000)) for seed in range(400)]
    spread = {k: np.std([getattr(one, k) for one in found]) for k in ("value", "plain")}
    assert spread["value"] < 0.65 * spread["plain"]  # sqrt(1 - 0.95^4 (1 - 0.1)) = 0.52
    assert np.mean([one.value for one in found]) == pytest.approx(0.2, rel=0.02)


@pytest.mark.parametrize("n", [0, 1, 5])
def test_too_few_pairs_are_no_estimate(n):
    y, c, everyone = twins(4, 0.9, n, 20)
    assert np.isnan(controlled_mean(y, paired_controls(c, everyone)).value)
    assert np.isnan(controlled_sd(y, c, everyone).value)


def test_gain_of_the_specification():
    """VERIFICATION.md, D: r = 0.95, w = 8 gives 2.4."""
    assert predicted_gain(0.95, 8.0) == pytest.approx(2.4, abs=0.05)


@pytest.mark.parametrize(("r", "w"), [(0.95, 8.0), (0.7, 3.0), (0.99, 30.0)])
def test_best_allocation_is_the_least_cost(r, w):
    """Against a search of the least variance at a cost of 1000 fine members."""

    def variance(n):
        return (1.0 - r**2) / n + r**2 / (w * (1000.0 - n))

    best = optimize.minimize_scalar(
        variance, bounds=(1.0, 1000.0 * w / (1.0 + w)), method="bounded", options={"xatol": 1e-9}
    ).x
    assert best_ratio(r, w) == pytest.approx(w * (1000.0 - best) / best, rel=1e-5)
    assert 1.0 / 1000.0 / variance(best) == pytest.approx(predicted_gain(r, w), rel=1e-9)
    n, m = allocate_for_cost(r, w, 1000)
    assert n == pytest.approx(best, abs=1.0) and n + m / w <= 1000
    n, m = allocate_for_half_width(0.2, r, w, 0.01)
    error = 0.2 * np.sqrt((1.0 - r**2) / n + r**2 / m)
    assert 1.959964 * error == pytest.approx(0.01, rel=0.02) and 1.959964 * error <= 0.01


def test_realised_gain_is_the_predicted_one_at_the_best_allocation():
    """Large samples, so that the estimated slope costs nothing: within the scatter of r, 2 %."""
    r, w = 0.95, 8.0
    n, m = allocate_for_cost(r, w, 20000)
    y, c, everyone = twins(7, r, n, m)
    got = controlled_mean(y, paired_controls(c, everyone))
    assert realised_gain(got, w) == pytest.approx(predicted_gain(r, w), rel=0.05)


def test_weights_of_one_are_plain_sampling():
    values = np.random.default_rng(3).normal(5.0, 1.0, 400)
    got = weighted_probability(values, np.zeros(400), 5.5)
    assert got.value == np.mean(values > 5.5)
    assert got.error == pytest.approx(np.std(values > 5.5, ddof=1) / 20.0)
    assert effective_size(np.zeros(400)) == 400.0
    assert weighted_mean(values, np.full(400, -800.0)).value == pytest.approx(values.mean())
    assert np.mean(values > exceedance_quantile(values, np.zeros(400), 0.1)) == 0.1


def test_moments_of_a_plan_for_the_tail_are_not_told():
    xi = np.random.default_rng(4).standard_normal(1000) + 3.0
    assert np.isnan(weighted_mean(xi, -3.0 * xi + 4.5).value)


KEYS = {"name": "phi", "property": "friction_angle", "material": "sand", "distribution": "normal",
        "mean": 35.0, "cov": 0.2, "scale_x": 0.4, "scale_y": 0.4, "lower": 28.0,
        "upper": 60.0}  # fmt: skip


def test_expected_field_mean_is_that_of_the_clipped_law(tmp_path):
    """Of a normal law that is set to its bounds, by SciPy's quadrature."""
    points = lattice_points(6, 5)
    write_run(tmp_path, [KEYS], [points], members=3)
    case = read_ensemble(tmp_path).case("snx_cov0.10")
    fields = read_random_fields(tmp_path)
    means = fields.values(case, case.id)["phi"].mean(axis=1)
    with h5py.File(tmp_path / "ensemble.h5", "r+") as file:
        file["cases/snx_cov0.10/field_mean"][...] = means
    law = stats.norm(35.0, 3.5)
    expected = (
        law.expect(lambda x: x, lb=28.0, ub=60.0) + 28.0 * law.cdf(28.0) + 60.0 * law.sf(60.0)
    )
    got = expected_field_means(read_ensemble(tmp_path))
    assert got == {"snx_cov0.10": pytest.approx(expected, rel=1e-9)}
    with h5py.File(tmp_path / "ensemble.h5", "r+") as file:  # points that are not those on record
        file["cases/snx_cov0.10/field_mean"][...] = means + 0.01
    assert expected_field_means(read_ensemble(tmp_path)) == {}


def test_exceedances_are_told_where_the_plan_draws():
    """Ten members on either side of s; below, the weights of a shift by three deceive."""
    xi = np.random.default_rng(6).standard_normal(1000) + 3.0
    for s, is_supported in ((-0.3, False), (1.5, True), (4.0, True), (5.9, False)):
        assert weighted_probability(xi, -3.0 * xi + 4.5, s).is_supported is is_supported


def pilot(directory, r=0.95, n=60, m=300, **attributes):
    """A study case with its twin, eight times cheaper."""
    y, c, everyone = twins(9, r, n, m)
    cases = [
        {"label": "deterministic", "values": 5.0 + 0.01 * np.arange(8)},
        {"label": "base", "values": y, "columns": {"seconds": np.full(n, 4.0)}},
        {"label": "base_control", "values": everyone, "columns": {"seconds": np.full(m, 0.5)},
         "more": {"role": "control", "control_of": "base"}},
    ]  # fmt: skip
    write_ensemble(directory, cases, **attributes)
    return controlled_mean(y, paired_controls(c, everyone))


def test_allocate_plans_the_next_run(tmp_path, capsys):
    estimate = pilot(tmp_path)
    assert main(["allocate", str(tmp_path), "--half-width", "0.01"]) == 0
    text = capsys.readouterr().out
    sd = np.std(twins(9, 0.95, 60, 300)[0], ddof=1)
    n, m = allocate_for_half_width(sd, estimate.correlation, 8.0, 0.01)
    assert f"realizations = {n}, control realizations = {m}" in text
    row = next(line for line in text.splitlines() if line.startswith("base")).split()
    assert row[1] == "60" and float(row[2]) == pytest.approx(estimate.correlation, abs=1e-3)
    assert main(["allocate", str(tmp_path), "--hours", "1"]) == 0
    n, m = allocate_for_cost(estimate.correlation, 8.0, 900)
    assert f"realizations = {n}, control realizations = {m}" in capsys.readouterr().out
    assert main(["allocate", str(tmp_path)]) == 0
    assert "--half-width or --hours" in capsys.readouterr().out


def test_cases_of_a_study_share_the_numbers(tmp_path, capsys):
    """The most that any case needs for a half-width; hours are those of both."""
    cases, sds, rs = [{"label": "deterministic", "values": 5.0 + 0.01 * np.arange(8)}], [], []
    for label, seed, r in (("one", 9, 0.95), ("two", 10, 0.8)):
        y, c, everyone = twins(seed, r, 60, 300)
        sds.append(np.std(y, ddof=1))
        rs.append(controlled_mean(y, paired_controls(c, everyone)).correlation)
        cases.append({"label": label, "values": y, "columns": {"seconds": np.full(60, 4.0)}})
        cases.append(
            {"label": f"{label}_control", "values": everyone,
             "columns": {"seconds": np.full(300, 0.5)},
             "more": {"role": "control", "control_of": label}}
        )  # fmt: skip
    write_ensemble(tmp_path, cases)
    assert main(["allocate", str(tmp_path), "--half-width", "0.01"]) == 0
    needed = [allocate_for_half_width(sd, r, 8.0, 0.01) for sd, r in zip(sds, rs)]
    n, m = (max(column) for column in zip(*needed))
    hours = 2 * (4.0 * n + 0.5 * m) / 3600.0
    text = capsys.readouterr().out
    assert f"realizations = {n}, control realizations = {m} in each case: {hours:.3g} core" in text
    assert main(["allocate", str(tmp_path), "--hours", "2"]) == 0
    n, m = (min(column) for column in zip(*(allocate_for_cost(r, 8.0, 900) for r in rs)))
    assert f"realizations = {n}, control realizations = {m} in" in capsys.readouterr().out


def test_a_twin_that_does_not_pay_is_told(tmp_path, capsys):
    pilot(tmp_path, r=0.3)
    assert main(["allocate", str(tmp_path)]) == 0
    assert "costs more than it brings in: base" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "attributes", "words"),
    [
        (["--hours", "0"], {}, "--hours must be above zero"),
        (["--half-width", "nan"], {}, "--half-width must be above zero"),
        ([], {"sampling": "antithetic"}, "members are not independent"),
        ([], {"n": 5}, "too few finished pairs"),
    ],
)
def test_a_pilot_that_does_not_serve_is_refused(arguments, attributes, words, tmp_path, capsys):
    pilot(tmp_path, **attributes)
    assert main(["allocate", str(tmp_path), *arguments]) == 2
    assert words in capsys.readouterr().err


def test_a_run_without_twins_is_no_pilot(tmp_path, capsys):
    write_ensemble(tmp_path, [{"label": "base", "values": [5.0, 5.1]}])
    assert main(["allocate", str(tmp_path)]) == 2
    assert "no case has a twin" in capsys.readouterr().err
