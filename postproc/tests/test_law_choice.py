"""Bootstrap of fitted laws against what is known exactly, and `sgimp-post fit`."""

import csv
import json

import numpy as np
import pytest
from scipy import stats
from synthetic import sample, write_ensemble

from sgimp_post.cli import main
from sgimp_post.law_choice import _simulate, anderson_darling, choose_law


def rng(seed=1):
    return np.random.default_rng(seed)


def quantile(choice, probability):
    return next(q for q in choice.quantiles if q.probability == probability)


def test_the_interval_of_a_normal_quantile_is_that_of_the_noncentral_t():
    """mean + s t'/sqrt(n), t' noncentral with n - 1 degrees and z sqrt(n) (the classical limits of
    a quantile). An end simulated 20000 times is known to 1 % of the width: four of these."""
    x = sample(4, 20, 0.0, 0.4)
    choice = choose_law(x, 20000, rng(), (0.05, 0.99))
    assert choice.law == "normal"
    for p in (0.05, 0.99):
        shift = stats.norm.ppf(p) * np.sqrt(20)
        ends = stats.nct.ppf([0.025, 0.975], 19, shift) / np.sqrt(20)
        low, high = x.mean() + x.std(ddof=1) * ends
        got = quantile(choice, p)
        assert got.low == pytest.approx(low, abs=0.04 * (high - low))
        assert got.high == pytest.approx(high, abs=0.04 * (high - low))


def test_anderson_darling_is_the_integral_that_defines_it():
    """n times the integral of (F_n - F)^2/(F (1 - F)) dF, by the midpoint rule in u = F(x)."""
    y = np.sort(sample(2, 12, 0.0, 1.0))
    u = (np.arange(400_000) + 0.5) / 400_000
    steps = np.searchsorted(stats.norm.cdf(y), u, side="right") / 12
    expected = 12 * np.mean((steps - u) ** 2 / (u * (1 - u)))
    assert anderson_darling("normal", y, 0.0, 1.0) == pytest.approx(expected, rel=1e-4)
    u = stats.gumbel_r.cdf(y)
    same = anderson_darling("normal", stats.norm.ppf(u), 0.0, 1.0)
    assert anderson_darling("gumbel", y, 0.0, 1.0) == pytest.approx(same, rel=1e-10)


@pytest.mark.parametrize(
    ("law", "point"),
    [
        ("normal", 0.752 / (1 + 0.75 / 300 + 2.25 / 300**2)),
        ("gumbel", 0.757 / (1 + 0.2 / np.sqrt(300))),
    ],
)
def test_five_percent_points_are_those_of_the_tables(law, point):
    """D'Agostino and Stephens, Goodness-of-fit techniques (1986), tables 4.7 and 4.17; 10000
    samples give the point to 0.01 (root of 0.05 0.95/10000 over a density of 0.2)."""
    got = np.quantile(_simulate(law, 300, 10000, rng()).statistic, 0.95)
    assert got == pytest.approx(point, abs=0.03)


def test_the_test_holds_its_level_and_finds_what_is_no_such_law():
    """200 samples of Weibull: 5 % are refuted, within four standard errors of 1.5 %."""
    generator = rng(5)
    p = [
        choose_law(5 * generator.weibull(3.0, 25), 99, generator).p_value["weibull"]
        for _ in range(200)
    ]
    assert np.mean(np.array(p) <= 0.05) == pytest.approx(0.05, abs=0.06)
    assert np.mean(p) == pytest.approx(0.5, abs=4 * np.sqrt(1 / 12 / 200))
    choice = choose_law(rng().exponential(1.0, 100), 199, rng())
    assert choice.p_value["normal"] == choice.p_value["gumbel"] == 1 / 200
    assert choice.p_value["weibull"] > 0.05  # of which the exponential is one


@pytest.mark.parametrize(
    ("change", "laws"),
    [
        (lambda x: 3.0 + 2.0 * x, ("normal", "gumbel")),
        (lambda x: 2.0 * x**1.5, ("lognormal", "weibull")),
    ],
)
def test_what_moves_a_law_along_its_line_changes_no_p_value(change, laws):
    x = sample(6, 30)
    first, second = (choose_law(values, 199, rng()) for values in (x, change(x)))
    for law in laws:
        assert second.p_value[law] == first.p_value[law]
        assert second.statistic[law] == pytest.approx(first.statistic[law], rel=1e-8)


def test_resamples_choose_again():
    """Where one law always wins, its quantile scatters as the delta method says,
    s sqrt(1/n + z^2/(2 n)); where the laws are alike, the wins are shared."""
    n, z = 3000, stats.norm.ppf(0.99)
    choice = choose_law(sample(7, n, 10.0, 3.0), 1000, rng())
    assert choice.wins["normal"] > 0.99
    got = quantile(choice, 0.99)
    error = 3.0 * np.sqrt(1 / n + z**2 / (2 * n))
    assert got.choice_high - got.choice_low == pytest.approx(2 * 1.96 * error, rel=0.12)
    assert got.high - got.low == pytest.approx(2 * 1.96 * error, rel=0.12)
    alike = choose_law(sample(8, 20, 10.0, 0.5), 400, rng())
    assert sum(alike.wins.values()) == pytest.approx(1.0, abs=1e-12)
    assert sum(share > 0.02 for share in alike.wins.values()) >= 3
    wide = quantile(alike, 0.999)
    assert wide.choice_low < wide.value < wide.choice_high


def test_values_below_zero_and_few_values():
    choice = choose_law(np.r_[-1.0, sample(1, 20)], 99, rng())
    assert set(choice.p_value) == set(choice.wins) == {"normal", "gumbel"}
    few = choose_law(sample(1, 5), 99, rng())
    assert few.law and not few.p_value and np.isnan(quantile(few, 0.95).low)
    assert np.isfinite(quantile(few, 0.95).value)
    none = choose_law([5.0] * 9, 99, rng())
    assert none.law == "" and np.isnan(quantile(none, 0.95).value)
    two_values = choose_law([5.0] * 7 + [6.0], 99, rng())  # resamples of one value are drawn again
    assert quantile(two_values, 0.95).choice_low > 5.0


def run_directory(tmp_path, **attributes):
    cases = [
        {"label": "deterministic", "values": sample(1, 8)},
        {"label": "snx", "values": rng(2).gumbel(5.0, 0.2, 400), "failed": [3]},
        {"label": "sqx", "values": sample(3, 5), "planned": 9},
    ]
    return str(write_ensemble(tmp_path, cases, **attributes))


def test_fit_prints_and_writes(tmp_path, capsys):
    assert main(["fit", run_directory(tmp_path), "--bootstrap", "200"]) == 0
    out = capsys.readouterr().out
    assert "snx: 399 members, runout_max (farthest point), m; 200 bootstrap samples" in out
    assert "Gumbel (max) fits best" in out and "do not speak against it" in out
    assert "fewer than 8 members say no more" in out and "deterministic" not in out
    content = json.loads((tmp_path / "fit" / "fit.json").read_text())
    assert [case["case"] for case in content["cases"]] == ["snx", "sqx"]
    assert content["cases"][1]["quantiles"][0]["low"] is None
    with open(tmp_path / "fit" / "fits.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    gumbel = next(row for row in rows if (row["case"], row["law"]) == ("snx", "gumbel"))
    assert gumbel["parameter_2"] == "scale" and float(gumbel["value_2"]) == pytest.approx(
        0.2, abs=4 * 0.2 * np.sqrt(0.607927 / 400)
    )
    with open(tmp_path / "fit" / "quantiles.csv", newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["case"] == "snx"]
    assert [float(row["probability"]) for row in rows] == [0.95, 0.99, 0.999]
    assert all(float(row["low"]) < float(row["value"]) < float(row["high"]) for row in rows)
    first = (tmp_path / "fit" / "fit.json").read_bytes()
    assert main(["fit", run_directory(tmp_path), "--bootstrap", "200"]) == 0
    assert (tmp_path / "fit" / "fit.json").read_bytes() == first


def test_fit_takes_one_case_and_one_runout(tmp_path, capsys):
    directory = run_directory(tmp_path)
    options = ["--case", "deterministic", "--runout", "runout_q99", "--bootstrap", "100"]
    assert main(["fit", directory, *options]) == 0
    out = capsys.readouterr().out
    assert "deterministic: 8 members, runout_q99" in out and "snx" not in out
    content = json.loads((tmp_path / "fit" / "fit.json").read_text())
    mean = 0.8 * sample(1, 8).mean()
    assert content["cases"][0]["fits"][0]["parameters"]["mean"] == pytest.approx(mean, rel=1e-12)


def test_of_an_unfinished_run_the_members_without_a_gap_count(tmp_path, capsys):
    case = {"label": "snx", "values": sample(3, 12), "ids": [*range(1, 11), 12, 13]}
    write_ensemble(tmp_path, [case], "running", sampling="antithetic")
    assert main(["fit", str(tmp_path), "--bootstrap", "100"]) == 0
    captured = capsys.readouterr()
    assert "snx: 10 members" in captured.out and "the run is running" in captured.err
    assert "not independent" in captured.err


@pytest.mark.parametrize(
    ("attributes", "options", "words"),
    [
        ({"sampling": "importance"}, [], "sampling='importance': members have weights"),
        ({}, ["--case", "smk"], "no case smk; there are: deterministic, snx, sqx"),
        ({}, ["--bootstrap", "99"], "--bootstrap must be 100 or more"),
    ],
)
def test_what_cannot_be_fitted_is_said(attributes, options, words, tmp_path, capsys):
    assert main(["fit", run_directory(tmp_path, **attributes), *options]) == 2
    assert words in capsys.readouterr().err and not (tmp_path / "fit").exists()
