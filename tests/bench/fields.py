"""Random fields: time of ours by every method, and of gstools and OpenTURNS, as Markdown tables.

    fields.py BUILD_DIRECTORY [--fields 1000] [--dense 3] [--large 10]

The first table is of the paper's column (input/paper/study.nml, 6400 points), the last of correlations that are no
product of functions of x and y, and of 1024 x 1024 points; on one core, in processor time. gstools and OpenTURNS are
timed where the Python that runs this has them (PyPI; some minutes). gstools has functions of the distance and sums
random waves, so within a field, given its waves, the correlation misses the one asked for; that error is printed too.
OpenTURNS factors the full matrix. What their fields are like: field_statistics.py.
"""

import argparse
import re
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from launch import environment

CASE = Path(__file__).resolve().parents[2] / "input" / "paper" / "study.nml"
SCALE = 0.2  # m, of the case
SITES = (np.arange(80) + 0.5) * 0.0625
GSTOOLS_MODES = 1000  # its default
PEER_FIELDS = 5
METHOD = re.compile(r"(\w+) (\w+) least +(\S+) most +(\S+) setup +(\S+) bytes +(\d+)")
PART = re.compile(r"part (.+?) +least +(\S+) most +(\S+)")
# A square of so many points a side, 0.0625 m apart; the simulation never runs.
SQUARE = """
&case name='square' /
&grid x_min=0, x_max={length}, y_min=0, y_max={length}, cell_size=0.125 /
&material name='it', model='mohr_coulomb', density=1, young=1, poisson=0, friction_angle=30 /
&body name='square', material='it', shape='rectangle', x=0, y=0, width={length}, height={length} /
&solver end_time=1 /
&random_field material='it', mean=30, cov=0.1, acf='{acf}', scale_x={scale_x}, scale_y=0.2, form='{form}',
  rotation={rotation} /
&monte_carlo realizations=1 /
"""
KINDS = {
    "product": {"form": "product", "rotation": 0, "scale_x": 0.2},
    "radial": {"form": "radial", "rotation": 0, "scale_x": 0.2},
    "5:1, turned by 30 degrees": {"form": "product", "rotation": 30, "scale_x": 1.0},
}


def run_benchmark(build, *arguments):
    """The lines of bench_fields."""
    command = [build.resolve() / "tests" / "bench" / "bench_fields", *map(str, arguments)]
    return subprocess.run(command, check=True, capture_output=True, text=True, env=environment()).stdout


def time_square(build, side, kind, method, fields, acf="snx"):
    """Least and most seconds per 1000 fields, set-up and bytes."""
    with tempfile.TemporaryDirectory() as scratch:
        case = Path(scratch) / "case.nml"
        case.write_text(SQUARE.format(length=side * 0.0625, acf=acf, **KINDS[kind]))
        _, _, least, most, setup, size = METHOD.search(run_benchmark(build, case, fields, method)).groups()
    return float(least), float(most), float(setup), int(size)


def time_peer(draw):
    """Seconds per 1000 fields, least and most; `draw(seed)` makes one."""
    seconds = []
    for seed in range(PEER_FIELDS):
        started = time.process_time()
        draw(seed)
        seconds.append(1000 * (time.process_time() - started))
    return min(seconds), max(seconds)


def time_gstools():
    """Least and most seconds, and the error of the correlation (rms over lags); None without gstools."""
    try:
        import gstools
    except ImportError:
        return None
    # Its length scale is half of the scale of fluctuation: the integral of the correlation from 0.
    field = gstools.SRF(gstools.Gaussian(dim=2, var=1.0, len_scale=SCALE / 2), mode_no=GSTOOLS_MODES)
    lags = np.random.default_rng(1).uniform(0.0, 5.0, size=(1000, 2))
    expected = np.exp(-np.pi * (lags**2).sum(axis=1) / SCALE**2)
    errors = []

    def draw(seed):
        field.structured((SITES, SITES), seed=seed)
        errors.append(np.cos(lags @ field.generator._cov_sample).mean(axis=1) - expected)  # waves: [2, modes]

    least, most = time_peer(draw)
    return least, most, float(np.sqrt(np.mean(np.square(errors))))


def time_openturns():
    """Least and most seconds, and those of the first field, which takes the factor; None without OpenTURNS."""
    try:
        import openturns
    except ImportError:
        return None
    one = openturns.AbsoluteExponential([SCALE / 2])
    mesh = openturns.Mesh(np.column_stack((np.tile(SITES, SITES.size), np.repeat(SITES, SITES.size))))
    process = openturns.GaussianProcess(openturns.ProductCovarianceModel([one, one]), mesh)
    started = time.process_time()
    process.getRealization()
    first = time.process_time() - started
    return *time_peer(lambda _: process.getRealization()), first


def print_column(options):
    """The paper's column: products, and the peers; then the parts of a field."""
    text = run_benchmark(options.build, CASE, options.fields, options.dense)
    methods = METHOD.findall(text)
    ours = {acf: float(least) for method, acf, least, *_ in methods if method == "kronecker"}
    print("| method | function | s per 1000 fields, least to most | times kronecker | set up once, s | MB |")
    print("|---|---|---|---|---|---|")
    for method, acf, least, most, setup, size in methods:
        name = "`cholesky`, 16 at a time" if method.endswith("_together") else f"`{method}`"
        print(
            f"| {name} | {acf} | {float(least):.2f} to {float(most):.2f} | {float(least) / ours[acf]:.1f} | "
            f"{float(setup):.3f} | {int(size) * 1e-6:.1f} |"
        )
    gstools, openturns = time_gstools(), time_openturns()
    if gstools:
        least, most, _ = gstools
        print(f"| gstools, {GSTOOLS_MODES} waves | sqx | {least:.0f} to {most:.0f} | {least / ours['sqx']:.0f} | | |")
    if openturns:
        least, most, first = openturns
        print(f"| OpenTURNS | snx | {least:.0f} to {most:.0f} | {least / ours['snx']:.0f} | {first:.1f} | |")
    if gstools:
        print(f"\nCorrelation in a field of gstools, given its waves: off by {gstools[2]:.3f} (rms over lags).")
    print("\n| part of a field (`kronecker`) | s per 1000 fields |\n|---|---|")
    for name, least, most in PART.findall(text):
        print(f"| {name} | {float(least):.3f} to {float(most):.3f} |")


def print_squares(options):
    """Correlations that are no product, and many points."""
    rows = [(80, kind, method, options.fields) for kind in list(KINDS)[1:] for method in ("circulant",)]
    if options.dense > 0:
        rows += [(80, kind, "cholesky", options.dense) for kind in list(KINDS)[1:]]
    if options.large > 0:
        rows += [(1024, "product", method, options.large) for method in ("kronecker", "circulant")]
        rows += [(1024, kind, "circulant", options.large) for kind in list(KINDS)[1:]]
    print("\n| points | correlation (snx) | method | s per field, least to most | set up once, s | MB |")
    print("|---|---|---|---|---|---|")
    for side, kind, method, fields in rows:
        least, most, setup, size = time_square(options.build, side, kind, method, fields)
        print(
            f"| {side} x {side} | {kind} | `{method}` | {least * 1e-3:.2g} to {most * 1e-3:.2g} | {setup:.2g} | "
            f"{size * 1e-6:.3g} |"
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path, help="for instance build/release")
    parser.add_argument("--fields", type=int, default=1000, help="fields of each repeat")
    parser.add_argument("--dense", type=int, default=3, help="the same of the dense method; 0: leave it out")
    parser.add_argument("--large", type=int, default=10, help="the same for 1024 x 1024 points; 0: leave them out")
    options = parser.parse_args()
    print_column(options)
    print_squares(options)


if __name__ == "__main__":
    main()
