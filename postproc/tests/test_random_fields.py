"""The fields rebuilt without the program, and their audit, against closed forms."""

import csv
import json

import h5py
import numpy as np
import pytest
from scipy import integrate, special, stats
from synthetic import write_ensemble
from synthetic_fields import lattice_points, philox, white_noise, write_run

from sgimp_post import random_fields
from sgimp_post.autocorrelation import ACF_NAMES, Correlation, average_correlation, rho
from sgimp_post.cli import main
from sgimp_post.conditioning import pivoted_factor
from sgimp_post.errors import PostError
from sgimp_post.field_audit import check_mean
from sgimp_post.marginals import LAWS, Marginal
from sgimp_post.namelist import read_namelist
from sgimp_post.random_fields import read_random_fields
from sgimp_post.samplers import Points, create_sampler, plane_spectrum, ring_spectrum
from sgimp_post.sampling_plan import latin_hypercube_uniform, normal, uniform

#: Variance reduction over x = T/delta, VERIFICATION.md part C.
REDUCTIONS = {
    "snx": lambda x: (2 * x + np.exp(-2 * x) - 1) / (2 * x**2),
    "sqx": lambda x: (
        (np.pi * x * special.erf(np.sqrt(np.pi) * x) + np.exp(-np.pi * x**2) - 1) / (np.pi * x**2)
    ),
    "smk": lambda x: (2 + np.exp(-4 * x) - 3 / (4 * x) * (1 - np.exp(-4 * x))) / (2 * x),
    "csx": lambda x: (x - np.exp(-x) * np.sin(x)) / x**2,
    "bin": lambda x: 1 - x / 3 if x <= 1 else (1 - 1 / (3 * x)) / x,
}
#: rho(.3125 delta), Gamma^2(delta), condition of C and least eigenvalue of the ring of 158 sites on
#: a line of 80 points 0.3125 scales apart (the same table).
TABLE = {
    "snx": (0.535261, 0.567668, 10.9, 0.303),
    "sqx": (0.735801, 0.683257, 1523.0, 0.0021),
    "smk": (0.644636, 0.641026, 26.3, 0.122),
    "csx": (0.696182, 0.690440, 24.4, 0.159),
    "bin": (0.687500, 0.666667, 55.4, 0.058),
}
#: Mean and standard deviation that every law can have on [20, 60].
MEAN, SD, LOWER, UPPER = 35.0, 5.0, 20.0, 60.0
FIELD = {"name": "phi", "property": "friction_angle", "distribution": "normal", "mean": MEAN,
         "cov": 0.1, "scale_x": 0.6, "scale_y": 0.4, "lower": 1.0, "upper": 60.0}  # fmt: skip


def points_of(x, y, size=0.25):
    return Points(x, y, np.full(len(x), size), np.full(len(x), size))


def law_of(name, mean=MEAN, sd=SD, lower=LOWER, upper=UPPER):
    return Marginal(name, np.atleast_1d(mean), np.atleast_1d(sd), lower, upper)


# Autocorrelation.


@pytest.mark.parametrize("acf", ACF_NAMES)
@pytest.mark.parametrize("smoothness", [0.3, 0.5, 2.2])
def test_twice_the_integral_of_rho_is_one_scale_of_fluctuation(acf, smoothness):
    edges = [0.0, 0.05, 1.0, 4.0 / 3.0, 5.0, 40.0]
    parts = [
        integrate.quad(lambda t: float(rho(acf, t, smoothness)), a, b, epsabs=1e-12)[0]
        for a, b in zip(edges[:-1], edges[1:])
    ]
    assert rho(acf, 0.0, smoothness) == pytest.approx(1.0, abs=1e-15)
    assert 2.0 * sum(parts) == pytest.approx(1.0, abs=1e-9)


def test_matern_contains_the_functions_of_half_integers():
    t = np.linspace(0.0, 3.0, 301)
    for smoothness, acf in ((0.5, "snx"), (1.5, "smk"), (1.5, "matern32"), (2.5, "matern52")):
        assert rho("matern", t, smoothness) == pytest.approx(rho(acf, t), rel=1e-12, abs=1e-14)
    # For ever smoother fields it goes to SQX; the distance falls as 1/nu.
    distance = [np.abs(rho("matern", t, nu) - rho("sqx", t)).max() for nu in (50.0, 100.0, 200.0)]
    assert np.diff(distance).max() < 0.0 and distance[2] < 2e-3
    assert distance[0] / distance[2] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("acf", TABLE)
def test_table_of_the_verification_document(acf):
    value, reduction, condition, eigenvalue = TABLE[acf]
    assert rho(acf, 0.3125) == pytest.approx(value, abs=6e-7)
    assert average_correlation(acf, 0.0, 0.2, 0.2, 0.2) == pytest.approx(reduction, abs=6e-7)
    line = np.arange(80) * 0.0625
    matrix = rho(acf, np.abs(line[:, None] - line) / 0.2)
    assert np.linalg.cond(matrix) == pytest.approx(condition, rel=6e-3)
    spectrum = ring_spectrum(Correlation(acf, 0.2, 0.2), 0, 158, 0.0625)
    assert spectrum.min() == pytest.approx(eigenvalue, rel=0.025)


@pytest.mark.parametrize("acf", REDUCTIONS)
@pytest.mark.parametrize("x", [0.01, 0.3125, 1.0, 1.5, 7.0])
def test_averages_against_closed_variance_reductions(acf, x):
    """A single cell, and two side by side: Gamma^2(2x) = (Gamma^2(x) + c)/2."""
    got = average_correlation(acf, np.array([0.0, x]), x, x, 1.0)
    # The closed forms cancel: they hold to eps/x^2.
    loose = 1e-12 + 4e-16 / x**2
    assert got[0] == pytest.approx(REDUCTIONS[acf](x), abs=loose)
    assert got[1] == pytest.approx(2 * REDUCTIONS[acf](2 * x) - REDUCTIONS[acf](x), abs=3 * loose)


def test_averages_of_unlike_lengths_and_at_points():
    """Two lengths a + b make one: (a+b)^2 G(a+b) = a^2 G(a) + b^2 G(b) + 2 a b c; a point in the
    middle of a length sees twice the integral over half of it."""
    a, b, gamma = 0.7, 0.2, REDUCTIONS["csx"]
    mixed = average_correlation("csx", 0.5 * (a + b), a, b, 1.0)
    rest = (a + b) ** 2 * gamma(a + b) - a**2 * gamma(a) - b**2 * gamma(b)
    assert mixed == pytest.approx(rest / (2 * a * b), rel=1e-12)
    assert average_correlation("snx", 0.0, 0.8, 0.0, 1.0) == pytest.approx(
        (1 - np.exp(-0.8)) / 0.8, rel=1e-13
    )


@pytest.mark.parametrize("smoothness", [0.3, 0.7, 1.8])
def test_averages_of_rough_matern_fields(smoothness):
    expected = 2.0 * integrate.quad(
        lambda u: (1 - u**3) * float(rho("matern", u**3, smoothness)) * 3 * u**2,
        0, 1, epsabs=1e-14, epsrel=1e-13,
    )[0]  # fmt: skip
    got = average_correlation("matern", 0.0, 1.0, 1.0, 1.0, smoothness)
    assert got == pytest.approx(expected, rel=1e-12)


def test_rotation_and_radial_form():
    along = Correlation("snx", 2.0, 0.5, "product", 30.0)
    step = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])
    assert along.at(*step) == pytest.approx(np.exp(-2 / 2.0), rel=1e-14)
    assert along.at(-step[1], step[0]) == pytest.approx(np.exp(-2 / 0.5), rel=1e-14)
    radial = Correlation("snx", 2.0, 0.5, "radial")
    assert radial.at(1.2, -0.4) == pytest.approx(np.exp(-2 * np.hypot(0.6, 0.8)), rel=1e-14)


# Marginals.


@pytest.mark.parametrize("name", LAWS)
def test_marginals_go_there_and_back_in_both_tails(name):
    """To 8 sigma; a value near a bound of its law holds z only as well as its distance from it."""
    law = law_of(name)
    z = np.linspace(-8.0, 8.0, 161)[:, None]
    value = law.unclipped(z)
    assert (np.diff(value[:, 0]) >= 0.0).all()
    slope = np.maximum(law.slope(z), 1e-300)
    allowed = 1e-11 + 8 * np.finfo(float).eps * np.abs(value) / slope
    good = allowed < 0.1
    assert good.mean() > 0.7
    assert (np.abs(law.gaussian(value) - z) <= allowed)[good].all()


@pytest.mark.parametrize("name", LAWS)
def test_slope_is_the_derivative(name):
    law, z = law_of(name), np.linspace(-2.0, 2.0, 9)[:, None]
    difference = (law.unclipped(z + 1e-5) - law.unclipped(z - 1e-5)) / 2e-5
    assert law.slope(z) == pytest.approx(difference, rel=1e-7)


@pytest.mark.parametrize("name", LAWS)
def test_moments_are_those_asked_for(name):
    lower, upper = (LOWER, UPPER) if name == "beta" else (-1e30, 1e30)
    if name == "truncated_normal":
        lower, upper = 32.0, 39.0
    mean, variance, share = law_of(name, lower=lower, upper=upper).moments()
    expected = (MEAN, SD)
    if name == "truncated_normal":
        frozen = stats.truncnorm((32 - MEAN) / SD, (39 - MEAN) / SD, MEAN, SD)
        expected = frozen.mean(), frozen.std()
    assert mean == pytest.approx(expected[0], rel=1e-11)
    assert np.sqrt(variance) == pytest.approx(expected[1], rel=1e-9)
    assert share == 0.0


def test_moments_of_a_clipped_normal():
    """max(x, a) of N(0, 1): a Phi(a) + phi(a); its square: a^2 Phi(a) + 1 - Phi(a) + a phi(a)."""
    a = -0.5
    law = law_of("normal", lower=MEAN + a * SD, upper=1e9)
    mean, variance, share = law.moments()
    first = a * stats.norm.cdf(a) + stats.norm.pdf(a)
    second = a**2 * stats.norm.cdf(a) + stats.norm.sf(a) + a * stats.norm.pdf(a)
    assert mean == pytest.approx(MEAN + SD * first, rel=1e-13)
    assert variance == pytest.approx(SD**2 * (second - first**2), rel=1e-12)
    assert share == pytest.approx(stats.norm.cdf(a), rel=1e-13)


@pytest.mark.parametrize(
    ("name", "law"),
    [
        ("gamma", stats.gamma(49.0, scale=25.0 / 35.0)),
        ("gumbel", stats.gumbel_r(35 - np.euler_gamma * 5 * 6**0.5 / np.pi, 5 * 6**0.5 / np.pi)),
        ("uniform", stats.uniform(35 - 5 * 3**0.5, 10 * 3**0.5)),
        ("beta", stats.beta(5.25, 8.75, 20, 40)),
    ],
)
def test_quantiles_are_those_of_scipy(name, law):
    z = np.array([-6.0, -2.0, -0.1, 0.0, 0.3, 3.0, 6.0])
    expected = np.where(z <= 0, law.ppf(stats.norm.cdf(z)), law.isf(stats.norm.sf(z)))
    assert law_of(name).unclipped(z[:, None])[:, 0] == pytest.approx(expected, rel=1e-12)


# White noise.


def test_noise_is_that_of_philox_written_out():
    for realization, stream in ((1, 1), (417, 3), (2**40, 102)):
        got = normal("random", 2022, stream, realization, 11, 0)
        assert got.tolist() == white_noise(realization, 11, stream).tolist()
    numbers = uniform(1, 1, 1, 1000)
    assert numbers.min() > 0.0 and numbers.max() < 1.0


def test_twins_on_coarser_cells_are_not_rebuilt(tmp_path):
    """Their points are not those on record."""
    group = {"name": "phi", "property": "friction_angle", "mean": 35.0, "scale_x": 0.4,
             "scale_y": 0.4}  # fmt: skip
    write_run(tmp_path, [group], [lattice_points(3, 2)], members=1, covs=(0.1, 0.2))
    with h5py.File(tmp_path / "ensemble.h5", "r+") as file:
        file["cases/snx_cov0.20"].attrs["role"] = "control"
    assert [case.label for case in read_random_fields(tmp_path).cases] == ["snx_cov0.10"]


def test_antithetic_pairs_cancel():
    first, second, third = (normal("antithetic", 7, 1, i, 50, 4) for i in (1, 2, 3))
    assert (first + second == 0.0).all()
    assert (first == normal("random", 7, 1, 1, 50, 4)).all()
    assert (third == normal("random", 7, 1, 3, 50, 4)).all()


@pytest.mark.parametrize("members", [1, 5, 16, 37])
def test_latin_hypercube_has_each_number_once_in_each_interval(members):
    numbers = [latin_hypercube_uniform(7, 1, i, 40, members) for i in range(1, members + 1)]
    intervals = np.sort(np.floor(np.array(numbers) * members).astype(int), axis=0)
    assert (intervals == np.arange(members)[:, None]).all()
    if members == 37:  # each number has an order of its own
        orders = np.argsort(np.array(numbers), axis=0)
        assert len({tuple(order) for order in orders.T}) == 40
    with pytest.raises(PostError, match="Latin"):
        latin_hypercube_uniform(7, 1, members + 1, 40, members)


def latin_number(u, words, member, members):
    """One number in plain integers: (interval + u)/N, the interval by a Feistel network of six
    rounds and a rotation."""
    bits = max(1, -(-(members - 1).bit_length() // 2))
    keys = [words[0] % 2**32, words[0] >> 32, words[1] % 2**32, words[1] >> 32]
    keys += [(key + 0x9E3779B9) % 2**32 for key in keys[:2]]
    place = member - 1
    while True:
        left, right = divmod(place, 2**bits)
        for key in keys:
            mixed = (right ^ key) * 0x85EBCA6B % 2**32
            mixed = (mixed ^ (mixed >> 13)) * 0xC2B2AE35 % 2**32 >> 16
            left, right = right, left ^ (mixed % 2**bits)
        place = left * 2**bits + right
        if place < members:
            break
    interval = (place + (words[2] >> 2)) % members
    return (int((interval + u) / members * 2.0**52) + 0.5) * 2.0**-52


@pytest.mark.parametrize(("member", "members"), [(1, 2), (3, 5), (17, 1000), (4096, 4096)])
def test_latin_hypercube_number_by_number(member, members):
    words = []
    for block in range(1, 8):
        words += philox([block, 0, 0, 0], [2022, 102])
    u = uniform(2022, 102, member, 9)
    expected = [latin_number(u[j], words[3 * j : 3 * j + 3], member, members) for j in range(9)]
    assert latin_hypercube_uniform(2022, 102, member, 9, members).tolist() == expected


# Samplers.


def covariance_of(sampler):
    """L L^T, from the fields of unit noise."""
    factor = sampler.sample(np.eye(sampler.count))
    return factor.T @ factor


def dense_covariance(correlation, points):
    return correlation.at(points.x[:, None] - points.x, points.y[:, None] - points.y)


@pytest.mark.parametrize("acf", ACF_NAMES)
@pytest.mark.parametrize("method", ["kronecker", "cholesky", "circulant"])
def test_covariance_of_each_method_is_the_function(acf, method):
    points, correlation = points_of(*lattice_points(7, 5)), Correlation(acf, 0.6, 0.4)
    ring = [48, 32] if method == "circulant" else None
    got = covariance_of(create_sampler(method, correlation, points, [0.0, 0.0], ring))
    assert got == pytest.approx(dense_covariance(correlation, points), abs=1e-12)


@pytest.mark.parametrize("method", ["cholesky", "circulant"])
@pytest.mark.parametrize(
    ("form", "rotation"), [("radial", 0.0), ("product", 25.0), ("radial", 40.0)]
)
def test_covariance_of_radial_and_rotated_fields(method, form, rotation):
    points = points_of(*lattice_points(6, 5))
    correlation = Correlation("snx", 0.6, 0.3, form, rotation)
    # So long that what the ring wraps round is below the tolerance.
    got = covariance_of(create_sampler(method, correlation, points, [0.0], [60, 61]))
    assert got == pytest.approx(dense_covariance(correlation, points), abs=1e-10)


def test_plane_transform_is_the_product_of_axes_for_a_product():
    """cas(a + b) mixes what cas(a) cas(b) keeps apart, but the covariance is the same."""
    points = points_of(*lattice_points(4, 3))
    plain = Correlation("snx", 0.5, 0.5)
    turned = Correlation("snx", 0.5, 0.5, "product", 90.0)
    one = covariance_of(create_sampler("circulant", plain, points, [0.0], [24, 24]))
    two = covariance_of(create_sampler("circulant", turned, points, [0.0], [24, 24]))
    assert one == pytest.approx(two, abs=1e-12)


@pytest.mark.parametrize("rotation", [0.0, 90.0])
def test_circulant_field_is_the_sum_of_waves(rotation):
    """Term by term: cas(a) cas(b) along axes, cas(a + b) where the correlation is no product."""
    mx, my, correlation = 8, 7, Correlation("snx", 0.3, 0.2, "product", rotation)
    points = points_of(*lattice_points(4, 3))
    sampler = create_sampler("circulant", correlation, points, [0.0], [mx, my])
    noise = np.random.default_rng(6).normal(size=(my, mx))
    k, wave_x, wave_y = np.arange(mx), 2 * np.pi / mx, 2 * np.pi / my
    dx = np.minimum(k, mx - k) * 0.25
    dy = np.minimum(np.arange(my), my - np.arange(my)) * 0.25
    ring = correlation.at(dx, dy[:, None])
    field = np.zeros((3, 4))
    for p, q in np.ndindex(my, mx):
        mode = np.cos(wave_x * q * k) * np.cos(wave_y * p * np.arange(my))[:, None]
        root = np.sqrt(np.sum(ring * mode) / (mx * my))
        for j, i in np.ndindex(3, 4):
            a, b = wave_x * q * i, wave_y * p * j
            cas = (np.cos(a) + np.sin(a)) * (np.cos(b) + np.sin(b))
            if rotation:
                cas = np.cos(a + b) + np.sin(a + b)
            field[j, i] += cas * root * noise[p, q]
    got = sampler.sample(noise.reshape(1, -1))[0]
    assert got == pytest.approx(field.ravel(), abs=1e-12)


def test_half_way_round_a_ring_both_signs_count():
    correlation = Correlation("snx", 0.5, 0.2, "product", 25.0)
    ring = np.fft.ifft2(plane_spectrum(correlation, (6, 5), (0.25, 0.25))).real
    for j, dy in ((1, 0.25), (4, -0.25)):
        both = correlation.at(0.75, dy), correlation.at(-0.75, dy)
        assert both[0] != pytest.approx(both[1], rel=0.1)
        assert ring[j, 3] == pytest.approx(np.mean(both), abs=1e-14)
        assert ring[j, 4] == pytest.approx(correlation.at(-0.5, dy), abs=1e-14)


def test_kronecker_and_cholesky_give_the_same_field():
    points, correlation = points_of(*lattice_points(9, 6)), Correlation("smk", 0.5, 0.7)
    noise = np.random.default_rng(1).normal(size=(3, 54))
    one, two = (
        create_sampler(m, correlation, points).sample(noise) for m in ("kronecker", "cholesky")
    )
    assert one == pytest.approx(two, abs=1e-12)


def test_points_in_any_order_with_holes():
    """The field of a site does not depend on the order of the points, nor on missing ones."""
    x, y = lattice_points(6, 5)
    correlation, noise = Correlation("snx", 0.6, 0.4), np.random.default_rng(2).normal(size=(2, 30))
    whole = create_sampler("kronecker", correlation, points_of(x, y)).sample(noise)
    keep = np.random.default_rng(3).permutation(30)[:22]
    some = create_sampler("kronecker", correlation, points_of(x[keep], y[keep])).sample(noise)
    assert some == pytest.approx(whole[:, keep], abs=1e-14)


def test_averaged_fields_have_the_variance_of_averages():
    points = points_of(*lattice_points(4, 3))
    for method in ("kronecker", "cholesky"):
        sampler = create_sampler(
            method, Correlation("snx", 0.25, 0.5, cell=(0.25, 0.25)), points, [0.0, 0.0]
        )
        expected = REDUCTIONS["snx"](1.0) * REDUCTIONS["snx"](0.5)
        assert np.diag(covariance_of(sampler)) == pytest.approx(expected, rel=1e-12)
        assert sampler.correlation.variance == pytest.approx(expected, rel=1e-12)


def test_recorded_jitter_is_on_the_diagonal():
    points, correlation = points_of(*lattice_points(4, 1)), Correlation("snx", 0.6, 0.4)
    got = covariance_of(create_sampler("cholesky", correlation, points, [0.01]))
    assert np.diag(got) == pytest.approx(1.01, rel=1e-13)


def test_a_ring_that_is_too_short_is_refused():
    points = points_of(*lattice_points(20, 20))
    with pytest.raises(PostError, match="eigenvalue"):
        create_sampler("circulant", Correlation("sqx", 5.0, 5.0), points, [0.0], [38, 38])
    with pytest.raises(PostError, match="38 are the least"):
        create_sampler("circulant", Correlation("sqx", 5.0, 5.0), points, [0.0], [37, 38])


def test_pivoted_factor_of_a_singular_matrix():
    b = np.random.default_rng(4).normal(size=(5, 3))
    factor = pivoted_factor(b @ b.T)
    assert factor @ factor.T == pytest.approx(b @ b.T, abs=1e-12)
    assert np.count_nonzero(np.any(factor != 0.0, axis=0)) == 3


# Whole fields.


def dense_fields(ids, x, y, scale_x=0.6, scale_y=0.4, acf="snx", stream=1):
    """Standard Gaussian fields from the dense factor and Philox written out."""
    matrix = np.ones((len(x), len(x)))
    for c, scale in ((x, scale_x), (y, scale_y)):
        matrix *= np.exp(-2 * np.abs(c[:, None] - c) / scale)
    factor = np.linalg.cholesky(matrix)
    return np.stack([factor @ white_noise(int(i), len(x), stream) for i in ids])


def test_fields_are_rebuilt_from_the_directory(tmp_path):
    x, y = lattice_points(7, 5)
    write_run(tmp_path, [FIELD], [(x, y)], acfs=("snx", "csx"), covs=(0.1, 0.2))
    fields = read_random_fields(tmp_path)
    case = next(case for case in fields.cases if case.label == "snx_cov0.20")
    expected = MEAN * (1 + 0.2 * dense_fields([1, 5], x, y))
    got = fields.values(case, np.array([1, 5]))["phi"]
    assert got == pytest.approx(np.clip(expected, 1.0, 60.0), rel=1e-12)


def test_cross_correlated_fields(tmp_path):
    """w'_2 = r w_1 + sqrt(1 - r^2) w_2, with a trend of the second."""
    trend = {"mean": 5e3, "sd": 1e3, "mean_gradient": 400.0, "datum": 1.25, "lower": 0.0}
    names = {"name": "c", "property": "cohesion", "distribution": "lognormal"}
    second = {**FIELD, **names, **trend}
    del second["cov"], second["upper"]
    x, y = lattice_points(6, 5)
    more = "&cross_correlation\n  between = 'phi', 'c'\n  coefficient = -0.6\n/\n"
    write_run(tmp_path, [FIELD, second], [(x, y)] * 2, more=more, members=300)
    fields = read_random_fields(tmp_path)
    ids = np.arange(1, 301)
    z = fields.gaussian(fields.cases[0], ids)
    one, two = (dense_fields(ids[:3], x, y, stream=s) for s in (1, 102))
    assert z["c"][:3] == pytest.approx(-0.6 * one + 0.8 * two, abs=1e-12)
    mean = 5e3 + 400.0 * (1.25 - y)
    spread = np.sqrt(np.log1p((1e3 / mean) ** 2))
    values = fields.values(fields.cases[0], ids[:3])["c"]
    assert values == pytest.approx(
        np.exp(np.log(mean) - spread**2 / 2 + spread * z["c"][:3]), rel=1e-12
    )
    # One number a member: the mean over 30 points of the products.
    estimate = check_mean(("", "", "", ""), np.mean(z["phi"] * z["c"], axis=1), -0.6)
    assert estimate.p_value > 1e-3
    assert check_mean(("", "", "", ""), np.mean(z["phi"] * z["c"], axis=1), -0.3).p_value < 1e-6


@pytest.mark.parametrize("method", ["kronecker", "cholesky", "circulant"])
def test_conditioning_is_exact_at_data_without_error(tmp_path, method):
    x, y = lattice_points(8, 6)
    on = [5, 20, 41]
    rows = "".join(f"{x[k]},{y[k]},{value},0\n" for k, value in zip(on, (30.0, 41.0, 36.5)))
    (tmp_path / "data.csv").write_text("x,y,value,error\n" + rows)
    record = {"method": method, "jitter": [0.0, 0.0]}
    if method == "circulant":
        record = {"method": method, "ring": [32, 32]}
    keys = {**FIELD, "data": str(tmp_path / "data.csv")}
    write_run(tmp_path, [keys], [(x, y)], records=[record])
    fields = read_random_fields(tmp_path)
    case, ids = fields.cases[0], np.arange(1, 400)
    values = fields.values(case, ids)["phi"]
    assert values[:, on] == pytest.approx(np.broadcast_to([30.0, 41.0, 36.5], (399, 3)), rel=1e-9)
    # Elsewhere simple kriging: mean and variance by the textbook.
    c = np.exp(-2 * np.abs(x[:, None] - x) / 0.6) * np.exp(-2 * np.abs(y[:, None] - y) / 0.4)
    solved = np.linalg.solve(c[np.ix_(on, on)], c[on])
    mean, variance = fields.expectation(fields.specs[0], case)
    z = (np.array([30.0, 41.0, 36.5]) / MEAN - 1) / 0.1
    assert mean == pytest.approx(z @ solved, abs=1e-10)
    assert variance == pytest.approx(1 - np.einsum("dn,dn->n", c[on], solved), abs=1e-10)
    k = 12  # beside a datum
    got = fields.conditioned(case, ids)["phi"][:, k]
    assert abs(got.mean() - mean[k]) < 4 * np.sqrt(variance[k] / 399)
    assert got.var() == pytest.approx(variance[k], rel=4 * np.sqrt(2 / 399))


@pytest.mark.parametrize("spread", [{"cov": 0.1}, {"sd": 3.0, "sd_gradient": 0.4}])
def test_data_are_read_by_the_law_at_their_depth(tmp_path, spread):
    """The datum of the trend is the top of the points, 1.5 m, where the namelist names none."""
    x, y = lattice_points(8, 6)
    (tmp_path / "data.csv").write_text("x,y,value,error\n0.875,0.375,47,0\n")
    keys = {**FIELD, "mean_gradient": 4.0, "data": str(tmp_path / "data.csv")}
    del keys["cov"]
    write_run(tmp_path, [{**keys, **spread}], [(x, y)])
    depth = 1.5 - y
    with h5py.File(tmp_path / "ensemble.h5", "r+") as file:
        group = file["random_fields/phi"]
        del group["mean"], group["sd"]
        group["mean"] = MEAN + 4.0 * depth
        group["sd"] = 3.0 + 0.4 * depth if "sd" in spread else 0.1 * (MEAN + 4.0 * depth)
    fields = read_random_fields(tmp_path)
    values = fields.values(fields.cases[0], np.array([1, 2, 3]))["phi"]
    assert values[:, 8 + 3] == pytest.approx(47.0, rel=1e-12)


def test_conditioning_between_the_points_and_with_errors(tmp_path):
    """A datum off the lattice with an error: kriging with error^2 on the diagonal."""
    x, y = lattice_points(8, 6)
    (tmp_path / "data.csv").write_text("x,y,value,error\n0.93,0.61,42,1.75\n")
    write_run(tmp_path, [{**FIELD, "data": str(tmp_path / "data.csv")}], [(x, y)], members=2000)
    fields = read_random_fields(tmp_path)
    case, ids = fields.cases[0], np.arange(1, 2001)
    c = np.exp(-2 * np.abs(x - 0.93) / 0.6) * np.exp(-2 * np.abs(y - 0.61) / 0.4)
    z_d, gram = (42 / MEAN - 1) / 0.1, 1 + (1.75 / 3.5) ** 2
    got = fields.conditioned(case, ids)["phi"]
    k = int(np.argmax(c))
    variance = 1 - c**2 / gram
    assert got.mean(axis=0)[k] == pytest.approx(
        c[k] * z_d / gram, abs=4 * np.sqrt(variance[k] / 2000)
    )
    assert got.var(axis=0)[k] == pytest.approx(variance[k], rel=4 * np.sqrt(2 / 2000))


@pytest.mark.parametrize("method", ["kronecker", "cholesky"])
def test_noise_of_data_is_taken_in_order(tmp_path, method):
    """Stream 3: errors of all data, then what the points of field 1, 2, ... leave open at them. Two
    correlated fields with one datum each, off the points; everything from dense matrices."""
    x, y = lattice_points(5, 4)
    for name, row in (("a", "0.33,0.41,38,1.4"), ("b", "0.9,0.55,33,0.7")):
        (tmp_path / f"{name}.csv").write_text(f"x,y,value,error\n{row}\n")
    groups = [{**FIELD, "name": name, "data": str(tmp_path / f"{name}.csv")} for name in "ab"]
    more = "&cross_correlation\n  between = 'a', 'b'\n  coefficient = 0.6\n/\n"
    record = {"method": method, "jitter": [0.0, 0.0]}
    write_run(tmp_path, groups, [(x, y)] * 2, more=more, records=[record] * 2)
    fields = read_random_fields(tmp_path)
    everywhere = np.r_[x, 0.33, 0.9], np.r_[y, 0.41, 0.55]
    c = np.ones((22, 22))
    for line, scale in zip(everywhere, (0.6, 0.4)):
        c *= np.exp(-2 * np.abs(line[:, None] - line) / scale)
    # The rest at the data by complete pivoting: the larger one first.
    factor = np.linalg.cholesky(c[:20, :20])
    b = np.linalg.solve(factor, c[:20, 20:]).T
    left = c[20:, 20:] - b @ b.T
    order = np.argsort(-np.diag(left))
    rest = np.empty((2, 2))
    rest[order] = np.linalg.cholesky(left[np.ix_(order, order)])
    w = [white_noise(4, 20, stream) for stream in (1, 102)]
    errors, *open_noise = white_noise(4, 6, 3).reshape(3, 2)
    mix = np.array([[1.0, 0.0], [0.6, 0.8]])
    z = [factor @ (row @ w) for row in mix]
    seen = [b @ (row @ w) + rest @ (row @ open_noise) for row in mix]
    z_d, z_error = np.array([38 / MEAN - 1, 33 / MEAN - 1]) / 0.1, np.array([0.4, 0.2])
    between = np.array([[1.0, 0.6], [0.6, 1.0]])
    gram = between * c[20:, 20:] + np.diag(z_error**2)
    misfit = z_d - [seen[0][0], seen[1][1]] - z_error * errors
    weights = np.linalg.solve(gram, misfit)
    got = fields.conditioned(fields.cases[0], np.array([4]))
    for k, name in enumerate("ab"):
        expected = z[k] + c[:20, 20:] * between[k] @ weights
        assert got[name][0] == pytest.approx(expected, abs=1e-12)


# The command.


def recorded(case, member, scale_x=0.6):
    x, y = lattice_points(10, 8)
    z = dense_fields([member], x, y, scale_x)[0]
    return np.clip(MEAN * (1 + case["cov"] * z), 1.0, 60.0)


def audit(directory, *more):
    code = main(["fields", str(directory), *more])
    return code, json.loads((directory / "fields" / "audit.json").read_text())


@pytest.mark.filterwarnings("error")
def test_audit_of_sound_fields_finds_no_fault(tmp_path, capsys):
    write_run(tmp_path, [FIELD], [lattice_points(10, 8)], members=60, values=recorded)
    code, numbers = audit(tmp_path, "--members", "60")
    words = capsys.readouterr().out
    assert code == 0 and numbers["faults"] == [] and "No fault found" in words
    assert numbers["fields"][0]["recorded"]["field_mean"] < 1e-12
    assert numbers["fields"][0]["recorded_members"] == 60
    kinds = {check["kind"] for check in numbers["checks"]}
    assert {"mean", "sd", "law", "gaussian variance", "correlation"} <= kinds
    assert 0.8 * numbers["judged"] < numbers["inside"] <= numbers["judged"]
    with open(tmp_path / "fields" / "audit.csv", newline="", encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == len(numbers["checks"])
    for kind in ("maps", "correlation", "quantiles"):
        for suffix in ("svg", "pdf"):
            assert (tmp_path / "fields" / f"{kind}_phi.{suffix}").stat().st_size > 5000


@pytest.mark.usefixtures("no_pictures")
def test_audit_catches_fields_of_another_scale_by_what_was_recorded(tmp_path, capsys):
    """The program would have used 0.7 m where the namelist says 0.6 m."""
    write_run(tmp_path, [FIELD], [lattice_points(10, 8)],
              values=lambda case, member: recorded(case, member, 0.7))  # fmt: skip
    code, numbers = audit(tmp_path)
    assert code == 1 and "FAULT" in capsys.readouterr().out
    assert any("field_min" in fault for fault in numbers["faults"])


@pytest.mark.usefixtures("no_pictures")
@pytest.mark.parametrize(
    ("wrong", "kind"),
    [({"scale_x": 0.75}, "correlation"), ({"scale_y": 0.3}, "correlation")],
)
def test_audit_catches_a_sampler_of_another_scale(tmp_path, monkeypatch, wrong, kind):
    """The sampler is spoilt, the target is not."""
    write_run(tmp_path, [FIELD], [lattice_points(16, 12)], members=300)
    right = random_fields.create_sampler

    def spoilt(method, correlation, *more):
        values = {**correlation.__dict__, **wrong}
        return right(method, Correlation(**values), *more)

    monkeypatch.setattr(random_fields, "create_sampler", spoilt)
    code, numbers = audit(tmp_path, "--members", "300")
    assert code == 1
    assert any(kind in fault for fault in numbers["faults"])


@pytest.mark.usefixtures("no_pictures")
def test_audit_catches_a_wrong_spread(tmp_path, monkeypatch):
    write_run(tmp_path, [FIELD], [lattice_points(16, 12)], members=300)
    right = Marginal.values
    monkeypatch.setattr(Marginal, "values", lambda law, z: right(law, 1.05 * np.asarray(z)))
    monkeypatch.setattr(Marginal, "moments", lambda law, *_: (law.mean, law.sd**2, 0.0 * law.sd))
    code, numbers = audit(tmp_path, "--members", "300")
    assert code == 1 and any(": sd is" in fault for fault in numbers["faults"])


@pytest.mark.usefixtures("no_pictures")
def test_audit_of_antithetic_members_counts_pairs(tmp_path):
    write_run(tmp_path, [FIELD], [lattice_points(10, 8)], members=60)
    text = (tmp_path / "resolved.nml").read_text()
    text = text.replace("&monte_carlo\n", "&monte_carlo\n  sampling = 'antithetic'\n")
    (tmp_path / "resolved.nml").write_text(text)
    code, numbers = audit(tmp_path)
    mean = next(check for check in numbers["checks"] if check["kind"] == "mean")
    assert code == 0 and mean["n"] == 30
    assert mean["value"] == pytest.approx(MEAN, rel=1e-13)


def test_bands_cover_what_they_promise():
    """Of 2000 audits of 40 members, a 95 % band misses 100 +- 10: four of those."""
    rng = np.random.default_rng(8)
    hits = sum(check_mean(("", "", "", ""), rng.normal(3, 1, 40), 3.0).inside for _ in range(2000))
    assert 1860 <= hits <= 1940


@pytest.mark.usefixtures("no_pictures")
@pytest.mark.parametrize(("state", "done"), [("running", 0), ("stopped", 3), ("complete", 20)])
def test_every_state_of_a_sweep_can_be_audited(tmp_path, state, done):
    write_run(tmp_path, [FIELD], [lattice_points(5, 4)], state=state, done=done)
    code, numbers = audit(tmp_path)
    assert code == 0 and numbers["fields"][0]["members"] == 20


def test_a_deterministic_run_has_no_field(tmp_path, capsys):
    write_ensemble(tmp_path, [{"label": "deterministic", "values": [5.6]}])
    assert main(["fields", str(tmp_path)]) == 0
    assert "there is no random field" in capsys.readouterr().out


def test_export_and_comparison(tmp_path, capsys):
    x, y = lattice_points(7, 5)
    write_run(tmp_path, [FIELD], [(x, y)])
    table, copy = tmp_path / "one.csv", tmp_path / "all.h5"
    assert main(["fields", str(tmp_path), "--realization", "3", "--csv", str(table)]) == 0
    got = np.loadtxt(table, delimiter=",", skiprows=1)
    expected = MEAN * (1 + 0.1 * dense_fields([3], x, y)[0])
    assert got[:, :2] == pytest.approx(np.column_stack([x, y]), abs=0)
    assert got[:, 2] == pytest.approx(expected, rel=1e-12)
    assert main(["fields", str(tmp_path), "--h5", str(copy), "--members", "6"]) == 0
    capsys.readouterr()
    assert main(["fields", str(tmp_path), "--against", str(copy)]) == 0
    assert "difference 0.00e+00" in capsys.readouterr().out
    with h5py.File(copy, "r+") as file:
        assert file["cases/snx_cov0.10/phi"].shape == (6, 35)
        file["cases/snx_cov0.10/phi"][4, 7] *= 1 + 1e-9
    assert main(["fields", str(tmp_path), "--against", str(copy)]) == 1
    assert "1.00e-09" in capsys.readouterr().out
    assert main(["fields", str(tmp_path), "--against", str(copy), "--tolerance", "1e-8"]) == 0


@pytest.mark.parametrize("precision", ["double", "single"])
def test_comparison_with_snapshots(tmp_path, precision):
    """Points in another order; a run in single precision keeps the angles so."""
    x, y = lattice_points(7, 5)
    write_run(tmp_path, [FIELD], [(x, y)], more=f"&solver\n  precision = '{precision}'\n/\n")
    (tmp_path / "snapshots").mkdir()
    order = np.random.default_rng(5).permutation(35)
    path = tmp_path / "snapshots" / "snx_cov0.10_r000002.h5"
    values = MEAN * (1 + 0.1 * dense_fields([2], x, y)[0])[order]
    with h5py.File(path, "w") as file:
        file["step_000000/position"] = np.column_stack([x, y])[order]
        file["step_000000/friction_angle"] = values
    arguments = ["fields", str(tmp_path), "--against", str(tmp_path / "snapshots")]
    assert main(arguments) == (0 if precision == "double" else 1)
    with h5py.File(path, "r+") as file:
        file["step_000000/friction_angle"][...] = values.astype(np.float32)
    assert main(arguments) == (1 if precision == "double" else 0)


def test_where_layers_overlap_the_last_one_counts(tmp_path):
    """Both cover all points; the snapshot holds the values of the second."""
    x, y = lattice_points(7, 5)
    second = {**FIELD, "name": "upper", "mean": 25.0}
    write_run(tmp_path, [FIELD, second], [(x, y), (x, y)])
    (tmp_path / "snapshots").mkdir()
    with h5py.File(tmp_path / "snapshots" / "snx_cov0.10_r000001.h5", "w") as file:
        file["step_000000/position"] = np.column_stack([x, y])
        values = 25.0 * (1 + 0.1 * dense_fields([1], x, y, stream=102)[0])
        file["step_000000/friction_angle"] = values
    assert main(["fields", str(tmp_path), "--against", str(tmp_path / "snapshots")]) == 0


@pytest.mark.filterwarnings("error")
def test_audit_of_turned_correlated_fields_with_trend_and_data(tmp_path):
    """Everything at once, with pictures."""
    x, y = lattice_points(16, 10)
    keep = x + y < 5.0
    (tmp_path / "data.csv").write_text("x,y,value,error\n1.125,0.625,40,0\n0.7,1.4,30,2\n")
    turned = {"scale_x": 3.0, "scale_y": 0.8, "rotation": 30.0, "form": "radial"}
    first = {**FIELD, **turned, "distribution": "beta", "lower": 15.0}
    first["data"] = str(tmp_path / "data.csv")
    names = {"name": "c", "property": "cohesion", "distribution": "gamma", "lower": 0.0}
    second = {**FIELD, **turned, **names, "mean": 5e3, "sd": 1e3, "mean_gradient": 500.0}
    del second["cov"], second["upper"]
    more = "&cross_correlation\n  between = 'phi', 'c'\n  coefficient = -0.6\n/\n"
    record = {"method": "cholesky", "jitter": [0.0]}
    points = [(x[keep], y[keep])] * 2
    write_run(tmp_path, [first, second], points, more=more, members=100, records=[record] * 2)
    code, numbers = audit(tmp_path)
    assert code == 0 and numbers["faults"] == []
    assert numbers["fields"][0]["data"]["exact_on_points"] == 1
    assert numbers["fields"][0]["data"]["largest_difference"] < 1e-9
    assert "cross-correlation" in {check["kind"] for check in numbers["checks"]}
    assert {check["where"].split(",")[0] for check in numbers["checks"]} >= {
        "along the bedding",
        "across the bedding",
    }


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda file: file.__delitem__("random_fields"), "older than the record"),
        (lambda file: file.__delitem__("random_fields/phi/snx"), "does not say how"),
        (lambda file: file.__delitem__("random_fields/phi/x"), "cannot be read"),
        (lambda file: file["random_fields/phi"].attrs.modify("index", 2), "has index 2"),
        (lambda file: file["random_fields/phi/snx"].attrs.modify("method", "fft"), "no method"),
    ],
)
def test_what_is_wrong_in_the_file_is_said(tmp_path, capsys, change, words):
    write_run(tmp_path, [FIELD], [lattice_points(5, 4)])
    with h5py.File(tmp_path / "ensemble.h5", "r+") as file:
        change(file)
    assert main(["fields", str(tmp_path)]) == 2
    assert words in capsys.readouterr().err


def test_namelist_reader():
    text = "&a\n x = 1, -2.5d3 ! c\n  s = 'it''s / =', yes = .true.\n/\n&B n='' /"
    assert read_namelist(text) == [
        ("a", {"x": [1, -2500.0], "s": "it's / =", "yes": True}),
        ("b", {"n": ""}),
    ]
    for bad in ("&a x = 1", "x = 1 /", "&a 1 /"):
        with pytest.raises(PostError):
            read_namelist(bad)


@pytest.fixture
def no_pictures(monkeypatch):
    """For tests of words and numbers."""
    monkeypatch.setattr("sgimp_post.field_report._draw", lambda *_: None)
