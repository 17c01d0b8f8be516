"""What the paper says, held against the numbers of `paper`: each statement reproduces, does not, or
cannot be told, with the numbers and one reason. No number here is typed that could be computed.

A number is judged by an interval: it does not reproduce where the interval leaves out all of what
is printed; it cannot be told where the interval holds both what is printed and no effect at all; it
reproduces otherwise. A statement about all cases reproduces if it does in each, and does not if it
does not in one; the intervals then hold for all of them at once (Bonferroni), p values are adjusted
(Holm). A mean is judged by its own interval; the noise floor is what one run scatters by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .printed import ACFS, NUMBERS
from .statistics import LEVEL

#: A shift of a mean without effect.
NO_SHIFT = (0.0, 0.0)

NONE_YET = "no member of these cases yet"
REPRODUCES, DOES_NOT, OPEN = "reproduces", "does not", "cannot be told"


@dataclass(frozen=True)
class Statement:
    """`verdicts` by runout; under '' where it is the same for each."""

    key: str
    place: str
    claim: str
    verdicts: dict
    numbers: str
    why: str

    def verdict(self, runout: str) -> str:
        """'' where this runout is not judged."""
        return self.verdicts.get(runout, self.verdicts.get("", ""))


def judge(low, high, printed_low, printed_high, nothing=None) -> str:
    """Of an interval against the printed range; nothing[0] to nothing[1] is no effect."""
    if not np.isfinite([low, high]).all():
        return OPEN
    if high < printed_low or low > printed_high:
        return DOES_NOT
    return OPEN if nothing and low <= nothing[1] and high >= nothing[0] else REPRODUCES


def direction(difference, p_adjusted) -> str:
    """Of the statement that a difference is positive."""
    if not p_adjusted < LEVEL:  # NaN too
        return OPEN
    return REPRODUCES if difference > 0.0 else DOES_NOT


def of_all(verdicts) -> str:
    """Of a statement about all of these cases."""
    verdicts = list(verdicts)
    if DOES_NOT in verdicts:
        return DOES_NOT
    return REPRODUCES if verdicts and set(verdicts) == {REPRODUCES} else OPEN


def rows_of(n, runout, cov=None) -> list:
    return [
        row
        for row in n["cases"]
        if row["runout"] == runout and row["n"] and (cov is None or np.isclose(row["cov"], cov))
    ]


def is_complete(rows) -> bool:
    """There is a case of each function: a statement about all can be made."""
    return len(rows) == len(ACFS)


def for_all(rows, verdict) -> str:
    """Of all functions; with some missing it can be refuted, but not confirmed."""
    got = of_all(verdict(row) for row in rows)
    return OPEN if got == REPRODUCES and not is_complete(rows) else got


def hundreds(blocks) -> list:
    """Blocks of the same members of all functions together."""
    by_number = {}
    for block in blocks:
        by_number.setdefault(block["block"], []).append(block)
    return [table for table in by_number.values() if len(table) == len(ACFS)]


def shown(value, form=".2f") -> str:
    """A number in words; a dash for what is not known."""
    return f"{value:{form}}" if np.isfinite(value) else "–"


def p_text(p, least) -> str:
    """A p value of resampling, of which none is smaller than `least`."""
    return f"≤ {least:.3f}" if p <= least else shown(p, ".3f")


def spans(rows, key, low, high, form="+.2f", factor=1.0, unit="") -> str:
    """`SNX +1.20 (+0.90 to +1.50); ...` of these keys of the rows."""
    texts = []
    for row in rows:
        value, *ends = (shown(factor * row[name], form) for name in (key, low, high))
        texts.append(f"{row['acf'].upper()} {value}{unit} ({' to '.join(ends)})")
    return "; ".join(texts)


def shares(rows) -> str:
    return spans(rows, "share", "share_low", "share_high", ".0f", 100.0, " %")


def damping_text(settings) -> str:
    value = settings["damping"]
    return "unknown damping" if value is None else f"damping {value:g}/s"


def is_as_printed(settings) -> bool:
    return settings["damping"] is not None and np.isclose(
        settings["damping"], NUMBERS["damping"].value
    )


def floor_text(floor) -> str:
    if not floor["n"]:
        return "no homogeneous run"
    text = f"{floor['mean']:.2f} dm"
    if floor["n"] > 1:
        text += f" ({floor['mean_low']:.2f} to {floor['mean_high']:.2f}; {floor['n']} runs, sd"
        text += f" {floor['sd']:.2f} dm; the nominal run alone {shown(floor['nominal'])} dm)"
    return text
