"""Rows and numbers as files."""

from __future__ import annotations

import csv
import math
from pathlib import Path


def write_table(path: Path, rows: list) -> None:
    """Rows of the keys of the first one as CSV; OSError goes through."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def null_for_nan(value):
    """The same with null for what is not finite, which JSON cannot hold."""
    if isinstance(value, dict):
        return {key: null_for_nan(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [null_for_nan(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
