"""Members at the quantiles, their pictures, and what a casebook does besides running the program
(that is tests/system/casebook.py)."""

import re

import h5py
import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image
from synthetic import sample, write_ensemble
from synthetic_fields import lattice_points, white_noise, write_run

from sgimp_post.casebook_figures import _write_gif
from sgimp_post.casebook_frames import (
    Quantity,
    Track,
    frame_steps,
    frame_times,
    shared_quantities,
    survey,
)
from sgimp_post.cli import main
from sgimp_post.ensemble import read_ensemble
from sgimp_post.errors import PostError
from sgimp_post.member_figures import member_figure
from sgimp_post.member_section import member_entries
from sgimp_post.member_states import FieldRebuild, last_field
from sgimp_post.quantile_members import MOST_CASES, quantile_members, shown_cases
from sgimp_post.replays import Program, differences, find_program, read_row, replay_case
from sgimp_post.style import Gallery, rendered

PROGRAM = Program(None, "sgimp 0.1.0 (abc)")
ROW = """base_r000002: ok
  runout_max               5.6 m
  height_max               NaN m
  seconds                  0.9 s
  written to somewhere/snapshots
"""


def case_of(directory, values, **more):
    """A run with one study case, as statistics see it."""
    write_ensemble(directory, [{"label": "base", "acf": "snx", "values": values, **more}])
    (case,) = read_ensemble(directory).for_statistics()
    return case


def named(members):
    return {member.name: member.id for member in members}


@pytest.mark.parametrize(
    ("n", "ranks"),
    [
        (1, {"max": 1}),
        (2, {"P50": 1, "max": 2}),
        (3, {"P5": 1, "P50": 2, "max": 3}),
        (20, {"P5": 1, "P50": 10, "P95": 19, "max": 20}),
        (21, {"P5": 2, "P50": 11, "P95": 20, "max": 21}),
        (1000, {"P5": 50, "P50": 500, "P95": 950, "max": 1000}),
    ],
)
def test_members_are_those_of_the_nearest_rank(tmp_path, n, ranks):
    """The rank of id k is that of its value, in whatever order the ids come."""
    order = np.random.default_rng(n).permutation(n)
    members = quantile_members(case_of(tmp_path, 5.0 + order), "runout_max")
    assert {m.name: order[m.id - 1] + 1 for m in members} == ranks
    assert all(m.value == 5.0 + order[m.id - 1] for m in members)


def test_ties_go_to_the_lowest_id_and_bad_values_do_not_count(tmp_path):
    values = [9.0, 5.0, np.nan, 6.0, 6.0, 5.0, 6.0]
    case = case_of(tmp_path, values, failed=[1])
    assert named(quantile_members(case, "runout_max")) == {"P5": 2, "max": 4}


def test_no_member_without_a_value(tmp_path):
    assert quantile_members(case_of(tmp_path, [5.0, 6.0], failed=[1, 2]), "runout_max") == []
    assert quantile_members(case_of(tmp_path / "none", []), "runout_max") == []


def test_each_definition_of_the_runout_has_members_of_its_own(tmp_path):
    case = case_of(tmp_path, [5.0, 6.0], columns={"runout_q99": np.array([4.0, 3.0])})
    assert named(quantile_members(case, "runout_q99")) == {"P50": 2, "max": 1}


def test_weighted_members_only_where_the_plan_draws(tmp_path):
    """Standard normals shifted by 1.5: weights exp(-1.5 x + 1.5^2/2). P95 of the law is 1.645, in
    the middle of those drawn; of its P5 they know nothing."""
    x = sample(3, 2000, mean=1.5, sd=1.0)
    case = case_of(tmp_path, x, columns={"log_weight": -1.5 * x + 1.125})
    members = {member.name: member.value for member in quantile_members(case, "runout_max", True)}
    # Standard error of the quantile: sqrt(E[w 1(x > q)] - 0.05^2)/(density sqrt(n)) = 0.02.
    assert members["P95"] == pytest.approx(1.645, abs=0.08)
    assert members["max"] == x.max() and "P5" not in members


def test_shown_cases_are_of_all_functions_and_of_the_largest_cov(tmp_path):
    cases = [
        {"label": f"{acf}_{cov}", "acf": acf, "cov": cov, "values": [5.0]}
        for cov in (0.05, 0.15, 0.10)
        for acf in ("snx", "sqx", "smk")
    ]
    ensemble = read_ensemble(write_ensemble(tmp_path, cases))
    labels = [case.label for case in shown_cases(ensemble)]
    # Three of the largest, then two of the next, in the order of the plan.
    assert labels == ["snx_0.15", "sqx_0.15", "smk_0.15", "snx_0.1", "sqx_0.1"]
    assert len(labels) == MOST_CASES
    assert [case.label for case in shown_cases(ensemble, "smk_0.05")] == ["smk_0.05"]
    with pytest.raises(PostError, match="no case is called 'x'"):
        shown_cases(ensemble, "x")
    deterministic = [{"label": "deterministic", "values": [5.0]}]
    (case,) = shown_cases(read_ensemble(write_ensemble(tmp_path / "run", deterministic)))
    assert case.label == "deterministic"


def test_a_casebook_does_not_go_where_a_run_is(tmp_path, capsys):
    """It would put its replays where the snapshots of the run are."""
    case_of(tmp_path, [5.0, 6.0])
    assert main(["casebook", str(tmp_path), "--out", str(tmp_path), "--sgimp", "true"]) == 2
    assert "holds results of a run" in capsys.readouterr().err


def test_a_running_sweep_shows_members_of_its_prefix(tmp_path):
    """Member 5 has run farthest, but 4 is still missing: the slow ones are."""
    case = {"label": "base", "acf": "snx", "values": [5.0, 6.0, 5.5, 9.0], "ids": [1, 2, 3, 5]}
    (case,) = shown_cases(read_ensemble(write_ensemble(tmp_path, [case], state="running")))
    assert named(quantile_members(case, "runout_max")) == {"P5": 1, "P50": 3, "max": 2}


@pytest.fixture
def run_with_field(tmp_path):
    """A run with a rebuilt field on 6 x 5 points, uncorrelated: value = mean + sd times noise."""
    group = {"name": "friction_angle", "property": "friction_angle", "material": "sand",
             "mean": 35.0, "acf": "snx", "scale_x": 1e-3, "scale_y": 1e-3, "cov": 0.1}  # fmt: skip
    write_run(tmp_path, [group], [lattice_points(6, 5)], members=4)
    return tmp_path


def test_fields_are_rebuilt_of_the_member_that_is_shown(run_with_field):
    case = read_ensemble(run_with_field).case("snx_cov0.10")
    rebuild = FieldRebuild(run_with_field)
    for member, field in rebuild.of(case, [3, 1]).items():
        assert field.values == pytest.approx(35.0 + 3.5 * white_noise(member, 30), rel=1e-12)
    assert rebuild.of(read_ensemble(run_with_field).case("deterministic"), [1]) == {}


def write_states(directory, member, label="snx_cov0.10", steps=(0, 7, 20)):
    """States in which every point goes `step` mm to the right."""
    (directory / "snapshots").mkdir(parents=True, exist_ok=True)
    path = directory / "snapshots" / f"{label}_r{member:06d}.h5"
    x, y = lattice_points(6, 5)
    with h5py.File(path, "w") as file:
        for step in steps:
            group = file.create_group(f"step_{step:06d}")
            way = np.full_like(x, 1e-3 * step)
            group["time"] = 0.1 * step
            group["position"] = np.column_stack([x + way, y])
            group["displacement"] = np.column_stack([0.6 * way, -0.8 * way])
            group["friction_angle"] = 30.0 + x
            group["plastic_strain"] = 0.0 * x
            group["friction_angle"].attrs["units"] = "degree"
    return path


def test_the_last_state_is_found_in_snapshots_and_in_the_casebook(run_with_field):
    case = read_ensemble(run_with_field).case("snx_cov0.10")
    assert last_field(run_with_field, case, 2, "friction_angle") is None
    x, _ = lattice_points(6, 5)
    for home, member in ((run_with_field, 2), (run_with_field / "casebook", 3)):
        path = write_states(home, member)
        field = last_field(run_with_field, case, member, "friction_angle")
        assert np.array_equal(field.points.x, x + 0.02) and np.array_equal(field.values, 30.0 + x)
        path.write_bytes(b"being written")
        assert last_field(run_with_field, case, member, "friction_angle") is None


def test_entries_have_a_light_figure_and_a_row_a_member(run_with_field):
    gallery = Gallery()
    write_states(run_with_field / "casebook", 2)
    with h5py.File(run_with_field / "ensemble.h5", "r+") as file:
        file["cases/snx_cov0.10/runout_max"][...] = [5.4, 5.2, 5.3, 5.1]
    (entry,) = member_entries(read_ensemble(run_with_field), "runout_max", gallery)
    rows = [(row["name"], row["id"], row["value"]) for row in entry["rows"]]
    assert rows == [("P5", 4, 5.1), ("P50", 2, 5.2), ("max", 1, 5.4)]
    assert set(gallery.files) == {"members_snx_cov0.10.svg", "members_snx_cov0.10.pdf"}
    svg = gallery.files["members_snx_cov0.10.svg"]
    assert len(svg) < 150_000
    # Three fields and the points of one member as pictures; no point as a mark of its own.
    assert svg.count(b"<image") == 4
    assert all(f"{row[0]}: member {row[1]}, {row[2]:.3f} m".encode() in svg for row in rows)


def test_figure_marks_the_front_and_says_what_is_missing(tmp_path):
    case = case_of(tmp_path, [5.0, 6.0])
    case.profile_height[case.id == 1] = np.nan
    members = quantile_members(case, "runout_max")
    figure = member_figure(case, members, {}, {})
    assert len(figure.axes) == 2  # no field and no bar
    for axis, member in zip(figure.axes, members):
        (front,) = (line for line in axis.lines if line.get_linestyle() == "--")
        assert front.get_xdata()[0] == 5.0 + member.value  # the toe is at 5 m
    assert b"no profile and no state" in rendered(figure)
    plt.close(figure)
    assert member_figure(case, [], {}, {}) is None


def test_gif_has_the_frames_and_the_colours_of_its_pictures(tmp_path):
    """To the bit, as far as the first one has no more than 256: white stays white."""
    greys = np.repeat(np.arange(256, dtype=np.uint8), 3).reshape(16, 16, 3)
    frames = [np.roll(greys, k, axis=0) for k in range(3)]
    _write_gif([Image.fromarray(frame) for frame in frames], tmp_path / "a.gif")
    with Image.open(tmp_path / "a.gif") as film:
        assert film.n_frames == 3
        for k, frame in enumerate(frames):
            film.seek(k)
            assert np.array_equal(np.asarray(film.convert("RGB")), frame)


def test_survey_reads_ranges_scales_and_half_of_the_way(tmp_path):
    track = survey(write_states(tmp_path, 1), "friction_angle")
    assert track.steps.tolist() == [0, 7, 20] and track.times == pytest.approx([0.0, 0.7, 2.0])
    assert track.x == pytest.approx((0.125, 1.375 + 0.02)) and track.y == (0.125, 1.125)
    assert track.half_way == 20  # 7 mm are less than half of 20 mm
    angle, way, strain = track.quantities
    assert (way.low, way.high) == (0.0, pytest.approx(0.02)) and strain.is_uniform
    assert angle.low < angle.high and angle.units == "degree"
    with pytest.raises(PostError, match="cohesion"):
        survey(track.path, "cohesion")


def test_members_share_scales_and_times():
    def track(times, high):
        quantities = [
            Quantity("friction_angle", "degree", 35.0, 35.0 + 1e-5),
            Quantity("displacement", "m", 0.0, 0.0),
            Quantity("plastic strain", "1", 0.0, high),
        ]
        steps = 10 * np.arange(len(times))
        return Track(None, steps, np.array(times), (0.0, 1.0), (0.0, 1.0), quantities, 0)

    tracks = [track([0.0, 1.0, 2.1, 3.0], 0.5), track([0.0, 1.0, 2.0], 0.7)]
    angle_is_left_out = [(q.property, q.low, q.high) for q in shared_quantities(tracks)]
    assert angle_is_left_out == [("displacement", 0.0, 0.0), ("plastic strain", 0.0, 0.7)]
    times = frame_times(tracks, 7)
    assert times == pytest.approx(np.arange(7) / 2)
    assert frame_steps(tracks[0], times[::2]) == [0, 10, 20, 30]
    assert frame_steps(tracks[1], times[::2]) == [0, 10, 20, 20]  # at rest, it waits


def test_case_file_of_replays_differs_in_the_interval_alone(tmp_path):
    text = "&output\n  directory = 'runs/a'\n  snapshot_interval = 0\n  history_interval = 0\n/\n"
    write_ensemble(tmp_path, [{"label": "base", "values": [5.0]}], resolved_namelist=text)
    ensemble = read_ensemble(tmp_path)
    changed = replay_case(ensemble, PROGRAM, 0.125)
    assert changed.splitlines()[0] == "! For sgimp 0.1.0 (abc)."
    assert changed.partition("\n")[2] == text.replace(
        "snapshot_interval = 0", "snapshot_interval = 0.125"
    )
    (tmp_path / "resolved.nml").write_text("&output\n/\n")
    with pytest.raises(PostError, match="no snapshot_interval"):
        replay_case(ensemble, PROGRAM, 0.125)


def test_rows_are_compared_to_the_last_bit(tmp_path):
    case = case_of(tmp_path, [5.5, 5.6], columns={"height_max": np.array([4.0, np.nan])})
    row, problem = read_row(ROW, "base_r000002")
    assert problem == "" and set(row) == {"runout_max", "height_max", "seconds"}
    assert differences(case, 2, row) == []
    above = np.nextafter(5.6, 6.0)
    assert differences(case, 2, {**row, "runout_max": above}) == [("runout_max", 5.6, above)]
    assert differences(case, 2, {"height_max": 4.0})[0][2] == 4.0  # recorded: not known


def test_replays_that_fail_are_told():
    assert read_row(ROW.replace(": ok", ": point lost"), "base_r000002")[1] == (
        "it fails now: point lost"
    )
    assert read_row(ROW, "base_r000003") == ({}, "the program prints no row")
    assert read_row("", "base_r000002") == ({}, "the program prints no row")


def test_bad_input_is_refused(tmp_path, capsys, monkeypatch):
    write_ensemble(tmp_path, [{"label": "base", "acf": "snx", "values": [5.0]}])
    run = ["casebook", str(tmp_path)]
    for options, said in (
        (["--frames", "1"], "--frames must be at least 2"),
        (["--study-case", "nobody"], "no case is called 'nobody'"),
        (["--sgimp", str(tmp_path / "sgimp")], "no such program"),
    ):
        assert main([*run, *options]) == 2
        assert said in capsys.readouterr().err
    assert not (tmp_path / "casebook").exists()
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("sgimp_post.replays._BUILT", tmp_path / "build")
    with pytest.raises(PostError, match="name it with --sgimp, put it on PATH, or build it"):
        find_program(None)


def test_nothing_to_show_is_one_sentence(tmp_path, capsys):
    write_ensemble(tmp_path, [{"label": "base", "acf": "snx", "values": [5.0], "failed": [1]}])
    assert main(["casebook", str(tmp_path)]) == 0
    assert re.search("no member has ended well yet", capsys.readouterr().out)
