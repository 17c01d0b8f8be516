"""`sgimp-post watch DIR`: how far a sweep has come and what it says so far, until it ends."""

from __future__ import annotations

import math
import shutil
import sys
import time
from datetime import datetime, timezone
from pathlib import Path

from .ensemble import FILE_NAME, RUNOUTS, Ensemble, read_ensemble
from .errors import PostError
from .events import EVENTS_NAME, Progress, age, read_starts
from .importance import weighted_mean, weighted_sd
from .statistics import describe

#: Seconds without an event from which on it is told.
SILENCE = 120.0
_CLEAR = "\x1b[H\x1b[2J"
_EXIT_TOO_MANY_FAILED = 4


def run(options) -> int:
    """Exit code 0, also after an interrupt from the keyboard."""
    if not (math.isfinite(options.interval) and options.interval > 0.0):
        raise PostError("--interval must be above zero")
    try:
        watch(options.directory, options.interval, options.once, options.runout)
    except KeyboardInterrupt:
        print()
    return 0


def watch(directory: Path, interval: float, once: bool, runout: str, out=None, pause=time.sleep):
    """Shows the table every `interval` s until the run ends, or `once`. On a terminal each takes
    the place of the last, else they follow one another. PostError where there is no run."""
    out = out or sys.stdout
    is_screen = out.isatty() and not once
    while True:
        is_over, lines = look(Path(directory), runout)
        if is_screen:
            lines = _fitting(lines, shutil.get_terminal_size().lines - 1)
        out.write((_CLEAR if is_screen else "") + "\n".join(lines) + "\n")
        if is_over or once:
            out.flush()
            return
        out.write("" if is_screen else "\n")
        out.flush()
        pause(interval)


def look(directory: Path, runout: str, now: datetime | None = None):
    """(whether the run has ended, lines that say where it stands)."""
    starts = read_starts(directory / EVENTS_NAME)
    progress = starts[-1] if starts else None
    # Results are not there from the first moment on.
    is_early = progress is not None and not (directory / FILE_NAME).exists()
    ensemble = None if is_early else read_ensemble(directory)
    if progress is None:
        progress = _from_results(ensemble)
    lines = [f"{directory}: {_headline(progress)}"]
    silent = age(progress, now or datetime.now(timezone.utc))
    if progress.state == "running" and silent > SILENCE:
        lines.append(f"no event for {duration(silent)}: members are slow, or the run was killed")
    lines += ["no results yet"] if ensemble is None else _table(ensemble, runout)
    return progress.state != "running", lines


def _from_results(ensemble: Ensemble) -> Progress:
    """Of a directory without events, as `sgimp-post merge` makes them."""
    total = sum(case.planned for case in ensemble.cases)
    return Progress(
        ensemble.state,
        sum(case.count for case in ensemble.cases),
        total,
        total,
        sum(int(case.failed.sum()) for case in ensemble.cases),
    )


def _headline(progress: Progress) -> str:
    text = f"{progress.done} of {progress.total} done, {progress.failed} failed"
    if progress.state == "complete" and progress.exit_code == _EXIT_TOO_MANY_FAILED:
        return f"complete, but more members failed than allowed: {text}"
    if progress.state != "running":
        more = "; the same command goes on" if progress.state == "stopped" else ""
        return f"{progress.state}: {text}{more}"
    ranks = f" on {progress.ranks} rank{'s' * (progress.ranks > 1)}" if progress.ranks else ""
    text = f"running{ranks}: {text}"
    if math.isfinite(progress.rate):
        text += f", {progress.rate:.{1 if progress.rate < 100.0 else 0}f}/min"
    if progress.expected < progress.total:
        text += f", about {progress.expected - progress.done} more needed"
    return text + (f", ETA {duration(progress.eta)}" if math.isfinite(progress.eta) else "")


def duration(seconds: float) -> str:
    """Two units at most."""
    whole = round(seconds)
    hours, minutes = whole // 3600, whole // 60 % 60
    if hours:
        return f"{hours} h {minutes:02d} min"
    return f"{minutes} min {whole % 60:02d} s" if minutes else f"{whole} s"


def _table(ensemble: Ensemble, runout: str):
    """`n` members are behind mean and sd: those without a gap from the first on, without failed
    ones."""
    written = sum(case.count for case in ensemble.cases)
    yield f"{runout} ({RUNOUTS[runout]}), mean with 95 % interval, m; {written} members written"
    width = max([len(case.label) for case in ensemble.cases] + [4])
    yield f"{'case':<{width}} {'done':>13} {'failed':>6} {'n':>6}   {'mean':<18} {'sd':<8}".rstrip()
    for case, used in zip(ensemble.cases, ensemble.for_statistics()):
        n, mean, half, sd = _estimates(used, runout, ensemble.is_weighted)
        line = f"{case.label:<{width}} {f'{case.count}/{case.planned}':>13}"
        line += f" {int(case.failed.sum()):>6} {n:>6}   "
        shown = f"{mean:.4f}" if math.isfinite(mean) else "-"
        shown += f" +- {half:.4f}" if math.isfinite(half) else ""
        yield f"{line}{shown:<18} {f'{sd:.4f}' if math.isfinite(sd) else '-'}"


def _estimates(case, runout: str, is_weighted: bool):
    if not is_weighted or case.is_homogeneous:
        known = describe(case.values(runout))
        return known.n, known.mean, known.half_width, known.sd
    values, weights = case.column(runout)[case.ok], case.column("log_weight")[case.ok]
    mean, sd = weighted_mean(values, weights), weighted_sd(values, weights)
    return mean.n, mean.value, 0.5 * (mean.high - mean.low), sd.value


def _fitting(lines: list, rows: int) -> list:
    """No more lines than the terminal has rows."""
    if len(lines) <= rows:
        return lines
    return [*lines[: rows - 1], f"and {len(lines) - rows + 1} more lines"]
