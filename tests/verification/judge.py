"""What a case yields: a number beside its reference, with the error that is allowed and the reason for it."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Check:
    """One judged number. `error` and `allowed` are in the same measure, which `why` explains."""

    quantity: str
    reference: str
    ours: str
    error: float
    allowed: float
    why: str

    @property
    def is_met(self):
        """False for a number that is not finite, too."""
        return self.error <= self.allowed


def close(quantity, reference, ours, allowed, why):
    """Relative error |ours - reference|/|reference|."""
    error = abs(ours - reference) / abs(reference)
    return Check(quantity, f"{reference:.7g}", f"{ours:.7g}", error, allowed, why)


def small(quantity, ours, scale, allowed, why):
    """The reference is 0; the error is relative to `scale`."""
    return Check(quantity, "0", f"{ours:.3g}", abs(ours) / scale, allowed, why)


def between(quantity, low, high, ours, why):
    """The reference is a range; the error is the distance from it as a share of its nearer end."""
    bound = min(max(ours, low), high)
    return Check(
        quantity, f"{low:g} to {high:g}", f"{ours:.4g}", abs(ours - bound) / abs(bound or 1.0), 0.0, why
    )


def note(quantity, ours, why):
    """A number that is told and not judged."""
    return Check(quantity, "not judged", f"{ours:.6g}", 0.0, float("inf"), why)


def at_least(quantity, limit, ours, why):
    """The error is what is missing."""
    return Check(quantity, f"at least {limit:g}", f"{ours:.4g}", max(0.0, limit - ours), 0.0, why)


def at_most(quantity, limit, ours, why):
    """The error is the excess."""
    return Check(quantity, f"at most {limit:g}", f"{ours:.4g}", max(0.0, ours - limit), 0.0, why)


def pareto_front(rows, cost, error):
    """Rows that no other beats in both cost(row) and error(row), in order of cost."""
    front = []
    for row in sorted(rows, key=lambda row: (cost(row), error(row))):
        if not front or error(row) < error(front[-1]):
            front.append(row)
    return front


def order_of(sizes, errors):
    """Slope of log error over log size, by least squares."""
    return np.polyfit(np.log(sizes), np.log(errors), 1)[0]
