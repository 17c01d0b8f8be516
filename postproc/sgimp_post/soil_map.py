"""Which soil decides: correlation of the runout with the random field, place by place, over the
members, whose fields are rebuilt.

At a point the field is its Gaussian one (for a normal law without bounds the property, but for
origin and scale): normal in every law, so that the t test of no correlation is exact whatever the
law of the runout. A place of a fine field has little to say of a runout that feels all of them; the
same is therefore told of means over blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.spatial import cKDTree

from .ensemble import RUNOUTS, most_variable
from .errors import PostError
from .random_fields import random_fields_of
from .samplers import SAME_POINT, Points
from .statistics import CONFIDENCE, benjamini_hochberg, correlation_interval, t_factor

#: Share of the marked places that may be false ones.
FALSE_SHARE = 0.05
#: Fewest members for a map: two halves of twenty.
FEWEST = 40
#: Cases of a study that have maps, at most.
MOST_MAPS = 5
#: Blocks at most: coefficients of a linear model that some hundred members can bear.
MOST_BLOCKS = 25
#: Members for each coefficient of a linear model, at least.
MEMBERS_A_COEFFICIENT = 4
FOLDS = 10
#: Exchanges of the runouts among the members, for the split-half number of no correlation.
EXCHANGES = 199
#: Points that these exchanges look at, at most.
_MOST_PROBES = 10_000
#: Values of a field that are held at once: 32 MiB.
_MOST_VALUES = 2**22
#: A variance below this (of 1) is rounding: the field is known there, from a measurement.
_NO_VARIANCE = 1e-9


@dataclass(frozen=True)
class SplitHalf:
    """Members of odd and of even id apart. `correlation` of their two maps; `null_high`: what no
    more than 5 % of maps of exchanged runouts pass, `p_value` the share of these that pass it;
    `repeated` of `marked` places that one half marks have the same sign in the other."""

    correlation: float
    null_high: float
    p_value: float
    marked: int
    repeated: int


@dataclass(frozen=True)
class Place:
    """A correlation at a place, with Fisher's interval."""

    x: float
    y: float
    correlation: float
    low: float
    high: float


@dataclass(frozen=True)
class CorrelationMap:
    """At n places: correlation of all members and of those of odd and even id, p value of all
    members against zero, whether it is marked (FALSE_SHARE). `strongest` of all members, whose
    interval knows nothing of the choice; `confirmed`: the strongest one of the odd ids, told by the
    even ids, which had no part in the choice."""

    x: np.ndarray
    y: np.ndarray
    correlation: np.ndarray
    odd: np.ndarray
    even: np.ndarray
    p_value: np.ndarray
    marked: np.ndarray
    split_half: SplitHalf
    strongest: Place
    confirmed: Place


@dataclass(frozen=True)
class ExplainedShare:
    """Share of the variance that a linear model explains in members that it has not seen."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Blocks:
    """Rectangles over the body: edges in m, and block of each point [n] in the order of `place`,
    the column and row [blocks, 2] of those that have points."""

    x_edges: np.ndarray
    y_edges: np.ndarray
    owner: np.ndarray
    place: np.ndarray


@dataclass(frozen=True)
class SoilMap:
    """Of one case and one of its fields."""

    label: str
    acf: str
    cov: float
    spec: object
    n: int
    #: Points that have the property from this field.
    body: Points
    points: CorrelationMap
    blocks: Blocks
    block_map: CorrelationMap
    #: Runout with the mean of the field over its points; x, y are NaN.
    mean: Place
    #: Of each runout: (by the mean of the field, by the means of all blocks).
    explained: dict


def soil_maps(ensemble, name: str):
    """(maps, sentences on what has none) for the runout `name`: of a study the
    MOST_MAPS cases whose soil varies most, a map for each field."""
    cases = [case for case in ensemble.for_statistics() if case.role == "study"]
    sampling = str(ensemble.attributes.get("sampling", ""))
    if not cases:
        return [], ["No soil varies: there is no map of which soil decides."]
    if sampling not in ("", "random"):
        words = sampling.replace("_", " ")
        return [], [f"No map of which soil decides: members of sampling {words} are not alike."]
    try:
        fields = random_fields_of(ensemble)
        if fields is None:
            return [], ["The run has no random field: there is no map of which soil decides."]
    except PostError as cause:
        return [], [f"The fields cannot be rebuilt: {cause}."]
    found, notes = [], []
    for case in most_variable(cases, MOST_MAPS):
        try:
            found += _maps_of(fields, case, name)
        except PostError as cause:
            notes.append(f"{case.label}: no map of which soil decides: {cause}.")
    return found, notes


def _maps_of(fields, case, name) -> list:
    known = case.select(case.ok & np.isfinite(case.column(name)))
    if not case.has_recorded_fields:
        raise PostError("the record is of other fields than those of this case")
    if known.count < FEWEST:
        raise PostError(f"{known.count} members, {FEWEST} are needed")
    runout = known.column(name)
    if np.ptp(runout) == 0.0:
        raise PostError("all members run equally far")
    specs = [spec for spec in fields.specs if not spec.file]
    if not specs:
        raise PostError("its fields were imported")
    for spec in specs:
        if spec.is_too_dense:
            raise PostError(f"a dense factor of {spec.points.count} points takes too long")
    is_recorded = not fields.specs[0].file and np.isfinite(known.column("field_mean")[0])
    if is_recorded and not fields.is_on_record(known, 0):
        raise PostError("the field that is rebuilt is not the one on record")
    halves = known.id % 2 == 0
    if min(np.count_nonzero(halves), np.count_nonzero(~halves)) < FEWEST // 2 or any(
        np.ptp(runout[half]) == 0.0 for half in (halves, ~halves)
    ):
        raise PostError("too few members of odd or even id that differ")
    kept = {spec.name: _where_it_counts(fields, spec) for spec in specs}
    specs = [spec for spec in specs if kept[spec.name].any()]
    if not specs:
        raise PostError("imported fields cover all others")
    bodies = {spec.name: _part(spec.points, kept[spec.name]) for spec in specs}
    blocks = {key: divide(body) for key, body in bodies.items()}
    sums = {key: _HalfSums.of(runout, halves, body.count) for key, body in bodies.items()}
    means = {key: [] for key in bodies}
    most = max(1, _MOST_VALUES // max(spec.points.count for spec in specs))
    for first in range(0, known.count, most):
        rows = slice(first, first + most)
        fresh = fields.conditioned(known, known.id[rows])
        for key in bodies:
            values = fresh[key][:, kept[key]]
            sums[key].add(values, rows)
            means[key].append(block_means(values, blocks[key]))
    return [
        _finished(known, spec, bodies[spec.name], runout, halves, sums[spec.name],
                  blocks[spec.name], np.concatenate(means[spec.name]))
        for spec in specs
    ]  # fmt: skip


def _where_it_counts(fields, spec) -> np.ndarray:
    """Mask of its points: where several fields of a property cover a point, the last one counts."""
    free = np.ones(spec.points.count, dtype=bool)
    places = np.column_stack([spec.points.x, spec.points.y])
    near = SAME_POINT * max(np.ptp(places), 1e-300)
    for later in fields.specs[spec.index :]:
        if later.property.replace("tan_", "") == spec.property.replace("tan_", ""):
            tree = cKDTree(np.column_stack([later.points.x, later.points.y]))
            free &= tree.query(places)[0] > near
    return free


def _part(points, kept) -> Points:
    return Points(*(column[kept] for column in (points.x, points.y, points.width, points.height)))


def _finished(case, spec, body, runout, halves, sums, blocks, means) -> SoilMap:
    block_sums = _HalfSums.of(runout, halves, means.shape[1])
    block_sums.add(means, slice(None))
    size = np.bincount(blocks.owner)
    mean = means @ size / size.sum()
    r = float(np.corrcoef(mean, runout)[0, 1])
    centre = [np.bincount(blocks.owner, weights=at) / size for at in (body.x, body.y)]
    return SoilMap(
        case.label,
        case.acf,
        case.cov,
        spec,
        case.count,
        body,
        sums.finished(body.x, body.y),
        blocks,
        block_sums.finished(*centre),
        Place(np.nan, np.nan, r, *correlation_interval(r, case.count)),
        {
            name: tuple(explained_share(x, case.column(name)) for x in (mean[:, None], means))
            for name in RUNOUTS
        },
    )


def correlation_map(values, runout, is_even, x, y) -> CorrelationMap:
    """Of `values` [N, n] at places x, y [n] with the runouts [N] of members of odd and even id."""
    sums = _HalfSums.of(runout, is_even, values.shape[1])
    sums.add(values, slice(None))
    return sums.finished(x, y)


class _Moments:
    """Sums over members of z [n], z^2 and z y, with those of y; y is centred on all members."""

    def __init__(self, n, z, zz, zy, y, yy):
        self.n, self.z, self.zz, self.zy, self.y, self.yy = n, z, zz, zy, y, yy

    def __add__(self, other):
        mine, theirs = vars(self), vars(other)
        return _Moments(**{key: mine[key] + theirs[key] for key in mine})

    def correlation(self, zy=None) -> np.ndarray:
        """[n]; NaN where z does not vary. `zy` [n, k]: sums with k orders of the same y."""
        zy = self.zy if zy is None else zy
        shape = (-1,) + (1,) * (zy.ndim - 1)
        z, variance = self.z.reshape(shape), (self.zz - self.z**2 / self.n).reshape(shape)
        scale = np.where(variance > _NO_VARIANCE * self.n, variance, np.nan)
        scale = scale * (self.yy - self.y**2 / self.n)
        return np.clip((zy - z * self.y / self.n) / np.sqrt(scale), -1.0, 1.0)


class _HalfSums:
    """Moments of both halves, block of members by block, with those of exchanged runouts at some
    of the points."""

    @classmethod
    def of(cls, runout, is_even, count):
        self = cls()
        self.y = runout - runout.mean()
        self.is_even = is_even
        rng = np.random.default_rng(1)
        self.probes = np.arange(count)
        if count > _MOST_PROBES:
            self.probes = np.sort(rng.choice(count, _MOST_PROBES, replace=False))
        self.exchanged = np.empty((len(runout), EXCHANGES))
        for half in (~is_even, is_even):
            for k in range(EXCHANGES):
                self.exchanged[half, k] = rng.permutation(self.y[half])
        self.moments, self.zy = [], []
        for half in (~is_even, is_even):
            y = self.y[half]
            zeros = [np.zeros(count) for _ in range(3)]
            self.moments.append(_Moments(len(y), *zeros, y.sum(), y @ y))
            self.zy.append(np.zeros((len(self.probes), EXCHANGES)))
        return self

    def add(self, values, rows) -> None:
        """Values [members, n] of the members in these rows."""
        even = self.is_even[rows]
        for half, moments, zy in zip((~even, even), self.moments, self.zy):
            z = values[half]
            moments.z += z.sum(axis=0)
            moments.zz += np.einsum("ij,ij->j", z, z)
            moments.zy += self.y[rows][half] @ z
            zy += z[:, self.probes].T @ self.exchanged[rows][half]

    def finished(self, x, y) -> CorrelationMap:
        together = self.moments[0] + self.moments[1]
        r = together.correlation()
        odd, even = (one.correlation() for one in self.moments)
        p = no_correlation_p(r, together.n)
        exchanged = [one.correlation(zy) for one, zy in zip(self.moments, self.zy)]
        return CorrelationMap(
            x,
            y,
            r,
            odd,
            even,
            p,
            is_marked(p),
            _split_half(odd, even, self.probes, exchanged, [one.n for one in self.moments]),
            _place(x, y, r, r, together.n),
            _place(x, y, odd, even, self.moments[1].n),
        )


def no_correlation_p(r, n: int) -> np.ndarray:
    """Two-sided p value of r of n pairs against no correlation: Student's t with n - 2."""
    with np.errstate(divide="ignore"):
        t = np.abs(r) * np.sqrt((n - 2.0) / (1.0 - r**2))
    return 2.0 * stats.t.sf(t, n - 2)


def is_marked(p_values) -> np.ndarray:
    """By Benjamini and Hochberg: neighbours go together, for which their bound is proven of
    one-sided tests (Benjamini and Yekutieli 2001); of two-sided ones of the fields here it holds in
    simulation, the factor ln n of any dependence is not needed."""
    adjusted = benjamini_hochberg(p_values)
    return np.isfinite(adjusted) & (adjusted <= FALSE_SHARE)


def _split_half(odd, even, probes, exchanged, counts) -> SplitHalf:
    marked = repeated = 0
    for one, other, n in ((odd, even, counts[0]), (even, odd, counts[1])):
        chosen = is_marked(no_correlation_p(one, n))
        marked += int(np.count_nonzero(chosen))
        repeated += int(np.count_nonzero(chosen & (one * other > 0.0)))
    got = _alike(odd[probes, None], even[probes, None])[0]
    null = _alike(*exchanged)
    return SplitHalf(
        float(got),
        float(np.quantile(null, 0.95)),
        float((1 + np.count_nonzero(null >= got)) / (1 + len(null))),
        marked,
        repeated,
    )


def _alike(first, second) -> np.ndarray:
    """Correlation [k] of the columns of two arrays [n, k] over the places where both are known."""
    known = np.isfinite(first).all(axis=1) & np.isfinite(second).all(axis=1)
    a, b = (one[known] - one[known].mean(axis=0) for one in (first, second))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.sum(a * b, axis=0) / np.sqrt(np.sum(a**2, axis=0) * np.sum(b**2, axis=0))


def _place(x, y, chosen_by, told_by, n) -> Place:
    if not np.isfinite(chosen_by).any():
        return Place(*[np.nan] * 5)
    k = int(np.nanargmax(np.abs(chosen_by)))
    r = float(told_by[k])
    return Place(float(x[k]), float(y[k]), r, *correlation_interval(r, n))


def divide(points, most: int = MOST_BLOCKS) -> Blocks:
    """Blocks as square as the extent of the points allows, `most` at most."""
    extent = [
        (at.min() - 0.5 * size.max(), at.max() + 0.5 * size.max())
        for at, size in ((points.x, points.width), (points.y, points.height))
    ]
    width, height = (max(high - low, 1e-300) for low, high in extent)
    columns = int(np.clip(round((most * width / height) ** 0.5), 1, most))
    rows = int(np.clip(round(columns * height / width), 1, most // columns))
    edges = [np.linspace(*span, count + 1) for span, count in zip(extent, (columns, rows))]
    column, row = (
        np.clip(np.searchsorted(edge, at, side="right") - 1, 0, len(edge) - 2)
        for edge, at in zip(edges, (points.x, points.y))
    )
    kept, owner = np.unique(row * columns + column, return_inverse=True)
    return Blocks(*edges, owner, np.column_stack([kept % columns, kept // columns]))


def block_means(values, blocks: Blocks) -> np.ndarray:
    """Means [N, blocks] of values [N, n]."""
    count = len(blocks.place)
    means = np.empty((len(values), count))
    for k in range(count):
        means[:, k] = values[:, blocks.owner == k].mean(axis=1)
    return means


def explained_share(design, y, confidence: float = CONFIDENCE) -> ExplainedShare:
    """1 - sum (y - model)^2/sum (y - mean)^2 with the model of least squares and the mean of the
    other members, in FOLDS parts of the members in turn; below zero where the model is worse than
    the mean. Interval: delta method of the ratio over members, which takes the parts to be
    independent. NaN for fewer than MEMBERS_A_COEFFICIENT members a coefficient; members of unknown
    `y` do not count."""
    known = np.isfinite(y)
    design, y = design[known], y[known]
    n = len(y)
    if n < max(FOLDS, MEMBERS_A_COEFFICIENT * (design.shape[1] + 1)):
        return ExplainedShare(*[np.nan] * 3)
    full = np.column_stack([np.ones(n), design])
    fold = np.arange(n) % FOLDS
    by_mean, by_model = np.empty(n), np.empty(n)
    for k in range(FOLDS):
        out = fold == k
        slopes = np.linalg.lstsq(full[~out], y[~out], rcond=None)[0]
        by_model[out] = (y[out] - full[out] @ slopes) ** 2
        by_mean[out] = (y[out] - y[~out].mean()) ** 2
    if by_mean.sum() == 0.0:
        return ExplainedShare(*[np.nan] * 3)
    value = 1.0 - by_model.sum() / by_mean.sum()
    rest = by_mean - by_model - value * by_mean
    half = t_factor(n, confidence) * np.std(rest, ddof=1) * np.sqrt(n) / by_mean.sum()
    return ExplainedShare(float(value), float(value - half), float(value + half))


def tables(maps: list) -> dict:
    """Rows of the CSV files by name."""
    return {
        "soil_map.csv": [
            {
                "case": one.label,
                "field": one.spec.name,
                "places": words,
                "x": float(x),
                "y": float(y),
                "correlation": float(r),
                "odd_ids": float(odd),
                "even_ids": float(even),
                "p_value": float(p),
                "marked": int(marked),
            }
            for one in maps
            for words, m in (("blocks", one.block_map), ("points", one.points))
            for x, y, r, odd, even, p, marked in zip(
                m.x, m.y, m.correlation.round(4), m.odd.round(4), m.even.round(4), m.p_value,
                m.marked,
            )
        ],
        "soil_map_summary.csv": [_summary_row(one) for one in maps],
        "soil_explained.csv": [
            {
                "case": one.label,
                "field": one.spec.name,
                "runout": name,
                **_named("by_mean", by_mean, ("value", "low", "high")),
                **_named("by_blocks", by_blocks, ("value", "low", "high")),
            }
            for one in maps
            for name, (by_mean, by_blocks) in one.explained.items()
        ],
    }  # fmt: skip


def _summary_row(one) -> dict:
    row = {"case": one.label, "field": one.spec.name, "n": one.n}
    row.update(_named("mean", one.mean, ("correlation", "low", "high")))
    for words, m in (("blocks", one.block_map), ("points", one.points)):
        row.update({f"{words}": len(m.x), f"{words}_marked": int(m.marked.sum())})
        for kind in ("strongest", "confirmed"):
            keys = ("x", "y", "correlation", "low", "high")
            row.update(_named(f"{words}_{kind}", getattr(m, kind), keys))
        row.update({f"{words}_split_{key}": value for key, value in vars(m.split_half).items()})
    return row


def _named(prefix: str, record, keys) -> dict:
    return {f"{prefix}_{key}": getattr(record, key) for key in keys}
