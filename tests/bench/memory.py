"""Memory of a rank: what the arrays of the points and of the grid add up to, and what runs really take.

    memory.py SGIMP [--points 6400 100000 1000000] [--ranks 2]

Runs the paper's column with other numbers of points for a few steps, deterministic and with a random field, and prints
a Markdown table of the largest resident set of any rank as the kernel counts it, and the bytes per point by which it
grows from row to row. The prediction for a deterministic run counts the declarations of particles_t and grid_t: a rank
holds the points twice (the scene that all members share, and the member), the friction angles of the member, every node
of the grid, and at the end what sorting the points for the runouts takes.
"""

import argparse
import math
import os
import re
import subprocess
import tempfile
from pathlib import Path

from launch import environment, on_ranks

SOURCE = Path(__file__).resolve().parents[2] / "src" / "gimp"
STEPS = 5
STEP_PER_CELL = 0.008  # s/m: CFL 0.4 at the wave speed of this sand, 49.85 m/s
WIDTH = 5.0
POINTS_PER_CELL = 4
NODES_PER_CELL = 4 * 1.25  # the paper's domain: 4 x 1.25 columns
FRICTION_ANGLE = 8
SORTING = 8 + 8 + 8 + 4 + 4  # mass_front: place, mass, two orders (of GSL and ours), mask
NAMELIST = """
&case name='memory' /
&grid x_min=0, x_max={width}, y_min=0, y_max={height}, cell_size={cell} /
&material name='sand', model='mohr_coulomb', density=1450, young=2.6e6, poisson=0.31, friction_angle=35 /
&body name='column', material='sand', shape='rectangle', x=0, y=0, width=5, height=5, points_per_cell=2 /
&loading damping=0.4 /
&solver end_time={end_time} /
{field}
&output directory='{directory}' /
"""
FIELD = "&random_field material='sand', mean=35, cov=0.10, acf='snx', scale_x=0.2, scale_y=0.2 /\n"
MEMBERS = {"none": "&monte_carlo noise_members=2 /", "kronecker": FIELD + "&monte_carlo realizations=2 /"}


def bytes_of_a_point():
    """Bytes of the arrays of particles_t with one number for each point; arrays of size 0 unless asked for, apart."""
    text = (SOURCE / "sg_particles.f90").read_text()
    body = re.search(r"type :: particles_t\n(.*?)\n  contains", text, re.S).group(1)
    always = optional = 0
    comment = ""
    for line in body.splitlines():
        if line.strip().startswith("!"):
            comment += line
            continue
        names = re.findall(r"\w+\(:\)", line) if line.strip().startswith("real(wp), allocatable") else []
        if "size 0" in comment:
            optional += 8 * len(names)
        else:
            always += 8 * len(names)
        comment = ""
    return always, optional


def bytes_of_a_node():
    """Bytes of total(8, ...) and motion(8, ...) of grid_t."""
    text = (SOURCE / "sg_grid.f90").read_text()
    counts = re.search(r"total\((\d+), 0:nx, 0:ny\) and motion\((\d+), 0:nx, 0:ny\)", text)
    return 8 * sum(map(int, counts.groups()))


def resident_megabytes(options, points, field, directory):
    """The largest resident set of a run, in MB, and its number of points."""
    cells = round((points / POINTS_PER_CELL) ** 0.5)
    cell = WIDTH / cells
    case = Path(directory) / f"{points}_{field}.nml"
    case.write_text(
        NAMELIST.format(
            cell=repr(cell),
            width=repr(4 * cells * cell),
            height=repr(math.ceil(1.25 * cells) * cell),
            end_time=STEPS * STEP_PER_CELL * cell,
            field=MEMBERS[field],
            directory=case.with_suffix(""),
        )
    )
    command = [options.sgimp, case]
    if options.ranks > 1:
        command = on_ranks(options.ranks, command)
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, env=environment())
    # ru_maxrss, in KiB, is the largest of the process and of those it has waited for: under mpirun, the ranks.
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise SystemExit(f"{case}: the run failed")
    return usage.ru_maxrss * 1024e-6, POINTS_PER_CELL * cells**2


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sgimp", type=Path, help="the sgimp executable")
    parser.add_argument("--points", type=int, nargs="+", default=[6400, 100000, 1000000])
    parser.add_argument("--ranks", type=int, default=1)
    options = parser.parse_args()
    options.sgimp = options.sgimp.resolve()
    always, optional = bytes_of_a_point()
    node = bytes_of_a_node()
    grid = node * NODES_PER_CELL / POINTS_PER_CELL
    print(f"a point: {always} bytes, {optional} more where materials or output ask for them; a node: {node} bytes")
    print(
        f"predicted: 2 x {always} + {FRICTION_ANGLE} + {SORTING} + {grid:.0f} for the grid = "
        f"{2 * always + FRICTION_ANGLE + SORTING + grid:.0f} bytes per point\n"
    )
    print("| random field | points | largest resident set of a rank, MB | growth, bytes per point |")
    print("|---|---|---|---|")
    with tempfile.TemporaryDirectory() as directory:
        for field in MEMBERS:
            before = None
            for points in options.points:
                size, points = resident_megabytes(options, points, field, directory)
                growth = f"{(size - before[0]) * 1e6 / (points - before[1]):.0f}" if before else ""
                print(f"| {field} | {points} | {size:.1f} | {growth} |", flush=True)
                before = size, points


if __name__ == "__main__":
    main()
