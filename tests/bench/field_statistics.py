"""Statistics of our random fields beside those of gstools and OpenTURNS, where the Python that runs this has them.

    field_statistics.py SGIMP_EXECUTABLE [--fields 4000] [--acf snx sqx matern32 matern52 spherical]

On 16 x 16 points, two of them to a scale of fluctuation: mean and correlation with the middle point over many fields,
each against what was asked for. The table gives, for each program and function, the largest deviation in
standard errors (of 256 numbers, about 3 is expected, 4 rare) and the root mean square one (1 is expected), of the mean
and of the correlation. gstools has functions of the distance (our form='radial'), sums random waves and is exact in the
mean over many fields only; OpenTURNS factors the full matrix, of products too. Last, the functions themselves: largest
difference between those of the post-processor and of gstools.
"""

import argparse
import subprocess
import tempfile
from pathlib import Path

import h5py
import numpy as np
from launch import environment

SCALE, SPACING, SIDE = 1.0, 0.5, 16
CASE = """
&case name='statistics' /
&grid x_min=0, x_max=8, y_min=0, y_max=8, cell_size=0.5 /
&material name='it', model='mohr_coulomb', density=1, young=1, poisson=0, friction_angle=30 /
&body name='block', material='it', shape='rectangle', x=0, y=0, width=8, height=8, points_per_cell=1 /
&solver end_time=1 /
&random_field material='it', mean=30, sd=1e-3, acf='{acf}', scale_x=1, scale_y=1, form='{form}', method='{method}' /
&monte_carlo realizations={fields} /
"""
CENTRE = SIDE // 2 * SIDE + SIDE // 2


def places():
    """x and y of the points, x fastest."""
    axis = (np.arange(SIDE) + 0.5) * SPACING
    return np.tile(axis, SIDE), np.repeat(axis, SIDE)


def ours(executable, acf, form, method, fields):
    """Gaussian fields of the program, [fields, points]."""
    with tempfile.TemporaryDirectory() as scratch:
        case, out = Path(scratch) / "case.nml", Path(scratch) / "fields.h5"
        case.write_text(CASE.format(acf=acf, form=form, method=method, fields=fields))
        subprocess.run([executable, case, "--write-fields", out], check=True, env=environment(), cwd=scratch)
        with h5py.File(out) as file:
            return (file["cases/base/friction_angle"][:] - 30.0) / 1e-3


def model_of_gstools(acf):
    """The model of gstools with the same scale of fluctuation, which is twice its integral scale; None without one."""
    import gstools

    models = {
        "snx": (gstools.Exponential, {}),
        "sqx": (gstools.Gaussian, {}),
        "matern32": (gstools.Matern, {"nu": 1.5}),
        "matern52": (gstools.Matern, {"nu": 2.5}),
        "spherical": (gstools.Spherical, {}),
    }
    if acf not in models:
        return None
    model, options = models[acf]
    return model(dim=2, var=1.0, integral_scale=SCALE / 2, **options)


def fields_of_gstools(acf, fields):
    """The same by gstools, or None."""
    import gstools

    model = model_of_gstools(acf)
    if model is None:
        return None
    field = gstools.SRF(model)
    return np.array([field(places(), seed=seed) for seed in range(fields)])


def fields_of_openturns(acf, fields):
    """The same by OpenTURNS, as a product, or None."""
    import openturns

    one = {
        "snx": lambda: openturns.AbsoluteExponential([SCALE / 2]),
        "sqx": lambda: openturns.SquaredExponential([SCALE / np.sqrt(2 * np.pi)]),
        "matern32": lambda: openturns.MaternModel([np.sqrt(3.0) * SCALE / 4], 1.5),
        "matern52": lambda: openturns.MaternModel([np.sqrt(5.0) * 3 * SCALE / 16], 2.5),
    }
    if acf not in one:
        return None
    openturns.RandomGenerator.SetSeed(1)
    process = openturns.GaussianProcess(
        openturns.ProductCovarianceModel([one[acf](), one[acf]()]), openturns.Mesh(np.column_stack(places()))
    )
    return np.array([np.asarray(process.getRealization().getValues())[:, 0] for _ in range(fields)])


def target(acf, form):
    """Correlation with the middle point that was asked for."""
    from sgimp_post.autocorrelation import rho

    x, y = places()
    lag = np.abs(x - x[CENTRE]) / SCALE, np.abs(y - y[CENTRE]) / SCALE
    return rho(acf, np.hypot(*lag)) if form == "radial" else rho(acf, lag[0]) * rho(acf, lag[1])


def deviations(fields, expected):
    """Largest and root mean square deviation of mean and of correlation, in standard errors."""
    count = len(fields)
    mean = fields.mean(axis=0) * np.sqrt(count)
    products = (fields * fields[:, CENTRE : CENTRE + 1]).mean(axis=0)
    correlation = (products - expected) / np.sqrt((1 + expected**2) / count)
    return [f(d) for d in (mean, correlation) for f in (lambda v: np.abs(v).max(), lambda v: np.sqrt(np.mean(v**2)))]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("executable", type=lambda name: Path(name).resolve())
    parser.add_argument("--fields", type=int, default=4000)
    parser.add_argument("--acf", nargs="+", default=["snx", "sqx", "matern32", "matern52", "spherical"])
    given = parser.parse_args()
    print("| program | function | form | mean: largest, rms | correlation: largest, rms |\n|---|---|---|---|---|")
    for acf in given.acf:
        rows = [
            (f"sgimp, {method}", form, ours(given.executable, acf, form, method, given.fields))
            for form, methods in (("product", ("kronecker", "cholesky")), ("radial", ("circulant", "cholesky")))
            for method in methods
        ]
        for name, form, peer in (
            ("gstools", "radial", fields_of_gstools),
            ("OpenTURNS", "product", fields_of_openturns),
        ):
            try:
                rows.append((name, form, peer(acf, given.fields)))
            except ImportError:
                continue
        for name, form, fields in rows:
            if fields is None:
                continue
            a, b, c, d = deviations(fields, target(acf, form))
            print(f"| {name} | {acf} | {form} | {a:.1f}, {b:.2f} | {c:.1f}, {d:.2f} |")
    try:
        lags = np.linspace(0.0, 5.0, 1001)
        from sgimp_post.autocorrelation import rho

        worst = max(np.abs(model_of_gstools(acf).correlation(lags * SCALE) - rho(acf, lags)).max() for acf in given.acf)
        print(f"\nFunctions against those of gstools, lags up to 5 scales of fluctuation: within {worst:.1e}.")
    except ImportError:
        print("\nThis Python has no gstools.")


if __name__ == "__main__":
    main()
