"""journal.bin byte by byte, and the merge of directories."""

import struct
import zlib

import h5py
import numpy as np
import pytest
from synthetic import sample, write_ensemble

from sgimp_post.cli import main
from sgimp_post.ensemble import read_ensemble
from sgimp_post.errors import PostError
from sgimp_post.journal import Journal, read_journal, write_journal

IDENTITY = "&grid cell_size = 0.125\n&material young = 2.6e6\n&random_field cov = 0.1\n"
COLUMNS = 3


def payload(case, member, columns=COLUMNS, reason=b""):
    """As sg_outcome_bytes: case, status, profile, letters, id, columns, profile, reason."""
    head = struct.pack("=4iq", case, 0, 2, len(reason), member)
    return head + np.arange(columns, dtype=float).tobytes() + bytes(8) + reason


def record(case, member, **more):
    """As sg_journal."""
    body = payload(case, member, **more)
    length = struct.pack("=i", len(body))
    crc = struct.pack("=I", zlib.crc32(length + body))
    return struct.pack("=i", 1397181522) + length + crc + body


def header(text=b"&case name='t' /\n", version=1, order=16909060, columns=COLUMNS):
    crc = struct.unpack("=i", struct.pack("=I", zlib.crc32(text)))[0]
    return b"SGIMPJNL" + struct.pack("=5i", version, order, columns, len(text), crc) + text


def ids_of(journal):
    return [(record.case, record.id) for record in journal.records]


def test_a_journal_is_read_and_written_to_the_byte(tmp_path):
    content = header() + record(1, 1) + record(2, 417, reason=b"lost") + record(2, 2**40)
    (tmp_path / "journal.bin").write_bytes(content)
    got = read_journal(tmp_path / "journal.bin")
    assert ids_of(got) == [(1, 1), (2, 417), (2, 2**40)]
    assert (got.text, got.columns, got.damaged) == (b"&case name='t' /\n", COLUMNS, 0)
    write_journal(tmp_path / "copy.bin", got)
    assert (tmp_path / "copy.bin").read_bytes() == content


def flipped(content, at):
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


@pytest.mark.parametrize(
    ("damage", "left"),
    [
        (lambda one, two, three: one + flipped(two, 40) + three, [1, 3]),
        (lambda one, two, three: one + flipped(two, 5) + three, [1, 3]),
        (lambda one, two, three: one + two + three[:-1], [1, 2]),
        (lambda one, two, three: one + two[:7] + three, [1, 3]),
        (lambda one, two, three: one + b"\0\1\2" + two + three, [1, 2, 3]),
        (lambda one, two, three: one + record(1, 9, columns=2) + two, [1, 2]),
    ],
)
def test_damaged_records_are_left_out(damage, left, tmp_path):
    content = damage(*(record(1, k) for k in (1, 2, 3)))
    (tmp_path / "journal.bin").write_bytes(header() + content)
    got = read_journal(tmp_path / "journal.bin")
    assert [member for _, member in ids_of(got)] == left
    good = sum(len(record(1, k)) for k in left)
    assert got.damaged == len(content) - good


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "not a journal"),
        (b"SGIMPJNM" + bytes(40), "not a journal"),
        (header(version=2), "a journal of version 2"),
        (header(order=67305985), "another byte order"),
        (header()[:-1], "header is damaged"),
        (flipped(header(), 30), "header is damaged"),
    ],
)
def test_what_is_no_journal_is_named(content, words, tmp_path):
    (tmp_path / "journal.bin").write_bytes(content)
    with pytest.raises(PostError, match=words):
        read_journal(tmp_path / "journal.bin")


def part(directory, ids, state="complete", journal_ids=None, **attributes):
    """A directory that ran these ids of one study case; the first one has the homogeneous case."""
    noise = [1, 2] if 1 in ids else []
    value = dict(zip(range(1, 101), sample(3, 100)))
    cases = [
        {"label": "deterministic", "values": [5.0, 5.1][: len(noise)], "planned": 2},
        {"label": "base", "values": [value[i] for i in ids], "ids": ids, "planned": 8},
    ]
    attributes = {"identity": IDENTITY, "members": f"{ids[0]}-{ids[-1]}", **attributes}
    write_ensemble(directory, cases, state, **attributes)
    kept = ids if journal_ids is None else journal_ids
    content = b"".join(record(1, i) for i in noise) + b"".join(record(2, i) for i in kept)
    (directory / "journal.bin").write_bytes(header() + content)
    (directory / "resolved.nml").write_text("&case name='t' /\n")
    return str(directory)


def merge(tmp_path, *parts):
    return main(["merge", *parts, "--out", str(tmp_path / "all")])


def test_parts_become_one_directory(tmp_path, capsys):
    """Rows and records in the order of the ids, whatever the order of the parts."""
    two = part(tmp_path / "two", [5, 6, 7, 8], host="second")
    one = part(tmp_path / "one", [1, 2, 3, 4])
    assert merge(tmp_path, two, one) == 0
    captured = capsys.readouterr()
    assert captured.err == "" and "10 members of 2 cases" in captured.out
    whole = write_ensemble(
        tmp_path / "whole",
        [
            {"label": "deterministic", "values": [5.0, 5.1]},
            {"label": "base", "values": sample(3, 100)[:8]},
        ],
    )
    got, expected = (read_ensemble(directory) for directory in (tmp_path / "all", whole))
    assert (got.state, got.attributes["members"], got.asked) == ("complete", "", None)
    for mine, theirs in zip(got.cases, expected.cases):
        assert (mine.label, mine.planned) == (theirs.label, theirs.planned)
        assert list(mine.id) == list(theirs.id)
        assert mine.values("runout_max") == pytest.approx(theirs.values("runout_max"), abs=0)
        assert mine.units == theirs.units and mine.profile_height.shape == (mine.count, 40)
    journal = read_journal(tmp_path / "all" / "journal.bin")
    assert ids_of(journal) == [(1, 1), (1, 2)] + [(2, i) for i in range(1, 9)]
    assert journal.text == b"&case name='t' /\n"
    assert (tmp_path / "all" / "resolved.nml").read_text() == "&case name='t' /\n"
    with h5py.File(tmp_path / "all" / "ensemble.h5") as file:
        assert [file[f"parts/{k}"].attrs["host"] for k in (1, 2)] == ["second", "node"]
        assert file["parts/2"].attrs["directory"] == one
        assert list(file["cases/base/id"]) == list(range(1, 9))
        assert list(file["cases/base/runout_max"]) == list(sample(3, 100)[:8])
        assert file["parts/2"].attrs["members"] == "1-4"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["all", "one", "two", "whole"]
    assert main(["report", str(tmp_path / "all")]) == 0


def test_what_was_merged_can_be_merged_again(tmp_path, capsys):
    parts = [part(tmp_path / str(ids[0]), ids) for ids in ([1, 2], [3, 4], [7, 8])]
    assert merge(tmp_path, *parts[:2]) == 0
    assert main(["merge", str(tmp_path / "all"), parts[2], "--out", str(tmp_path / "more")]) == 0
    assert "not run of base: 5-6" in capsys.readouterr().out
    got = read_ensemble(tmp_path / "more")
    assert got.attributes["members"] == "1-4,7-8" and list(got.case("base").id) == [
        1,
        2,
        3,
        4,
        7,
        8,
    ]
    with h5py.File(tmp_path / "more" / "ensemble.h5") as file:
        assert [file[f"parts/{k}"].attrs["members"] for k in (1, 2, 3)] == ["1-2", "3-4", "7-8"]


def test_an_unfinished_part_is_told_and_its_journal_kept(tmp_path, capsys):
    one = part(tmp_path / "one", [1, 2, 3, 4])
    two = part(tmp_path / "two", [5], "running", journal_ids=[5, 6, 6])
    assert merge(tmp_path, one, two) == 0
    out = capsys.readouterr().out
    assert f"{two} is running" in out and "not run of base: 7-8" in out
    assert "only in the journal until the program goes on: 6 of base" in out
    assert read_ensemble(tmp_path / "all").state == "stopped"
    assert ids_of(read_journal(tmp_path / "all" / "journal.bin"))[-2:] == [(2, 5), (2, 6)]


def test_another_version_of_the_program_is_a_warning(tmp_path, capsys):
    parts = [part(tmp_path / "1", [1, 2]), part(tmp_path / "2", [3, 4], version="0.2.0")]
    assert merge(tmp_path, *parts) == 0
    assert "version of" in (text := capsys.readouterr().err) and "'0.2.0'" in text


def drop_column(directory):
    with h5py.File(f"{directory}/ensemble.h5", "r+") as file:
        del file["cases/base/steps"]


@pytest.mark.parametrize(
    ("ids", "more", "words"),
    [
        ([4, 5], {}, "both have 4 of base"),
        ([5, 6], {"journal_ids": [3, 4, 5, 6]}, "both have 3-4 of base"),
        (
            [5, 6],
            {"identity": IDENTITY.replace("0.125", "0.25")},
            "&grid cell_size: 0.125 -> 0.25",
        ),
        ([5, 6], {"identity": IDENTITY + "&solver cfl = 0.4"}, "&solver cfl: (not set) -> 0.4"),
        ([5, 6], {"identity": ""}, "no attribute identity"),
        ([5, 6], {"change": lambda d: drop_column(d)}, "different datasets (steps)"),
        (
            [5, 6],
            {"change": lambda d: write_journal(f"{d}/journal.bin", Journal(b"", 4, []))},
            "3 and 4 columns",
        ),
        (
            [5, 6],
            {"change": lambda d: open(f"{d}/journal.bin", "wb").close()},
            "not a journal of sgimp",
        ),
    ],
)
def test_what_does_not_fit_is_refused_and_leaves_nothing(ids, more, words, tmp_path, capsys):
    change = more.pop("change", lambda directory: None)
    parts = [part(tmp_path / "1", [1, 2, 3, 4]), part(tmp_path / "2", ids, **more)]
    change(parts[1])
    assert merge(tmp_path, *parts) == 2
    assert words in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["1", "2"]


def test_a_latin_hypercube_has_one_size(tmp_path, capsys):
    parts = [
        part(tmp_path / str(n), ids, sampling="latin_hypercube", realizations=n)
        for n, ids in ((10, [1, 2]), (20, [3, 4]))
    ]
    assert merge(tmp_path, *parts) == 2
    assert "&monte_carlo realizations: 10 -> 20" in capsys.readouterr().err


def test_a_directory_with_something_in_it_is_not_touched(tmp_path, capsys):
    parts = [part(tmp_path / "1", [1, 2]), part(tmp_path / "2", [3, 4])]
    (tmp_path / "all").mkdir()
    (tmp_path / "all" / "mine").write_text("kept")
    assert merge(tmp_path, *parts) == 2
    assert "is there already" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "all").iterdir()] == ["mine"]


def test_one_directory_is_nothing_to_merge(tmp_path, capsys):
    assert merge(tmp_path, part(tmp_path / "1", [1, 2])) == 2
    assert "two directories or more" in capsys.readouterr().err
