"""The whole engine against closed forms: fields, study, restriction to coarser cells, ranks, journal, files, with
S = a^T v in place of a simulation. v is normal, so S is: mean, variance a^T C a, exceedance, the correlation with the
twin on coarser cells and weights of importance sampling are known."""

import h5py
import numpy as np
from common import Program, arguments, check
from scipy import stats

MEAN, SD, SCALE_Y = 35.0, 3.5, 0.5
#: Two-sided probability of a normal number to be farther out: 2e-6 each, 1e-3 for all of some 400 comparisons.
FARTHEST = 4.75
ACFS = {
    "snx": lambda t: np.exp(-2 * t),
    "sqx": lambda t: np.exp(-np.pi * t**2),
    "smk": lambda t: (1 + 4 * t) * np.exp(-4 * t),
    "csx": lambda t: np.exp(-t) * np.cos(t),
    "bin": lambda t: np.maximum(0, 1 - t),
}


def points(number):
    """Centres of number x number squares of a body of 2 m x 2 m, x fastest."""
    line = (np.arange(number) + 0.5) * 2.0 / number
    y, x = np.meshgrid(line, line, indexing="ij")
    return x.ravel(), y.ravel()


def functionals(x, y):
    """The weights a of each runout."""
    first = np.zeros_like(x)
    first[0] = 1.0
    weights = {"runout_max": np.ones_like(x), "runout_q99": first}
    weights |= {"runout_q995": x - x.min(), "runout_connected": y - y.min()}
    return {name: a / a.sum() for name, a in weights.items()}


def covariance(acf, scale_x, x, y):
    """Of the field at the points."""
    rho = ACFS[acf]
    return SD**2 * rho(np.abs(x[:, None] - x) / scale_x) * rho(np.abs(y[:, None] - y) / SCALE_Y)


def close(value, wanted, error, what):
    """Within FARTHEST standard errors."""
    check(
        abs(value - wanted) <= FARTHEST * error,
        f"{what}: {value}, not {wanted} ({(value - wanted) / error:.1f} errors)",
    )


def check_moments(values, sd, what):
    """Mean, standard deviation and exceedance of normal values."""
    n = len(values)
    close(values.mean(), MEAN, sd / np.sqrt(n), f"{what}: mean")
    close(values.std(ddof=1), sd, sd / np.sqrt(2 * n), f"{what}: sd")
    for k in (0.0, 1.0, 2.0):
        p = stats.norm.sf(k)
        close(np.mean(values > MEAN + k * sd), p, np.sqrt(p * (1 - p) / n), f"{what}: exceedance of {k} sd")


program = Program(arguments())
program.run("plain", 2)
x, y = points(8)
fine = functionals(x, y)
xc, yc = points(4)
coarse = functionals(xc, yc)
# Each coarse point sees the mean of four fine ones.
restriction = ((np.abs(xc[:, None] - x) < 0.25) & (np.abs(yc[:, None] - y) < 0.25)) / 4.0
compared = 0
with h5py.File(program.root / "plain" / "ensemble.h5") as file:
    for acf in ACFS:
        for scale in (0.5, 1.0):
            label = f"{acf}_cov0.10_scale_x{scale:g}"
            case, twin = file[f"cases/{label}"], file[f"cases/{label}_control"]
            check(twin.attrs["control_of"].decode() == label, "twin of another case")
            check(case.attrs["noise_case"].decode() == "deterministic", "another noise floor")
            c = covariance(acf, scale, x, y)
            for name, a in fine.items():
                values, twins = case[name][:], twin[name][:]
                b = restriction.T @ coarse[name]
                check(len(values) == 20000 and len(twins) == 40000, "number of members")
                check_moments(values, np.sqrt(a @ c @ a), f"{label} {name}")
                check_moments(twins, np.sqrt(b @ c @ b), f"{label}_control {name}")
                r = (a @ c @ b) / np.sqrt((a @ c @ a) * (b @ c @ b))
                # Fisher's z of a correlation has standard deviation 1/sqrt(n - 3); 1 - r of a mean is rounding.
                found = np.corrcoef(values, twins[: len(values)])[0, 1]
                if 1.0 - r > 1e-12:
                    close(
                        np.arctanh(found), np.arctanh(r), 1 / np.sqrt(len(values) - 3), f"{label} {name}: correlation"
                    )
                check(abs(found - 1.0) < 1e-9 or 1.0 - r > 1e-12, f"{label} {name}: correlation {found}, not 1")
                compared += 11

# Importance sampling: P(S < mean - k sd) down to 3e-5, where 20000 plain members would see none.
tilted = program.changed_case("noise_members=3", "noise_members=3, sampling='importance', tilt=-4")
text = tilted.read_text()
tilted.write_text("\n".join(line for line in text.splitlines() if not line.startswith(("&study", "&control"))))
program.run("tilted", 2, case=tilted)
with h5py.File(program.root / "tilted" / "ensemble.h5") as file:
    case = file["cases/base"]
    c = covariance("smk", 1.0, x, y)
    a = fine["runout_max"]
    weights = np.exp(case["log_weight"][:])
    for k in (2.0, 3.0, 4.0):
        hit = weights * (case["runout_max"][:] < MEAN - k * np.sqrt(a @ c @ a))
        error = hit.std() / np.sqrt(len(hit))
        close(hit.mean(), stats.norm.sf(k), error, f"importance sampling of {k} sd")
        check(k < 4 or error < 0.02 * stats.norm.sf(k), "importance sampling gains nothing")
        compared += 1
    check(np.all(file["cases/deterministic/log_weight"][:] == 0), "homogeneous members have weights")
print(f"{compared} comparisons with closed forms")
program.clean()
