"""Any member's random field can be rebuilt from the seed and its id alone, without the program.

    check_field_rebuild.py --sgimp PROGRAM

Runs small cases with snapshots and compares the friction angles in them with fields made here by
NumPy's Philox, SciPy's normal quantile and NumPy's Cholesky factors and Fourier transform.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
from scipy.special import ndtri

FIELD_STREAM = 1
TOLERANCE = 1e-12  # relative; the correlation matrices used here have condition numbers below 1e4
SEED = 2022
SNAPSHOT_MEMBERS = (1, 3)
ACFS = ("snx", "smk", "csx", "bin")
CASES = (
    dict(method="auto", distribution="normal", mean=35.0, lower=32.0, upper=60.0, scale_x=0.3, scale_y=0.2),
    dict(method="cholesky", distribution="lognormal", mean=35.0, lower=1.0, upper=60.0, scale_x=0.2, scale_y=0.3),
    dict(method="circulant", distribution="normal", mean=30.0, lower=1.0, upper=60.0, scale_x=0.2, scale_y=0.2),
)
NAMELIST = """
&case name='rebuild' /
&grid x_min=0, x_max=4, y_min=0, y_max=2, cell_size=0.25 /
&material name='sand', model='mohr_coulomb', density=1450, young=2.6e6, poisson=0.31, friction_angle={mean} /
&body name='column', material='sand', shape='rectangle', x=0, y=0, width=2, height=1.5, points_per_cell=2 /
&loading gravity=0,-9.81, damping=0.4 /
&solver end_time=0.01 /
&random_field property='friction_angle', material='sand', distribution='{distribution}', mean={mean}, cov=0.05,
  acf='snx', scale_x={scale_x}, scale_y={scale_y}, lower={lower}, upper={upper}, method='{method}' /
&monte_carlo realizations={realizations}, seed={seed}, noise_members=1 /
&study acf={acfs}, cov=0.05,0.15 /
&output directory='{directory}', snapshot_members={members} /
"""


def rho(acf, t):
    """Autocorrelation at the lag t >= 0, in scales of fluctuation."""
    return {
        "snx": lambda: np.exp(-2 * t),
        "sqx": lambda: np.exp(-np.pi * t**2),
        "smk": lambda: (1 + 4 * t) * np.exp(-4 * t),
        "csx": lambda: np.exp(-t) * np.cos(t),
        "bin": lambda: np.maximum(1 - t, 0),
    }[acf]()


def white_noise(seed, realization, count):
    """Standard normal numbers: the quantiles of ((word >> 12) + 1/2) / 2^52."""
    key = np.array([seed, FIELD_STREAM], dtype=np.uint64)
    counter = np.array([0, realization, 0, 0], dtype=np.uint64)
    words = np.random.Philox(key=key, counter=counter).random_raw(count)
    return ndtri(((words >> np.uint64(12)).astype(float) + 0.5) * 2.0**-52)


def factor_field(acf, x, y, scale_x, scale_y, seed, realization):
    """L_y Xi L_x^T with Xi [ny, nx] on the lattice of the coordinates x and y."""
    factors = [np.linalg.cholesky(rho(acf, abs(c[:, None] - c) / scale)) for c, scale in ((y, scale_y), (x, scale_x))]
    return factors[0] @ white_noise(seed, realization, y.size * x.size).reshape(y.size, x.size) @ factors[1].T


def circulant_field(acf, x, y, scale_x, scale_y, seed, realization):
    """The same by the shortest rings, with the Hartley transform: Re - Im of the Fourier transform."""
    roots = []
    for c, scale in ((y, scale_y), (x, scale_x)):
        length = 2 * (c.size - 1)
        lag = np.minimum(np.arange(length), length - np.arange(length)) * (c[1] - c[0])
        eigenvalues = np.fft.fft(rho(acf, lag / scale)).real
        if eigenvalues.min() < 0:
            raise ValueError("the shortest ring does not do: choose another case for this test")
        roots.append(np.sqrt(eigenvalues / length))
    field = white_noise(seed, realization, roots[0].size * roots[1].size).reshape(roots[0].size, roots[1].size)
    field = field * roots[0][:, None] * roots[1]
    for axis in (0, 1):
        transform = np.fft.fft(field, axis=axis)
        field = transform.real - transform.imag
    return field[: y.size, : x.size]


def property_of(z, case, cov):
    """The values of the property, cut off at the bounds."""
    if case["distribution"] == "normal":
        values = case["mean"] * (1 + cov * z)
    else:
        spread = np.sqrt(np.log1p(cov**2))
        values = case["mean"] * np.exp(spread * z - spread**2 / 2)
    return np.clip(values, case["lower"], case["upper"])


def indices(coordinates):
    """Distinct coordinates, and the index of each."""
    distinct, index = np.unique(np.round(coordinates, 9), return_inverse=True)
    return distinct, index


def check_snapshot(path, acf, cov, seed, case):
    """Largest relative difference in one snapshot file, and the share at the bounds."""
    with h5py.File(path) as file:
        realization = int(file.attrs["realization"])
        step = file[min(name for name in file if name.startswith("step_"))]
        position, actual = step["position"][:], step["friction_angle"][:]
    x, column = indices(position[:, 0])
    y, row = indices(position[:, 1])
    make = circulant_field if case["method"] == "circulant" else factor_field
    z = make(acf, x, y, case["scale_x"], case["scale_y"], seed, realization)
    expected = property_of(z[row, column], case, cov)
    at_bounds = np.mean((expected == case["lower"]) | (expected == case["upper"]))
    return realization, np.max(abs(actual / expected - 1)), at_bounds


def check_case(program, directory, case):
    """Runs one case; the number of faults."""
    namelist = directory.with_suffix(".nml")
    members = ",".join(map(str, SNAPSHOT_MEMBERS))
    namelist.write_text(
        NAMELIST.format(
            **case,
            seed=SEED,
            realizations=max(SNAPSHOT_MEMBERS),
            members=members,
            directory=directory,
            acfs=",".join(f"'{acf}'" for acf in ACFS),
        )
    )
    subprocess.run([program, namelist], check=True)
    faults = 0
    seen = 0
    with h5py.File(directory / "ensemble.h5") as ensemble:
        seed = int(ensemble.attrs["seed"])
        for label, group in ensemble["cases"].items():
            if group.attrs["is_homogeneous"]:
                continue
            acf, cov = group.attrs["acf"], float(group.attrs["cov"])
            acf = acf.decode() if isinstance(acf, bytes) else str(acf)
            clipped = dict(zip(group["id"][:].tolist(), group["field_clipped"][:].tolist(), strict=True))
            for path in sorted((directory / "snapshots").glob(f"{label}_r*.h5")):
                realization, difference, at_bounds = check_snapshot(path, acf, cov, seed, case)
                good = difference <= TOLERANCE and abs(clipped[realization] - at_bounds) < 1e-12
                seen += 1
                faults += not good
                print(
                    f"{'ok    ' if good else 'failed'} {case['method']} {path.name}: "
                    f"relative difference {difference:.1e}, clipped {at_bounds:.4f}"
                )
    wanted = len(ACFS) * 2 * len(SNAPSHOT_MEMBERS)
    if seen != wanted:
        print(f"failed: {seen} snapshots of {wanted}")
        faults += 1
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sgimp", required=True, help="the sgimp executable")
    program = Path(parser.parse_args().sgimp).resolve()
    with tempfile.TemporaryDirectory() as directory:
        faults = sum(check_case(program, Path(directory) / f"case_{k}", case) for k, case in enumerate(CASES))
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
