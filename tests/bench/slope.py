"""What comes out of input/slope/slope.nml: how often the slope fails, and how far what fails runs.

    slope.py RUN [--failed 0.5] [--picture FILE]

RUN is the directory of the run, finished or not. A slope has failed when its farthest point is more than `failed`
metres before the initial toe. Prints the table of input/slope/README.md: probabilities with their Wilson intervals,
distances that a share of those that failed pass with the intervals of order statistics, which hold for any law. The
picture shows the members that have snapshots, from the shortest runout to the longest.
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from sgimp_post.ensemble import read_ensemble
from sgimp_post.reach import distance
from sgimp_post.snapshots import find_snapshots, list_steps, read_point_states
from sgimp_post.statistics import probability_above
from sgimp_post.style import rendered, styled

BEYOND = (2.0, 4.0, 6.0)
RUNOUTS = {"runout_max": "farthest point", "runout_connected": "connected deposit"}


def print_table(case, failed):
    """Rows of the README, from the members that the program could finish."""
    farthest = case.column("runout_max")[case.ok]
    fails = farthest > failed
    print(f"| {len(farthest)} members | value | 95 % |\n|---|---|---|")
    chances = {"P(the slope fails)": failed} | {f"P(farthest point beyond {x:g} m)": x for x in BEYOND}
    for text, threshold in chances.items():
        p = probability_above(farthest, threshold)
        print(f"| {text} | {p.value:.3f} | {p.low:.3f} to {p.high:.3f} |")
    for name, text in RUNOUTS.items():
        reach = case.column(name)[case.ok][fails]
        for share in (0.5, 0.1) if len(reach) else ():
            d = distance(reach, share)
            high = f"to {d.high:.2f}" if np.isfinite(d.high) else "or more"
            print(f"| {text} that {share:.0%} of those that fail pass, m | {d.value:.2f} | {d.low:.2f} {high} |")
    at_rest = case.column("settled")[case.ok] > 0
    for text, group in (("fail", fails), ("stand", ~fails)):
        print(f"| of {group.sum()} that {text}, at rest by the rule of `settle` | {at_rest[group].sum()} | |")


def panel(figure, axis, position, values, label, **limits):
    """The points, coloured by a value each."""
    drawn = axis.scatter(*position.T, c=values, s=1.6, marker="s", lw=0, rasterized=True, **limits)
    axis.set_aspect("equal")
    axis.set_xlim(0.0, 27.0)
    axis.set_ylim(0.0, 10.5)
    axis.grid(False)
    figure.colorbar(drawn, ax=axis, label=label, shrink=0.75)


@styled
def picture(members, runouts):
    """A row a member: friction angle and cohesion at the start, displacement at the end."""
    members = sorted(members, key=lambda member: runouts[member[1]])
    figure, axes = plt.subplots(len(members), 3, figsize=(13.0, 1.9 * len(members)), squeeze=False, sharex=True)
    for row, (_, member, path) in zip(axes, members, strict=True):
        steps = list_steps(path)
        first, last = read_point_states(path, (steps[0], steps[-1]))
        way = np.linalg.norm(last.values["displacement"], axis=1)
        friction, cohesion = first.values["friction_angle"], first.values["cohesion"]
        panel(figure, row[0], first.position, friction, "friction angle [°]", cmap="viridis", vmin=15, vmax=45)
        panel(figure, row[1], first.position, cohesion / 1e3, "cohesion [kPa]", cmap="viridis", vmin=0, vmax=15)
        panel(figure, row[2], last.position, way, "displacement [m]", cmap="cividis", vmin=0, vmax=6)
        row[0].set_title(f"member {member}")
        row[2].set_title(f"farthest point at {runouts[member]:.1f} m")
        row[0].set_ylabel("y [m]")
    for axis in axes[-1]:
        axis.set_xlabel("x [m]")
    return figure


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("--failed", type=float, default=0.5, help="m")
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    case = next(case for case in read_ensemble(options.run).for_statistics() if not case.is_homogeneous)
    print_table(case, options.failed)
    if options.picture:
        members = [found for found in find_snapshots(options.run) if found[0] == case.label]
        runouts = dict(zip(case.id, case.column("runout_max"), strict=True))
        members = [found for found in members if found[1] in runouts]
        options.picture.write_bytes(rendered(picture(members, runouts), "png", dpi=110))


if __name__ == "__main__":
    main()
