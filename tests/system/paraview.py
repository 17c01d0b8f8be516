"""Snapshots as ParaView sees them: the program's XDMF, and the VTKHDF that `sgimp-post export` makes of them.

Every dataset that the XDMF names must be there with the stated numbers, and its times must be those of the file. Where
VTK is installed its readers open both: the same counts, times and values to the last bit, as neither computes.
"""

import importlib
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import h5py
import numpy as np
from common import Program, arguments, check

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "postproc"))
from sgimp_post.cli import main  # noqa: E402

SNAPSHOTS = "report_seconds=0.5, snapshot_members=1,3, snapshot_interval=0.75, history_interval=0.75"
#: 20 x 20 points; the start, three times and the end at 3 s.
POINTS, STATES = 400, 5
KINDS = {("Float", "8"): np.float64, ("Int", "4"): np.int32}


def check_xdmf(path):
    """The text against the HDF5 file beside it; returns the times and the arrays of each grid, by name."""
    grids, times = ElementTree.parse(path).findall("./Domain/Grid[@CollectionType='Temporal']/Grid"), []
    check(len(grids) == STATES, f"{path}: {len(grids)} states, not {STATES}")
    with h5py.File(path.with_suffix(".h5")) as file:
        names = sorted(name for name in file if name.startswith("step_"))
        check([grid.get("Name") for grid in grids] == names, f"{path}: other states than {names}")
        states = [check_grid(path, file, grid) for grid in grids]
        times = [time for time, _ in states]
        check(times[0] == 0 and (np.diff(times) > 0).all(), f"{path}: times {times}")
        check(times[-1] == file["history/time"][-1], f"{path}: the end is not that of the history")
    return states


def check_grid(path, file, grid):
    """One state: time and arrays."""
    name, arrays = grid.get("Name"), {}
    time = float(grid.find("Time").get("Value"))
    check(time == file[name]["time"][()], f"{path}: {name} at {time} s")
    topology = grid.find("Topology")
    check(topology.get("TopologyType") == "Polyvertex", f"{path}: {name} is not made of vertices")
    check(int(topology.get("NumberOfElements")) == POINTS, f"{path}: {name} has other points than {POINTS}")
    check(grid.find("Geometry").get("GeometryType") == "XY", f"{path}: {name} has no plane geometry")
    for item in grid.iter("DataItem"):
        home, _, place = item.text.partition(":")
        check(home == path.with_suffix(".h5").name, f"{path}: refers to {home}")
        check(place in file, f"{path}: {place} is not in the file")
        dataset = file[place]
        shape = tuple(map(int, item.get("Dimensions").split()))
        check(dataset.shape == shape and len(dataset) == POINTS, f"{path}: {place} is {dataset.shape}, not {shape}")
        kind = KINDS[item.get("NumberType"), item.get("Precision")]
        check(dataset.dtype == kind, f"{path}: {place} holds {dataset.dtype}, not {kind}")
        arrays[place.rpartition("/")[2]] = dataset[...]
    named = {"position", *(attribute.get("Name") for attribute in grid.findall("Attribute"))}
    check(named == set(arrays) == set(file[name]) - {"time"}, f"{path}: {name} has the arrays {sorted(named)}")
    return time, arrays


def check_reader(reader, path, states):
    """What a reader of VTK makes of a file. Components beyond those of the program are zero."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

    reader.SetFileName(str(path))
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    check(list(times) == [time for time, _ in states], f"{path}: VTK finds the times {times}")
    for time, arrays in states:
        reader.UpdateTimeStep(time)
        output = reader.GetOutputDataObject(0)
        counts = output.GetNumberOfPoints(), output.GetNumberOfCells()
        check(counts == (POINTS, POINTS), f"{path}: VTK finds {counts} points and cells at {time} s")
        check(output.GetPointData().GetNumberOfArrays() == len(arrays) - 1, f"{path}: VTK finds other arrays")
        for name, values in arrays.items():
            data = output.GetPoints().GetData() if name == "position" else output.GetPointData().GetArray(name)
            check(data is not None, f"{path}: VTK finds no {name} at {time} s")
            got, wanted = (array.reshape(len(array), -1) for array in (vtk_to_numpy(data), values))
            width = wanted.shape[1]
            same = len(got) == POINTS and np.array_equal(got[:, :width], wanted) and not got[:, width:].any()
            check(same, f"{path}: VTK finds another {name} at {time} s, {got.shape}")


def reader_of(module, name):
    """A reader of VTK, None where VTK is not installed."""
    try:
        return getattr(importlib.import_module(f"vtkmodules.{module}"), name)()
    except ImportError:
        return None


program = Program(arguments())
case = program.changed_case("report_seconds=0.5", SNAPSHOTS)
program.run("run", 2, "--members", "1-3", case=case)
directory = program.root / "run"
check(main(["export", str(directory), "--vtkhdf"]) == 0, "export fails")
found = sorted((directory / "snapshots").glob("*.xdmf"))
check(len(found) == 6, f"{len(found)} snapshots, not 2 of each of 3 cases")
for path in found:
    states = check_xdmf(path)
    for reader, file in (
        (reader_of("vtkIOXdmf2", "vtkXdmfReader"), path),
        (reader_of("vtkIOHDF", "vtkHDFReader"), directory / "export" / f"{path.stem}.vtkhdf"),
    ):
        check(file.is_file(), f"{file} is not there")
        if reader is None:
            print(f"VTK is not installed: {file.name} is not opened")
        else:
            check_reader(reader, file, states)
program.clean()
