"""Error of the statistic against core-hours: for which cell size and how many realizations the next hour is best spent.

    statistic.py EXE CASE --out DIR [--cells 0.5 0.25 0.125 0.0625] [--realizations 2000 2000 600 120] [--acf snx]
                 [--cov 0.1] [--runout runout_q995] [--above S] [--ranks 2] [--hours ...] [--plot]

CASE is input/paper/baseline.nml, or another case with &study. Each cell size is an ensemble of its own, in
DIR/cell_SIZE, which sgimp itself resumes: run the same command again after a stop, or with larger --realizations
(totals; one for all or one for each cell size). --plot evaluates what is there. The grid grows to whole cells.
Another executable wants another --out, since its members take another time.

The statistics are the mean runout and P(runout > S), S being the mean of the finest ensemble to a centimetre unless
--above says it. For N members on cells of size h

    squared error = bias(h)^2 + variance(h)/N,        core-hours = N x core-seconds a member / 3600

- Variance and core-seconds come from the ensemble of that h: wall times of the members, each on a core of its own, so
  the machine must have no other work. Of the share p the variance is p (1 - p), with p towards 1/2 by two members more
  on either side (Agresti and Coull), so that 0 of N does not pass for certain.
- The bias is the difference to the finest ensemble, which has an error of its own. Members of two cell sizes cannot be
  paired: there is one value of the field for each material point, so that another cell size is another number of
  points, another draw, and other places. The interval of the bias (95 %) is thus Welch's, of shares Newcombe's. Where
  it holds 0, the bias is not resolved, and neither it nor the error is told as a number: the error is then between
  that without bias and that with the largest of the interval. Where it is resolved, the squared bias is the squared
  difference less the variance of the difference.
- The bias of the finest ensemble is unknown and not counted: errors are against an infinite ensemble of the finest
  cells. Its order of magnitude is guessed from the two finest: of first order in h, halving h leaves as much again as
  they differ. Errors below that guess are printed with an asterisk. With three sizes in a constant ratio, the order
  at which they change is told; where it is above 1, the guess is too large.

What the cell size changes is mechanics and field together. The field is sampled at the points, h/2 apart with 2 x 2
points a cell, whatever the scale of fluctuation (0.2 m in the paper): at h = 0.5 m neighbours are 0.25 m apart and next
to independent (exp(-2 x 0.25/0.2) = 0.08 for snx), and each stands for its 0.25 m square. The lattice then acts like a
longer scale, d coth(d/0.2) with d the spacing, for snx 0.295, 0.225, 0.206 and 0.202 m for cells of 0.5 to 0.0625 m,
and strengths averaged over a region scatter more by the same factors, 1.47, 1.13, 1.03 and 1.01. For a user who must
choose h, all of it is the error of h. To hold the field fixed, hold the points: 0.5 m with 8 x 8 points a cell and
0.125 m with 2 x 2 have the same points and the same field, member by member; the coarser one then saves steps only, a
quarter of the cost, not 1/64, and its points are not those of the cell size as people use it. That is not done here.

Writes DIR/statistic.csv (a row for each h and N; empty where an error is not resolved) and DIR/statistic.png, and
prints the ensembles, and for some numbers of core-hours the best cell size and N twice: for the largest the error can
be, and for the least. Where the two name different cells, the ensembles are too small to tell.
"""

import argparse
import csv
import math
import os
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from launch import environment, on_ranks
from sgimp_post.ensemble import RUNOUTS, read_ensemble
from sgimp_post.statistics import (
    describe,
    probability_above,
    proportion_difference,
    welch_difference,
)

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "verification"))
from judge import pareto_front
from runner import read_namelist, write_changed

COLUMNS = ("statistic", "cell_size", "members", "core_hours", "error_least", "error", "error_most")
LEAST_MEMBERS = 10
COUNTS = [*(n * 10**power for power in range(1, 5) for n in (1, 2, 5)), 100000]
COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#7A6A00", "#56B4E9")


@dataclass(frozen=True)
class Ensemble:
    """The members of one cell size that did not fail; `seconds`: of a core, for each of them."""

    cell: float
    values: np.ndarray
    seconds: float
    failed: int


@dataclass(frozen=True)
class Estimate:
    """One statistic of one cell size: its value with interval, and the variance that N members share. `bias` is a
    Difference to the finest ensemble with its variance, None for the finest itself."""

    name: str
    cell: float
    seconds: float
    value: float
    low: float
    high: float
    variance: float
    bias: object = None
    bias_variance: float = 0.0

    @property
    def is_resolved(self):
        """The finest has no bias by definition."""
        return self.bias is None or not self.bias.low <= 0.0 <= self.bias.high

    def bias_bounds(self):
        """Least and largest size of the bias."""
        if self.bias is None:
            return 0.0, 0.0
        ends = sorted((abs(self.bias.low), abs(self.bias.high)))
        return (ends[0] if self.is_resolved else 0.0), ends[1]

    def errors(self, members):
        """Least, likely and largest error of N members; the likely one is NaN where the bias is not resolved."""
        sampling = self.variance / members
        least, most = (math.sqrt(bias**2 + sampling) for bias in self.bias_bounds())
        if not self.is_resolved:
            return least, math.nan, most
        squared = self.bias.mean**2 - self.bias_variance if self.bias else 0.0
        return least, min(max(math.sqrt(max(squared, 0.0) + sampling), least), most), most

    def affordable(self, hours):
        """Members in so many core-hours."""
        return math.floor(3600 * hours / self.seconds)


def arguments():
    """Parses the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("executable", type=lambda name: Path(name).resolve())
    parser.add_argument("case", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--cells", type=float, nargs="+", default=[0.5, 0.25, 0.125, 0.0625], help="sizes in m")
    parser.add_argument("--realizations", type=int, nargs="+", default=[2000, 2000, 600, 120])
    parser.add_argument("--acf", default="snx")
    parser.add_argument("--cov", type=float, default=0.1)
    parser.add_argument("--runout", choices=RUNOUTS, default="runout_q995")
    parser.add_argument("--above", type=float, metavar="S", help="m; the mean of the finest")
    parser.add_argument("--hours", type=float, nargs="+", help="core-hours of the advice")
    parser.add_argument("--ranks", type=int, default=os.cpu_count())
    parser.add_argument("--mpiexec", default="mpirun")
    parser.add_argument("--plot", action="store_true", help="only evaluate what is there")
    options = parser.parse_args()
    if len(options.realizations) == 1:
        options.realizations *= len(options.cells)
    if len(options.realizations) != len(options.cells):
        parser.error("--realizations: one number, or one for each of --cells")
    return options


def directory_of(options, cell):
    """Where the ensemble of a cell size is."""
    return options.out / f"cell_{cell:g}"


def whole_cells(grid, cell):
    """The upper ends of the grid, moved out to whole cells."""
    ends = {}
    for axis in "xy":
        low, high = (float(grid.get(f"{axis}_{end}", "0")) for end in ("min", "max"))
        ends[f"grid.{axis}_max"] = low + cell * math.ceil((high - low) / cell - 1e-9)
    return ends


def run(options, cell, realizations):
    """Runs or resumes the ensemble of a cell size."""
    directory = directory_of(options, cell)
    namelist = options.out / f"{directory.name}.nml"
    keys = {group: values for group, values in read_namelist(options.case)}
    changes = whole_cells(keys["grid"], cell) | {
        "grid.cell_size": cell,
        "study.acf": [options.acf],
        "study.cov": [options.cov],
        "monte_carlo.realizations": realizations,
        "monte_carlo.noise_members": 1,
        "output.snapshot_members": None,
    }
    write_changed(options.case, changes, namelist)
    print(f"cells of {cell:g} m: to {realizations} members", flush=True)
    command = [options.executable, namelist, "--output", directory]
    if options.ranks > 1:
        command = on_ranks(options.ranks, command, options.mpiexec)
    code = subprocess.run(command, stdout=subprocess.DEVNULL, env=environment()).returncode
    if code not in (0, 4):  # 4: too many failed members, which the table tells
        sys.exit(f"{namelist}: exit code {code}; run the same command again if it was stopped")


def read(options, cell):
    """The ensemble of a cell size."""
    case = next(case for case in read_ensemble(directory_of(options, cell)).for_statistics() if not case.is_homogeneous)
    values = case.values(options.runout)
    seconds = np.nansum(case.column("seconds")) / max(len(values), 1)
    return Ensemble(cell, values, float(seconds), int(case.failed.sum()))


def mean_of(ensemble, finest):
    """The mean runout."""
    own = describe(ensemble.values)
    common = (own.mean, own.mean_low, own.mean_high, own.sd**2)
    if ensemble is finest:
        return Estimate("mean", ensemble.cell, ensemble.seconds, *common)
    bias = welch_difference(ensemble.values, finest.values)
    variance = own.sd**2 / own.n + describe(finest.values).sd ** 2 / len(finest.values)
    return Estimate("mean", ensemble.cell, ensemble.seconds, *common, bias, variance)


def share_of(ensemble, finest, threshold):
    """P(runout > threshold)."""
    own, best = (probability_above(some.values, threshold) for some in (ensemble, finest))
    spread = [(p := (share.count + 2) / (share.n + 4)) * (1 - p) for share in (own, best)]
    common = (own.value, own.low, own.high, spread[0])
    if ensemble is finest:
        return Estimate("probability", ensemble.cell, ensemble.seconds, *common)
    variance = spread[0] / own.n + spread[1] / best.n
    return Estimate("probability", ensemble.cell, ensemble.seconds, *common, proportion_difference(own, best), variance)


def told_bias(estimate):
    """The bias in words."""
    if estimate.bias is None:
        return "not known"
    text = f"{estimate.bias.mean:+.4f} ({estimate.bias.low:+.4f} to {estimate.bias.high:+.4f})"
    return text if estimate.is_resolved else f"not resolved: {estimate.bias.low:+.4f} to {estimate.bias.high:+.4f}"


def tell_ensembles(options, ensembles, means, shares, threshold):
    """What was measured."""
    print(
        f"\n{options.runout} of {options.case.name}, {options.acf}, COV {options.cov:g}; S = {threshold:g} m; "
        f"intervals of 95 %; bias against the finest\n\n| cell, m | members | failed | core-s a member | mean, m "
        f"| bias, m | sd, m | P(runout > S) | bias |\n|---|---|---|---|---|---|---|---|---|"
    )
    for ensemble, mean, share in zip(ensembles, means, shares, strict=True):
        own = describe(ensemble.values)
        print(
            f"| {ensemble.cell:g} | {own.n} | {ensemble.failed} | {ensemble.seconds:.3g} "
            f"| {mean.value:.4f} ({mean.low:.4f} to {mean.high:.4f}) | {told_bias(mean)} "
            f"| {own.sd:.4f} ({own.sd_low:.4f} to {own.sd_high:.4f}) "
            f"| {share.value:.3f} ({share.low:.3f} to {share.high:.3f}) | {told_bias(share)} |"
        )
    guess = guessed_bias(means)
    print(
        f"\nThe cells of {means[-1].cell:g} m have a bias too, which no error here counts. From the two finest, at "
        f"first order in the cell size: {guess.mean:+.3f} m ({guess.low:+.3f} to {guess.high:+.3f}) of the mean, "
        f"{guessed_bias(shares).mean:+.2f} of P. *: error below that"
    )
    if len(means) > 2:
        sizes, values = ([getattr(mean, name) for mean in means[-3:]] for name in ("cell", "value"))
        (one, two), (above, below) = np.abs(np.diff(values)), (sizes[0] / sizes[1], sizes[1] / sizes[2])
        if math.isclose(above, below) and two > 0.0:
            print(f"Order at which the means of the three finest change: {math.log(one / two) / math.log(above):.1f}")


def guessed_bias(estimates):
    """Bias of the finest ensemble, from the two finest, at first order in the cell size, as a Difference."""
    other, finest = estimates[-2:]
    factor = 1 / (other.cell / finest.cell - 1)
    low, mean, high = (factor * value for value in (other.bias.low, other.bias.mean, other.bias.high))
    return replace(other.bias, mean=mean, low=low, high=high)


def best(estimates, hours, which):
    """Estimate, members and errors with the least error; `which`: 0 the least it can be, 2 the largest."""
    able = [(e, n, e.errors(n)) for e in estimates if (n := e.affordable(hours)) >= LEAST_MEMBERS]
    return min(able, key=lambda row: row[2][which], default=None)


def told_error(errors):
    """The likely error, else between which ones it is."""
    least, likely, most = errors
    return f"{least:.2g} to {most:.2g}" if math.isnan(likely) else f"{likely:.2g}"


def tell_advice(options, estimates, unit):
    """The best cell size for some numbers of core-hours."""
    hours = options.hours or [h * 10.0**power for power in range(-3, 3) for h in (1, 3)]
    print(
        f"\n{estimates[0].name}{unit}\n\n| with core-hours | best cell, m | members | error "
        "| if biases are as small as they can be | members | error, least |\n|---|---|---|---|---|---|---|"
    )
    guess = abs(guessed_bias(estimates).mean)
    for budget in hours:
        if (safe := best(estimates, budget, 2)) is None:
            continue
        hopeful = best(estimates, budget, 0)
        mark = "*" if safe[2][2] < guess else ""
        entry = f"{safe[0].cell:g} | {safe[1]} | {told_error(safe[2])}{mark}"
        other = (
            f"{hopeful[0].cell:g} | {hopeful[1]} | {hopeful[2][0]:.2g}" if hopeful[0] is not safe[0] else "the same | |"
        )
        print(f"| {budget:g} | {entry} | {other} |")


def told(value):
    """A value as the file has it: six digits, nothing for what is not resolved."""
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.6g}"
    return value


def rows_of(estimates):
    """The rows of the file."""
    for estimate in estimates:
        for members in COUNTS:
            hours = members * estimate.seconds / 3600
            yield dict(
                zip(COLUMNS, (estimate.name, estimate.cell, members, hours, *estimate.errors(members)), strict=True)
            )


def draw(panels, path):
    """Error against core-hours: a curve a cell size where the bias is resolved, bands of what the error can be, and
    what no other cell size beats. `panels`: [(title, rows)]."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(panels), figsize=(11, 4.8), layout="constrained")
    for axis, (title, rows) in zip(axes, panels, strict=True):
        cells = sorted({row["cell_size"] for row in rows}, reverse=True)
        for cell, colour in zip(cells, COLOURS, strict=False):
            some = [row for row in rows if row["cell_size"] == cell]
            hours, *errors = ([row[name] for row in some] for name in COLUMNS[3:])
            axis.fill_between(hours, errors[0], errors[2], color=colour, alpha=0.18, lw=0)
            axis.plot(hours, errors[1], ".-", color=colour, ms=4, lw=1.3)
            axis.plot([], [], "o-", color=colour, ms=4, label=f"{cell:g} m")
        for name, mark, label in (
            ("error_most", "o", "best by the largest error"),
            ("error_least", "s", "best by the least error"),
        ):
            front = pareto_front(rows, lambda row: row["core_hours"], lambda row, name=name: row[name])
            x, y = ([row[key] for row in front] for key in ("core_hours", name))
            axis.plot(x, y, ":", color="black", lw=0.7, marker=mark, ms=8, mfc="none", mew=0.7, label=label)
        axis.set(xscale="log", yscale="log", title=title, xlabel="core-hours", ylabel="error")
        axis.grid(True, which="major", color="#E4E9ED")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=6, frameon=False)
    figure.savefig(path, dpi=110)


def main():
    """Runs what is missing, then evaluates."""
    options = arguments()
    options.out.mkdir(parents=True, exist_ok=True)
    plan = sorted(zip(options.cells, options.realizations, strict=True), reverse=True)
    if len(plan) < 2:
        sys.exit("at least two cell sizes: the finest is the reference")
    for cell, realizations in [] if options.plot else plan:
        run(options, cell, realizations)
    ensembles = [read(options, cell) for cell, _ in plan]
    finest = ensembles[-1]
    threshold = round(float(finest.values.mean()), 2) if options.above is None else options.above
    means = [mean_of(one, finest) for one in ensembles]
    shares = [share_of(one, finest, threshold) for one in ensembles]
    tell_ensembles(options, ensembles, means, shares, threshold)
    tell_advice(options, means, " runout, error in m")
    tell_advice(options, shares, f" of a runout beyond {threshold:g} m")
    panels = [
        ("mean runout, error in m", list(rows_of(means))),
        (f"P(runout > {threshold:g} m)", list(rows_of(shares))),
    ]
    with (options.out / "statistic.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        for row in (row for _, rows in panels for row in rows):
            writer.writerow({key: told(value) for key, value in row.items()})
    draw(panels, options.out / "statistic.png")


if __name__ == "__main__":
    main()
