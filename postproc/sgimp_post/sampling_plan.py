"""White noise of every member, rebuilt by NumPy's Philox from (seed, stream, realization) alone."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from .errors import PostError

FIELD_STREAM = 1
DATA_STREAM = 3
#: Streams of the second field on: this number plus its index.
LATER_FIELDS = 100
_LOW_32_BITS = 2**32 - 1
#: Members of importance sampling have the noise of random ones, and their first field is shifted.
PLANS = ("random", "antithetic", "latin_hypercube", "importance")


def field_stream(index: int) -> int:
    """Stream of the field with this index, counted from 1."""
    return FIELD_STREAM if index == 1 else LATER_FIELDS + index


def words(seed: int, stream: int, realization: int, count: int) -> np.ndarray:
    """Of Philox4x64-10, 64 bits each."""
    key = np.array([seed % 2**64, stream], dtype=np.uint64)
    # NumPy counts one up before the first block: the program starts at block 1.
    counter = np.array([0, realization, 0, 0], dtype=np.uint64)
    return np.random.Philox(key=key, counter=counter).random_raw(count)


def uniform(seed: int, stream: int, realization: int, count: int) -> np.ndarray:
    """((word >> 12) + 1/2) / 2^52: never 0 or 1."""
    return (
        (words(seed, stream, realization, count) >> np.uint64(12)).astype(float) + 0.5
    ) * 2.0**-52


def latin_hypercube_uniform(seed, stream, realization, count, realizations) -> np.ndarray:
    """Number j of the members runs through N equally likely intervals: (interval + u)/N, where the
    interval of member i is perm_j(i - 1) + rotation_j modulo N, both from three words of the
    realization 0, which no member has."""
    if not 1 <= realization <= realizations:
        raise PostError(f"member {realization} of a Latin hypercube of {realizations}")
    order = words(seed, stream, 0, 3 * count).reshape(count, 3)
    n = np.uint64(realizations)
    interval = (
        permuted(realization - 1, realizations, order[:, :2]) + (order[:, 2] >> np.uint64(2)) % n
    )
    place = ((interval % n).astype(float) + uniform(seed, stream, realization, count)) / float(n)
    return (np.minimum(np.floor(place * 2.0**52), 2.0**52 - 1.0) + 0.5) * 2.0**-52


def permuted(i: int, n: int, order) -> np.ndarray:
    """Where permutations of 0 to n - 1, one for each row of two words, take i: six rounds of a
    Feistel network on as many bits as n needs, again until the result is below n."""
    bits = 1
    while 4**bits < n:
        bits += 1
    mask, shift, low = (np.uint64(v) for v in (2**bits - 1, bits, _LOW_32_BITS))
    keys = (
        order[:, 0] & low,
        order[:, 0] >> np.uint64(32),
        order[:, 1] & low,
        order[:, 1] >> np.uint64(32),
    )
    keys += tuple((key + np.uint64(0x9E3779B9)) & low for key in keys[:2])
    place = np.full(len(order), i, dtype=np.uint64)
    beyond = np.arange(len(order))
    while len(beyond):
        left, right = place[beyond] >> shift, place[beyond] & mask
        for key in keys:
            left, right = right, left ^ (_mixed(right, key[beyond]) & mask)
        place[beyond] = (left << shift) | right
        beyond = beyond[place[beyond] >= n]
    return place


def _mixed(value, key):
    """Sixteen well mixed bits, by the multipliers of MurmurHash3."""
    bits = ((value ^ key) * np.uint64(0x85EBCA6B)) & np.uint64(_LOW_32_BITS)
    bits = ((bits ^ (bits >> np.uint64(13))) * np.uint64(0xC2B2AE35)) & np.uint64(_LOW_32_BITS)
    return bits >> np.uint64(16)


def normal(plan: str, seed: int, stream: int, realization: int, count: int, realizations: int):
    """Standard normal numbers [count] of one member under a sampling plan."""
    if plan in ("random", "importance"):
        return ndtri(uniform(seed, stream, realization, count))
    if plan == "antithetic":
        odd = realization - (realization + 1) % 2
        sign = 1.0 if odd == realization else -1.0
        return sign * ndtri(uniform(seed, stream, odd, count))
    if plan == "latin_hypercube":
        return ndtri(latin_hypercube_uniform(seed, stream, realization, count, realizations))
    raise PostError(f"no sampling plan is called '{plan}' (known: {', '.join(PLANS)})")
