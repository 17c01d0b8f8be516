"""journal.bin of a run: what `sg_journal` and `sg_outcome_bytes` of the program write. Records are
checked and handed on as bytes; what their numbers mean is not looked at.

Header: 'SGIMPJNL', five int32 (version, byte order, columns, length of text, CRC of the text),
text. Record: three int32 (mark, length of payload, CRC of length and payload), payload. Payload:
four int32 (case, status, columns of the profile, length of the reason), int64 id, one float64 a
column, one float32 a column of the profile, the reason. Numbers are in the byte order of the
machine."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

from .errors import PostError

FILE_NAME = "journal.bin"
_SIGNATURE = b"SGIMPJNL"
_VERSION, _BYTE_ORDER, _MARK = 1, 16909060, 1397181522
_HEADER = struct.Struct("=8s5i")
_RECORD = struct.Struct("=3i")
_PAYLOAD = struct.Struct("=4iq")
_LONGEST = 67108864


@dataclass(frozen=True)
class Record:
    """One finished member. `case` counts from 1 in the order of the plan."""

    case: int
    id: int
    payload: bytes


@dataclass(frozen=True)
class Journal:
    """The configuration the directory belongs to, the number of result columns, and the good
    records in the order of the file; `damaged` is the number of bytes that are none."""

    text: bytes
    columns: int
    records: list
    damaged: int = 0


def read_journal(path: Path) -> Journal:
    """PostError, naming the file, where the header is not one of this version and machine."""
    try:
        content = Path(path).read_bytes()
    except OSError as cause:
        raise PostError(f"{path}: cannot be read ({cause.strerror})") from cause
    if len(content) < _HEADER.size or not content.startswith(_SIGNATURE):
        raise PostError(f"{path}: not a journal of sgimp")
    _, version, order, columns, length, crc = _HEADER.unpack_from(content)
    if order != _BYTE_ORDER:
        raise PostError(f"{path}: written on a machine with another byte order")
    if version != _VERSION:
        raise PostError(f"{path}: a journal of version {version}, known is {_VERSION}")
    text = content[_HEADER.size : _HEADER.size + max(length, 0)]
    if length < 0 or len(text) < length or _checksum(text) != crc:
        raise PostError(f"{path}: its header is damaged")
    records, damaged, at = [], 0, _HEADER.size + length
    while at < len(content):
        record, end = _record_at(content, at, columns)
        if record:
            records.append(record)
        else:
            damaged += end - at
        at = end
    return Journal(text, columns, records, damaged)


def write_journal(path: Path, journal: Journal) -> None:
    """OSError goes through."""
    header = _HEADER.pack(
        _SIGNATURE,
        _VERSION,
        _BYTE_ORDER,
        journal.columns,
        len(journal.text),
        _checksum(journal.text),
    )
    with open(path, "wb") as file:
        file.write(header + journal.text)
        for record in journal.records:
            file.write(_record_bytes(record.payload))


def _record_bytes(payload: bytes) -> bytes:
    length = struct.pack("=i", len(payload))
    return _RECORD.pack(_MARK, len(payload), _checksum(length + payload)) + payload


def _record_at(content: bytes, at: int, columns: int):
    """The record at this offset with the offset behind it; None with the next offset at which one
    may begin where there is no good one."""
    if at + _RECORD.size <= len(content):
        mark, length, crc = _RECORD.unpack_from(content, at)
        first = at + _RECORD.size
        payload = content[first : first + max(length, 0)]
        if (
            mark == _MARK
            and 0 <= length <= _LONGEST
            and len(payload) == length
            and _checksum(content[at + 4 : at + 8] + payload) == crc
            and _is_row(payload, columns)
        ):
            case, _, _, _, member = _PAYLOAD.unpack_from(payload)
            return Record(case, member, payload), first + length
    following = content.find(struct.pack("=i", _MARK), at + 1)
    return None, following if following > 0 else len(content)


def _is_row(payload: bytes, columns: int) -> bool:
    if len(payload) < _PAYLOAD.size:
        return False
    _, _, profile, letters, _ = _PAYLOAD.unpack_from(payload)
    expected = _PAYLOAD.size + 8 * columns + 4 * profile + letters
    return profile >= 0 and letters >= 0 and len(payload) == expected


def _checksum(content: bytes) -> int:
    """CRC-32 as a signed number."""
    return struct.unpack("=i", struct.pack("=I", zlib.crc32(content)))[0]
