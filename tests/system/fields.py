"""Random fields in files: rebuilt from (seed, id) alone, and taken back to the last bit.

    fields.py --sgimp PROGRAM [--only NAME ...]

For each case below, --write-fields and the first states of recorded members are compared with fields that the
post-processor rebuilds with NumPy (`sgimp-post fields DIR --against`): to 1e-12, as the correlation matrices have
condition numbers below 1e4 here. Then the file is read as input (`&random_field file=`) and written once more: the same
bits; the same by way of CSV for a single field. Last, files that are not what they were or should be are refused.
"""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
HEAD = """
&case name='fields' /
&grid x_min=0, x_max=4, y_min=0, y_max=2, cell_size=0.25 /
&material name='sand', model='mohr_coulomb', density=1450, young=2.6e6, poisson=0.31, friction_angle=30, cohesion=1000 /
&body name='column', material='sand', {body} /
&solver end_time=0.002 /
&output directory='run', snapshot_members={recorded} /
"""
COLUMN = "shape='rectangle', x=0, y=0, width=2, height=1.5"
FRICTION = "&random_field material='sand', mean=30, cov=0.1"
COHESION = "&random_field property='cohesion', material='sand', mean=1000"
ISOTROPIC = "scale_x=0.3, scale_y=0.3"
BEDDED = "scale_x=0.6, scale_y=0.2"
# Name: body, then fields and the rest.
CASES = {
    "study": (
        COLUMN,
        f"{FRICTION}, {ISOTROPIC} /\n&monte_carlo realizations=4 /\n"
        "&study acf='snx','smk','csx','bin','matern32','spherical', cov=0.05,0.15 /",
    ),
    "cholesky_radial": (
        COLUMN,
        f"{FRICTION}, acf='matern', smoothness=0.8, form='radial', {BEDDED}, distribution='beta', lower=15, upper=45, "
        "method='cholesky' /\n&monte_carlo realizations=4, sampling='antithetic' /",
    ),
    "circulant": (COLUMN, f"{FRICTION}, acf='csx', {BEDDED}, method='circulant' /\n&monte_carlo realizations=4 /"),
    "circulant_rotated": (
        COLUMN,
        f"{FRICTION}, acf='snx', {BEDDED}, rotation=30, distribution='gamma', method='circulant', "
        "data='friction.csv' /\n"
        "&monte_carlo realizations=4, sampling='latin_hypercube' /",
    ),
    "averages": (
        COLUMN,
        f"{FRICTION}, acf='smk', {BEDDED}, averaging='cell', distribution='lognormal' /\n&monte_carlo realizations=4 /",
    ),
    "followers": (
        COLUMN,
        f"{FRICTION}, {ISOTROPIC} /\n{COHESION}, sd=200, {ISOTROPIC} /\n"
        "&cross_correlation between='friction_angle','cohesion', coefficient=-0.5 /\n&monte_carlo realizations=4 /\n"
        "&study acf='snx','bin' /",
    ),
    "measured": (
        COLUMN,
        f"{FRICTION}, acf='smk', {ISOTROPIC}, data='friction.csv' /\n"
        f"{COHESION}, sd=300, acf='smk', {ISOTROPIC}, distribution='weibull' /\n"
        "&cross_correlation between='friction_angle','cohesion', coefficient=-0.6 /\n&monte_carlo realizations=4 /",
    ),
    "mixed": (
        COLUMN,
        "&random_field property='tan_friction_angle', material='sand', mean=0.6, cov=0.1, "
        f"distribution='truncated_normal', acf='snx', {ISOTROPIC} /\n"
        f"{COHESION}, sd=200, mean_gradient=150, sd_gradient=20, acf='spherical', {BEDDED}, distribution='gumbel' /\n"
        "&cross_correlation between='tan_friction_angle','cohesion', coefficient=0.4 /\n&monte_carlo realizations=4 /",
    ),
    "layers": (
        "shape='polygon', vertices=0,0, 2,0, 1,1.5, 0,1.5",
        f"{FRICTION}, acf='snx', {ISOTROPIC} /\n"
        "&random_field name='seam', material='sand', mean=22, cov=0.05, region=0,0.5, 2,0.5, 2,0.75, 0,0.75, "
        f"distribution='uniform', acf='snx', {ISOTROPIC} /\n&monte_carlo realizations=4 /",
    ),
}
MEASURED = "x,y,value,error\n0.3125,0.3125,33,0\n1.5,1.1,27.5,0.4\n0.8,0.75,30,0\n"


def call(command, scratch):
    """Standard output; what failed is shown."""
    done = subprocess.run(list(map(str, command)), cwd=scratch, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def rebuild(scratch, against):
    """What the post-processor says of a rebuild."""
    path = str(ROOT / "postproc")
    code = f"import sys; sys.path.insert(0, {path!r}); from sgimp_post.cli import main; sys.exit(main())"
    return call([sys.executable, "-c", code, "fields", "run", "--against", against], scratch).splitlines()[-1]


def datasets(path):
    """Every dataset of a file, as bytes."""
    found = {}
    with h5py.File(path) as file:
        file.visititems(
            lambda name, item: found.update({name: item[()].tobytes()}) if isinstance(item, h5py.Dataset) else None
        )
    return found


def round_trip(program, scratch, text):
    """Fields as input, by HDF5 and, where there is one field, by CSV; nothing of how they were made is left."""
    plain = re.sub(r", data='[^']*'", "", text)
    plain = re.sub(r"&cross_correlation[^/]*/", "", plain)
    (scratch / "again.nml").write_text(re.sub(r"(&random_field [^/]*)/", r"\1, file='fields.h5' /", plain))
    call([program, "again.nml", "--write-fields", "again.h5"], scratch)
    if datasets(scratch / "fields.h5") != datasets(scratch / "again.h5"):
        raise RuntimeError("fields read from fields.h5 are not written as the same bits")
    if text.count("&random_field") > 1:
        return "same bits by HDF5"
    for name in ("field.csv", "field.h5"):
        call([program, "case.nml", "--write-fields", name, "--realization", "2"], scratch)
    (scratch / "again.nml").write_text(re.sub(r"(&random_field [^/]*)/", r"\1, file='field.csv' /", plain))
    call([program, "again.nml", "--write-fields", "again.h5", "--realization", "1", "--overwrite"], scratch)
    with h5py.File(scratch / "field.h5") as before, h5py.File(scratch / "again.h5") as after:
        name = next(name for name in before["cases/base"] if name != "id")
        if not np.array_equal(before[f"cases/base/{name}"], after[f"cases/base/{name}"]):
            raise RuntimeError("a field read from field.csv is not the same to the last bit")
    return "same bits by HDF5 and CSV"


def refuse(command, scratch, *expected):
    """The command must end with exit code 2 and say what is expected."""
    done = subprocess.run(list(map(str, command)), cwd=scratch, capture_output=True, text=True)
    if done.returncode != 2 or not all(text in done.stderr for text in expected):
        raise RuntimeError(
            f"{' '.join(map(str, command))}: exit {done.returncode}, not 2 with {expected}\n{done.stderr}"
        )


def check_refusals(program, scratch):
    """Measurements that have changed since the run began; files of fields that do not do."""
    head, data, fields = HEAD.format(body=COLUMN, recorded="1"), scratch / "friction.csv", scratch / "fields.h5"
    text = f"{head}{FRICTION}, acf='snx', {ISOTROPIC}, data='friction.csv' /\n&monte_carlo realizations=2 /\n"
    (scratch / "case.nml").write_text(text)
    data.write_text(MEASURED)
    hidden = (
        f"&random_field property='tan_friction_angle', material='sand', mean=0.6, cov=0.1, acf='snx', {ISOTROPIC} /"
    )
    (scratch / "hidden.nml").write_text(text + hidden + "\n")
    refuse([program, "hidden.nml", "--check"], scratch, "friction_angle counts nowhere")
    call([program, "case.nml"], scratch)
    data.write_text(MEASURED.replace("27.5", "28.5"))
    (scratch / "more.nml").write_text(text.replace("realizations=2", "realizations=4"))
    refuse([program, "more.nml"], scratch, "data_content")
    refuse([program, "run/resolved.nml", "--check"], scratch, "friction.csv", "has changed")
    call([program, "case.nml", "--write-fields", "fields.h5"], scratch)
    refuse([program, "case.nml", "--write-fields", "fields.h5"], scratch, "there already")
    refuse([program, "case.nml", "--write-fields", "fields"], scratch, ".h5 or .csv")
    imported = f"{head}{FRICTION}, acf='snx', {ISOTROPIC}, file='fields.h5' /\n&monte_carlo realizations=4 /\n"
    (scratch / "imported.nml").write_text(imported)
    refuse([program, "imported.nml", "--check"], scratch, "no realization 3")
    (scratch / "imported.nml").write_text(imported.replace("realizations=4", "realizations=2"))
    call([program, "imported.nml", "--check"], scratch)
    with h5py.File(fields, "r+") as file:
        file["cases/base/friction_angle"][1, 7] = np.nan
    refuse([program, "imported.nml", "--write-fields", "again.h5"], scratch, "realization 2", "not finite")
    with h5py.File(fields, "r+") as file:
        file["points/friction_angle/x"][3] += 0.01
    refuse([program, "imported.nml", "--check"], scratch, "point 4 is elsewhere")
    print("ok     files that have changed or do not fit are refused")


def check(program, name, scratch):
    """One case; raises where something is wrong."""
    body, rest = CASES[name]
    text = HEAD.format(body=body, recorded="1,3") + rest + "\n"
    (scratch / "case.nml").write_text(text)
    (scratch / "friction.csv").write_text(MEASURED)
    call([program, "case.nml"], scratch)
    call([program, "run/resolved.nml", "--check"], scratch)
    call([program, "case.nml", "--write-fields", "fields.h5"], scratch)
    said = [rebuild(scratch, "fields.h5"), rebuild(scratch, "run/snapshots")]
    if "&study" not in text:
        said.append(round_trip(program, scratch, text))
    print(f"ok     {name}: {'; '.join(said)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sgimp", required=True, help="the sgimp executable")
    parser.add_argument("--only", nargs="+", choices=CASES, default=list(CASES))
    given = parser.parse_args()
    faults = 0
    for name in given.only:
        with tempfile.TemporaryDirectory() as scratch:
            try:
                check(Path(given.sgimp).resolve(), name, Path(scratch))
            except RuntimeError as fault:
                faults += 1
                print(f"failed {name}: {fault}")
    with tempfile.TemporaryDirectory() as scratch:
        try:
            check_refusals(Path(given.sgimp).resolve(), Path(scratch))
        except RuntimeError as fault:
            faults += 1
            print(f"failed refusals: {fault}")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
