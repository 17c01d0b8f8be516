"""The report on whole, running, failed and empty ensembles."""

import csv
import json
import re
import subprocess
import sys

import h5py
import numpy as np
import pytest
from scipy import stats
from synthetic import RUNOUTS_FACTOR, sample, write_ensemble

from sgimp_post.cli import main
from sgimp_post.ensemble import Geometry, read_ensemble
from sgimp_post.figures import configuration_figure, weighted_figure
from sgimp_post.snapshots import State, read_snapshot

HOMOGENEOUS = {"label": "deterministic", "values": sample(1, 8, 5.6, 0.05)}


def study(count):
    """Five functions and three coefficients of variation."""
    return [
        {"label": f"{acf}_cov{cov:.2f}", "acf": acf, "cov": cov, "values": sample(k, count)}
        for k, (acf, cov) in enumerate(
            (acf, cov) for acf in ("snx", "sqx", "smk", "csx", "bin") for cov in (0.05, 0.1, 0.15)
        )
    ]


def base(count, **more):
    """One case without a study."""
    return {"label": "base", "acf": "snx", "cov": 0.1, "values": sample(9, count), **more}


ENSEMBLES = {
    "one case": ([HOMOGENEOUS, base(50)], "complete"),
    "deterministic only": ([HOMOGENEOUS], "complete"),
    "one member": ([{**HOMOGENEOUS, "values": [5.6]}], "complete"),
    "empty": ([{**HOMOGENEOUS, "values": []}, base(0, planned=10)], "running"),
    "one row": ([HOMOGENEOUS, base(1, planned=10)], "running"),
    "two rows": ([HOMOGENEOUS, base(2, planned=10)], "running"),
    "partial": ([HOMOGENEOUS, base(6, ids=[1, 2, 3, 5, 8, 9], planned=10)], "stopped"),
    "all failed": ([HOMOGENEOUS, base(4, failed=[1, 2, 3, 4])], "complete"),
    "nominal failed": ([{**HOMOGENEOUS, "failed": [1]}, base(5)], "complete"),
    "not compared": ([base(2)], "complete"),
    "not finite": ([HOMOGENEOUS, {**base(4), "values": [5.1, np.nan, np.inf, 5.3]}], "complete"),
    "one far": ([HOMOGENEOUS, {**base(0), "values": [*sample(2, 49), 1e9]}], "complete"),
    "almost equal": ([HOMOGENEOUS, {**base(0), "values": [5.0] * 8 + [5.0 + 1e-15]}], "complete"),
}


def report(directory, capsys):
    """Runs the command; returns the HTML and the numbers."""
    assert main(["report", str(directory)]) == 0
    path = capsys.readouterr().out.strip()
    assert path == str(directory / "report" / "report.html")
    html = (directory / "report" / "report.html").read_text()
    return html, json.loads((directory / "report" / "report.json").read_text())


@pytest.fixture
def no_pictures(monkeypatch):
    """For tests of words and numbers: drawing is nine tenths of the time."""
    for name in ("_figures", "_reach", "_soil_maps", "_field_audit", "member_entries"):
        monkeypatch.setattr(f"sgimp_post.report.{name}", lambda *_: {})


def assert_page_is_sound(html, directory):
    """Offline, no script, no dead link, no value that is not one, files that can be read."""
    assert len(html) < 5_000_000
    assert not re.search(r"(src|href)=\"(https?:)?//", html) and "<script" not in html
    for target in re.findall(r'href="#([^"]+)"', html):
        assert f'id="{target}"' in html
    targets = re.findall(r'href="([^"#]+)"', html)
    assert {"summary.csv", "report.json"} <= set(targets)
    for target in targets:
        assert (directory / target).is_file()
    for path in directory.glob("*.csv"):
        with open(path, newline="", encoding="utf-8") as file:
            assert len({len(row) for row in csv.reader(file)}) == 1
    assert not re.search(r"\b(nan|inf)\b", re.sub(r"data:[^\"]+", "", html))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ENSEMBLES)
def test_every_kind_of_ensemble_gives_a_sound_page(name, tmp_path, capsys):
    cases, state = ENSEMBLES[name]
    write_ensemble(tmp_path, cases, state, snapshots=[("deterministic", 1)])
    html, _ = report(tmp_path, capsys)
    assert_page_is_sound(html, tmp_path / "report")
    assert ("the nominal run has no result" in html) is (name == "nominal failed")


@pytest.mark.usefixtures("no_pictures")
def test_numbers_are_those_of_the_sample(tmp_path, capsys):
    case = base(50)
    write_ensemble(tmp_path, [HOMOGENEOUS, case])
    html, numbers = report(tmp_path, capsys)
    got = numbers["cases"][0]
    values = case["values"]
    assert got["runouts"]["runout_max"]["mean"] == pytest.approx(values.mean(), rel=1e-12)
    assert got["runouts"]["runout_q995"]["sd"] == pytest.approx(0.9 * values.std(ddof=1), rel=1e-12)
    above = np.mean(values > np.mean(HOMOGENEOUS["values"]))
    assert got["exceedance"]["value"] == pytest.approx(above)
    assert f"mean {values.mean():.3f} m" in html
    for name, factor in RUNOUTS_FACTOR.items():
        runout, x = got["runouts"][name], factor * values
        assert runout["n"] == 50
        assert [runout[key] for key in ("minimum", "p05", "median", "p95", "maximum")] == (
            pytest.approx(np.percentile(x, [0, 5, 50, 95, 100]), rel=1e-12)
        )
        half = 2.0095752 * x.std(ddof=1) / np.sqrt(50)  # Student's t, 49 degrees, 97.5 %
        assert runout["mean_high"] - runout["mean"] == pytest.approx(half, rel=1e-7)
    with open(tmp_path / "report" / "members.csv", newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["case"] == "base"]
    assert [float(row["runout_max"]) for row in rows] == list(values)
    with open(tmp_path / "report" / "summary.csv", newline="", encoding="utf-8") as file:
        rows = {(row["case"], row["runout"]): row for row in csv.DictReader(file)}
    assert float(rows["base", "runout_max"]["sd"]) == got["runouts"]["runout_max"]["sd"]
    assert float(rows["deterministic", "runout_max"]["mean"]) == pytest.approx(
        np.mean(HOMOGENEOUS["values"]), rel=1e-12
    )


@pytest.mark.usefixtures("no_pictures")
def test_a_stopped_run_counts_no_member_behind_a_gap(tmp_path, capsys):
    cases, state = ENSEMBLES["partial"]
    write_ensemble(tmp_path, cases, state)
    html, numbers = report(tmp_path, capsys)
    assert numbers["cases"][0]["runouts"]["runout_max"]["n"] == 3
    assert "without a gap" in html


@pytest.mark.usefixtures("no_pictures")
def test_failed_members_are_listed_with_their_reason(tmp_path, capsys):
    write_ensemble(tmp_path, [HOMOGENEOUS, base(9, failed=[4])])
    html, numbers = report(tmp_path, capsys)
    assert (
        numbers["totals"]["failed"] == 1 and numbers["cases"][0]["runouts"]["runout_max"]["n"] == 8
    )
    assert "point left the grid" in html and "point lost" in html


@pytest.mark.usefixtures("no_pictures")
def test_pairs_use_the_same_realizations(tmp_path, capsys):
    first = {**base(20), "label": "snx_cov0.10"}
    second = {**first, "label": "sqx_cov0.10", "acf": "sqx", "values": first["values"] - 0.25}
    write_ensemble(tmp_path, [HOMOGENEOUS, first, second])
    _, numbers = report(tmp_path, capsys)
    pair = numbers["pairs"][0]
    assert pair["mean"] == pytest.approx(0.25) and pair["high"] - pair["low"] < 1e-6


def test_a_full_study_stays_within_five_megabytes(tmp_path, capsys):
    """15 cases of 1000. What is drawn of fields is not in these data: in the paper's study it takes
    0.2 MB for the members of a case, 0.1 MB for a soil map, five times each, and 0.2 MB."""
    cases = study(1000)
    write_ensemble(tmp_path, [HOMOGENEOUS, *cases])
    html, _ = report(tmp_path, capsys)
    assert_page_is_sound(html, tmp_path / "report")
    assert len(html) < 5_000_000 - 1_700_000
    assert "Heterogeneous ground, 15 cases:" in html
    for picture in ("Field and deposit of the members at the quantiles of", "Surfaces of the"):
        shown = re.findall(rf'alt="{picture}[^"]* (...)_cov', html)
        assert sorted(shown) == ["bin", "csx", "smk", "snx", "sqx"]


@pytest.mark.usefixtures("no_pictures")
def test_a_nominal_run_far_from_the_other_homogeneous_ones_is_told(tmp_path, capsys):
    """The runs of input/paper/baseline.nml, in which it happened."""
    values = [6.565, 5.909, 5.935, 6.039, 5.928, 5.840, 5.952, 5.987]
    write_ensemble(tmp_path / "far", [{**HOMOGENEOUS, "values": values}, base(20)])
    html, numbers = report(tmp_path / "far", capsys)
    floor = numbers["deterministic"]["runout_max"]
    assert floor["nominal_is_outlier"] and "lies far outside the other 7" in html
    assert floor["sd"] == pytest.approx(np.std(values, ddof=1))
    assert floor["others"]["sd"] == pytest.approx(np.std(values[1:], ddof=1))
    write_ensemble(tmp_path / "near", [HOMOGENEOUS, base(20)])
    html, _ = report(tmp_path / "near", capsys)
    assert "lies far outside" not in html


@pytest.mark.usefixtures("no_pictures")
def test_differences_below_the_noise_floor_are_called_so(tmp_path, capsys):
    first = {**base(20), "label": "snx_cov0.10"}
    noise = np.std(HOMOGENEOUS["values"], ddof=1)
    for factor, is_below in ((0.5, True), (2.0, False)):
        values = first["values"] - factor * noise
        second = {**first, "label": "sqx_cov0.10", "acf": "sqx", "values": values}
        write_ensemble(tmp_path / str(factor), [HOMOGENEOUS, first, second])
        html, numbers = report(tmp_path / str(factor), capsys)
        assert numbers["pairs"][0]["below_noise"] is is_below
        assert ("smaller than the noise floor" in " ".join(html.split())) is is_below


@pytest.mark.parametrize("shift", [0.0, -20.0])
def test_a_deposit_is_drawn_where_it_lies(shift):
    x, y = np.meshgrid(np.linspace(0, 10, 30), np.linspace(0, 5, 20))
    points = np.column_stack([x.ravel() + shift, y.ravel()])
    state = State(7, 1.0, points, np.full(len(points), 35.0))
    figure = configuration_figure(state, Geometry(point_spacing=0.25))
    low, high = figure.axes[0].get_xlim()
    assert low <= shift < shift + 10 <= high and high - low < 12


@pytest.mark.parametrize("content", [None, b"", b"no HDF5"])
def test_bad_input_is_one_line_and_exit_code_2(content, tmp_path, capsys):
    if content is not None:
        (tmp_path / "ensemble.h5").write_bytes(content)
    assert main(["report", str(tmp_path)]) == 2
    message = capsys.readouterr().err
    assert message.startswith("sgimp-post: ") and message.count("\n") == 1


def replace(path, name, value):
    """Puts `value` in place of what has that name in an HDF5 file."""
    with h5py.File(path, "a") as file:
        del file[name]
        file[name] = value


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("cases", [1, 2], "cannot be read"),
        ("cases/base", [1, 2], "case base has no dataset id"),
        ("cases/base/runout_max", [1.0], "1 rows of runout_max for 4 members"),
        ("cases/base/profile/height", np.ones((4, 3)), "expected (4, 40)"),
    ],
)
def test_a_file_that_does_not_fit_is_named(name, value, words, tmp_path, capsys):
    write_ensemble(tmp_path, [base(4)])
    replace(tmp_path / "ensemble.h5", name, value)
    assert main(["report", str(tmp_path)]) == 2
    message = capsys.readouterr().err
    assert "ensemble.h5" in message and words in message and message.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("position", np.empty((0, 2))),
        ("position", np.full((64, 2), np.nan)),
        ("friction_angle", np.full(3, 35.0)),
    ],
)
def test_a_snapshot_that_cannot_be_drawn_is_left_out(name, value, tmp_path):
    write_ensemble(tmp_path, [base(1)], snapshots=[("base", 1)])
    path = tmp_path / "snapshots" / "base_r000001.h5"
    assert read_snapshot("base", 1, path) is not None
    replace(path, f"step_000100/{name}", value)
    assert read_snapshot("base", 1, path) is None


@pytest.mark.usefixtures("no_pictures")
def test_texts_of_the_run_are_text_in_the_page(tmp_path, capsys):
    write_ensemble(tmp_path, [base(3, failed=[2])])
    replace(tmp_path / "ensemble.h5", "cases/base/reason", ["", "<script>alert('ü')</script>", ""])
    html, numbers = report(tmp_path, capsys)
    assert "<script" not in html and "&lt;script&gt;" in html
    assert numbers["failures"][0]["reason"] == "<script>alert('ü')</script>"


def test_the_command_line(tmp_path):
    """As a user calls it: from inside the directory, another definition, another place."""
    write_ensemble(tmp_path / "dir", [base(5)])
    command = [sys.executable, "-m", "sgimp_post", "report"]
    done = subprocess.run(
        [*command, ".", "--runout", "runout_q99", "--output", "../other/page.html"],
        cwd=tmp_path / "dir",
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "../other/page.html\n", "")
    html = (tmp_path / "other" / "page.html").read_text(encoding="utf-8")
    assert "<title>SGIMP: dir</title>" in html
    assert_page_is_sound(html, tmp_path / "other")
    numbers = json.loads((tmp_path / "other" / "report.json").read_text())
    assert numbers["primary"] == "runout_q99"
    assert not (tmp_path / "dir" / "report").exists()


@pytest.mark.parametrize("arguments", [[], ["rapport"], ["report", ".", "--runout", "far"]])
def test_a_wrong_command_is_exit_code_2(arguments, capsys):
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == 2 and "usage: sgimp-post" in capsys.readouterr().err


@pytest.mark.usefixtures("no_pictures")
def test_a_place_that_cannot_be_written_is_one_line(tmp_path, capsys):
    write_ensemble(tmp_path, [base(1)])
    (tmp_path / "file").write_text("")
    assert main(["report", str(tmp_path), "--output", str(tmp_path / "file" / "page.html")]) == 2
    message = capsys.readouterr().err
    assert "cannot be written" in message and message.count("\n") == 1


def test_field_columns_have_their_unit(tmp_path, capsys):
    """Cohesion in pascals, an angle in degrees."""
    for unit, shown in (("Pa", "mean of field means [Pa]"), ("degree", "mean of field means [°]")):
        directory = tmp_path / unit
        write_ensemble(directory, [HOMOGENEOUS, base(5)], "complete")
        with h5py.File(directory / "ensemble.h5", "r+") as file:
            for case in file["cases"].values():
                case["field_mean"].attrs["units"] = unit
        html, _ = report(directory, capsys)
        assert shown in html


def damping_study():
    """Two dampings with a homogeneous case each, two functions, two coefficients of variation; the
    twin of one case."""
    cases = []
    for damping, mean in (("0.4", 5.6), ("0.7", 5.0)):
        varied, noise = f"damping={damping}", f"deterministic_damping{damping}"
        more = {"role": "homogeneous", "varied": varied}
        cases.append({"label": noise, "values": sample(1, 8, mean, 0.05), "more": more})
        more = {"role": "study", "varied": varied, "noise_case": noise}
        for acf, cov in (("snx", 0.05), ("snx", 0.1), ("sqx", 0.05)):
            label = f"{acf}_cov{cov:.2f}_damping{damping}"
            values = mean + 2.0 * cov * sample(3, 50, 0.0, 1.0) + (acf == "sqx") * 0.01
            case = {"label": label, "acf": acf, "cov": cov, "values": values, "more": more}
            cases.append({**case, "columns": {"seconds": np.full(50, 4.0)}})
    twin = {"role": "control", "control_of": cases[1]["label"]}
    values = np.concatenate(
        [cases[1]["values"] + sample(5, 50, 0.0, 0.02), sample(6, 100, 5.6, 0.1)]
    )
    columns = {"seconds": np.full(150, 0.4)}
    return [*cases, {"label": "twin", "values": values, "more": twin, "columns": columns}]


@pytest.mark.filterwarnings("error")
def test_a_study_of_another_key_gives_a_sound_page(tmp_path, capsys):
    write_ensemble(tmp_path, damping_study())
    html, _ = report(tmp_path, capsys)
    assert_page_is_sound(html, tmp_path / "report")
    assert "deterministic_damping0.7" in html and "Against the coefficient" not in html


@pytest.mark.usefixtures("no_pictures")
def test_each_case_stands_against_its_own_noise_floor(tmp_path, capsys):
    cases = damping_study()
    write_ensemble(tmp_path, cases)
    _, numbers = report(tmp_path, capsys)
    assert list(numbers["floors"]) == ["deterministic_damping0.4", "deterministic_damping0.7"]
    assert len(numbers["cases"]) == 6
    noise, case = cases[4]["values"], cases[5]["values"]
    assert numbers["cases"][3]["label"] == cases[5]["label"]
    for name, factor in RUNOUTS_FACTOR.items():
        got = numbers["cases"][3]["against_floor"][name]
        share = 1.0 - np.var(noise, ddof=1) / np.var(case, ddof=1)
        assert got["soil_share"]["value"] == pytest.approx(share, rel=1e-9)
        assert got["soil_share"]["low"] < share < got["soil_share"]["high"]
        shift = factor * (case.mean() - noise.mean())
        assert got["shift"]["mean"] == pytest.approx(shift, rel=1e-9)
        assert got["exceedance"]["share"]["value"] == np.mean(case > noise.mean())
        assert got["above_nominal"] == np.mean(case > noise[0])
    with open(tmp_path / "report" / "noise_floor.csv", newline="", encoding="utf-8") as file:
        rows = {(row["case"], row["runout"]): row for row in csv.DictReader(file)}
    got = numbers["cases"][3]["against_floor"]["runout_max"]
    row = rows[cases[5]["label"], "runout_max"]
    assert float(row["noise_sd"]) == pytest.approx(np.std(noise, ddof=1))
    assert float(row["exceedance_share_low"]) == got["exceedance"]["share"]["low"]


@pytest.mark.usefixtures("no_pictures")
def test_pairs_differ_in_one_thing(tmp_path, capsys):
    write_ensemble(tmp_path, damping_study())
    html, numbers = report(tmp_path, capsys)
    found = {}
    for pair in numbers["pairs"]:
        found.setdefault(pair["by"], []).append(pair)
    assert {by: len(rows) for by, rows in found.items()} == {"acf": 2, "cov": 2, "damping": 3}
    assert all(pair["mean"] == pytest.approx(0.6) for pair in found["damping"])
    assert all(pair["mean"] == pytest.approx(-0.01) for pair in found["acf"])
    for rows in found.values():  # Holm among the rows of one kind alone
        assert min(row["p_adjusted"] for row in rows) == pytest.approx(
            min(1.0, len(rows) * min(row["p_value"] for row in rows))
        )
    assert "By damping" in html
    with open(tmp_path / "report" / "pairs.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["mean"]) for row in rows] == [pair["mean"] for pair in numbers["pairs"]]


@pytest.mark.usefixtures("no_pictures")
def test_rows_of_pairs_are_limited_in_the_page_only(tmp_path, capsys):
    cases = [
        {**base(10), "label": f"base_h{k}", "more": {"varied": f"cell_size={k}"}} for k in range(12)
    ]
    write_ensemble(tmp_path, cases)
    html, numbers = report(tmp_path, capsys)
    assert len(numbers["pairs"]) == 66 and "The 45 of the smallest p of 66" in html
    assert len(re.findall(r"base_h\d+ − base_h\d+", html)) == 45


@pytest.mark.usefixtures("no_pictures")
def test_a_twin_is_a_control_and_no_case_of_the_study(tmp_path, capsys):
    cases = damping_study()
    write_ensemble(tmp_path, cases)
    html, numbers = report(tmp_path, capsys)
    (entry,) = numbers["controls"]
    assert (entry["case"], entry["twin"]) == (cases[1]["label"], "twin")
    assert entry["cost_ratio"] == pytest.approx(10.0)
    assert {row["quantity"] for row in entry["rows"]} == {"mean", "sd", "exceedance"}
    y, twins = cases[1]["values"], cases[-1]["values"]
    slope = np.cov(y, twins[:50])[0, 1] / np.var(twins[:50], ddof=1)
    row = entry["rows"][0]
    assert row["value"] == pytest.approx(y.mean() + slope * (twins.mean() - twins[:50].mean()))
    assert row["gain"] == pytest.approx(row["variance_ratio"] * 50 / (50 + 150 / 10.0))
    assert "Fewer runs for the same answer" in html and ">twin<" in html
    write_ensemble(tmp_path / "mirrored", cases, sampling="antithetic")
    _, numbers = report(tmp_path / "mirrored", capsys)
    assert numbers["controls"] == []


def weighted_case():
    """Members drawn three standard deviations out."""
    xi = sample(7, 1000, 3.0, 1.0)
    return base(0) | {"values": 5.6 + 0.1 * xi, "columns": {"log_weight": 4.5 - 3.0 * xi}}


@pytest.mark.filterwarnings("error")
def test_members_of_importance_sampling_are_never_shown_as_plain_ones(tmp_path, capsys):
    write_ensemble(tmp_path, [HOMOGENEOUS, weighted_case()], sampling="importance")
    html, numbers = report(tmp_path, capsys)
    assert_page_is_sound(html, tmp_path / "report")
    assert "Plain means, spreads, histograms" in html and "Distribution, convergence" not in html
    assert "Exceedance probability from weighted members" in html
    (case,), (weighted,) = numbers["cases"], numbers["importance"]
    assert case["runouts"]["runout_max"]["n"] == 0 and case["fits"][0]["note"]
    assert weighted["mean"]["value"] is None
    exact = {row["threshold"]: stats.norm.sf((row["threshold"] - 5.6) / 0.1)
             for row in weighted["rows"]}  # fmt: skip
    assert len(exact) >= 4 and min(exact.values()) < 1e-4
    for row in weighted["rows"]:
        assert row["value"] == pytest.approx(exact[row["threshold"]], rel=0.5)


def test_the_curve_of_weighted_members_is_the_exact_one(tmp_path):
    """Within 40 %, where three standard errors of ten effective members would be 95 %."""
    ensemble = read_ensemble(write_ensemble(tmp_path, [weighted_case()], sampling="importance"))
    figure = weighted_figure(ensemble.cases, "runout_max", {"mean": np.nan, "sd": np.nan})
    x, p = figure.axes[0].lines[0].get_data()
    assert len(x) > 100 and p[-1] < 1e-5
    assert p == pytest.approx(stats.norm.sf((x - 5.6) / 0.1), rel=0.4)


@pytest.mark.usefixtures("no_pictures")
def test_a_case_that_its_stop_rule_ended_is_told(tmp_path, capsys):
    case = base(30, more={"stop_rule_met": 1}, planned=20)
    write_ensemble(tmp_path, [HOMOGENEOUS, case])
    html, numbers = report(tmp_path, capsys)
    assert "The stop rule ended base" in html
    assert numbers["cases"][0]["runouts"]["runout_max"]["n"] == 20
