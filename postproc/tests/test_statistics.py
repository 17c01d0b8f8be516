"""Intervals against tables and by hand; how often they hold is in test_coverage.py."""

import numpy as np
import pytest
from scipy import stats
from synthetic import sample, write_ensemble

from sgimp_post.ensemble import read_ensemble
from sgimp_post.errors import PostError
from sgimp_post.id_ranges import format_ids, parse_ids
from sgimp_post.statistics import (
    describe,
    describe_pairs,
    exceedance,
    holm,
    paired_difference,
    probability_above_mean,
    proportion_difference,
    running,
    sd_interval,
    soil_share,
    variance_ratio,
    welch_difference,
    wilson,
)


def test_wilson_against_the_table():
    at_100, at_1000 = wilson(60, 100), wilson(600, 1000)
    assert (at_100.low, at_100.high) == pytest.approx((0.502, 0.691), abs=1e-3)
    assert (at_1000.low, at_1000.high) == pytest.approx((0.569, 0.630), abs=1e-3)


@pytest.mark.parametrize("n", [1, 2, 50, 1000])
def test_wilson_is_that_of_scipy(n):
    for count in {0, 1, n // 3, n - 1, n}:
        expected = stats.binomtest(count, n).proportion_ci(0.95, method="wilson")
        got = wilson(count, n)
        assert (got.low, got.high) == pytest.approx((expected.low, expected.high), abs=1e-12)
        assert 0.0 <= got.low <= got.value <= got.high <= 1.0


@pytest.mark.parametrize(
    ("first", "second", "low", "high"),
    [
        ((56, 70), (48, 80), 0.0524, 0.3339),
        ((9, 10), (3, 10), 0.1705, 0.8090),
        ((10, 10), (0, 10), 0.6075, 1.0),
    ],
)
def test_difference_of_shares_against_the_table(first, second, low, high):
    """Newcombe (1998), Statistics in Medicine 17, 873-890, table II, method 10."""
    got = proportion_difference(wilson(*first), wilson(*second))
    assert (got.low, got.high) == pytest.approx((low, high), abs=6e-5)


def test_interval_of_the_standard_deviation_by_hand():
    """Bonett (2006): c = n/(n - z), se = c sqrt((kurtosis - (n - 3)/n)/(n - 1)), ends
    sqrt(exp(ln(c s^2) +- z se)); of ten values two are cut off at either end (10/(2 sqrt(6)) is
    2.04)."""
    x = np.array([9.5, 1.0, 2.0, 2.5, 2.75, 3.0, 3.25, 4.0, 5.0, 30.0])
    middle = np.mean([2.5, 2.75, 3.0, 3.25, 4.0, 5.0])
    fourth = 10 * np.sum((x - middle) ** 4) / np.sum((x - x.mean()) ** 2) ** 2
    c, z = 10 / (10 - 1.959964), 1.959964
    error = c * np.sqrt((fourth - 0.7) / 9)
    expected = np.sqrt(np.exp(np.log(c * x.var(ddof=1)) + np.array([-1, 1]) * z * error))
    assert sd_interval(x) == pytest.approx(expected, rel=1e-6)
    assert np.isnan(sd_interval(x[:7])).all()
    # What the program's own stop rule is tested with (tests/unit/test_stop_rule.pf).
    got = sd_interval([1, 2, 3, 30, 4, 5, 9, 8, 7, 6])
    assert got == pytest.approx((2.8138936911560366, 30.572514973576027), rel=1e-12)
    assert sd_interval(np.full(9, 2.0)) == (0.0, 0.0)


@pytest.mark.parametrize("n", [100, 1000])
def test_interval_of_the_standard_deviation_of_normal_values(n):
    """Kurtosis 3 leaves ln s^2 the error sqrt(2/n) to first order, as chi-square does: the factors
    of VERIFICATION, [0.878, 1.162] at 100 and [0.958, 1.046] at 1000, within the scatter of the
    kurtosis, sqrt(24/n), which moves the width by a quarter of it."""
    low, high = sd_interval(stats.norm.ppf((np.arange(n) + 0.5) / n))
    sd = np.std(stats.norm.ppf((np.arange(n) + 0.5) / n), ddof=1)
    expected = {100: (0.878, 1.162), 1000: (0.958, 1.046)}[n]
    room = 0.25 * np.sqrt(24.0 / n) * (expected[1] - expected[0]) / 2.0
    assert (low / sd, high / sd) == pytest.approx(expected, abs=room)


def test_ratio_of_variances_of_normal_values_is_the_f_interval():
    a, b = sample(1, 40), sample(2, 8)
    got = variance_ratio(a, b)
    ratio = a.var(ddof=1) / b.var(ddof=1)
    expected = [ratio / stats.f.ppf(p, 39, 7) for p in (0.975, 0.025)]
    assert (got.normal_low, got.normal_high) == pytest.approx(expected, rel=1e-10)
    assert got.low <= got.normal_low and got.high >= got.normal_high
    share = soil_share(b, a)
    assert (share.value, share.low, share.high) == pytest.approx(
        (1.0 - got.value, 1.0 - got.high, 1.0 - got.low)
    )


def test_kurtosis_takes_degrees_of_freedom_from_the_ratio():
    """2 n/(kurtosis - (n - 3)/(n - 1)), by hand, of a sample with a far value; 7 of the other."""
    a, b = np.append(sample(1, 39), 8.0), sample(2, 8)
    cut = int(40 / (2.0 * np.sqrt(36.0)))
    middle = np.sort(a)[cut : 40 - cut].mean()
    fourth = 40 * np.sum((a - middle) ** 4) / np.sum((a - a.mean()) ** 2) ** 2
    freedom = 80.0 / (fourth - 37.0 / 39.0)
    assert freedom < 6.0
    got = variance_ratio(a, b)
    expected = [got.value / stats.f.ppf(p, freedom, 7) for p in (0.975, 0.025)]
    assert (got.low, got.high) == pytest.approx(expected, rel=1e-10)


def test_exceedance_of_a_mean_that_is_not_known_exactly():
    values = np.arange(100.0)
    got = probability_above_mean(values, [48.5, 50.5] * 4)
    assert got.share.value == 0.5
    half = stats.t.ppf(0.975, 7) * np.std([48.5, 50.5] * 4, ddof=1) / np.sqrt(8)
    assert got.at_high == np.mean(values > 49.5 + half) < 0.5 < got.at_low
    assert got.low == pytest.approx(0.5 - np.hypot(0.5 - got.share.low, 0.5 - got.at_high))
    exact = probability_above_mean(values, [49.5] * 8)
    assert (exact.low, exact.high) == pytest.approx((exact.share.low, exact.share.high))


def test_running_is_what_the_first_values_give():
    values = np.random.default_rng(6).normal(1e3, 0.1, 37)
    got = running(values)
    for k in (2, 10, 37):
        at = list(got.count).index(k)
        assert got.mean[at] == pytest.approx(values[:k].mean(), rel=1e-12)
        assert got.sd[at] == pytest.approx(values[:k].std(ddof=1), rel=1e-9)


def test_exceedance_counts_what_is_above():
    got = exceedance([1.0, 2.0, 3.0, 4.0])
    assert list(got.x) == [1.0, 2.0, 3.0, 4.0]
    assert list(got.probability) == [0.75, 0.5, 0.25, 0.0]


def test_differences_are_those_of_scipy():
    first, second = sample(1, 30), sample(2, 30, 5.5, 0.4)
    paired, free = paired_difference(first, second), welch_difference(first, second[:20])
    assert paired.p_value == pytest.approx(stats.ttest_rel(first, second).pvalue, rel=1e-10)
    expected = stats.ttest_ind(first, second[:20], equal_var=False)
    assert free.p_value == pytest.approx(expected.pvalue, rel=1e-10)
    assert paired.mean == pytest.approx(np.mean(first - second))
    half = stats.t.ppf(0.975, 29) * stats.sem(first - second)
    assert paired.high - paired.mean == pytest.approx(half, rel=1e-10)


def test_holm_against_a_case_by_hand():
    """0.01 x 4, 0.02 x 3, 0.03 x 2 and 0.04 x 1, none below the one before it."""
    got = holm([0.03, 0.01, np.nan, 0.04, 0.02])
    assert got[[0, 1, 3, 4]] == pytest.approx([0.06, 0.04, 0.06, 0.06])
    assert np.isnan(got[2])


@pytest.mark.parametrize("values", [[], [np.nan], [5.0]])
def test_what_cannot_be_estimated_is_nan(values):
    got = describe(values)
    assert got.n == np.count_nonzero(np.isfinite(values))
    assert np.isnan([got.mean_low, got.mean_high, got.sd, got.sd_low, got.sd_high]).all()
    assert np.isnan(got.mean) == (got.n == 0)


@pytest.mark.parametrize(
    ("state", "ids", "used"),
    [
        ("stopped", [1, 2, 3, 5, 8], 3),
        ("running", [2, 3], 0),
        ("running", [1, 2, 3], 3),
        ("complete", [1, 2, 3, 5, 8], 5),
    ],
)
def test_an_unfinished_run_gives_statistics_its_first_members(tmp_path, state, ids, used):
    case = {"label": "base", "values": sample(4, len(ids)), "ids": ids}
    (got,) = read_ensemble(write_ensemble(tmp_path, [case], state)).for_statistics()
    assert list(got.id) == ids[:used]
    assert got.values("runout_max") == pytest.approx(case["values"][:used])
    assert got.profile_height.shape[0] == len(got.reason) == used


def test_an_unfinished_range_counts_from_its_first_member(tmp_path):
    case = {"label": "base", "values": sample(4, 5), "ids": [101, 102, 104, 105, 106]}
    directory = write_ensemble(tmp_path, [case], "stopped", members="101-110")
    (got,) = read_ensemble(directory).for_statistics()
    assert list(got.id) == [101, 102]


def test_what_came_in_after_a_stop_rule_does_not_count(tmp_path):
    case = {"label": "base", "values": sample(4, 6), "planned": 4, "more": {"stop_rule_met": 1}}
    (got,) = read_ensemble(write_ensemble(tmp_path, [case])).for_statistics()
    assert list(got.id) == [1, 2, 3, 4]


def test_a_case_says_what_it_is(tmp_path):
    more = {"role": "control", "control_of": "base_h0.25", "noise_case": "deterministic_h0.25",
            "varied": "damping=0.7, cell_size=0.25", "cell_size": 0.25, "toe": 5.5}  # fmt: skip
    cases = [{"label": "coarse", "values": [1.0], "more": more}, {"label": "old", "values": [1.0]}]
    new, old = read_ensemble(write_ensemble(tmp_path, cases)).cases
    assert (new.role, new.control_of, new.noise_case) == tuple(
        more[key] for key in ("role", "control_of", "noise_case")
    )
    assert new.varied == {"damping": "0.7", "cell_size": "0.25"}
    assert (new.geometry.toe, new.geometry.cell_size, new.geometry.x_max) == (5.5, 0.25, 20.0)
    assert (old.role, old.varied, old.geometry.cell_size) == ("study", {}, 0.5)
    assert old.column("log_weight")[0] == 0.0


@pytest.mark.parametrize(
    ("text", "ids"), [("", []), ("7", [7]), ("1-3, 9", [1, 2, 3, 9]), ("5,4-6,9-9", [4, 5, 6, 9])]
)
def test_ids_as_text(text, ids):
    assert list(parse_ids(text)) == ids
    assert list(parse_ids(format_ids(ids))) == ids


@pytest.mark.parametrize("text", ["a", "3-1", "1-", "1,,2", "-4"])
def test_what_is_no_range_of_ids_is_refused(text):
    with pytest.raises(PostError, match="is no range of ids"):
        parse_ids(text)


def test_members_stand_in_the_order_of_their_ids(tmp_path):
    values = sample(4, 4)
    case = {"label": "base", "values": values, "ids": [3, 1, 4, 2], "failed": [4]}
    (got,) = read_ensemble(write_ensemble(tmp_path, [case])).cases
    assert list(got.id) == [1, 2, 3, 4] and list(got.failed) == [False, False, False, True]
    assert got.values("runout_max") == pytest.approx(values[[1, 3, 0]])


def test_pairs_of_antithetic_members():
    """Mirror images leave only the even part: means of pairs and their interval by hand."""
    ids = np.array([1, 2, 3, 4, 5, 7, 8, 9, 10])
    values = np.array([1.0, 3.0, 2.0, 4.0, 9.0, np.nan, 5.0, 0.0, 8.0])
    found = describe_pairs(ids, values)
    assert found.n == 3  # (1, 2), (3, 4), (9, 10)
    assert found.mean == pytest.approx(3.0)
    half = stats.t.ppf(0.975, 2) * 1.0 / np.sqrt(3)  # pairs 2, 3, 4: deviation 1
    assert found.mean_high - found.mean == pytest.approx(half)


def test_intervals_of_pairs_hold_where_those_of_members_do_not():
    """Pairs z, -z of |z| + z/5: 40 members are 20 values twice, their interval is too narrow by
    sqrt(2) and holds the mean in 83 % of 1000 cases; that of pairs in 95 %, less four standard
    errors (0.0276)."""
    rng = np.random.default_rng(5)
    ids, mean, inside = np.arange(1, 41), np.sqrt(2.0 / np.pi), {"pairs": 0, "members": 0}
    for _ in range(1000):
        z = rng.standard_normal(20)
        values = np.empty(40)
        values[::2], values[1::2] = np.abs(z) + 0.2 * z, np.abs(z) - 0.2 * z
        for name, found in (("pairs", describe_pairs(ids, values)), ("members", describe(values))):
            inside[name] += bool(found.mean_low <= mean <= found.mean_high)
    assert inside["pairs"] > 922
    assert inside["members"] < 900
