"""Intervals against tables, and their coverage."""

import numpy as np
import pytest

from sgimp_post.statistics import describe, exceedance, probability_above, running, wilson


def test_wilson_against_the_table():
    at_100, at_1000 = wilson(60, 100), wilson(600, 1000)
    assert (at_100.low, at_100.high) == pytest.approx((0.502, 0.691), abs=1e-3)
    assert (at_1000.low, at_1000.high) == pytest.approx((0.569, 0.630), abs=1e-3)


@pytest.mark.parametrize(("n", "low", "high"), [(100, 0.878, 1.162), (1000, 0.958, 1.046)])
def test_standard_deviation_factors(n, low, high):
    values = np.random.default_rng(2).normal(0, 1, n)
    got = describe(values)
    assert (got.sd_low / got.sd, got.sd_high / got.sd) == pytest.approx((low, high), abs=1e-3)


def test_intervals_cover_what_they_promise():
    """Of 1000 ensembles of 50, a 95 % interval misses 50 +- 7: 93 to 97 % is three sigma."""
    rng = np.random.default_rng(5)
    mean = proportion = 0
    for _ in range(1000):
        values = rng.normal(3.0, 0.7, 50)
        got = describe(values)
        mean += got.mean_low <= 3.0 <= got.mean_high
        share = probability_above(values, 3.0)
        proportion += share.low <= 0.5 <= share.high
    assert 0.93 <= mean / 1000 <= 0.97
    assert 0.93 <= proportion / 1000 <= 0.97


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
