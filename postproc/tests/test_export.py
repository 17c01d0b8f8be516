"""What `sgimp-post export` writes, read back by the rules of each format and by the libraries that
users open it with."""

import csv

import h5py
import numpy as np
import pytest
from synthetic import sample, write_ensemble

from sgimp_post.cli import main
from sgimp_post.ensemble import STATUS_TEXTS

#: Steps and times of the states, not evenly spaced.
STEPS = {0: 0.0, 129: 0.5, 1000417: 1.75}
POINTS = 37
#: Name: components in the snapshot, where they go in VTKHDF, units.
ARRAYS = {
    "velocity": (2, 3, "m/s"),
    "displacement": (2, 3, "m"),
    "stress": (4, 6, "Pa"),
    "volume": (1, 1, "m2"),
    "friction_angle": (1, 1, "degree"),
    "plastic_strain": (1, 1, "1"),
    "cohesion": (1, 1, "Pa"),
    "material": (1, 1, "1"),
}


def write_states(directory, label, member, points=POINTS):
    """A snapshot as the program's, other numbers in every array and step; its path."""
    (directory / "snapshots").mkdir(parents=True, exist_ok=True)
    path = directory / "snapshots" / f"{label}_r{member:06d}.h5"
    random = np.random.default_rng(member)
    with h5py.File(path, "w") as file:
        for step, time in STEPS.items():
            group = file.create_group(f"step_{step:06d}")
            group["time"] = time
            group["position"] = random.normal(size=(points, 2))
            for name, (width, _, units) in ARRAYS.items():
                shape = (points, width) if width > 1 else (points,)
                group[name] = random.normal(size=shape) * 1e5
                if name == "material":
                    del group[name]
                    group[name] = np.arange(points, dtype=np.int32) % 3 + 1
                group[name].attrs["units"] = np.bytes_(units)
        file["history/time"] = np.zeros(3)
    return path


def export(directory, *options):
    return main(["export", str(directory), *options])


def padded(values, width):
    """With components of zero up to `width`, [np] if that is one."""
    if width == 1:
        return values
    return np.pad(values, ((0, 0), (0, width - values.shape[1])))


def expected_states(path):
    """(time, points [np, 3], arrays) of each step, as a reader of VTKHDF should see them."""
    with h5py.File(path) as file:
        for step, time in STEPS.items():
            group = file[f"step_{step:06d}"]
            arrays = {name: padded(group[name][...], to) for name, (_, to, _) in ARRAYS.items()}
            yield time, padded(group["position"][...], 3), arrays


def test_vtkhdf_follows_the_specification(tmp_path):
    """Each step is found by the offsets alone, as VTKHDF 2.0 has them for PolyData."""
    source = write_states(tmp_path, "base", 3)
    assert export(tmp_path, "--vtkhdf") == 0
    with h5py.File(tmp_path / "export" / "base_r000003.vtkhdf") as file:
        root, steps = file["VTKHDF"], file["VTKHDF/Steps"]
        assert list(root.attrs["Version"]) == [2, 0] and root.attrs["Type"] == b"PolyData"
        # The reader takes a string of fixed length in ASCII only.
        kind = h5py.h5a.open(root.id, b"Type").get_type()
        assert not kind.is_variable_str() and kind.get_cset() == h5py.h5t.CSET_ASCII
        assert steps.attrs["NSteps"] == len(STEPS)
        assert set(root["PointData"]) == set(steps["PointDataOffsets"]) == set(ARRAYS)
        assert (file.attrs["label"], file.attrs["realization"]) == ("base", 3)
        for k, (time, points, arrays) in enumerate(expected_states(source)):
            assert steps["Values"][k] == time and steps["NumberOfParts"][k] == 1
            part, first = steps["PartOffsets"][k], steps["PointOffsets"][k]
            count = root["NumberOfPoints"][part]
            np.testing.assert_array_equal(root["Points"][first : first + count], points)
            for column, name in enumerate(("Vertices", "Lines", "Polygons", "Strips")):
                cells = root[name]["NumberOfCells"][part]
                assert cells == (POINTS if name == "Vertices" else 0)
                start = steps["CellOffsets"][k, column]
                ids = steps["ConnectivityIdOffsets"][k, column]
                offsets = root[name]["Offsets"][start + part : start + part + cells + 1]
                assert list(np.diff(offsets)) == [1] * cells and offsets[0] == 0
                assert root[name]["NumberOfConnectivityIds"][part] == cells
                connectivity = root[name]["Connectivity"][ids : ids + cells]
                np.testing.assert_array_equal(connectivity, np.arange(cells))
            for name, values in arrays.items():
                start = steps["PointDataOffsets"][name][k]
                dataset = root["PointData"][name]
                np.testing.assert_array_equal(dataset[start : start + count], values)
                assert dataset.attrs["units"] == ARRAYS[name][2]
        assert root["PointData/material"].dtype == np.int32


def test_vtk_reads_counts_times_and_values(tmp_path):
    reader_module = pytest.importorskip("vtkmodules.vtkIOHDF")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

    source = write_states(tmp_path, "base", 3)
    assert export(tmp_path, "--vtkhdf") == 0
    reader = reader_module.vtkHDFReader()
    reader.SetFileName(str(tmp_path / "export" / "base_r000003.vtkhdf"))
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(Pipeline.TIME_STEPS())
    assert list(times) == list(STEPS.values())
    for time, points, arrays in expected_states(source):
        reader.UpdateTimeStep(time)
        got = reader.GetOutputDataObject(0)
        assert got.GetClassName() == "vtkPolyData"
        assert got.GetNumberOfPoints() == got.GetNumberOfVerts() == got.GetNumberOfCells() == POINTS
        np.testing.assert_array_equal(vtk_to_numpy(got.GetPoints().GetData()), points)
        data = got.GetPointData()
        assert data.GetNumberOfArrays() == len(ARRAYS)
        for name, values in arrays.items():
            np.testing.assert_array_equal(vtk_to_numpy(data.GetArray(name)), values)
            last = values if values.ndim == 1 else values[:, 0]
            assert data.GetArray(name).GetRange(0) == (last.min(), last.max())


def test_csv_holds_every_number_of_a_step(tmp_path):
    source = write_states(tmp_path, "base", 3)
    assert export(tmp_path, "--csv") == 0
    names = sorted(path.name for path in (tmp_path / "export").iterdir())
    assert names == [f"base_r000003_step_{step}.csv" for step in ("000000", "000129", "1000417")]
    with open(tmp_path / "export" / names[1], encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == POINTS and list(rows[0])[:3] == ["time", "x", "y"]
    column = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    with h5py.File(source) as file:
        group = file["step_000129"]
        assert set(column["time"]) == {0.5}
        for k, axis in enumerate("xy"):
            np.testing.assert_array_equal(column[axis], group["position"][:, k])
            np.testing.assert_array_equal(column[f"velocity_{axis}"], group["velocity"][:, k])
        for k, part in enumerate(("xx", "yy", "zz", "xy")):
            np.testing.assert_array_equal(column[f"stress_{part}"], group["stress"][:, k])
        np.testing.assert_array_equal(column["cohesion"], group["cohesion"])
        assert rows[4]["material"] == str(group["material"][4])


@pytest.mark.parametrize(
    ("asked", "steps"),
    [("first", [0]), ("last", [1000417]), ("129", [129]), ("000129", [129])],
)
def test_one_step_is_exported(asked, steps, tmp_path):
    write_states(tmp_path, "base", 3)
    assert export(tmp_path, "--csv", "--step", asked) == 0
    names = [path.name for path in (tmp_path / "export").iterdir()]
    assert names == [f"base_r000003_step_{step:06d}.csv" for step in steps]
    assert export(tmp_path, "--vtkhdf", "--step", asked) == 0
    with h5py.File(tmp_path / "export" / "base_r000003.vtkhdf") as file:
        assert list(file["VTKHDF/Steps/Values"]) == [STEPS[step] for step in steps]


@pytest.mark.parametrize(
    ("options", "names"),
    [
        ([], ["base_r000003", "base_r000004", "deterministic_r000001"]),
        (["--study-case", "base"], ["base_r000003", "base_r000004"]),
        (["--members", "1,4"], ["base_r000004", "deterministic_r000001"]),
        (["--members", "3-4", "--study-case", "base"], ["base_r000003", "base_r000004"]),
    ],
)
def test_members_and_cases_are_chosen(options, names, tmp_path, capsys):
    for label, member in (("base", 3), ("base", 4), ("deterministic", 1)):
        write_states(tmp_path, label, member)
    out = tmp_path / "elsewhere" / "deep"
    assert export(tmp_path, "--vtkhdf", "--out", str(out), *options) == 0
    assert sorted(path.stem for path in out.iterdir()) == names
    assert capsys.readouterr().out.split() == [str(out / f"{name}.vtkhdf") for name in names]


#: The second case has other members, other cells and a failure.
CASES = [
    {"label": "deterministic", "values": [5.0, 5.1], "ids": [1, 3]},
    {
        "label": "base",
        "values": sample(3, 3),
        "ids": [1, 2, 5],
        "failed": [2],
        "acf": "snx",
        "cov": 0.1,
        "planned": 9,
        "columns": {"height_max": np.array([1.5, 2.5, 3.5])},
    },
]
CELLS = 0.125 + 0.25 * np.arange(4)


@pytest.fixture(name="ensemble")
def fixture_ensemble(tmp_path):
    """The file that was exported from an ensemble of two cases."""
    write_ensemble(tmp_path, CASES, state="running")
    with h5py.File(tmp_path / "ensemble.h5", "r+") as file:
        profile = file["cases/base/profile"]
        del profile["x"], profile["height"]
        profile["x"] = CELLS
        profile["height"] = np.arange(12.0, dtype=np.float32).reshape(3, 4)
    assert export(tmp_path, "--netcdf") == 0
    return tmp_path / "export" / "ensemble.nc"


def test_netcdf_has_dimensions_units_and_names(ensemble):
    """netCDF-4 is HDF5 whose variables are attached to dimension scales."""
    with h5py.File(ensemble) as file:
        members, x = [1, 2, 3, 5], np.union1d(0.25 + 0.5 * np.arange(40), CELLS)
        assert list(file["case"].asstr()) == ["deterministic", "base"]
        assert list(file["member"]) == members and list(file["x"]) == list(x)
        assert all(h5py.h5ds.is_scale(file[name].id) for name in ("case", "member", "x"))
        for name, dataset in file.items():
            assert dataset.attrs["long_name"]
            if not h5py.h5ds.is_scale(dataset.id):
                axes = [dimension[0].name for dimension in dataset.dims]
                assert axes == ["/case", "/member", "/x"][: dataset.ndim], name
        runout, status = file["runout_max"][...], file["status"][...]
        expected = [5.0, np.nan, 5.1, np.nan]
        assert list(runout[0]) == pytest.approx(expected, abs=0, nan_ok=True)
        expected = [sample(3, 3)[0], np.nan, np.nan, sample(3, 3)[2]]
        assert list(runout[1]) == pytest.approx(expected, abs=0, nan_ok=True)
        assert file["runout_max"].attrs["units"] == "m"
        assert status.tolist() == [[0, -1, 0, -1], [0, 2, -1, 0]]
        assert list(file["status"].attrs["flag_values"]) == list(STATUS_TEXTS)
        assert file["status"].attrs["flag_meanings"].split()[2] == "point_lost"
        assert file["steps"].attrs["_FillValue"] == -1 and file["steps"].dtype == np.int64
        assert file["height_max"][1, 3] == 3.5
        assert file["reason"].asstr()[1].tolist() == ["", "point left the grid", "", ""]
        assert file["acf"].asstr()[1] == "snx" and list(file["planned"]) == [2, 9]
        assert (file.attrs["seed"], file.attrs["state"]) == (2022, "running")
        height = file["height"][...]
        got = height[1, [0, 1, 3]][:, np.isin(x, CELLS)]
        np.testing.assert_array_equal(got, np.arange(12).reshape(3, 4))
        assert np.isnan(height[1][:, ~np.isin(x, CELLS)]).all() and np.isnan(height[0, 3]).all()
        assert (height[0, [0, 2]][:, np.isin(x, 0.25 + 0.5 * np.arange(40))] == 1).all()


def test_xarray_selects_by_case_and_member(ensemble):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    with xarray.open_dataset(ensemble, engine="h5netcdf") as data:
        assert dict(data.sizes) == {"case": 2, "member": 4, "x": 44}
        assert float(data.runout_max.sel(case="base", member=5)) == sample(3, 3)[2]
        assert np.isnan(data.steps.sel(case="deterministic", member=5))
        assert data.runout_max.attrs["units"] == "m"
        assert float(data.runout_max.mean("member").sel(case="deterministic")) == 5.05
        base = data.height.sel(case="base", member=2).dropna("x")
        assert list(base.x) == list(CELLS) and list(base) == [4, 5, 6, 7]
        assert str(data.reason.sel(case="base", member=2).values) == "point left the grid"


def test_netcdf_of_chosen_members(tmp_path):
    write_ensemble(tmp_path, CASES)
    assert export(tmp_path, "--netcdf", "--study-case", "base", "--members", "2-5") == 2
    assert export(tmp_path, "--netcdf", "--study-case", "base", "--members", "2,5") == 0
    with h5py.File(tmp_path / "export" / "ensemble.nc") as file:
        assert list(file["case"].asstr()) == ["base"] and list(file["member"]) == [2, 5]
        assert file["runout_max"].shape == (1, 2)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--vtkhdf", "--study-case", "bse"], "no snapshots of a case 'bse'"),
        (["--csv", "--study-case", "bse"], "takes one of base, deterministic"),
        (["--netcdf", "--study-case", "bse"], "no rows of a case 'bse'"),
        (["--vtkhdf", "--members", "3,8-9"], "no snapshots of member 8-9 (there are 1,3)"),
        (["--vtkhdf", "--members", "1", "--study-case", "base"], "of member 1 (there are 3)"),
        (["--vtkhdf", "--members", ""], "--members: names no member"),
        (["--vtkhdf", "--members", "3-"], "'3-' is no range of ids"),
        (["--csv", "--step", "130"], "no step 130 (there are 0, 129, 1000417)"),
        (["--csv", "--step=-1"], "'-1' is not 'first', 'last' or the number of a step"),
        (["--netcdf", "--step", "1"], "--step belongs to --vtkhdf and --csv"),
    ],
)
def test_what_is_not_there_is_named_and_nothing_written(options, words, tmp_path, capsys):
    write_ensemble(tmp_path, CASES)
    write_states(tmp_path, "base", 3)
    write_states(tmp_path, "deterministic", 1)
    before = sorted(tmp_path.rglob("*"))
    assert export(tmp_path, *options) == 2
    message = capsys.readouterr().err
    assert words in message and message.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("form", ["--vtkhdf", "--csv"])
def test_a_run_without_snapshots_is_told_how_to_make_some(form, tmp_path, capsys):
    write_ensemble(tmp_path, CASES)
    assert export(tmp_path, form) == 2
    assert "no snapshots here" in (text := capsys.readouterr().err) and "--snapshots" in text
    assert export(tmp_path / "none", form) == 2
    assert "no such directory" in capsys.readouterr().err


def test_a_run_without_a_finished_member_is_told(tmp_path, capsys):
    write_ensemble(tmp_path, [{"label": "base", "values": []}])
    assert export(tmp_path, "--netcdf") == 2
    assert "no member is done yet" in capsys.readouterr().err


def remove_points(path):
    """The last step has fewer points than the others."""
    with h5py.File(path, "r+") as file:
        group = file["step_1000417"]
        for name in ("position", *ARRAYS):
            values = group[name][:-1]
            del group[name]
            group[name] = values


def remove_array(path):
    with h5py.File(path, "r+") as file:
        del file["step_1000417/volume"]


def shorten_array(path):
    with h5py.File(path, "r+") as file:
        del file["step_1000417/volume"]
        file["step_1000417/volume"] = np.ones(3)


def cut(path):
    path.write_bytes(path.read_bytes()[:2000])


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (remove_points, "steps 0 and 1000417 have different points"),
        (remove_array, "steps 0 and 1000417 have different points or arrays"),
        (shorten_array, "volume has shape (3,)"),
        (cut, "cannot be read"),
    ],
)
def test_a_damaged_snapshot_is_named_and_nothing_is_left(damage, words, tmp_path, capsys):
    """Nor the file of the member before it."""
    write_states(tmp_path, "base", 1)
    damage(write_states(tmp_path, "base", 2))
    assert export(tmp_path, "--vtkhdf") == 2
    message = capsys.readouterr().err
    assert words in message and "base_r000002" in message
    assert [path.name for path in tmp_path.iterdir()] == ["snapshots"]


def test_files_that_are_there_are_replaced_only_when_asked(tmp_path, capsys):
    write_states(tmp_path, "base", 1)
    assert export(tmp_path, "--vtkhdf") == 0
    there = tmp_path / "export" / "base_r000001.vtkhdf"
    there.write_text("mine")
    write_states(tmp_path, "base", 2)
    capsys.readouterr()
    assert export(tmp_path, "--vtkhdf") == 2
    assert "--overwrite" in capsys.readouterr().err
    assert [path.name for path in there.parent.iterdir()] == [there.name]
    assert there.read_text() == "mine"
    assert export(tmp_path, "--vtkhdf", "--overwrite") == 0
    names = sorted(path.name for path in there.parent.iterdir())
    assert names == [there.name, "base_r000002.vtkhdf"] and h5py.is_hdf5(there)
