"""Runs a case of input/verification, with some of its keys changed, and reads the files of the run."""

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

TEXT = r"'[^']*'|\"[^\"]*\""
GROUP = re.compile(rf"&(\w+)((?:{TEXT}|[^'\"/])*)/")
KEY = re.compile(rf"(\w+)\s*=\s*((?:{TEXT}|[^'\"=])*?)\s*(?=,?\s*\w+\s*=|$)")
COMMENT = re.compile(rf"((?:{TEXT}|[^'\"!])*)!.*")


def read_namelist(path):
    """The groups of a namelist as a list of (name, {key: value as text})."""
    lines = [COMMENT.sub(r"\1", line) for line in path.read_text().splitlines()]
    groups = []
    for name, body in GROUP.findall("\n".join(lines)):
        pairs = KEY.findall(body.strip())
        groups.append((name.lower(), {key.lower(): value.rstrip(", ") for key, value in pairs}))
    return groups


def as_text(value):
    """A Python value as a namelist writes it."""
    if isinstance(value, str):
        return f"'{value}'"
    if isinstance(value, (list, tuple)):
        return ", ".join(as_text(part) for part in value)
    return repr(value.item() if isinstance(value, np.generic) else value)


def change_keys(groups, changes):
    """Changes keys in place. `changes`: {"group.key" or "group:name.key": value}; None drops the key."""
    for place, value in changes.items():
        where, key = place.rsplit(".", 1)
        group, _, name = where.partition(":")
        found = [
            keys for title, keys in groups if title == group and name in ("", keys.get("name", "").strip("'"))
        ]
        if len(found) != 1:
            raise KeyError(f"{place}: {len(found)} groups of this name")
        if value is None:
            found[0].pop(key, None)
        else:
            found[0][key] = as_text(value)


@dataclass(frozen=True)
class State:
    """The points at one time: arrays of length n, or [n, k]."""

    time: float
    position: np.ndarray
    velocity: np.ndarray
    stress: np.ndarray
    volume: np.ndarray
    displacement: np.ndarray

    @property
    def start(self):
        """Where the points were at the start."""
        return self.position - self.displacement


class Result:
    """What a deterministic run left: history columns by name, states in order of time, and its row."""

    def __init__(self, directory):
        with h5py.File(directory / "snapshots" / "deterministic_r000001.h5", "r") as file:
            self.history = {name: data[:] for name, data in file.get("history", {}).items()}
            names = sorted((name for name in file if name.startswith("step_")), key=lambda s: int(s[5:]))
            self.states = [
                State(
                    float(file[name]["time"][()]),
                    *(file[name][key][:] for key in list(State.__annotations__)[1:]),
                )
                for name in names
            ]
        with h5py.File(directory / "ensemble.h5", "r") as file:
            member = file["cases/deterministic"]
            self.row = {name: data[0] for name, data in member.items() if isinstance(data, h5py.Dataset)}

    @property
    def first(self):
        """The state at the start."""
        return self.states[0]

    @property
    def last(self):
        """The state at the end."""
        return self.states[-1]


def namelist_text(groups):
    """What read_namelist has read, as text."""
    return "".join(f"&{name} " + ", ".join(f"{k}={v}" for k, v in keys.items()) + " /\n" for name, keys in groups)


def write_changed(case, changes, path):
    """The namelist `case` with changed keys (see change_keys), written to `path`."""
    groups = read_namelist(case)
    change_keys(groups, changes)
    path.write_text(namelist_text(groups))


def run_namelist(executable, namelist, directory, codes=(0,)):
    """Runs a namelist in `directory`, whatever that held; any exit code but `codes` is an error."""
    command = [executable, namelist, "--output", directory, "--overwrite"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in codes:
        raise RuntimeError(
            f"exit code {done.returncode}\n{done.stdout}{done.stderr}{Path(namelist).read_text()}"
        )
    return Result(directory)


class Bench:
    """Runs cases of one directory with one executable in one precision; results are kept in a scratch directory."""

    def __init__(self, executable, inputs, scratch, precision="double"):
        self.executable, self.inputs, self.scratch = Path(executable).resolve(), Path(inputs), Path(scratch)
        self.precision = precision
        self.count = 0

    def bound(self, double, single):
        """What is allowed where rounding decides, and why: (allowed, why) of the precision of the runs."""
        return single if self.precision == "single" else double

    def run(self, case, changes=None, fails=False):
        """Runs `case`.nml with changed keys. `fails`: a failed member (exit code 4) is no error."""
        self.count += 1
        groups = read_namelist(self.inputs / f"{case}.nml")
        change_keys(groups, {"solver.precision": self.precision} | (changes or {}))
        for _, keys in groups:
            if "file" in keys:
                keys["file"] = as_text(str((self.inputs / keys["file"].strip("'")).resolve()))
        namelist = self.scratch / f"{case}_{self.count}.nml"
        namelist.write_text(namelist_text(groups))
        directory = self.scratch / f"{case}_{self.count}"
        return run_namelist(self.executable, namelist, directory, (0, 4) if fails else (0,))
