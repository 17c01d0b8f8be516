"""`sgimp-post casebook`: the members at the quantiles of the runout computed again with their
states, and shown: animations, stills and one page."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from . import __version__
from .casebook_figures import animate, shared_view, still_figure
from .casebook_frames import Track, frame_steps, frame_times, shared_quantities, survey
from .ensemble import FILE_NAME, RUNOUTS, read_ensemble
from .errors import PostError
from .member_section import member_entries
from .member_states import CASEBOOK, varied_property
from .namelist import read_namelist, resolved_text
from .page import environment, field_unit
from .quantile_members import QuantileMember, quantile_members, shown_cases
from .replays import Replay, find_program, replay, replay_case
from .snapshots import read_point_states
from .style import FIGURE_KINDS, Gallery, rendered

#: Frames of an animation if no number is asked for; the states of a replay take 104 bytes a point
#: and frame.
FRAMES = 40


@dataclass
class Exhibit:
    """A member of a case with its replay, and the names of its pictures in the casebook; `problem`
    is empty, or says why there are none."""

    member: QuantileMember
    replay: Replay
    track: Track | None = None
    problem: str = ""
    gif: str = ""
    still: str = ""
    files: list = field(default_factory=list)

    @property
    def name(self) -> str:
        return f"{self.member.name}: member {self.member.id}, {self.member.value:.3f} m"

    @property
    def verdict(self) -> str:
        """How the replay compares with what was recorded."""
        if self.problem:
            return self.problem
        if not self.replay.differences:
            return "equal to the last bit"
        return "differs: " + "; ".join(
            f"{column} {recorded:.17g} recorded, {replayed:.17g} replayed"
            for column, recorded, replayed in self.replay.differences
        )


def run(options) -> int:
    """Prints a line a replay and the page it wrote. Exit code: 0; 1 where a replay failed."""
    frames = FRAMES if options.frames is None else options.frames
    if frames < 2:
        raise PostError("--frames must be at least 2")
    ensemble = read_ensemble(options.directory)
    cases = shown_cases(ensemble, options.study_case)
    members = {
        case.label: quantile_members(case, options.runout, ensemble.is_weighted) for case in cases
    }
    cases = [case for case in cases if members[case.label]]
    if not cases:
        print(f"{options.directory}: no member has ended well yet: there is nothing to show")
        return 0
    program = find_program(options.sgimp)
    out = Path(options.out) if options.out else Path(options.directory) / CASEBOOK
    if (out / FILE_NAME).exists():
        raise PostError(f"{out}: holds results of a run; --out names a directory for the casebook")
    gallery, chapters = Gallery(), []
    try:
        out.mkdir(parents=True, exist_ok=True)
        for case in cases:
            exhibits = _replay(ensemble, case, members[case.label], program, frames, out)
            (entry,) = member_entries(ensemble, options.runout, gallery, case.label, out)
            _draw(case, exhibits, frames, out)
            chapters.append({**entry, "exhibits": exhibits})
        gallery.write(out)
        page = out / "casebook.html"
        page.write_text(_page(ensemble, chapters, program, options.runout, frames, out), "utf-8")
    except OSError as cause:
        raise PostError(f"{out}: cannot be written ({cause.strerror})") from cause
    print(page)
    return 1 if any(one.problem for chapter in chapters for one in chapter["exhibits"]) else 0


def _page(ensemble, chapters, program, runout: str, frames: int, out: Path) -> str:
    a = ensemble.attributes
    return (
        environment()
        .get_template("casebook.html.j2")
        .render(
            chapters=chapters,
            directory=ensemble.directory.resolve(),
            out=out,
            runout=RUNOUTS[runout],
            state=ensemble.state,
            total=sum(case.role == "study" for case in ensemble.cases),
            frames=frames,
            recorded=f"sgimp {a.get('version', '')} ({a.get('git_hash', '')})",
            replayed=program.version,
            field_unit=field_unit(ensemble),
            post_version=__version__,
        )
    )


def _replay(ensemble, case, members, program, frames: int, out: Path) -> list:
    """An Exhibit of each member, and a line about it on the terminal."""
    text = replay_case(ensemble, program, _interval(ensemble, case, members, frames))
    varied, exhibits = varied_property(ensemble), []
    for member in members:
        done = replay(program, text, case, member.id, out)
        one = Exhibit(member, done, problem=done.problem)
        if not one.problem:
            try:
                one.track = survey(done.path, varied)
            except PostError as cause:
                one.problem = str(cause)
        exhibits.append(one)
        what = " (there already)" if done.was_there else ""
        print(f"{case.label} {one.name}: {one.verdict}{what}", flush=True)
    return exhibits


def _interval(ensemble, case, members, frames: int) -> float:
    """Time between states in s: as many as frames until the last of the members comes to rest, or
    to the end of the run where one does not."""
    known = np.isin(case.id, [member.id for member in members])
    times = case.column("settle_time")[known]
    longest = float(np.max(times))
    if not (math.isfinite(longest) and longest > 0.0):
        solver = next(
            (k for name, k in read_namelist(*resolved_text(ensemble)) if name == "solver"), {}
        )
        longest = float(case.varied.get("end_time", solver.get("end_time", math.nan)))
    if not longest > 0.0:
        raise PostError(f"{ensemble.directory}: neither settle_time nor end_time is known")
    return longest / (frames - 1)


def _draw(case, exhibits, frames: int, out: Path) -> None:
    """Animation and still of each replay that is there, over the scales of them all."""
    shown = [one for one in exhibits if one.track is not None]
    if not shown:
        return
    tracks = [one.track for one in shown]
    view = shared_view(tracks, shared_quantities(tracks), case.geometry)
    times = frame_times(tracks, frames)
    for one in shown:
        path, runout = one.track.path, one.member.value
        states = read_point_states(path, frame_steps(one.track, times))
        files = animate(view, states, times, f"{case.label}, {one.name}", runout, out / path.stem)
        two = read_point_states(path, [one.track.half_way, int(one.track.steps[-1])])
        figure = still_figure(view, list(two), one.name, runout)
        for kind, dpi in {"png": 130, **FIGURE_KINDS}.items():
            files.append(out / f"{path.stem}.{kind}")
            files[-1].write_bytes(rendered(figure, kind, dpi))
        plt.close(figure)
        one.gif, one.still = f"{path.stem}.gif", f"{path.stem}.png"
        one.files = [file.name for file in files]
