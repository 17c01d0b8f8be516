"""Computes members of a run again with the program, one by one and with their states, in a
directory beside the run: nothing of the run is touched. What is there already is not repeated."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

from .errors import PostError
from .namelist import resolved_text

#: The program in a checkout that is built as the README says.
_BUILT = Path(__file__).resolve().parents[2] / "build" / "release" / "bin" / "sgimp"
#: A line of the row that the program prints: name, value and unit of a column.
_LINE = re.compile(r"^  (\w+) +(\S+) \S+$", re.MULTILINE)
#: Computing time: another one each time.
_NOT_COMPARED = "seconds"


@dataclass(frozen=True)
class Replay:
    """One member computed again: its states in `path`, the `row` that the program printed, and the
    columns that differ from the recorded row with both values. `problem` is empty, or says in a
    line why there are no states."""

    path: Path
    row: dict = field(default_factory=dict)
    differences: list = field(default_factory=list)
    problem: str = ""
    #: The program was not run again.
    was_there: bool = False


@dataclass(frozen=True)
class Program:
    path: Path
    #: What it says of itself.
    version: str


def find_program(asked: str | None) -> Program:
    """`asked`, or the one that is built in this checkout, or the one on PATH. PostError if there
    is none, or it cannot be started."""
    built = str(_BUILT) if _BUILT.is_file() else "sgimp"
    found = shutil.which(asked or built)
    if found is None and asked:
        raise PostError(f"--sgimp {asked}: no such program, or it cannot be executed")
    if found is None:
        raise PostError(
            "the program sgimp is needed to replay members: name it with --sgimp, put it on PATH,"
            f" or build it (expected at {_BUILT})"
        )
    path = Path(found).resolve()
    try:
        done = subprocess.run([str(path), "--version"], capture_output=True, text=True)
    except OSError as cause:
        raise PostError(f"{path}: cannot be started ({cause.strerror})") from cause
    if done.returncode != 0:
        raise PostError(f"{path}: --version ends with exit code {done.returncode}")
    return Program(path, " ".join(done.stdout.split()))


def replay_case(ensemble, program: Program, interval: float) -> str:
    """The case file of replays: that of the run, with a state every `interval` seconds, which
    changes no result, and with the program that it is for. Files of fields, measurements and points
    stand in it with absolute paths."""
    text, name = resolved_text(ensemble)
    text, count = re.subn(
        r"^(\s*snapshot_interval\s*=).*$", rf"\1 {interval:.17g}", text, flags=re.MULTILINE
    )
    if count != 1:
        raise PostError(f"{name}: no snapshot_interval in &output: not a resolved case file")
    return f"! For {program.version}.\n{text}"


def replay(program: Program, text: str, case, member: int, home: Path) -> Replay:
    """Member `member` of `case` by the case file `text`, its states in `home`/snapshots. The case
    file and what the program printed stay in `home`/replays; while they are there and the text is
    the same, the program does not run again. PostError if `home` cannot be written."""
    name = f"{case.label}_r{member:06d}"
    path = home / "snapshots" / f"{name}.h5"
    case_file, printed = (home / "replays" / f"{name}.{kind}" for kind in ("nml", "txt"))
    was_there = path.is_file() and printed.is_file() and _content(case_file) == text
    try:
        if not was_there:
            case_file.parent.mkdir(parents=True, exist_ok=True)
            printed.unlink(missing_ok=True)  # is written last: what it belongs to is complete
            path.unlink(missing_ok=True)
            case_file.write_text(text, encoding="utf-8")
            problem = _run(program, case_file, case.label, member, home, printed)
            if problem:
                return Replay(path, problem=problem)
        row, problem = read_row(printed.read_text(encoding="utf-8"), name)
    except OSError as cause:
        raise PostError(f"{home}: cannot be written ({cause.strerror})") from cause
    if not problem and not path.is_file():
        problem = "its states could not be written"
    return Replay(path, row, differences(case, member, row), problem, was_there)


def _content(path: Path) -> str | None:
    return path.read_text(encoding="utf-8") if path.is_file() else None


def _run(program, case_file, label, member, home, printed) -> str:
    """Runs the program; what it says if it fails, else ''."""
    command = [str(program.path), str(case_file.resolve()), "--output", str(home.resolve())]
    command += ["--realization", str(member), "--study-case", label, "--snapshots"]
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace"
        )
    except OSError as cause:
        return f"the program cannot be started ({cause.strerror})"
    if done.returncode != 0:
        lines = (done.stderr or done.stdout).strip().splitlines() or ["nothing is said"]
        return f"the program ends with exit code {done.returncode}: {lines[-1].strip()}"
    printed.write_text(done.stdout, encoding="utf-8")
    return ""


def read_row(text: str, name: str):
    """{column: value} of a replay's output, and what is wrong with it, or ''."""
    status = re.search(rf"^{re.escape(name)}: (.*)$", text, re.MULTILINE)
    row = {}
    for column, value in _LINE.findall(text):
        try:
            row[column] = float(value)
        except ValueError:  # a sentence of three words
            continue
    if status is None or not row:
        return {}, "the program prints no row"
    return row, "" if status[1] == "ok" else f"it fails now: {status[1]}"


def differences(case, member: int, row: dict) -> list:
    """(column, recorded, replayed) where a replayed row is not the recorded one to the last bit;
    columns that the file does not have are left out."""
    (k,) = (case.id == member).nonzero()[0]
    found = []
    for name, replayed in row.items():
        if name == _NOT_COMPARED or not case.units.get(name):
            continue
        recorded = float(case.column(name)[k])
        both_unknown = recorded != recorded and replayed != replayed
        if recorded != replayed and not both_unknown:
            found.append((name, recorded, replayed))
    return found
