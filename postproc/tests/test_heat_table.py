"""Shaded tables of a study from numbers that are known."""

import numpy as np

from sgimp_post.heat_table import DARKEST, heat_tables


def case(acf, cov, mean, **varied):
    estimate = {"mean": mean, "mean_low": mean - 0.1, "mean_high": mean + 0.1}
    spread = {"sd": 1.0, "sd_low": 0.9, "sd_high": 1.1}
    share = {"share": {"value": 0.3}, "low": 0.1, "high": 0.7}
    return {
        "acf": acf,
        "cov": cov,
        "varied": varied,
        "runouts": {"runout_max": {**estimate, **spread}},
        "against_floor": {"runout_max": {"exceedance": share}},
    }


def shown(*cases):
    return heat_tables({"primary": "runout_max", "cases": list(cases)})


def test_cells_stand_where_they_belong_and_are_shaded_in_proportion():
    mean, spread, share = shown(
        case("snx", 0.05, 4.0), case("snx", 0.1, 5.0), case("bin", 0.1, 8.0)
    )
    assert mean["covs"] == [0.05, 0.1]
    (snx, first), (bin_row, second) = mean["rows"]
    assert (snx, bin_row) == ("SNX", "BIN")
    assert [cell["value"] for cell in first] == [4.0, 5.0]
    shades = [first[0]["shade"], first[1]["shade"], second[1]["shade"]]
    np.testing.assert_allclose(shades, [0.0, 0.25 * DARKEST, DARKEST])
    assert np.isnan(second[0]["value"]) and second[0]["shade"] is None  # there is no such case
    np.testing.assert_allclose([first[0]["low"], first[0]["high"]], [3.9, 4.1])
    # Equal numbers have no shade; the interval of a share is the one with both uncertainties.
    assert {cell["shade"] for _, cells in spread["rows"] for cell in cells} == {None}
    assert [share["rows"][0][1][0][k] for k in ("value", "low", "high")] == [0.3, 0.1, 0.7]


def test_a_row_for_whatever_else_the_study_varies():
    mean = shown(case("snx", 0.1, 4.0, damping="0.4"), case("snx", 0.1, 5.0, damping="2"))[0]
    assert [name for name, _ in mean["rows"]] == ["SNX damping=0.4", "SNX damping=2"]


def test_spreads_that_are_no_cov_share_a_column():
    mean = shown(case("snx", np.nan, 4.0), case("bin", np.nan, 5.0))[0]
    assert mean["covs"] == [0.0]
    assert [cells[0]["value"] for _, cells in mean["rows"]] == [4.0, 5.0]
