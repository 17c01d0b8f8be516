"""Reads `ensemble.h5` into plain arrays. Knows the names in the file and nothing of statistics."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import h5py
import numpy as np

from .errors import PostError
from .id_ranges import parse_ids

FILE_NAME = "ensemble.h5"

#: The four definitions of runout, from the initial toe, with the words used for them.
RUNOUTS = {
    "runout_max": "farthest point",
    "runout_q995": "99.5 % of the mass",
    "runout_q99": "99 % of the mass",
    "runout_connected": "connected deposit",
}

#: As `status_text` of the program.
STATUS_TEXTS = {
    0: "ok",
    1: "not finite",
    2: "point lost",
    3: "time step collapsed",
    4: "time limit",
    5: "runaway speed",
    6: "field failed",
    7: "energy created",
    8: "extreme strain",
}

#: Texts of the root: attributes, or datasets where they are too long for one (64 KiB).
LONG_TEXTS = ("namelist", "resolved_namelist", "identity")

INTEGER_COLUMNS = ("settled", "wall_touched", "steps", "failure_step", "failure_point")
FLOAT_COLUMNS = (
    *RUNOUTS,
    "height_max",
    "height_wall",
    "settle_time",
    "kinetic_energy_end",
    "kinetic_energy_ratio",
    "energy_error",
    "mass_error",
    "field_mean",
    "field_min",
    "field_max",
    "field_clipped",
    "seconds",
    "failure_x",
    "failure_y",
    "log_weight",
)

ROLES = ("study", "homogeneous", "control")

#: Between the keys of `damping=0.7, cell_size=0.25`.
_NEXT_KEY = re.compile(r",\s*(?=[^\s,=]+\s*=)")


@dataclass(frozen=True)
class Geometry:
    """Where the body stood and how large the grid is, in m; None if the file does not say."""

    toe: float | None = None
    initial_height: float | None = None
    initial_width: float | None = None
    x_min: float | None = None
    x_max: float | None = None
    y_min: float | None = None
    y_max: float | None = None
    cell_size: float | None = None
    point_spacing: float | None = None

    def updated(self, attributes) -> Geometry:
        """With what these HDF5 attributes say."""
        known = {
            name: float(_plain(attributes[name]))
            for name in self.__dataclass_fields__
            if name in attributes
        }
        return replace(self, **known)


@dataclass(frozen=True)
class Case:
    """The members of one study case, one array entry a member, sorted by id."""

    label: str
    acf: str
    cov: float
    mean: float
    distribution: str
    scale_x: float
    scale_y: float
    #: One of ROLES.
    role: str
    #: Label of the homogeneous case that is the noise floor of this one; '' if it is not known.
    noise_case: str
    #: Label of the case whose cheap twin on coarser cells this one is, or ''.
    control_of: str
    #: Keys of the study beyond acf and cov, with their values as text.
    varied: dict
    #: Its fields are those that /random_fields describes.
    has_recorded_fields: bool
    planned: int
    #: The case was ended by its stop rule, `planned` members from the first on.
    stop_rule_met: bool
    order: int
    id: np.ndarray
    status: np.ndarray
    columns: dict
    units: dict
    reason: list
    geometry: Geometry = Geometry()
    #: Cell centres [nx] and deposit depth [N, nx], in m; both None if not in the file.
    profile_x: np.ndarray | None = None
    profile_height: np.ndarray | None = None

    @property
    def is_homogeneous(self) -> bool:
        return self.role == "homogeneous"

    @property
    def count(self) -> int:
        return len(self.id)

    @property
    def ok(self) -> np.ndarray:
        """Mask of the members that did not fail."""
        return self.status == 0

    @property
    def failed(self) -> np.ndarray:
        return self.status != 0

    def column(self, name: str) -> np.ndarray:
        return self.columns[name]

    def values(self, name: str) -> np.ndarray:
        """Finite values of the members that did not fail, in order of id."""
        column = self.columns[name][self.ok]
        return column[np.isfinite(column)]

    def select(self, keep: np.ndarray) -> Case:
        """The same case with some of its rows."""
        return replace(
            self,
            id=self.id[keep],
            status=self.status[keep],
            columns={name: values[keep] for name, values in self.columns.items()},
            reason=[text for text, kept in zip(self.reason, keep) if kept],
            profile_height=None if self.profile_height is None else self.profile_height[keep],
        )

    def prefix(self, asked=None) -> Case:
        """Rows from the first of the ids `asked` for (1, 2, ... if none are named) on without a
        gap. In an unfinished run the members that are still missing are the slow ones; what comes
        after the first of them is a biased draw."""
        wanted = np.arange(1, self.count + 1)
        if asked is not None:
            wanted = np.resize(asked[: self.count], self.count)
        return self.select(np.logical_and.accumulate(self.id == wanted))


@dataclass(frozen=True)
class Ensemble:
    directory: Path
    attributes: dict
    geometry: Geometry
    #: Every row in the file, in the order of the plan.
    cases: list = field(default_factory=list)

    @property
    def state(self) -> str:
        return str(self.attributes.get("state", "unknown"))

    @property
    def provenance(self) -> dict:
        """What the root says of program, machine, seed and time; without the case files."""
        return {name: text for name, text in self.attributes.items() if name not in LONG_TEXTS}

    @property
    def is_complete(self) -> bool:
        return self.state == "complete"

    @property
    def asked(self):
        """Sorted ids that were asked for in this directory; None for all."""
        text = str(self.attributes.get("members", ""))
        return parse_ids(text, f"{self.directory / FILE_NAME}: members") if text else None

    @property
    def is_weighted(self) -> bool:
        """Members were drawn by importance sampling."""
        return str(self.attributes.get("sampling", "")) == "importance"

    def case(self, label: str) -> Case | None:
        return next((case for case in self.cases if case.label == label), None)

    def for_statistics(self) -> list:
        """The cases with the rows that statistics may use: all of a complete run, else those
        without a gap from the first on. What came in after a stop rule was met does not count."""
        cases = [
            case.select(case.id <= case.planned) if case.stop_rule_met else case
            for case in self.cases
        ]
        if not self.is_complete:
            return [case.prefix(self.asked) for case in cases]
        # Of a range: what an earlier run of other members left unfinished stays out.
        asked = self.asked
        return cases if asked is None else [case.select(np.isin(case.id, asked)) for case in cases]


def most_variable(cases: list, most: int) -> list:
    """`most` of the cases, in their order: of each autocorrelation function the one of the largest
    cov, where the soil shows most, before a second one of any. A cov that is not a number, of a
    spread given otherwise, counts as none."""
    rank, seen = {}, {}
    for case in sorted(cases, key=lambda case: -np.nan_to_num(case.cov)):
        seen[case.acf] = seen.get(case.acf, 0) + 1
        rank[case.label] = seen[case.acf]
    chosen = sorted(cases, key=lambda case: rank[case.label])[:most]
    labels = {case.label for case in chosen}
    return [case for case in cases if case.label in labels]


def read_ensemble(directory: Path) -> Ensemble:
    """Reads DIR/ensemble.h5. Raises PostError, naming the file, on anything that is not one."""
    directory = Path(directory)
    if not directory.exists():
        raise PostError(f"{directory}: no such directory")
    if not directory.is_dir():
        raise PostError(f"{directory}: not a directory (give the output directory of a run)")
    path = directory / FILE_NAME
    if not path.is_file():
        raise PostError(f"{directory}: no {FILE_NAME} here (is it the output directory of a run?)")
    try:
        with h5py.File(path, "r") as file:
            return _read_file(directory, path, file)
    except PostError:
        raise
    except (OSError, KeyError, ValueError, RuntimeError, TypeError, AttributeError) as cause:
        words = " ".join(str(cause).split())
        raise PostError(f"{path}: cannot be read ({words})") from cause


def _read_file(directory: Path, path: Path, file: h5py.File) -> Ensemble:
    attributes = {name: _plain(value) for name, value in file.attrs.items()}
    for name in LONG_TEXTS:
        if name in file:
            attributes[name] = str(_plain(file[name][...].reshape(-1)[0]))
    if attributes.get("program") != "sgimp" or "cases" not in file:
        raise PostError(f"{path}: not a results file of sgimp (no program='sgimp' or no /cases)")
    geometry = Geometry()
    if "geometry" in file:
        geometry = geometry.updated(file["geometry"].attrs)
    cases = [_read_case(path, label, group, geometry) for label, group in file["cases"].items()]
    homogeneous = [case for case in cases if case.is_homogeneous]
    if len(homogeneous) == 1:  # files of earlier versions do not name it
        label = homogeneous[0].label
        cases = [replace(case, noise_case=case.noise_case or label) for case in cases]
    cases.sort(key=lambda case: (case.order, case.label))
    return Ensemble(directory, attributes, geometry, cases)


def _read_case(path: Path, label: str, group: h5py.Group, geometry: Geometry) -> Case:
    for name in ("id", "status"):
        if name not in group:
            raise PostError(f"{path}: case {label} has no dataset {name}")
    ids = group["id"][...].astype(np.int64).reshape(-1)
    count = len(ids)
    order = np.argsort(ids, kind="stable")
    columns, units = {}, {}
    for name in (*FLOAT_COLUMNS, *INTEGER_COLUMNS):
        is_integer = name in INTEGER_COLUMNS
        if name in group:
            values = _column(path, label, group[name], count)
            units[name] = str(_plain(group[name].attrs.get("units", "")))
        else:
            missing = 0.0 if name == "log_weight" else np.nan
            values = np.full(count, -1 if is_integer else missing)
            units[name] = ""
        columns[name] = values.astype(np.int64 if is_integer else np.float64)[order]
    reason = [""] * count
    if "reason" in group:
        reason = [_plain(text) for text in _column(path, label, group["reason"], count)]
    x, height = _read_profile(path, label, group, count)
    attributes = {name: _plain(value) for name, value in group.attrs.items()}
    is_homogeneous = bool(attributes.get("is_homogeneous", label == "deterministic"))
    role = str(attributes.get("role", "homogeneous" if is_homogeneous else "study"))
    if role not in ROLES:
        raise PostError(f"{path}: case {label} has the role '{role}' (known: {', '.join(ROLES)})")
    return Case(
        label=label,
        acf=str(attributes.get("acf", "")).lower(),
        cov=float(attributes.get("cov", np.nan)),
        mean=float(attributes.get("mean", np.nan)),
        distribution=str(attributes.get("distribution", "")),
        scale_x=float(attributes.get("scale_x", np.nan)),
        scale_y=float(attributes.get("scale_y", np.nan)),
        role=role,
        noise_case=str(attributes.get("noise_case", "")),
        control_of=str(attributes.get("control_of", "")),
        varied=_varied(str(attributes.get("varied", ""))),
        has_recorded_fields=bool(attributes.get("has_recorded_fields", 1)),
        planned=int(attributes.get("planned", count)),
        stop_rule_met=bool(attributes.get("stop_rule_met", 0)),
        order=int(attributes.get("order", 0)),
        id=ids[order],
        status=_column(path, label, group["status"], count).astype(np.int64)[order],
        columns=columns,
        units=units,
        reason=[reason[k] for k in order],
        geometry=geometry.updated(group.attrs),
        profile_x=x,
        profile_height=None if height is None else height[order],
    )


def _varied(text: str) -> dict:
    """`damping=0.7, cell_size=0.25` by key."""
    pairs = (part.partition("=") for part in _NEXT_KEY.split(text) if part.strip())
    return {key.strip(): value.strip() for key, _, value in pairs}


def _column(path: Path, label: str, dataset: h5py.Dataset, count: int) -> np.ndarray:
    values = dataset[...].reshape(-1)
    if len(values) != count:
        raise PostError(
            f"{path}: case {label}: {len(values)} rows of "
            f"{dataset.name.rsplit('/', 1)[-1]} for {count} members"
        )
    return values


def _read_profile(path: Path, label: str, group: h5py.Group, count: int):
    if "profile" not in group or not {"x", "height"} <= set(group["profile"]):
        return None, None
    x = group["profile/x"][...].astype(np.float64).reshape(-1)
    height = group["profile/height"][...].astype(np.float64)
    if height.size == 0:
        height = np.empty((0, len(x)))
    if height.shape != (count, len(x)):
        raise PostError(
            f"{path}: case {label}: profile/height has shape {height.shape}, "
            f"expected {(count, len(x))}"
        )
    return x, height


def _plain(value):
    """Attribute values as Python's own; strings without the blanks Fortran pads with."""
    if isinstance(value, h5py.Empty):
        return ""
    if isinstance(value, np.ndarray):
        value = value.reshape(-1)
        if len(value) != 1:
            return [_plain(item) for item in value]
        value = value[0]
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    if isinstance(value, str):
        return value.rstrip("\x00 ")
    return value.item() if isinstance(value, np.generic) else value
