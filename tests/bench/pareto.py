"""Error against CPU time: every weighting x scheme x cell size x points a cell x CFL number x precision on four scenes.

    pareto.py EXE --out DIR [--jobs J] [--only SCENE ...] [--precision double single] [--plot]

manufactured  neo-Hookean square at 5 % strain, points cross cells: largest rms error of displacement, over amplitude
column        elastic column under its own weight: mean stress error, over the largest stress (Charlton et al. 2017)
bar           axial vibration of a bar over three periods: rms error of the centre of mass, over its swing
sand          the paper's homogeneous column, calibrated: error of the 99.5 % front, over that of the finest run

The finest run of the sand column (musl, gimp, cells of 0.0625 m, 3 x 3 points a cell, CFL 0.4, double) is no exact
solution; a collapse is a draw, so that errors below its noise (1 %, grey) say nothing. The key `precision` is written
for single only: double is the default, and what executables without the key do.

CPU time is the lesser of two bounds: the wall time of the member, too long where another process had its core
meanwhile, and the CPU time of its whole process, 0.1 s longer for starting and ending MPI. 3457 runs take half an hour
on two cores; of each, 0.3 s are MPI waiting for itself.

Appends to DIR/pareto.csv and goes on where it stopped; then prints the Pareto fronts and draws them to DIR/pareto.png.
A run that fails, by name, has no error in the file.
"""

import argparse
import concurrent.futures
import csv
import itertools
import os
import resource
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "verification"))

from cases_column import column_changes, stress_error  # noqa: E402
from cases_manufactured import LARGE, error_of  # noqa: E402
from judge import pareto_front  # noqa: E402
from make_points import lattice, write  # noqa: E402
from runner import Bench  # noqa: E402

WEIGHTINGS = ("linear", "gimp", "cpgimp", "bspline")
SCHEMES = ("usf", "usl", "musl")
SIDES = (2, 3, 4)  # points a cell along each axis
CFLS = (0.2, 0.4, 0.8)
PRECISIONS = ("double", "single")
CELLS = {
    "manufactured": (8, 16, 24, 32),
    "column": (16, 32, 64, 128),
    "bar": (25, 50, 100, 200),
    "sand": (10, 20, 30, 40),
}
FINEST = {"cells": 80, "weighting": "gimp", "scheme": "musl", "side": 3, "cfl": 0.4, "precision": "double"}
SETUP = ("scene", "weighting", "scheme", "cells", "side", "cfl", "precision")
COLUMNS = (*SETUP, "points", "steps", "seconds", "process_cpu", "error", "front")
BAR_END = 30.0  # s: three periods
# Errors below say nothing: standard deviation of runs that differ in nothing physical (README).
NOISE = {"sand": 0.01}


def common(setup):
    """The keys of &solver that every scene takes."""
    keys = ("weighting", "scheme", "cfl") + (("precision",) if setup["precision"] != "double" else ())
    return {f"solver.{key}": setup[key] for key in keys}


def run_manufactured(bench, setup):
    """(result, error)"""
    changes = {
        "grid.cell_size": 1 / setup["cells"],
        "loading.amplitude": LARGE,
        "solver.time_step": None,
        "body.points_per_cell": setup["side"],
    }
    result = bench.run("manufactured", changes | common(setup))
    return result, error_of(result, LARGE)


def run_column(bench, setup):
    """(result, error)"""
    changes = column_changes(setup["cells"]) | {
        "body.points_per_cell": setup["side"],
        "output.history_interval": 0.0,
    }
    result = bench.run("self_weight_column", changes | common(setup))
    return result, stress_error(result.last)


def run_bar(bench, setup):
    """(result, error)"""
    size = 25.0 / setup["cells"]
    spacing = size / setup["side"]
    x, y = lattice(0.0, 0.0, setup["cells"] * setup["side"], setup["side"], spacing)
    points = bench.scratch / "bar.csv"
    write(points, x, y, spacing, 0.1 * np.sin(np.pi * x / 50.0), np.zeros_like(x))
    changes = {
        "grid.cell_size": size,
        "grid.x_max": 28.0,
        "grid.y_max": size,
        "body.file": str(points),
        "solver.end_time": BAR_END,
    }
    history = (result := bench.run("bar", changes | common(setup))).history
    swing = 0.1 * 2 / np.pi / 0.6283185
    moved = history["centre"][:, 0] - history["centre"][0, 0]
    return result, np.sqrt(np.mean((moved - swing * np.sin(0.6283185 * history["time"])) ** 2)) / swing


def run_sand(bench, setup):
    """(result, None): its error is known once the finest run is."""
    changes = {
        "grid.cell_size": 5.0 / setup["cells"],
        "grid.y_max": 7.5,
        "body.points_per_cell": setup["side"],
        "monte_carlo.noise_members": 1,
        "output.history_interval": 0.0,
        "output.snapshot_interval": 8.0,
    }
    return bench.run("homogeneous_calibrated", changes | common(setup)), None


RUNS = {"manufactured": run_manufactured, "column": run_column, "bar": run_bar, "sand": run_sand}


def cpu_of_children():
    """CPU seconds of the processes that this one has started and that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def measure(executable, setup):
    """One row of the file. A process does one at a time, for the CPU time of its child."""
    inputs = ROOT / "input" / ("paper" if setup["scene"] == "sand" else "verification")
    row = dict(setup)
    before = cpu_of_children()
    with tempfile.TemporaryDirectory() as scratch:
        try:
            result, error = RUNS[setup["scene"]](Bench(executable, inputs, scratch), setup)
        except RuntimeError as failure:
            if "exit code 4" not in str(failure):
                raise
            return row
    row |= {key: result.row[key] for key in ("steps", "seconds")}
    row |= {"points": len(result.last.volume), "error": error, "front": float(result.row["runout_q995"])}
    row["process_cpu"] = round(cpu_of_children() - before, 6)
    return row


def setups(scenes, precisions):
    """All runs, the finest of the sand first."""
    if "sand" in scenes:
        yield {"scene": "sand"} | FINEST
    for scene in scenes:
        for values in itertools.product(WEIGHTINGS, SCHEMES, CELLS[scene], SIDES, CFLS, precisions):
            yield dict(zip(SETUP, (scene, *values), strict=True))


def key_of(row):
    """What a run is known by."""
    return tuple(str(row[name]) for name in SETUP)


def read(path):
    """Rows of the file so far, as text."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        reader = csv.DictReader(file)
        if tuple(reader.fieldnames or COLUMNS) != COLUMNS:
            sys.exit(f"{path} has other columns, of another version of this script")
        return list(reader)


def complete(rows):
    """Rows that ended well, with numbers; the sand gets its errors."""
    good = []
    finest = key_of({"scene": "sand"} | FINEST)
    reference = next((float(row["front"]) for row in rows if key_of(row) == finest), None)
    for row in rows:
        if not row["seconds"] or key_of(row) == finest:
            continue
        if row["scene"] == "sand":
            row["error"] = abs(float(row["front"]) / reference - 1.0)
        cpu = min(float(row["seconds"]), float(row["process_cpu"]))
        good.append(row | {"cpu": cpu} | {name: float(row[name]) for name in ("error", "cfl")})
    return good


def front_of(scene, rows):
    """The Pareto front of a scene, down to its noise."""
    here = [row for row in rows if row["scene"] == scene]
    return pareto_front(here, lambda row: row["cpu"], lambda row: max(row["error"], NOISE.get(scene, 0.0)))


def draw(rows, path):
    """Error against CPU time, a panel a scene, the fronts as lines; open markers are single precision."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    colours = dict(zip(WEIGHTINGS, ("#999999", "#0072B2", "#009E73", "#D55E00"), strict=True))
    marks = dict(zip(SCHEMES, ("s", "^", "o"), strict=True))
    figure, axes = plt.subplots(2, 2, figsize=(11, 8), layout="constrained")
    for axis, scene in zip(axes.flat, CELLS, strict=True):
        here = [r for r in rows if r["scene"] == scene]
        for weighting, scheme in itertools.product(WEIGHTINGS, SCHEMES):
            for precision in PRECISIONS:
                wanted = (weighting, scheme, precision)
                some = [r for r in here if (r["weighting"], r["scheme"], r["precision"]) == wanted]
                x, y = ([r[name] for r in some] for name in ("cpu", "error"))
                look = {"label": f"{weighting} {scheme}"} if precision == "double" else {"mfc": "none", "mew": 0.7}
                axis.plot(x, y, marks[scheme], color=colours[weighting], ms=4, alpha=0.6, **look)
        front = front_of(scene, rows)
        axis.axhspan(0.0, NOISE.get(scene, 0.0), color="black", alpha=0.1, lw=0)
        axis.step([r["cpu"] for r in front], [r["error"] for r in front], where="post", color="black", lw=1)
        axis.set(xscale="log", yscale="log", title=scene, xlabel="CPU time (s)", ylabel="error (1)")
        axis.set_ylim(top=2.0)
    handles, labels = axes.flat[0].get_legend_handles_labels()
    title = "filled: double precision, open: single" if any(r["precision"] == "single" for r in rows) else None
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, title=title)
    figure.savefig(path, dpi=110)


def tell_precision(rows):
    """Single against double precision, over runs that are otherwise the same."""
    by_setup = {key_of(row): row for row in rows}
    pairs = [(row, by_setup.get((*key[:-1], "double"))) for key, row in by_setup.items() if key[-1] == "single"]
    pairs = [(single, double) for single, double in pairs if double]
    if pairs:
        cpu, error = (np.array([single[name] / double[name] for single, double in pairs]) for name in ("cpu", "error"))
        print(
            f"single over double, {len(pairs)} pairs: CPU {np.median(cpu):.3f} (median; quartiles "
            f"{np.quantile(cpu, 0.25):.3f} to {np.quantile(cpu, 0.75):.3f}), error {np.median(error):.3f} "
            f"({error.min():.3f} to {error.max():.3f})"
        )


def tell(rows):
    """The fronts as text."""
    for scene in CELLS:
        here = [r for r in rows if r["scene"] == scene]
        if not here:
            continue
        print(f"\n{scene}: {len(here)} runs\n{'CPU s':>9} {'error':>9}  setup")
        for r in front_of(scene, rows):
            points = f"{r['cells']} cells, {r['side']} x {r['side']}"
            setup = f"{r['weighting']} {r['scheme']}, {points}, CFL {r['cfl']}, {r['precision']}"
            print(f"{r['cpu']:9.4f} {r['error']:9.2e}  {setup}")
        tell_precision(here)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("executable", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", nargs="+", choices=CELLS, default=list(CELLS))
    parser.add_argument("--precision", nargs="+", choices=PRECISIONS, default=PRECISIONS)
    parser.add_argument("--plot", action="store_true", help="only print and draw what is there")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    path = given.out / "pareto.csv"
    done = {key_of(row) for row in read(path)}
    todo = [] if given.plot else [s for s in setups(given.only, given.precision) if key_of(s) not in done]
    with path.open("a", newline="") as file, concurrent.futures.ProcessPoolExecutor(given.jobs) as pool:
        writer = csv.DictWriter(file, COLUMNS)
        if file.tell() == 0:
            writer.writeheader()
        jobs = [pool.submit(measure, given.executable.resolve(), setup) for setup in todo]
        try:
            for job in concurrent.futures.as_completed(jobs):
                writer.writerow(job.result())
                file.flush()
        except BaseException:
            pool.shutdown(cancel_futures=True)  # else it would do all that is left first
            raise
    rows = complete(read(path))
    tell(rows)
    draw(rows, given.out / "pareto.png")


if __name__ == "__main__":
    main()
