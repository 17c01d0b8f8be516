"""Which soil decides, over fields and runouts whose correlation is known."""

import h5py
import jinja2
import numpy as np
import pytest
from scipy import stats
from synthetic import write_ensemble
from synthetic_fields import lattice_points, write_run

from sgimp_post import soil_map, soil_map_figures
from sgimp_post.autocorrelation import rho
from sgimp_post.ensemble import RUNOUTS, read_ensemble
from sgimp_post.page import environment
from sgimp_post.random_fields import read_random_fields
from sgimp_post.samplers import Points
from sgimp_post.soil_map import (
    block_means,
    correlation_map,
    divide,
    explained_share,
    is_marked,
    no_correlation_p,
    soil_maps,
    tables,
)
from sgimp_post.statistics import benjamini_hochberg, correlation_interval
from sgimp_post.style import rendered

SIDE = 16
FIELD = {"name": "friction_angle", "property": "friction_angle", "distribution": "normal",
         "mean": 35.0, "cov": 0.1, "scale_x": 0.5, "scale_y": 0.5}  # fmt: skip


class FieldOf:
    """Draws Gaussian fields of a product acf on SIDE x SIDE points 0.3125 scales apart."""

    def __init__(self, acf, rng):
        lag = 0.3125 * np.abs(np.subtract.outer(np.arange(SIDE), np.arange(SIDE)))
        self.factor = np.linalg.cholesky(rho(acf, lag) + 1e-8 * np.eye(SIDE))
        self.rng = rng

    def draw(self, members):
        noise = self.rng.standard_normal((members, SIDE, SIDE))
        return (self.factor @ noise @ self.factor.T).reshape(members, -1)


def is_even(count):
    return np.arange(1, count + 1) % 2 == 0


def points_of(x, y, size=0.25):
    return Points(x, y, np.full(len(x), size), np.full(len(x), size))


def correlations(z, y):
    z, y = z - z.mean(axis=0), y - y.mean()
    return y @ z / np.sqrt(np.sum(z**2, axis=0) * (y @ y))


def write_study(directory, members=80, **more):
    """A run of one case on 10 x 10 points; it runs far where the mean of the right part is low, but
    for noise; returns the rebuilt field [members, 100]."""
    x, y = lattice_points(10, 10)
    write_run(directory, [FIELD], [(x, y)], members=members, **more)
    fields = read_random_fields(directory)
    case = fields.ensemble.cases[1]
    z = fields.conditioned(case, case.id)["friction_angle"]
    signal = -z[:, x > 2.0].mean(axis=1)
    runout = 5.0 + 0.1 * signal / signal.std()
    runout += 0.05 * np.random.default_rng(2).standard_normal(members)
    with h5py.File(directory / "ensemble.h5", "r+") as file:
        for name in RUNOUTS:
            file[f"cases/{case.label}/{name}"][...] = runout
    return z


# Numbers.


def test_the_example_of_benjamini_and_hochberg():
    """1995, section 4: four of fifteen at 5 %."""
    p = [0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262,
         0.5719, 0.6528, 0.7590, 1.0000]  # fmt: skip
    order = np.random.default_rng(1).permutation(15)
    adjusted = benjamini_hochberg(np.append(np.array(p)[order], np.nan))
    assert np.isnan(adjusted[-1])
    assert sorted(order[adjusted[:-1] <= 0.05]) == [0, 1, 2, 3]
    assert adjusted[np.argsort(order)][:2] == pytest.approx([0.0015, 0.003])


def test_fishers_interval_and_its_ends():
    low, high = correlation_interval(0.5, 103)
    assert (low, high) == pytest.approx(np.tanh(np.arctanh(0.5) + np.array([-1, 1]) * 0.1959964))
    assert correlation_interval(-1.0, 50)[0] == pytest.approx(-1.0)
    assert np.isnan(correlation_interval(0.1, 3)).all()


def test_correlations_are_those_of_numpy_and_blocks_of_members_change_nothing(
    tmp_path, monkeypatch
):
    z = write_study(tmp_path / "r", members=90)
    ensemble = read_ensemble(tmp_path / "r")
    runout = ensemble.cases[1].column("runout_max")
    (once,), notes = soil_maps(ensemble, "runout_max")
    monkeypatch.setattr(soil_map, "_MOST_VALUES", 1700)  # 17 members
    (often,), _ = soil_maps(ensemble, "runout_max")
    assert notes == []
    odd = ~is_even(90)
    for got, rows in (("correlation", slice(None)), ("odd", odd), ("even", ~odd)):
        expected = [np.corrcoef(column, runout[rows])[0, 1] for column in z[rows].T]
        assert getattr(once.points, got) == pytest.approx(np.array(expected), abs=1e-12)
        assert getattr(often.points, got) == pytest.approx(np.array(expected), abs=1e-12)
    assert once.points.split_half.null_high == pytest.approx(often.points.split_half.null_high)
    r, p = stats.pearsonr(z[:, 7], runout)
    assert (once.points.correlation[7], once.points.p_value[7]) == pytest.approx((r, p))


def test_the_region_that_decides_is_found_and_its_correlation_is_known():
    """White noise; runout = - mean of the right quarter, with as much noise: r = -sqrt(1/2) with
    that mean and -sqrt(1/2/n) with each of its n points, 0 elsewhere."""
    rng, members = np.random.default_rng(3), 2000
    x, y = lattice_points(SIDE, SIDE)
    right = x > 3.0
    z = rng.standard_normal((members, SIDE**2))
    signal = z[:, right].mean(axis=1) * np.sqrt(right.sum())
    runout = rng.standard_normal(members) - signal
    got = correlation_map(z, runout, is_even(members), x, y)
    assert got.correlation[right].mean() == pytest.approx(-np.sqrt(0.5 / right.sum()), abs=0.008)
    assert got.correlation[~right].mean() == pytest.approx(0.0, abs=0.008)
    assert got.marked[right].mean() > 0.7 and got.marked[~right].mean() < 0.05
    assert got.split_half.correlation > got.split_half.null_high
    assert got.split_half.p_value == 1 / 200
    blocks = divide(points_of(x, y), 16)
    means = correlation_map(block_means(z, blocks), runout, is_even(members), *blocks.place.T)
    expected = np.where(blocks.place[:, 0] == 3, -np.sqrt(0.5 / 4), 0.0)  # four blocks share it
    assert means.correlation == pytest.approx(expected, abs=0.09)  # 4 standard errors
    assert np.array_equal(means.marked, blocks.place[:, 0] == 3)
    assert means.strongest.x == means.confirmed.x == 3
    assert means.confirmed.low < -np.sqrt(0.5 / 4) < means.confirmed.high
    assert means.split_half.repeated == means.split_half.marked >= 6


@pytest.mark.parametrize("acf", ["sqx", "csx"])  # smoothest; with negative correlations
@pytest.mark.parametrize("law", ["gumbel", "two values"])
def test_of_noise_nothing_is_marked_more_often_than_promised(acf, law):
    """Where no place correlates, every mark is false: in 5 % of 400 ensembles at most, and three
    standard errors. With ties as well: t is exact for normal fields whatever the runout."""
    rng = np.random.default_rng(5)
    source, found = FieldOf(acf, rng), 0
    for _ in range(400):
        y = rng.gumbel(size=60) if law == "gumbel" else rng.integers(0, 2, 60).astype(float)
        found += is_marked(no_correlation_p(correlations(source.draw(60), y), 60)).any()
    assert 0.005 <= found / 400 <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / 400)


def test_false_marks_beside_true_ones_keep_to_their_share():
    """BIN is zero from one scale on, 3.2 points: columns farther from the deciding ones than that
    are independent of the runout."""
    rng = np.random.default_rng(7)
    source, shares, marks = FieldOf("bin", rng), [], 0
    column = np.tile(np.arange(SIDE), SIDE)
    for _ in range(200):
        z = source.draw(100)
        signal = z[:, column >= 12].mean(axis=1)
        y = rng.gumbel(size=100) - 2.0 * signal / signal.std()
        marked = is_marked(no_correlation_p(correlations(z, y), 100))
        shares.append(np.count_nonzero(marked & (column < 8)) / max(1, marked.sum()))
        marks += marked.sum()
    assert marks / 200 > 10
    assert np.mean(shares) <= 0.05


def test_halves_of_noise_are_not_alike():
    rng = np.random.default_rng(9)
    source, found = FieldOf("smk", rng), []
    x, y = lattice_points(SIDE, SIDE)
    for _ in range(60):
        found.append(correlation_map(source.draw(50), rng.gumbel(size=50), is_even(50), x, y))
    splits = [one.split_half for one in found]
    values = np.array([one.correlation for one in splits])
    assert abs(values.mean()) < 3 * values.std() / np.sqrt(60)
    # p is uniform: Kolmogorov-Smirnov at 1e-3.
    assert stats.kstest([one.p_value for one in splits], "uniform").pvalue > 1e-3
    assert np.mean([one.null_high for one in splits]) == pytest.approx(
        np.quantile(values, 0.95), abs=0.08
    )


def test_a_place_that_does_not_vary_is_not_known():
    z = np.random.default_rng(1).standard_normal((60, 4))
    z[:, 2] = 0.3 + 1e-7 * z[:, 2]  # a measured point
    got = correlation_map(z, -z[:, 0], is_even(60), np.arange(4.0), np.zeros(4))
    assert np.isnan(got.correlation[2]) and not got.marked[2]
    assert got.correlation[0] == pytest.approx(-1.0) and got.strongest.x == 0.0
    assert np.isfinite(got.split_half.correlation)


@pytest.mark.parametrize("members, coefficients", [(60, 1), (200, 25)])
def test_the_explained_share_is_that_of_new_members(members, coefficients):
    """Against a million new members, of the same model fitted to 90 % of the members; 200
    ensembles."""
    rng, held, values = np.random.default_rng(15), 0, []
    slopes = np.full(coefficients, np.sqrt(0.5 / coefficients))
    truths = []
    for _ in range(200):
        x = rng.standard_normal((members, coefficients))
        y = x @ slopes + np.sqrt(0.5) * rng.standard_normal(members)
        got = explained_share(x, y)
        kept = np.arange(members) % 10 != 0
        full = np.column_stack([np.ones(members), x])
        b = np.linalg.lstsq(full[kept], y[kept], rcond=None)[0]
        truths.append(1.0 - (0.5 + b[0] ** 2 + np.sum((b[1:] - slopes) ** 2)))
        values.append(got.value)
        held += got.low <= truths[-1] <= got.high
    assert np.mean(values) == pytest.approx(np.mean(truths), abs=0.02)
    assert held / 200 >= 0.90


def test_the_explained_share_of_noise_is_not_positive():
    rng = np.random.default_rng(17)
    got = explained_share(rng.standard_normal((200, 25)), rng.gumbel(size=200))
    assert got.value < 0.05 and got.low < 0.0
    y = np.append(rng.gumbel(size=99), np.nan)
    assert np.isfinite(explained_share(rng.standard_normal((100, 3)), y).value)
    assert np.isnan(explained_share(rng.standard_normal((100, 25)), y).value)  # 104 are needed


def test_blocks_tile_what_the_body_fills():
    x, y = lattice_points(40, 10)
    blocks = divide(points_of(x, y))
    assert (len(blocks.x_edges), len(blocks.y_edges)) == (11, 3)
    assert np.bincount(blocks.owner).tolist() == [20] * 20
    keep = (x < 5.0) | (y < 1.0)  # an L: blocks without points are none
    blocks = divide(points_of(x[keep], y[keep]))
    values = np.vstack([x[keep], y[keep]])
    for k, (column, row) in enumerate(blocks.place):
        inside = blocks.x_edges[column : column + 2], blocks.y_edges[row : row + 2]
        mean = block_means(values, blocks)[:, k]
        assert inside[0][0] < mean[0] < inside[0][1] and inside[1][0] < mean[1] < inside[1][1]
    assert len(divide(points_of(np.array([1.0]), np.array([1.0]))).place) == 1


# Runs.


def test_a_run_gives_the_map_of_its_rebuilt_fields(tmp_path):
    z = write_study(tmp_path / "r", members=120)
    ensemble = read_ensemble(tmp_path / "r")
    (got,), notes = soil_maps(ensemble, "runout_max")
    runout = ensemble.cases[1].column("runout_max")
    assert notes == [] and got.n == 120 and got.label == "snx_cov0.10"
    assert got.mean.correlation == pytest.approx(np.corrcoef(z.mean(axis=1), runout)[0, 1])
    assert got.block_map.strongest.x > 2.0 and got.block_map.strongest.correlation < 0.0
    assert got.explained["runout_max"][1].value > got.explained["runout_max"][0].value > 0.0
    rows = tables([got])
    assert len(rows["soil_map.csv"]) == 125 and len(rows["soil_explained.csv"]) == len(RUNOUTS)
    assert rows["soil_map_summary.csv"][0]["points"] == 100


def test_where_a_later_field_covers_a_point_it_alone_counts(tmp_path):
    x, y = lattice_points(10, 10)
    seam = (y > 0.5) & (y < 1.0)
    fields = [FIELD, {**FIELD, "name": "seam"}]
    write_run(tmp_path / "r", fields, [(x, y), (x[seam], y[seam])], members=50)
    with h5py.File(tmp_path / "r" / "ensemble.h5", "r+") as file:
        file["cases/snx_cov0.10/runout_max"][...] = np.random.default_rng(1).gumbel(size=50)
    maps, notes = soil_maps(read_ensemble(tmp_path / "r"), "runout_max")
    assert notes == [] and [one.spec.name for one in maps] == ["friction_angle", "seam"]
    assert np.array_equal(np.column_stack([maps[0].points.x, maps[0].points.y]),
                          np.column_stack([x, y])[~seam])  # fmt: skip
    assert len(maps[1].points.x) == seam.sum()


def test_failed_members_and_unknown_runouts_do_not_count(tmp_path):
    z = write_study(tmp_path / "r", members=80)
    with h5py.File(tmp_path / "r" / "ensemble.h5", "r+") as file:
        group = file["cases/snx_cov0.10"]
        for name in RUNOUTS:
            runout = group[name][:]
            runout[3], runout[11] = 99.0, np.nan
            group[name][...] = runout
        status = group["status"][:]
        status[3] = 2
        group["status"][...] = status
    (got,), _ = soil_maps(read_ensemble(tmp_path / "r"), "runout_max")
    keep = ~np.isin(np.arange(80), (3, 11))
    assert got.n == 78
    assert got.points.correlation == pytest.approx(correlations(z[keep], runout[keep]), abs=1e-12)


def spoiled(directory, **attributes):
    with h5py.File(directory / "ensemble.h5", "r+") as file:
        file["cases/snx_cov0.10"].attrs.update(attributes)
    return read_ensemble(directory)


def test_what_has_no_map_has_a_sentence(tmp_path):
    write_study(tmp_path / "r", members=80)
    maps, notes = soil_maps(spoiled(tmp_path / "r", has_recorded_fields=0), "runout_max")
    assert maps == [] and "other fields" in notes[0]
    few = tmp_path / "few"
    write_study(few, members=39)
    assert "39 members, 40 are needed" in soil_maps(read_ensemble(few), "runout_max")[1][0]
    flat = tmp_path / "flat"
    write_study(flat, members=60)
    with h5py.File(flat / "ensemble.h5", "r+") as file:
        file["cases/snx_cov0.10/runout_max"][...] = 5.0
    assert "equally far" in soil_maps(read_ensemble(flat), "runout_max")[1][0]
    write_ensemble(tmp_path / "d", [{"label": "deterministic", "values": np.full(8, 5.0)}])
    assert "No soil varies" in soil_maps(read_ensemble(tmp_path / "d"), "runout_max")[1][0]
    case = {"label": "snx_cov0.10", "acf": "snx", "values": np.full(50, 5.0)}
    write_ensemble(tmp_path / "w", [case], sampling="importance")
    assert "importance" in soil_maps(read_ensemble(tmp_path / "w"), "runout_max")[1][0]
    write_ensemble(tmp_path / "u", [case])
    assert soil_maps(read_ensemble(tmp_path / "u"), "runout_max")[0] == []


def test_another_field_than_the_one_on_record_has_no_map(tmp_path):
    write_study(tmp_path / "r", members=80, values=lambda case, i: np.array([35.0 + i]))
    maps, notes = soil_maps(read_ensemble(tmp_path / "r"), "runout_max")
    assert maps == [] and "not the one on record" in notes[0]


def test_of_a_study_the_largest_cov_of_each_function_is_shown(tmp_path, monkeypatch):
    monkeypatch.setattr(soil_map, "MOST_MAPS", 3)
    x, y = lattice_points(6, 6)
    write_run(tmp_path / "r", [FIELD], [(x, y)], members=50, acfs=("snx", "sqx"), covs=(0.05, 0.15))
    rng = np.random.default_rng(4)
    with h5py.File(tmp_path / "r" / "ensemble.h5", "r+") as file:
        for label in list(file["cases"])[1:]:
            file[f"cases/{label}/runout_max"][...] = rng.gumbel(size=50)
    maps, _ = soil_maps(read_ensemble(tmp_path / "r"), "runout_max")
    assert [one.label for one in maps] == ["snx_cov0.05", "snx_cov0.15", "sqx_cov0.15"]


def test_picture_and_page_show_the_map(tmp_path):
    write_study(tmp_path / "r", members=120)
    maps, notes = soil_maps(read_ensemble(tmp_path / "r"), "runout_max")
    limit = soil_map_figures.shared_limit(maps)
    largest = np.abs(np.r_[maps[0].points.correlation, maps[0].block_map.correlation]).max()
    assert largest <= limit <= largest + 0.1
    svg = rendered(soil_map_figures.soil_map_figure(maps[0], limit)).decode()
    assert (
        "friction angle at points" in svg
        and "correlation with runout [–]" in svg
        and "y [m]" in svg
        and len(svg) < 150_000
    )
    templates = environment()
    templates.undefined = jinja2.StrictUndefined
    page = templates.get_template("soil_map.html.j2")
    shared = {"runouts": RUNOUTS, "s": {"primary": "runout_max"}}
    html = page.render(soil_maps=maps, soil_map_figures=["data:x"], soil_map_notes=notes, **shared)
    assert "weak soil there goes with a longer runout" in html and "120 members" in html
    html = page.render(soil_maps=[], soil_map_figures=[], soil_map_notes=["None."], **shared)
    assert "<p>None.</p>" in html and "<table>" not in html
