"""Rebuilds the random fields of any member from a run's directory: `resolved.nml`, what
`ensemble.h5` records of the points and methods, the seed and the member's id. No program needed."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import h5py
import numpy as np

from .autocorrelation import Correlation
from .conditioning import OPEN_VARIANCE, Data, pivoted_factor, weights_of_data
from .ensemble import FILE_NAME, _plain, read_ensemble
from .errors import PostError
from .marginals import Marginal
from .namelist import read_namelist, resolved_text
from .samplers import Points, create_sampler
from .sampling_plan import DATA_STREAM, PLANS, field_stream, normal

#: lower, upper of each property where the namelist names none; None: no bound.
DEFAULT_BOUNDS = {
    "friction_angle": (1.0, 60.0),
    "tan_friction_angle": (np.tan(np.deg2rad(1.0)), np.tan(np.deg2rad(60.0))),
    "dilation_angle": (0.0, 60.0),
}
#: The program's word for no bound is the largest number.
_NO_BOUND = 1e300
#: Points of a dense factor that is made again without being asked for.
MOST_DENSE = 4000
#: A field mean that is rebuilt differs from the one on record by rounding, in either precision.
SAME_MEAN = 1e-6
#: Numbers of a field that are held at once: 1 GiB.
MOST_NUMBERS = 2**27


@dataclass(frozen=True)
class Record:
    """What the program did for one autocorrelation function."""

    method: str
    jitter: np.ndarray
    ring: np.ndarray | None


@dataclass(frozen=True)
class FieldSpec:
    """One &random_field with the record of it."""

    name: str
    index: int
    property: str
    material: str
    units: str
    keys: dict
    points: Points
    #: Of the law at each point, for the first coefficient of variation of the study.
    mean: np.ndarray
    sd: np.ndarray
    records: dict
    data: Data | None = None

    @property
    def bounds(self):
        default = DEFAULT_BOUNDS.get(self.property, (0.0, np.inf))
        lower, upper = (self.keys.get(key, d) for key, d in zip(("lower", "upper"), default))
        lower = float(lower) if _is_number(lower) else default[0]
        upper = float(upper) if _is_number(upper) else default[1]
        return (
            lower if lower > -_NO_BOUND else -np.inf,
            upper if upper < _NO_BOUND else np.inf,
        )

    @property
    def is_too_dense(self) -> bool:
        """To make its factor again takes seconds and hundreds of megabytes, which no picture and no
        single number is worth."""
        is_dense = any(record.method == "cholesky" for record in self.records.values())
        return is_dense and self.points.count > MOST_DENSE

    @property
    def distribution(self) -> str:
        return str(self.keys.get("distribution", "normal")).lower()

    @property
    def has_cov(self) -> bool:
        """Spread given by a coefficient of variation, not by a standard deviation."""
        return not _is_number(self.keys.get("sd"))

    @property
    def rotation(self) -> float:
        return float(self.keys.get("rotation", 0.0))

    @property
    def file(self) -> str:
        """Path of imported fields, or ''."""
        return str(self.keys.get("file", "") or "")

    def acf_of(self, case) -> str:
        """The study varies the first field and those without a function of their own."""
        own = str(self.keys.get("acf", "")).lower()
        acf = case.acf if self.index == 1 or not own else own
        if acf not in self.records and len(self.records) == 1:
            return next(iter(self.records))
        if acf not in self.records:
            raise PostError(f"field {self.name}: nothing is recorded for acf='{acf}'")
        return acf

    def correlation(self, acf: str) -> Correlation:
        cell = (0.0, 0.0)
        if str(self.keys.get("averaging", "none")).lower() == "cell":
            cell = float(self.points.width[0]), float(self.points.height[0])
            if not np.allclose(self.points.width, cell[0], rtol=1e-9, atol=0.0) or not np.allclose(
                self.points.height, cell[1], rtol=1e-9, atol=0.0
            ):
                raise PostError(f"field {self.name}: averages over cells that differ in size")
        scales = float(self.keys["scale_x"]), float(self.keys["scale_y"])
        rotation = self.rotation % 180.0
        if rotation == 90.0:  # beds that stand upright: along and across change places
            scales, rotation = scales[::-1], 0.0
        return Correlation(
            acf,
            *scales,
            str(self.keys.get("form", "product")).lower(),
            rotation,
            float(self.keys.get("smoothness", 0.5)),
            cell,
        )

    def law(self, case) -> Marginal:
        """At the points."""
        sd = self._cov(case) * np.abs(self.mean) if self._cov(case) else self.sd
        return Marginal(self.distribution, self.mean, sd, *self.bounds)

    def law_at(self, y, case) -> Marginal:
        """At other heights [d] in m, by the trends of the namelist."""
        depth = self._datum() - y
        mean = float(self.keys["mean"]) + float(self.keys.get("mean_gradient", 0.0)) * depth
        if self.has_cov:
            sd = (self._cov(case) or float(self.keys["cov"])) * np.abs(mean)
        else:
            sd = float(self.keys["sd"]) + float(self.keys.get("sd_gradient", 0.0)) * depth
        return Marginal(self.distribution, mean, sd, *self.bounds)

    def _cov(self, case) -> float:
        """That of the case, which is that of the first field; 0: as the namelist and record say."""
        return case.cov if self.index == 1 and self.has_cov and case.cov > 0.0 else 0.0

    def _datum(self) -> float:
        datum = self.keys.get("datum")
        if _is_number(datum):
            return float(datum)
        return float(np.max(self.points.y + 0.5 * self.points.height))


@dataclass
class RandomFields:
    """All fields of a run."""

    directory: Path
    ensemble: object
    specs: list
    seed: int
    plan: str
    realizations: int
    #: Of importance sampling: shift of the mean of the first Gaussian field, in its sd; else 0.
    tilt: float
    #: Of the solver, in which the program keeps the properties.
    precision: str
    #: Correlation matrix of the fields, in the order of the groups.
    cross: np.ndarray
    _samplers: dict = field(default_factory=dict)

    @cached_property
    def mixing(self):
        try:
            return np.linalg.cholesky(self.cross)
        except np.linalg.LinAlgError as cause:
            raise PostError("the cross-correlations are not positive definite") from cause

    @property
    def cases(self) -> list:
        """The study cases whose fields are those of the record."""
        return [case for case in self.study_cases if case.has_recorded_fields]

    @property
    def study_cases(self) -> list:
        return [case for case in self.ensemble.cases if case.role == "study"]

    @property
    def has_data(self) -> bool:
        return any(spec.data is not None for spec in self.specs)

    def as_kept(self, values):
        """Rounded to the precision in which the points of the program keep them."""
        if self.precision == "single":
            return values.astype(np.float32).astype(np.float64)
        return values

    def law(self, spec, case) -> Marginal:
        return spec.law(case)

    def sampler(self, spec, case):
        acf = spec.acf_of(case)
        key = spec.name, acf
        if key not in self._samplers:
            if spec.file:
                raise PostError(
                    f"field {spec.name} was imported from {spec.file}: nothing to rebuild"
                )
            record = spec.records[acf]
            try:
                self._samplers[key] = create_sampler(
                    record.method, spec.correlation(acf), spec.points, record.jitter, record.ring
                )
            except PostError as cause:
                raise PostError(f"field {spec.name}, acf {acf}: {cause}") from cause
        return self._samplers[key]

    def noise(self, spec, case, ids) -> np.ndarray:
        """White noise of a field, [N, count], mixed with that of the fields before it."""
        count = self.sampler(spec, case).count
        if len(ids) * count > MOST_NUMBERS:
            raise PostError(
                f"{len(ids)} members of {count} numbers do not fit in memory: ask for fewer"
                " (--members)"
            )
        row = self.mixing[spec.index - 1]
        total = np.zeros((len(ids), count))
        for k in np.flatnonzero(row):
            total += row[k] * np.stack([self._normal(field_stream(k + 1), i, count) for i in ids])
        return total

    def _normal(self, stream, realization, count):
        return normal(self.plan, self.seed, stream, int(realization), count, self.realizations)

    def is_on_record(self, case, row: int) -> bool:
        """The mean of the first field of this row, rebuilt, is the one that the program recorded,
        but for rounding in either precision. A study may have moved the points or the law, which
        the record of the fields does not tell."""
        recorded = case.column("field_mean")[row]
        rebuilt = self.values(case, case.id[row : row + 1])[self.specs[0].name].mean()
        return bool(abs(rebuilt - recorded) <= SAME_MEAN * abs(recorded))

    def gaussian(self, case, ids) -> dict:
        """Standard Gaussian fields {name: [N, n]} before they know any data."""
        fields = {
            spec.name: self.sampler(spec, case).sample(self.noise(spec, case, ids))
            for spec in self.specs
            if not spec.file
        }
        if self.tilt:
            fields[self.specs[0].name] += self.tilt * self._direction(self.specs[0], case)
        return fields

    def _direction(self, spec, case):
        """C a/sqrt(a^T C a) with a = 1/n at each of the n points [n]: how the field goes when its
        mean goes by one standard deviation."""
        x, y = spec.points.x, spec.points.y
        correlation = spec.correlation(spec.acf_of(case))
        rows = [correlation.at(x - x[i], y - y[i]).mean() for i in range(len(x))]
        return np.array(rows) / np.sqrt(np.mean(rows))

    def conditioned(self, case, ids, fields=None) -> dict:
        """The same with the data taken in; the very same where there is none."""
        fields = self.gaussian(case, ids) if fields is None else fields
        if not self.has_data:
            return fields
        data = self._data(case)
        # Of the errors; then of what the points of field 1, 2, ... leave open at all data.
        blocks = (1 + len(self.specs), data.count)
        noise = np.stack([self._normal(DATA_STREAM, i, blocks[0] * blocks[1]) for i in ids])
        noise = noise.reshape(-1, *blocks)
        found = np.empty((len(ids), data.count))
        for spec in self.specs:
            mine = data.owner == spec.index - 1
            if not mine.any():
                continue
            project, fixed = self.sampler(spec, case).extend(data.x, data.y)
            seen = project(self.noise(spec, case, ids))
            if fixed is not None:
                correlation = spec.correlation(spec.acf_of(case))
                left = correlation.at(*_lags(data.x, data.y)) - fixed
                jitter = float(np.max(spec.records[spec.acf_of(case)].jitter, initial=0.0))
                tolerance = max(OPEN_VARIANCE, 10.0 * jitter) * correlation.variance
                rest = np.einsum("j,njd->nd", self.mixing[spec.index - 1], noise[:, 1:])
                seen = seen + rest @ pivoted_factor(left, tolerance).T
            found[:, mine] = seen[:, mine]
        errors = data.error * noise[:, 0]
        weights = weights_of_data(data.gram, (data.z - found - errors).T)
        return {
            spec.name: fields[spec.name] + (self._reach(spec, case, data) @ weights).T
            for spec in self.specs
            if spec.name in fields
        }

    def values(self, case, ids, fields=None) -> dict:
        """The properties {name: [N, n]}, in their units."""
        fields = self.conditioned(case, ids, fields)
        return {
            spec.name: self.law(spec, case).values(fields[spec.name])
            for spec in self.specs
            if spec.name in fields
        }

    def expectation(self, spec, case):
        """Mean and variance [n] of the Gaussian field at each point, given the data."""
        variance = spec.correlation(spec.acf_of(case)).variance
        variance = np.full(spec.points.count, variance)
        if not self.has_data:
            return np.zeros_like(variance), variance
        data = self._data(case)
        reach = self._reach(spec, case, data)
        solved = weights_of_data(data.gram, np.column_stack([data.z, reach.T]))
        return reach @ solved[:, 0], variance - np.einsum("nd,dn->n", reach, solved[:, 1:])

    def _data(self, case):
        return _GaussianData.of(self, case)

    def _reach(self, spec, case, data):
        """Covariance of the points of a field with all data, [n, d]."""
        correlation = spec.correlation(spec.acf_of(case))
        factor = self.cross[spec.index - 1, data.owner]
        dx, dy = spec.points.x[:, None] - data.x, spec.points.y[:, None] - data.y
        return np.where(factor != 0.0, factor * correlation.at(dx, dy), 0.0)


@dataclass(frozen=True)
class _GaussianData:
    """All data of a case in Gaussian space, in the order of the groups and rows."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    error: np.ndarray
    owner: np.ndarray
    gram: np.ndarray

    @property
    def count(self) -> int:
        return len(self.x)

    @classmethod
    def of(cls, fields, case):
        columns = []
        for spec in fields.specs:
            if spec.data is None:
                continue
            d = spec.data
            law = spec.law_at(d.y, case)
            z = law.gaussian(d.value)
            if not np.isfinite(z).all():
                raise PostError(f"field {spec.name}: a datum lies outside the law")
            owner = np.full(d.count, spec.index - 1)
            columns.append([d.x, d.y, z, d.error / law.slope(z), owner])
        x, y, z, error, owner = (np.concatenate(parts) for parts in zip(*columns))
        between = fields.cross[np.ix_(owner, owner)]
        for spec in fields.specs:
            if spec.file:
                continue
            moved = fields.sampler(spec, case).place(x, y)
            follows = fields.cross[spec.index - 1, owner] != 0.0
            x, y = np.where(follows, moved[0], x), np.where(follows, moved[1], y)
        gram = np.zeros_like(between)
        for k in np.unique(owner).tolist():  # of the field of the later datum: the lower triangle
            spec, rows = fields.specs[k], owner == k
            correlation = spec.correlation(spec.acf_of(case))
            gram[rows] = correlation.at(x[rows][:, None] - x, y[rows][:, None] - y)
        gram = np.tril(between * gram)
        gram = gram + np.tril(gram, -1).T + np.diag(error**2)
        return cls(x, y, z, error, owner, gram)


def read_random_fields(directory: Path) -> RandomFields | None:
    """The fields of the run in DIR; None if it is deterministic."""
    return random_fields_of(read_ensemble(directory))


def random_fields_of(ensemble) -> RandomFields | None:
    """The same of a run whose results have been read."""
    directory = ensemble.directory
    groups = read_namelist(*resolved_text(ensemble))
    keys = [keys for name, keys in groups if name == "random_field"]
    if not keys:
        return None
    path = directory / FILE_NAME
    try:
        with h5py.File(path, "r") as file:
            if "random_fields" not in file:
                raise PostError(
                    f"{path}: no /random_fields: the run is older than the record of its fields"
                )
            specs = [
                _read_spec(path, file["random_fields"], k, one) for k, one in enumerate(keys, 1)
            ]
    except (OSError, KeyError, ValueError, RuntimeError, TypeError) as cause:
        raise PostError(f"{path}: /random_fields cannot be read ({cause})") from cause
    monte_carlo = next((keys for name, keys in groups if name == "monte_carlo"), {})
    solver = next((keys for name, keys in groups if name == "solver"), {})
    plan = str(monte_carlo.get("sampling", "random")).lower()
    if plan not in PLANS:
        raise PostError(f"no sampling plan is called '{plan}' (known: {', '.join(PLANS)})")
    return RandomFields(
        directory,
        ensemble,
        specs,
        int(ensemble.attributes.get("seed", monte_carlo.get("seed", 0))),
        plan,
        int(monte_carlo.get("realizations", 0)),
        float(monte_carlo.get("tilt", 0.0)) if plan == "importance" else 0.0,
        str(solver.get("precision", "double")).lower(),
        _cross_correlation(specs, [keys for name, keys in groups if name == "cross_correlation"]),
    )


def _read_spec(path, root, index, keys) -> FieldSpec:
    name = str(keys.get("name") or keys.get("property"))
    if name not in root:
        raise PostError(f"{path}: /random_fields has no '{name}'")
    group = root[name]
    attributes = {key: _plain(value) for key, value in group.attrs.items()}
    recorded = int(attributes.get("index", index))
    if recorded != index:
        raise PostError(f"{path}: /random_fields/{name} has index {recorded}, it is group {index}")
    column = {key: group[key][...].astype(float).reshape(-1) for key in ("x", "y", "mean", "sd")}
    n = len(column["x"])
    for key in ("width", "height"):
        column[key] = group[key][...].astype(float).reshape(-1) if key in group else np.zeros(n)
    for key, values in column.items():  # what is the same at all points is written once
        if len(values) == 1:
            column[key] = np.broadcast_to(values, n).copy()
    if {len(values) for values in column.values()} != {n} or n == 0:
        raise PostError(f"{path}: /random_fields/{name}: columns of different lengths, or empty")
    records = {}
    for key, item in group.items():
        if isinstance(item, h5py.Group) and "method" in item.attrs:
            ring = item["ring"][:] if "ring" in item else None
            records[key] = Record(
                str(_plain(item.attrs["method"])).lower(),
                np.atleast_1d(
                    np.asarray(item["jitter"][:] if "jitter" in item else 0.0, dtype=float)
                ),
                None if ring is None or not np.any(ring) else np.asarray(ring, dtype=int),
            )
    if not records and not keys.get("file"):
        raise PostError(f"{path}: /random_fields/{name} does not say how it was sampled")
    return FieldSpec(
        name,
        index,
        str(keys.get("property", attributes.get("property", ""))),
        str(keys.get("material", attributes.get("material", ""))),
        str(attributes.get("units", "")),
        keys,
        Points(*(column[key] for key in ("x", "y", "width", "height"))),
        column["mean"],
        column["sd"],
        records,
        _read_data(path, group, keys),
    )


def _read_data(path, group, keys) -> Data | None:
    """The measurements from the record, or else from the file that the namelist names."""
    if "data" in group:
        table = group["data"]
        return Data(*(table[key][...].astype(float).reshape(-1) for key in
                      ("x", "y", "value", "error")))  # fmt: skip
    name = str(keys.get("data", "") or "")
    if not name:
        return None
    source = Path(name) if Path(name).is_absolute() else path.parent / name
    try:
        with open(source, newline="", encoding="utf-8") as file:
            lines = [line for line in file if line.strip() and not line.lstrip().startswith("#")]
        rows = list(csv.DictReader(lines, skipinitialspace=True))
        columns = [
            np.array([float(row.get(key) or 0.0) if key == "error" else float(row[key])
                      for row in rows])
            for key in ("x", "y", "value", "error")
        ]  # fmt: skip
    except OSError as cause:
        raise PostError(f"{source}: data cannot be read ({cause.strerror})") from cause
    except (KeyError, TypeError, ValueError) as cause:
        raise PostError(f"{source}: not a table of x,y,value,error ({cause})") from cause
    return Data(*columns) if rows else None


def _cross_correlation(specs, groups):
    matrix = np.eye(len(specs))
    index = {spec.name: spec.index - 1 for spec in specs}
    for keys in groups:
        names = keys.get("between", [])
        if not isinstance(names, list) or len(names) != 2 or not set(names) <= set(index):
            raise PostError(f"&cross_correlation between={names}: two names of fields expected")
        one, two = (index[name] for name in names)
        matrix[one, two] = matrix[two, one] = float(keys["coefficient"])
    return matrix


def _lags(x, y):
    return x[:, None] - x[None, :], y[:, None] - y[None, :]


def _is_number(value) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
