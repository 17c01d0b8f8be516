"""Ids of members as people write them: `1-250,300`."""

from __future__ import annotations

import re

import numpy as np

from .errors import PostError

_RANGE = re.compile(r"\s*(\d+)\s*(?:-\s*(\d+)\s*)?")


def parse_ids(text: str, name: str = "members") -> np.ndarray:
    """The ids of `1-250,300`, sorted, each once; PostError, with `name`, on anything else."""
    found = [np.array([], dtype=np.int64)]
    for part in text.split(",") if text.strip() else []:
        match = _RANGE.fullmatch(part)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if last < first:
            raise PostError(f"{name}: '{part.strip()}' is no range of ids such as 1-250")
        found.append(np.arange(first, last + 1, dtype=np.int64))
    return np.unique(np.concatenate(found))


def format_ids(ids) -> str:
    """The shortest text for these ids."""
    ids = np.unique(np.asarray(ids, dtype=np.int64))
    runs = np.split(ids, np.flatnonzero(np.diff(ids) != 1) + 1) if len(ids) else []
    return ",".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)
