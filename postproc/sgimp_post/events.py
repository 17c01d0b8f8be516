"""Reads DIR/events.jsonl: when a run was started and how far each start has come."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

from .errors import PostError

EVENTS_NAME = "events.jsonl"
_TIME = "%Y-%m-%dT%H:%M:%SZ"


@dataclass(frozen=True)
class Progress:
    """Of one start of a run, as its events tell. `state`: running, complete or stopped;
    `expected`: members needed in the end where stop rules may end cases; `eta`, `seconds` in s, NaN
    if not known; `first`, `last`: times of its first and last event."""

    state: str
    done: int
    total: int
    expected: int
    failed: int
    first_done: int = 0
    ranks: int = 0
    seconds: float = math.nan
    eta: float = math.nan
    exit_code: int = 0
    first: str = ""
    last: str = ""

    @property
    def rate(self) -> float:
        """Members a minute since the start; NaN before the first."""
        fresh = self.done - self.first_done
        return 60.0 * fresh / self.seconds if fresh > 0 and self.seconds > 0.0 else math.nan


def read_starts(path: Path) -> list:
    """A Progress for each start of the run, in order. A line that is not whole, as the last one of
    a running sweep may be, is passed over."""
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return []
    except OSError as cause:
        raise PostError(f"{path}: cannot be read ({cause.strerror})") from cause
    starts = []
    for line in text.splitlines():
        try:
            event = json.loads(line)
            found = _after(starts[-1] if starts else None, event)
            if event["event"] == "start":
                starts.append(found)
            elif starts:
                starts[-1] = found
        except (ValueError, KeyError, TypeError, AttributeError):
            continue
    return starts


def rank_seconds(starts) -> float:
    """Seconds that all ranks together had from each start to the last event of it; NaN for none."""
    spans = [start.ranks * _seconds(start.first, start.last) for start in starts]
    return sum(spans) if spans else math.nan


def age(progress: Progress, now: datetime) -> float:
    """Seconds since the last event; NaN if its time is not known."""
    return _seconds(progress.last, now.strftime(_TIME))


def _seconds(first: str, last: str) -> float:
    """Between two times of events; NaN if one is not known."""
    try:
        return (datetime.strptime(last, _TIME) - datetime.strptime(first, _TIME)).total_seconds()
    except ValueError:
        return math.nan


def _after(found: Progress | None, event: dict) -> Progress | None:
    kind, done = event["event"], int(event.get("done", 0))
    if kind == "start":
        total = int(event["members"])
        failed = found.failed if found else 0
        return Progress(
            "running",
            done,
            total,
            total,
            failed,
            done,
            int(event["ranks"]),
            first=event["time"],
            last=event["time"],
        )
    if found is None:
        return None
    if kind == "progress":
        eta = event["eta_seconds"]
        found = replace(
            found,
            done=done,
            total=int(event["total"]),
            expected=int(event["expected"]),
            failed=int(event["failed"]),
            seconds=float(event["seconds"]),
            eta=math.nan if eta is None else float(eta),
        )
    elif kind == "end":
        found = replace(
            found,
            state=str(event["state"]),
            done=done,
            failed=int(event["failed"]),
            exit_code=int(event["exit_code"]),
        )
    return replace(found, last=event["time"])
