"""`sgimp-post watch` on events and results as the program writes them."""

import io
import json
from datetime import datetime, timezone

import numpy as np
import pytest
from synthetic import sample, write_ensemble

from sgimp_post import watch as watching
from sgimp_post.cli import main
from sgimp_post.events import rank_seconds, read_starts
from sgimp_post.importance import weighted_mean
from sgimp_post.watch import duration, look, watch

NOON = datetime(2026, 1, 1, 12, 0, 0, tzinfo=timezone.utc)
VALUES = sample(1, 40)


def start(done=0, members=48, ranks=2):
    return {"event": "start", "members": members, "done": done, "ranks": ranks, "host": "node"}


def progress(done, seconds=60.0, eta=30.0, failed=0, expected=48):
    event = {"event": "progress", "done": done, "total": 48, "expected": expected}
    return {**event, "failed": failed, "seconds": seconds, "eta_seconds": eta}


def end(done=48, state="complete", exit_code=0, failed=0):
    return {"event": "end", "state": state, "done": done, "failed": failed, "exit_code": exit_code}


def write_events(directory, *events, tail=""):
    directory.mkdir(parents=True, exist_ok=True)
    lines = [json.dumps({"time": "2026-01-01T12:00:00Z", **event}) + "\n" for event in events]
    (directory / "events.jsonl").write_text("".join(lines) + tail)


def write_results(directory, count, state="running", ids=None, **more):
    ids = np.arange(1, count + 1) if ids is None else np.array(ids)
    case = {"label": "snx", "values": VALUES[ids - 1], "ids": ids, "planned": 40, **more}
    write_ensemble(directory, [{"label": "deterministic", "values": sample(2, 8)}, case], state)


def shown(directory, now=NOON):
    is_over, lines = look(directory, "runout_max", now)
    return is_over, "\n".join(lines)


def row(text, label):
    return next(line for line in text.splitlines() if line.startswith(label)).split()


def test_a_running_sweep_in_numbers(tmp_path):
    """Rate of the members of this start alone; estimates of those without a gap or a failure."""
    failure = {"event": "member_failed", "case": "snx", "id": 5, "status": 2, "reason": "x"}
    write_events(tmp_path, start(10), failure, progress(34, failed=1))
    write_results(tmp_path, 0, ids=[*range(1, 21), 22, 23], failed=[5])
    is_over, text = shown(tmp_path)
    assert not is_over
    assert "running on 2 ranks: 34 of 48 done, 1 failed, 24.0/min, ETA 30 s" in text
    x = np.delete(VALUES[:20], 4)
    half = 2.1009220 * x.std(ddof=1) / np.sqrt(19)  # Student's t, 18 degrees, 97.5 %
    expected = ["snx", "22/40", "1", "19", f"{x.mean():.4f}", "+-", f"{half:.4f}"]
    assert row(text, "snx") == [*expected, f"{x.std(ddof=1):.4f}"]
    assert "runout_max (farthest point), mean with 95 % interval, m; 30 members written" in text
    assert row(text, "deterministic")[1:4] == ["8/8", "0", "8"]


def test_a_half_written_line_and_foreign_ones_are_passed_over(tmp_path):
    write_events(tmp_path, start(), progress(12), tail='[1]\n{"x":1}\n{"time":"2026-01-01T12:0')
    got = read_starts(tmp_path / "events.jsonl")[-1]
    assert (got.state, got.done, got.rate) == ("running", 12, 12.0)


def test_time_of_all_ranks_over_all_starts(tmp_path):
    """Two ranks for a minute, then four for half of one; what followed a kill has no end."""
    first = [start(), {**end(20, "stopped", 3), "time": "2026-01-01T12:01:00Z"}]
    second = [start(20, ranks=4), {**progress(30), "time": "2026-01-01T12:00:30Z"}]
    write_events(tmp_path, *first, *second)
    assert rank_seconds(read_starts(tmp_path / "events.jsonl")) == 2 * 60 + 4 * 30
    assert np.isnan(rank_seconds(read_starts(tmp_path / "none.jsonl")))


def test_a_sweep_that_was_resumed_runs_again(tmp_path):
    stopped = [start(), progress(20, failed=1), end(21, "stopped", 3, failed=1)]
    write_events(tmp_path, *stopped)
    write_results(tmp_path, 13, "stopped")
    is_over, text = shown(tmp_path)
    assert is_over and "stopped: 21 of 48 done, 1 failed; the same command goes on" in text
    write_events(tmp_path, *stopped, start(21))
    is_over, text = shown(tmp_path)
    assert not is_over and "running on 2 ranks: 21 of 48 done, 1 failed\n" in text
    write_events(tmp_path, *stopped, start(21), progress(21, eta=None))
    assert "ETA" not in shown(tmp_path)[1] and "/min" not in shown(tmp_path)[1]


def test_a_rule_that_may_end_cases_shows_what_is_needed(tmp_path):
    write_events(tmp_path, start(), progress(20, expected=30))
    assert "about 10 more needed" in shown(tmp_path)[1]
    assert "no results yet" in shown(tmp_path)[1]


def test_too_many_failed_members_are_said(tmp_path):
    write_events(tmp_path, start(), end(exit_code=4, failed=9))
    write_results(tmp_path, 40, "complete")
    is_over, text = shown(tmp_path)
    assert is_over and "complete, but more members failed than allowed: 48 of 48" in text
    assert "9 failed" in text


def test_a_killed_run_falls_silent(tmp_path):
    write_events(tmp_path, start(), progress(12))
    write_results(tmp_path, 4)
    assert "no event" not in shown(tmp_path, NOON.replace(minute=2))[1]
    assert "no event for 2 min 01 s" in shown(tmp_path, NOON.replace(minute=2, second=1))[1]
    text = shown(tmp_path, NOON.replace(hour=14, minute=3))[1]
    assert "no event for 2 h 03 min: members are slow, or the run was killed" in text
    write_events(tmp_path, start(), progress(12), end())
    assert "no event" not in shown(tmp_path, NOON.replace(hour=14))[1]


def test_a_directory_without_events_is_told_from_its_results(tmp_path):
    write_results(tmp_path, 30, "stopped", failed=[2, 3])
    is_over, text = shown(tmp_path)
    assert is_over and "stopped: 38 of 48 done, 2 failed" in text


def test_members_with_weights_are_weighed(tmp_path):
    weights = 0.1 * sample(3, 400, 0.0, 1.0)
    values = sample(4, 400)
    case = {"label": "snx", "values": values, "columns": {"log_weight": weights}}
    write_ensemble(tmp_path, [case], sampling="importance")
    expected = weighted_mean(values, weights)
    got = row(shown(tmp_path)[1], "snx")
    assert got[3:5] == ["400", f"{expected.value:.4f}"]
    assert got[6] == f"{expected.high - expected.value:.4f}"
    assert got[4] != f"{values.mean():.4f}"


class Screen(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize("stream", [io.StringIO, Screen])
def test_the_table_is_shown_until_the_run_ends(stream, tmp_path):
    """One block each time; on a terminal each clears the one before."""
    write_events(tmp_path, start())
    waits = []

    def pause(seconds):
        waits.append(seconds)
        done = 12 * len(waits)
        last = [end()] if done == 48 else []
        write_events(tmp_path, start(), progress(done), *last)
        write_results(tmp_path, min(done, 40), "complete" if last else "running")

    out = stream()
    watch(tmp_path, 2.5, False, "runout_max", out, pause)
    assert waits == [2.5] * 4
    text = out.getvalue()
    counts = ["0 of 48", "12 of 48", "24 of 48", "36 of 48", "complete: 48 of 48"]
    blocks = text.split("\x1b[H\x1b[2J")[1:] if stream is Screen else text.split("\n\n")
    assert len(blocks) == 5 and all(count in block for count, block in zip(counts, blocks))
    assert row(blocks[-1], "snx")[1:4] == ["40/40", "0", "40"]
    assert ("\x1b" in text) is (stream is Screen)


def test_a_table_longer_than_the_terminal_is_cut(tmp_path, monkeypatch):
    monkeypatch.setenv("LINES", "5")
    monkeypatch.setenv("COLUMNS", "80")
    write_events(tmp_path, start(), end())
    write_results(tmp_path, 40, "complete")
    out = Screen()
    watch(tmp_path, 1.0, False, "runout_max", out, None)
    lines = out.getvalue().splitlines()
    assert len(lines) == 4 and lines[-1] == "and 2 more lines"


def test_the_command(tmp_path, capsys, monkeypatch):
    write_events(tmp_path, start(), progress(12))
    write_results(tmp_path, 4)
    assert main(["watch", str(tmp_path), "--once", "--runout", "runout_q99"]) == 0
    out = capsys.readouterr().out
    assert "runout_q99 (99 % of the mass)" in out
    assert row(out, "snx")[4] == f"{0.8 * VALUES[:4].mean():.4f}"

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(watching, "watch", interrupted)
    assert main(["watch", str(tmp_path)]) == 0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["none"], "no such directory"),
        (["."], "no ensemble.h5 here"),
        ([".", "--interval", "0"], "--interval must be above zero"),
        ([".", "--interval", "nan"], "--interval must be above zero"),
    ],
)
def test_bad_input_is_refused(options, words, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["watch", *options, "--once"]) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.4, "0 s"), (59.6, "1 min 00 s"), (3599, "59 min 59 s"), (7380, "2 h 03 min")],
)
def test_durations(seconds, text):
    assert duration(seconds) == text
