"""Random fields: ours by every method, the dense factorization, and gstools, as one Markdown table.

    fields.py BUILD_DIRECTORY [--fields 1000] [--dense 3]

All on the paper's column (input/paper/study.nml, 6400 points), on one core, in processor time. gstools is compared
where the Python that runs this has it (PyPI gstools; about a minute). Of the five autocorrelation functions it has the
squared exponential only: its other models depend on the distance, not on a product of the lags along x and y. It sums
random waves, so within a field, given its waves, the correlation misses the one asked for; that error is printed too.
"""

import argparse
import re
import subprocess
import time
from pathlib import Path

import numpy as np
from launch import environment

CASE = Path(__file__).resolve().parents[2] / "input" / "paper" / "study.nml"
SCALE = 0.2  # m, of the case
SITES = (np.arange(80) + 0.5) * 0.0625
GSTOOLS_MODES = 1000  # its default
GSTOOLS_FIELDS = 5
METHOD = re.compile(r"(\w+) (\w+) least +(\S+) most +(\S+) setup +(\S+) bytes +(\d+)")
PART = re.compile(r"part (.+?) +least +(\S+) most +(\S+)")


def run_benchmark(options):
    """The lines of bench_fields."""
    program = options.build.resolve() / "tests" / "bench" / "bench_fields"
    command = [program, CASE, str(options.fields), str(options.dense)]
    return subprocess.run(command, check=True, capture_output=True, text=True, env=environment()).stdout


def time_gstools():
    """Seconds per 1000 fields, least and most, and the error of the correlation (rms over lags); None without it."""
    try:
        import gstools
    except ImportError:
        return None
    # Its length scale is half of the scale of fluctuation: the integral of the correlation from 0.
    field = gstools.SRF(gstools.Gaussian(dim=2, var=1.0, len_scale=SCALE / 2), mode_no=GSTOOLS_MODES)
    seconds, errors = [], []
    lags = np.random.default_rng(1).uniform(0.0, 5.0, size=(1000, 2))
    expected = np.exp(-np.pi * (lags**2).sum(axis=1) / SCALE**2)
    for seed in range(GSTOOLS_FIELDS):
        started = time.process_time()
        field.structured((SITES, SITES), seed=seed)
        seconds.append(1000 * (time.process_time() - started))
        waves = field.generator._cov_sample  # [2, modes]
        errors.append(np.cos(lags @ waves).mean(axis=1) - expected)
    return min(seconds), max(seconds), float(np.sqrt(np.mean(np.square(errors))))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path, help="for instance build/release")
    parser.add_argument("--fields", type=int, default=1000, help="fields of each repeat")
    parser.add_argument("--dense", type=int, default=3, help="the same of the dense method; 0: leave it out")
    options = parser.parse_args()
    text = run_benchmark(options)
    methods = METHOD.findall(text)
    ours = {acf: float(least) for method, acf, least, *_ in methods if method == "kronecker"}
    print("| method | function | s per 1000 fields, least to most | times kronecker | set up once, s | MB |")
    print("|---|---|---|---|---|---|")
    for method, acf, least, most, setup, size in methods:
        ratio = float(least) / ours[acf]
        print(
            f"| `{method}` | {acf} | {float(least):.2f} to {float(most):.2f} | {ratio:.1f} | {float(setup):.3f} | "
            f"{int(size) * 1e-6:.1f} |"
        )
    gstools = time_gstools()
    if gstools:
        least, most, error = gstools
        print(f"| gstools, {GSTOOLS_MODES} waves | sqx | {least:.0f} to {most:.0f} | {least / ours['sqx']:.0f} | | |")
        print(f"\nCorrelation in a field of gstools, given its waves: off by {error:.3f} (root mean square over lags).")
    print("\n| part of a field (`kronecker`) | s per 1000 fields |\n|---|---|")
    for name, least, most in PART.findall(text):
        print(f"| {name} | {float(least):.3f} to {float(most):.3f} |")


if __name__ == "__main__":
    main()
