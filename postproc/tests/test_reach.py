"""Reach of the deposit over profiles whose law is known."""

import h5py
import jinja2
import numpy as np
import pytest
from scipy import stats
from synthetic import COLUMNS_X, write_ensemble

from sgimp_post import reach_figures
from sgimp_post.ensemble import Geometry, read_ensemble
from sgimp_post.page import environment
from sgimp_post.reach import depths_of_interest, distance, reaches, tables, weighted_distance
from sgimp_post.statistics import wilson
from sgimp_post.style import rendered

#: Of synthetic.py: columns of 0.5 m from 0 on, toe at 5 m, points 0.25 m apart.
TOE, WIDTH, LAYER = 5.0, 0.5, 0.25


def run(directory, fronts, depth=2.0, label="snx_cov0.10", columns=None, profile=None, **more):
    """Members whose deposit is `depth` m deep in their first `fronts` columns, bare beyond."""
    n = len(fronts)
    case = {"label": label, "acf": "snx", "cov": 0.1, "values": np.full(n, 5.0),
            "columns": columns or {}, **more.pop("case", {})}  # fmt: skip
    write_ensemble(directory, [{"label": "deterministic", "values": np.full(3, 5.0)}, case], **more)
    height = np.where(np.arange(COLUMNS_X) < np.asarray(fronts)[:, None], depth, 0.0)
    with h5py.File(directory / "ensemble.h5", "r+") as file:
        file["geometry"].attrs.update(initial_height=10.0, initial_width=5.0)
        file[f"cases/{label}/profile/height"][...] = height if profile is None else profile(height)
    return read_ensemble(directory)


def test_the_probability_at_a_column_is_the_share_of_members_that_fill_it(tmp_path):
    fronts = np.repeat([14, 18, 20, 30], [50, 30, 15, 5])
    (got,) = reaches(run(tmp_path / "r", fronts))
    layer = got.depths[0]
    for column, count in ((13, 100), (14, 50), (17, 50), (18, 20), (19, 20), (29, 5), (30, 0)):
        share = wilson(count, 100)
        found = layer.probability[column], layer.low[column], layer.high[column]
        assert found == (share.value, share.low, share.high)
        assert layer.beyond[column] == share.value  # no gaps: nothing farther than what is here
    assert got.n == 100 and layer.beyond_half == pytest.approx(np.sqrt(np.log(40.0) / 200.0))


def test_surfaces_are_quantiles_of_depth_at_each_column(tmp_path):
    depths = np.arange(1.0, 102.0)[:, None]
    (got,) = reaches(run(tmp_path / "r", np.full(101, 7), profile=lambda h: np.sign(h) * depths))
    assert got.surfaces[:, 3] == pytest.approx([6.0, 51.0, 96.0])
    assert not got.surfaces[:, 7:].any()


def test_distances_are_the_right_ends_of_the_farthest_columns(tmp_path):
    fronts = np.repeat([14, 18, 20, 30], [50, 30, 15, 5])
    (got,) = reaches(run(tmp_path / "r", fronts))
    found = {d.probability: d.value for d in got.depths[0].distances}
    expected = {0.5: 18, 0.1: 20, 0.05: 30, 0.01: 30}
    assert found == {p: column * WIDTH - TOE for p, column in expected.items()}


def test_the_interval_of_a_median_has_the_ranks_of_the_tables():
    """n = 100: X(40) and X(61), 96.5 % (Conover 1999, table A3)."""
    got = distance(np.random.default_rng(1).permutation(np.arange(1.0, 101.0)), 0.5)
    assert (got.low, got.value, got.high) == (40.0, 51.0, 61.0)


@pytest.mark.parametrize("probability", [0.5, 0.1, 0.05])
@pytest.mark.parametrize("column", [0.0, 0.5])
def test_the_interval_of_a_distance_holds(probability, column):
    """Of 1000 ensembles of 100; three standard errors below 95 %. In columns as wide as half the
    spread the truth is the end of one, and it holds more often."""
    rng = np.random.default_rng(3)

    def to_column(x):
        return x if column == 0.0 else np.ceil(x / column) * column

    truth = to_column(stats.norm.isf(probability))
    rows = [distance(to_column(x), probability) for x in rng.standard_normal((1000, 100))]
    low, high = (np.nan_to_num([getattr(d, e) for d in rows], nan=v) for e, v in
                 (("low", -np.inf), ("high", np.inf)))  # fmt: skip
    held = np.mean((low <= truth) & (truth <= high))
    assert held >= 0.95 - 3 * np.sqrt(0.95 * 0.05 / 1000)
    assert column or held <= 0.985


def test_what_few_members_cannot_tell_is_not_told():
    got = distance(np.arange(50.0), 0.01)
    assert np.isnan([got.value, got.high]).all() and got.low < 49.0
    assert distance(np.arange(100.0), 0.01).value == 99.0
    assert np.isnan(distance(np.full(40, -np.inf), 0.5).value)  # nobody is ever so deep


def test_the_band_of_all_distances_at_once_holds(tmp_path):
    rng, n, held = np.random.default_rng(5), 100, 0
    (entry,) = reaches(run(tmp_path / "r", np.full(n, 9)))
    for _ in range(1000):
        u = np.sort(rng.random(n))
        rank = np.arange(1, n + 1) / n
        largest = max(np.max(rank - u), np.max(u - rank + 1 / n))
        held += largest <= entry.depths[0].beyond_half
    assert 0.93 <= held / 1000 <= 0.985


def test_failed_members_and_unknown_profiles_do_not_count(tmp_path):
    def spoil(height):
        height[0] = np.nan
        height[1, 5] = np.nan
        height[2] = 9.0  # of a failed one
        return height

    (got,) = reaches(run(tmp_path / "r", np.full(40, 12), profile=spoil, case={"failed": [3]}))
    assert got.n == 37
    assert set(got.depths[0].probability) == {0.0, 1.0}


def test_without_two_profiles_there_is_no_reach(tmp_path):
    ensemble = run(tmp_path / "one", [12])
    assert reaches(ensemble) == []
    with h5py.File(tmp_path / "one" / "ensemble.h5", "r+") as file:
        del file["cases/snx_cov0.10/profile"]
    assert reaches(read_ensemble(tmp_path / "one")) == []


def test_a_lone_point_is_no_layer_and_a_layer_is_one_in_single_precision(tmp_path):
    lone, layer = LAYER**2 / WIDTH, np.float32(LAYER) * np.float32(1.0 - 3e-7)
    assert layer < LAYER
    for depth, expected in ((lone, 0.0), (layer, 1.0)):
        (got,) = reaches(run(tmp_path / f"d{depth:.3f}", np.full(20, 12), depth=depth))
        assert got.depths[0].depth == LAYER
        assert got.depths[0].probability[11] == expected


def test_beyond_a_gap_the_probability_at_x_is_not_that_of_anything_farther(tmp_path):
    def gap(height):
        height[:, 10:12] = 0.0
        return height

    (got,) = reaches(run(tmp_path / "r", np.full(20, 14), profile=gap))
    layer = got.depths[0]
    assert layer.probability[[9, 10, 13]].tolist() == [1.0, 0.0, 1.0]
    assert layer.beyond[[9, 10, 13, 14]].tolist() == [1.0, 1.0, 1.0, 0.0]
    assert layer.distances[0].value == 14 * WIDTH - TOE


def test_depths_that_are_thinner_than_a_layer_are_left_out():
    g = Geometry(initial_height=5.0, point_spacing=0.0625)
    assert [depth for depth, _ in depths_of_interest(g, 0.125)] == pytest.approx([0.0625, 0.1, 0.5])
    coarse = Geometry(initial_height=5.0, point_spacing=0.1)
    assert [depth for depth, _ in depths_of_interest(coarse, 0.2)] == pytest.approx([0.1, 0.5])
    assert depths_of_interest(Geometry(), 0.2) == [(0.1, "one layer of points")]


def test_weighted_members_give_the_reach_of_the_law_they_stand_for(tmp_path):
    """Fronts of a normal law in columns, drawn two standard deviations farther: column 20 + 3 x."""
    x = np.random.default_rng(11).normal(2.0, 1.0, 2000)
    weights = {"log_weight": 2.0 - 2.0 * x}
    fronts = np.clip(np.ceil(20 + 3 * x), 0, COLUMNS_X)
    (got,) = reaches(run(tmp_path / "r", fronts, columns=weights, sampling="importance"))
    layer = got.depths[0]
    assert got.surfaces is None and np.isnan(layer.beyond).all()
    for column in (25, 27, 28):  # filled where 20 + 3 x > column
        truth = stats.norm.sf((column - 20) / 3)
        assert layer.low[column] <= truth <= layer.high[column]
        assert layer.high[column] < 2.0 * truth
    assert np.isnan(layer.probability[35])  # hardly anybody was drawn there


def test_weighted_distances_hold():
    """In columns of half a standard deviation: more often than 95 %."""
    rng, held, p = np.random.default_rng(13), 0, 0.01
    truth = np.ceil(2.0 * stats.norm.isf(p)) / 2.0
    for _ in range(200):
        x = rng.normal(2.0, 1.0, 400)
        got = weighted_distance(np.ceil(2.0 * x) / 2.0, 2.0 - 2.0 * x, p)
        held += got.low <= truth <= got.high
    assert held / 200 >= 0.95 - 3 * np.sqrt(0.95 * 0.05 / 200)


def test_weighted_members_that_do_not_go_so_far_give_a_lower_end_alone():
    x = np.round(np.random.default_rng(17).normal(2.0, 1.0, 400), 1)
    got = weighted_distance(x, 2.0 - 2.0 * x, 1e-9)
    assert np.isnan([got.value, got.high]).all() and got.low > 3.0
    got = weighted_distance(x, 2.0 - 2.0 * x, 0.999)
    assert np.isnan([got.value, got.low]).all()


def test_homogeneous_ground_alone_is_told_of(tmp_path):
    write_ensemble(tmp_path / "h", [{"label": "deterministic", "values": np.full(8, 5.0)}])
    (got,) = reaches(read_ensemble(tmp_path / "h"))
    assert got.label == "deterministic" and got.n == 8


def test_rows_have_every_number(tmp_path):
    found = reaches(run(tmp_path / "r", np.repeat([14, 18], 10)))
    rows = tables(found)
    assert {name: len(one) for name, one in rows.items()} == {
        "reach.csv": 8,  # two depths, four probabilities
        "reach_curves.csv": 2 * COLUMNS_X,
        "surfaces.csv": COLUMNS_X,
    }
    row = rows["reach_curves.csv"][15]
    assert (row["x"], row["probability"], row["beyond"]) == (7.75, 0.5, 0.5)
    assert "surfaces.csv" in tables([]) and not any(tables([]).values())


@pytest.mark.parametrize("sampling", ["random", "importance"])
def test_pictures_and_page_show_what_is_there(tmp_path, sampling):
    ensemble = run(tmp_path / "r", np.repeat([14, 18, 20, 30], 20), sampling=sampling)
    found = reaches(ensemble)
    figure = reach_figures.reach_figure(found[0], ensemble.case("deterministic"))
    svg = rendered(figure).decode()
    assert "x [m]" in svg and "depth [m]" in svg and "homogeneous" in svg and len(svg) < 150_000
    assert ("5 to 95 %" in svg) == (sampling == "random")
    assert "COV 0.1" in rendered(reach_figures.overview_figure(found)).decode()
    page = environment().get_template("reach.html.j2")
    html = page.render(reaches=found, reach_figures={"snx_cov0.10": "data:x"}, reach_overview=None)
    assert "one layer of points" in html and 'src="data:x"' in html
    assert ("Members are weighted" in html) == (sampling == "importance")
    assert "No case has two members" in page.render(reaches=[], reach_figures={})


def test_the_page_needs_nothing_that_is_not_given(tmp_path):
    templates = environment()
    templates.undefined = jinja2.StrictUndefined
    found = reaches(run(tmp_path / "r", np.repeat([14, 18], 10)))
    page = templates.get_template("reach.html.j2")
    assert page.render(reaches=found, reach_figures={}, reach_overview=None)
