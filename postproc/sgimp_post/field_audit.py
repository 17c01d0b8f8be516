"""Do the fields of a run have the mean, spread, correlation and law that were asked for?

Every check is a mean over members. Within a member the points are correlated, so a member gives one
number: the spatial average of a statistic whose expected value E is known exactly (moments of the
clipped law by quadrature; E[z_i z_j] = rho(x_i - x_j), as the mean 0 and the variance of the
Gaussian field are known and not estimated, so that the usual bias of sample correlations does not
arise). Members are independent, so the mean of N such numbers lies within E +- t s/sqrt(N) in 95 %
of all runs, t = Student's quantile for N - 1 and s the standard deviation over the members
(Student 1908; for averages that are not normal it holds as N grows). Antithetic pairs are no two
members: their average counts as one."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from scipy import stats
from scipy.spatial import cKDTree

from .statistics import CONFIDENCE, holm

#: Lags a direction, pairs of points a lag.
_LAGS = 14
_MOST_PAIRS = 4096
#: Lags go so far: in scales of fluctuation, and as a share of the extent of the points.
_REACH_SCALES = 3.0
_REACH_EXTENT = 0.8
#: Shares at which the law is checked, where the members would put so many values beyond them even
#: if each of them counted as one value only.
_LEVELS = (0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99)
_LEAST_COUNT = 5
#: Members with a value beyond a quantile from which on its band is drawn; with a value at a bound
#: from which on the clipped share is checked.
_LEAST_MEMBERS_BEYOND = 30
#: Fewer members are not judged.
LEAST_MEMBERS = 10
#: Family-wise error of the verdict over all checks of a run (Holm: holds however they depend).
FAULT = 1e-3
#: Largest relative difference from a recorded column: rounding of a double through an
#: ill-conditioned factor.
RECORDED_TOLERANCE = 1e-10
_RECORDED = {"field_mean": np.mean, "field_min": np.min, "field_max": np.max}
#: Shares of the QQ plot.
_QUANTILES = np.r_[0.0005, 0.001, 0.002, 0.005, np.linspace(0.01, 0.99, 99), 0.995, 0.998, 0.999,
                   0.9995]  # fmt: skip


@dataclass(frozen=True)
class Check:
    """The mean of `n` members against its expected value with the 95 % band around that."""

    case: str
    field: str
    kind: str
    where: str
    n: int
    value: float
    expected: float
    low: float
    high: float
    p_value: float

    @property
    def inside(self) -> bool:
        return bool(self.low <= self.value <= self.high)


def check_mean(label: tuple, estimates, expected: float) -> Check:
    """`estimates`: one a member. Where all are alike, their value must be the expected one."""
    x = np.asarray(estimates, dtype=float)
    n, value = len(x), float(np.mean(x))
    sd = float(np.std(x, ddof=1)) if n > 1 else np.nan
    size = max(abs(expected), abs(value), 1e-3)
    if np.isnan(sd):
        return Check(*label, n, value, expected, np.nan, np.nan, np.nan)
    if sd <= 1e-12 * size:
        good = abs(value - expected) <= 1e-10 * size
        band = 1e-10 * size
        return Check(*label, n, value, expected, expected - band, expected + band, float(good))
    error = sd / np.sqrt(n)
    half = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, n - 1)) * error
    p_value = float(2.0 * stats.t.sf(abs(value - expected) / error, n - 1))
    return Check(*label, n, value, expected, expected - half, expected + half, p_value)


def audit(fields, members: int) -> dict:
    """All numbers: `checks`, `fields` (what the figures show) and the verdict. The first `members`
    of every study case are rebuilt, whether they have run yet or not."""
    checks, shown, notes = [], [], []
    gaussian = plain = key = None
    for case in sorted(fields.cases, key=lambda case: (case.acf, case.order)):
        ids = np.arange(1, min(members, case.planned) + 1)
        if len(ids) == 0:
            continue
        specs = [spec for spec in fields.specs if not spec.file]
        if key != (key := ([spec.acf_of(case) for spec in specs], len(ids))):
            gaussian = fields.gaussian(case, ids)  # the same for every coefficient of variation
            plain = _correlation_checks(fields, case, gaussian)
            checks += [check for found, _ in plain.values() for check in found]
        values = fields.values(case, ids, gaussian)
        for spec in specs:
            found, entry = _field(fields, spec, case, values[spec.name], ids)
            entry["correlation"] = plain[spec.name][1]
            entry.update(_recorded(fields, spec, case, values[spec.name]))
            checks += found
            shown.append(entry)
    notes = [
        f"{spec.name}: imported from {spec.file}, not audited" for spec in fields.specs if spec.file
    ]
    if fields.plan == "latin_hypercube":
        notes.append("latin_hypercube: members share the strata; bands of means are too wide")
    shown.sort(key=lambda entry: entry["order"])
    return {
        "members": members,
        "sampling": fields.plan,
        "seed": fields.seed,
        "checks": checks,
        "fields": shown,
        "notes": notes,
        **_verdict(checks, shown),
    }


def audit_rows(numbers: dict) -> list:
    """Of what `audit` gives, a row a case and field: members, mean and standard deviation with
    their expected values in the unit of the field, share of clipped values, how many checks lie in
    their band (as '21/25'), and how the field was made."""
    checks = {}
    for check in numbers["checks"]:
        checks.setdefault((check.case, check.field), []).append(check)
    rows = []
    for entry in numbers["fields"]:
        mine = checks[entry["case"], entry["field"]]
        mean, sd = (next(c for c in mine if c.kind == kind) for kind in ("mean", "sd"))
        method = entry["method"]
        if entry["ring"]:
            method += f" {entry['ring'][0]} x {entry['ring'][1]}"
        if any(entry["jitter"]):
            method += f", jitter {max(entry['jitter']):.0e}"
        rows.append(
            {
                "case": entry["case"],
                "field": entry["field"],
                "members": entry["members"],
                "mean": mean.value,
                "mean_target": mean.expected,
                "sd": sd.value,
                "sd_target": sd.expected,
                "clipped": entry["clipped"],
                "inside": f"{sum(c.inside for c in mine)}/{len(mine)}",
                "method": method,
            }
        )
    return rows


def one_of_each_acf(entries) -> list:
    """The first entry of each autocorrelation function."""
    first = {}
    for entry in entries:
        first.setdefault(entry["acf"], entry)
    return list(first.values())


def _units(fields, estimates):
    """One number a unit that is independent of the others, from one a member."""
    x = np.asarray(estimates, dtype=float)
    if fields.plan == "antithetic" and len(x) > 1:
        x = 0.5 * (x[: len(x) - 1 : 2] + x[1::2])
    return x


def _field(fields, spec, case, values, ids):
    """Checks of the values of one field: mean, spread, law, clipping."""
    law = fields.law(spec, case)
    location, variance = fields.expectation(spec, case)
    variance = np.maximum(variance, 0.0)
    expected, spread, share = law.moments(location, variance)
    acf = spec.acf_of(case)
    record = spec.records[acf]

    def check(kind, where, estimates, target):
        return check_mean((case.label, spec.name, kind, where), _units(fields, estimates), target)

    deviation = values - expected
    checks = [check("mean", "", values.mean(axis=1), float(expected.mean()))]
    squares = check("sd", "", np.mean(deviation**2, axis=1), float(spread.mean()))
    roots = {
        key: float(np.sqrt(max(getattr(squares, key), 0.0)))
        for key in ("value", "expected", "low", "high")
    }
    checks.append(Check(**{**asdict(squares), **roots}))
    at_bounds = np.mean((values <= law.lower) | (values >= law.upper), axis=1)
    if not law.is_clipping:
        at_bounds = np.zeros(len(values))
    if np.count_nonzero(at_bounds) >= _LEAST_MEMBERS_BEYOND:
        checks.append(check("clipped", "", at_bounds, float(share.mean())))
    checks += _law_checks(check, law, location, variance, values)
    entry = {
        "case": case.label,
        "field": spec.name,
        "property": spec.property,
        "units": spec.units,
        "acf": acf,
        "cov": case.cov,
        "precision": fields.precision,
        "order": case.order,
        "members": len(ids),
        "points": spec.points.count,
        "method": record.method,
        "jitter": [float(one) for one in record.jitter],
        "ring": None if record.ring is None else [int(one) for one in record.ring],
        "distribution": spec.distribution,
        "clipped": float(at_bounds.mean()),
        "clipped_expected": float(share.mean()),
        "qq": _quantiles(fields, law, location, variance, values),
    }
    if spec.data is not None:
        entry["data"] = _data_numbers(fields, spec, case, values, ids)
    return checks, entry


def _law_checks(check, law, location, variance, values):
    """Share of the values up to quantiles of the law (given the data) at each point."""
    keep = variance > 1e-6
    found = []
    for level in _LEVELS:
        if len(values) * min(level, 1.0 - level) < _LEAST_COUNT or not keep.any():
            continue
        z = location[keep] + np.sqrt(variance[keep]) * stats.norm.ppf(level)
        limit = law.select(keep).unclipped(z)
        # A quantile that is cut off to a bound has the whole clipped share on one side of it.
        inner = (limit > law.lower) & (limit < law.upper)
        if not inner.any():
            continue
        below = values[:, keep][:, inner] <= limit[inner]
        found.append(check("law", f"P(value <= {level:g} quantile)", below.mean(axis=1), level))
    return found


def _quantiles(fields, law, location, variance, values):
    """Pooled quantiles against those of the law, with the band that the members' shares below each
    leave it; in normal scores where each point has a law of its own (trend or data)."""
    keep = variance > 1e-6
    is_one = all(np.ptp(v) <= 1e-12 * np.abs(v).max() for v in (law.mean, law.sd, variance))
    is_one = is_one and np.ptp(location) == 0.0
    z, sample = stats.norm.ppf(_QUANTILES), values
    if not is_one:
        scores = law.select(keep).gaussian(values[:, keep]) - location[keep]
        sample = scores / np.sqrt(variance[keep])

    def quantile(score):
        if not is_one:
            return score
        return law.select(slice(0, 1)).values(location[0] + np.sqrt(variance[0]) * score)

    target = quantile(z)
    numbers = {"share": _QUANTILES, "target": target, "is_score": not is_one}
    if sample.size:
        shares = [np.searchsorted(np.sort(row), target, "right") / len(row) for row in sample]
        shares = _units(fields, np.array(shares))
        half = np.full(len(z), np.nan)
        if len(shares) > 1:
            half = stats.t.ppf(0.5 + 0.5 * CONFIDENCE, len(shares) - 1) * shares.std(axis=0, ddof=1)
            half = half / np.sqrt(len(shares))
        # Where few members have values beyond, their spread is no measure of the error.
        beyond = np.where(_QUANTILES < 0.5, shares > 0.0, shares < 1.0).sum(axis=0)
        half = np.where((half > 0.0) & (beyond >= _LEAST_MEMBERS_BEYOND), half, np.nan)
        half = np.where(half < np.minimum(_QUANTILES, 1.0 - _QUANTILES), half, np.nan)
        numbers["low"], numbers["high"] = (
            quantile(stats.norm.ppf(_QUANTILES + sign * half)) for sign in (-1, 1)
        )
        numbers["sample"] = np.quantile(sample, _QUANTILES)
    else:
        numbers["sample"] = numbers["low"] = numbers["high"] = np.full(len(z), np.nan)
    return {key: v.tolist() if isinstance(v, np.ndarray) else v for key, v in numbers.items()}


def _correlation_checks(fields, case, gaussian) -> dict:
    """{field: (checks, curves)} of the Gaussian fields before they know any data."""
    result = {}
    for spec in fields.specs:
        if spec.name not in gaussian:
            continue
        z = gaussian[spec.name]
        spread = np.sqrt(spec.correlation(spec.acf_of(case)).variance)
        unit = z / spread
        checks = [
            check_mean(
                (case.label, spec.name, "gaussian variance", "lag 0"),
                _units(fields, np.mean(unit**2, axis=1)),
                1.0,
            )
        ]
        curves = []
        for direction, name in _directions(spec):
            curve = {"direction": name, "lag": [], "target": [], "value": [], "low": [], "high": []}
            for lag, (one, two) in _pairs(spec, case, direction):
                target = _target(spec, case, one, two) / spread**2
                found = check_mean(
                    (case.label, spec.name, "correlation", f"{name}, lag {lag:.4g} m"),
                    _units(fields, np.mean(unit[:, one] * unit[:, two], axis=1)),
                    float(np.mean(target)),
                )
                checks.append(found)
                half = 0.5 * (found.high - found.low)
                row = (lag, found.expected, found.value, found.value - half, found.value + half)
                for key, number in zip(("lag", "target", "value", "low", "high"), row):
                    curve[key].append(number)
            curve.update(_curve(spec, case, direction, curve["lag"], spread))
            curves.append(curve)
        checks += _cross_checks(fields, spec, case, gaussian)
        result[spec.name] = checks, curves
    return result


def _cross_checks(fields, spec, case, gaussian):
    """Correlation with the fields before this one at the same points."""
    checks = []
    for other in fields.specs[: spec.index - 1]:
        if other.name not in gaussian or other.points.count != spec.points.count:
            continue
        if not np.allclose(other.points.x, spec.points.x) or not np.allclose(
            other.points.y, spec.points.y
        ):
            continue
        one, two = fields.sampler(spec, case), fields.sampler(other, case)
        coefficient = fields.cross[spec.index - 1, other.index - 1]
        product = one.product_with(two) if type(one) is type(two) else None
        if product is None:
            if coefficient != 0.0:
                continue
            product = np.zeros(spec.points.count)
        norm = np.sqrt(
            spec.correlation(spec.acf_of(case)).variance
            * other.correlation(other.acf_of(case)).variance
        )
        estimate = np.mean(gaussian[spec.name] * gaussian[other.name] / norm, axis=1)
        label = (case.label, spec.name, "cross-correlation", f"with {other.name}")
        expected = float(np.mean(coefficient * product / norm))
        checks.append(check_mean(label, _units(fields, estimate), expected))
    return checks


def _directions(spec):
    if spec.rotation == 0.0:
        return [(np.array([1.0, 0.0]), "along x"), (np.array([0.0, 1.0]), "along y")]
    a = np.deg2rad(spec.rotation)
    return [
        (np.array([np.cos(a), np.sin(a)]), "along the bedding"),
        (np.array([-np.sin(a), np.cos(a)]), "across the bedding"),
    ]


def _scale(spec, direction_name):
    is_first = direction_name in ("along x", "along the bedding")
    return float(spec.keys["scale_x" if is_first else "scale_y"])


def _pairs(spec, case, direction):
    """(lag, (i, j)) with points j nearest to point i moved by the lag; their true distance counts
    for the target."""
    points = np.column_stack([spec.points.x, spec.points.y])
    if len(points) < 2:
        return
    tree = cKDTree(points)
    spacing = float(np.median(tree.query(points, k=2)[0][:, 1]))
    axis = int(abs(direction[1]) > abs(direction[0]))
    if spec.rotation == 0.0 and spacing > 0.0:
        distinct = np.unique(np.round(points[:, axis] / (1e-6 * spacing)))
        gaps = np.diff(distinct) * 1e-6 * spacing
        if len(gaps) and gaps.min() > 0.1 * spacing:
            spacing = float(gaps.min())
    if spacing <= 0.0:
        return
    extent = float(np.ptp(points @ direction))
    name = "along x" if axis == 0 else "along y"
    if spec.rotation != 0.0:
        name = _directions(spec)[int(not np.allclose(direction, _directions(spec)[0][0]))][1]
    reach = min(_REACH_SCALES * _scale(spec, name), _REACH_EXTENT * extent)
    most = max(1, int(reach / spacing))
    for k in np.unique(np.rint(np.linspace(1, most, min(most, _LAGS))).astype(int)).tolist():
        distance, partner = tree.query(points + k * spacing * direction)
        start = np.flatnonzero((distance <= 0.71 * spacing) & (partner != np.arange(len(points))))
        if len(start) == 0:
            continue
        start = start[:: max(1, len(start) // _MOST_PAIRS)]
        one, two = start, partner[start]
        lag = float(np.mean((points[two] - points[one]) @ direction))
        yield lag, (one, two)


def _target(spec, case, one, two):
    p = spec.points
    return spec.correlation(spec.acf_of(case)).at(p.x[two] - p.x[one], p.y[two] - p.y[one])


def _curve(spec, case, direction, lags, spread):
    """The target along the direction, for the eye."""
    lag = np.linspace(0.0, 1.05 * max(lags, default=1.0), 121)
    value = spec.correlation(spec.acf_of(case)).at(lag * direction[0], lag * direction[1])
    return {"curve_lag": lag.tolist(), "curve": (value / spread**2).tolist()}


def _recorded(fields, spec, case, values) -> dict:
    """Largest relative difference of the members that have run from what the program recorded of
    them: columns of the first field."""
    if spec is not fields.specs[0]:
        return {"recorded": {}}
    ids = np.arange(1, len(values) + 1)
    _, mine, theirs = np.intersect1d(ids, case.id, return_indices=True)
    found = {}
    for name, reduce in _RECORDED.items():
        column = case.column(name)[theirs]
        good = np.isfinite(column) & (column != 0.0)
        if good.any():
            mean = reduce(values[mine], axis=1)
            found[name] = float(np.abs(mean[good] / column[good] - 1.0).max())
    return {"recorded": found, "recorded_members": len(mine)}


def _data_numbers(fields, spec, case, values, ids):
    """How well error-free data are met: the largest difference at points that lie on one."""
    data = spec.data
    tree = cKDTree(np.column_stack([spec.points.x, spec.points.y]))
    distance, point = tree.query(np.column_stack([data.x, data.y]))
    on = (data.error == 0.0) & (distance <= 1e-9 * max(np.ptp(spec.points.x), 1.0))
    numbers = {"count": data.count, "exact_on_points": int(on.sum())}
    if on.any():
        law = fields.law(spec, case)
        target = np.clip(data.value[on], law.lower, law.upper)
        numbers["largest_difference"] = float(
            np.max(np.abs(values[:, point[on]] - target) / np.maximum(np.abs(target), 1e-300))
        )
    return numbers


def _verdict(checks, shown) -> dict:
    """Counts, the smallest p value after Holm, and a sentence."""
    judged = [check for check in checks if check.n >= LEAST_MEMBERS and np.isfinite(check.p_value)]
    inside = sum(check.inside for check in judged)
    adjusted = holm([check.p_value for check in judged])
    faults = [
        f"{check.case}, {check.field}: {' '.join([check.kind, check.where]).strip()} is"
        f" {check.value:.5g}, expected {check.expected:.5g}"
        f" ({check.low:.5g} to {check.high:.5g})"
        for check, p in zip(judged, adjusted)
        if p < FAULT
    ]
    for entry in shown:
        for name, difference in entry["recorded"].items():
            if difference > RECORDED_TOLERANCE:
                faults.append(
                    f"{entry['case']}, {entry['field']}: {name} of the members differs from the"
                    f" recorded one by up to {difference:.1e} (tolerance {RECORDED_TOLERANCE:.0e})"
                )
        largest = entry.get("data", {}).get("largest_difference", 0.0)
        if largest > 1e-6:
            faults.append(
                f"{entry['case']}, {entry['field']}: error-free data are missed by {largest:.1e}"
            )
    if not judged:
        words = f"Fewer than {LEAST_MEMBERS} members: nothing is judged."
    else:
        share = 100.0 * inside / len(judged)
        words = (
            f"{inside} of {len(judged)} checks ({share:.1f} %) lie in their 95 % band; chance alone"
            f" gives about {0.95 * len(judged):.0f}, but checks on the same members miss together,"
            f" so that the judge is the smallest p value after Holm's correction:"
            f" {float(np.min(adjusted)):.2g} (a fault below {FAULT:g})."
        )
    recorded = [value for entry in shown for value in entry["recorded"].values()]
    if recorded:
        words += (
            f" Mean, least and largest value of every member that has run agree with the recorded"
            f" ones to {max(recorded):.1e}."
        )
    words += (
        f" FAULT: {faults[0]}" + (f", and {len(faults) - 1} more." if len(faults) > 1 else ".")
        if faults
        else " No fault found."
        if judged
        else ""
    )
    return {
        "judged": len(judged),
        "inside": inside,
        "smallest_p_adjusted": float(np.min(adjusted)) if judged else np.nan,
        "faults": faults,
        "verdict": words,
    }
