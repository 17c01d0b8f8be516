"""What the paper says of runouts (sections 4.1 to 4.2.2 and 5), each statement with its verdict."""

from __future__ import annotations

import numpy as np

from .ensemble import RUNOUTS
from .paper import BLOCK, NO_SHARE
from .paper_verdicts import (
    DOES_NOT,
    NO_SHIFT,
    NONE_YET,
    OPEN,
    REPRODUCES,
    Statement,
    damping_text,
    direction,
    floor_text,
    for_all,
    hundreds,
    is_as_printed,
    is_complete,
    judge,
    of_all,
    rows_of,
    shares,
    shown,
    spans,
)
from .printed import ACFS, BASELINE, COVS, MEANS, MEANS_PLACE, MEANS_ROUNDING, NUMBERS
from .statistics import LEVEL

#: Fewest tables of a hundred members each that say how far the ends of a range scatter.
_FEWEST_TABLES = 5


def statements(n: dict) -> list:
    """Of the numbers of `compare_with_paper`."""
    return [
        _homogeneous(n),
        *(_underestimate(n, cov) for cov in COVS),
        _shift_size(n),
        _exceeding(n),
        _one_share(n, "exceeding_smk", "smk", 0.05),
        _one_share(n, "exceeding_csx", "csx", 0.15),
        *(_largest_function(n, cov) for cov in COVS),
        _size_between_functions(n),
        *(_functions_differ(n, cov) for cov in COVS),
        _mean_grows(n),
        _spread_grows(n),
        _range(n),
        _rest(n),
        _fronts(n),
    ]


def _homogeneous(n) -> Statement:
    printed = NUMBERS["homogeneous"]
    if is_as_printed(n["settings"]):
        verdicts = {
            name: judge(f["mean_low"], f["mean_high"], printed.low, printed.high)
            for name, f in n["homogeneous"].items()
        }
        why = "the damping is the printed one"
    else:
        verdicts = {"": OPEN}
        why = (
            "the damping is not the printed one but was chosen so that the farthest point comes"
            " near the printed runout: no test, whatever comes out"
        )
    return Statement(
        "homogeneous",
        printed.place,
        "The homogeneous column runs out 60.03 dm",
        verdicts,
        f"{floor_text(n['homogeneous'][n['runout']])}, {damping_text(n['settings'])}",
        why,
    )


def _underestimate(n, cov) -> Statement:
    def verdict(row):
        return judge(row["together_shift_low"], row["together_shift_high"], 0.0, np.inf, NO_SHIFT)

    verdicts = {name: for_all(rows_of(n, name, cov), verdict) for name in RUNOUTS}
    rows = rows_of(n, n["runout"], cov)
    numbers, why = NONE_YET, "all functions together; shift of the mean against homogeneous runs"
    if rows:
        numbers = (
            f"mean less homogeneous mean, dm: {spans(rows, 'shift', 'shift_low', 'shift_high')}"
        )
        largest, noise = max(abs(row["shift"]) for row in rows), rows[0]["noise_sd"]
        if np.isfinite([largest, noise]).all():
            side = "less" if largest < noise else "more"
            why = (
                f"the largest shift, {largest:.2f} dm, is {side} than one run scatters by"
                f" ({noise:.2f} dm, the noise floor), but a mean is judged by its own interval;"
                " that has the doubt of the homogeneous mean in it, which all functions share"
            )
    return Statement(
        f"underestimate_{cov:.2f}",
        "4.2.1; 4.2.2, Fig. 13; 5",
        f"The deterministic run underestimates the runout: every mean is larger, COV {cov:.2f}",
        verdicts,
        numbers,
        why,
    )


def _shift_size(n) -> Statement:
    base = NUMBERS["homogeneous"]
    rounding = MEANS_ROUNDING + base.rounding

    def verdict(row):
        size = MEANS[row["acf"]] - base.value
        return judge(
            row["together_shift_low"],
            row["together_shift_high"],
            size - rounding,
            size + rounding,
            NO_SHIFT,
        )

    rows = rows_of(n, n["runout"], BASELINE)
    numbers, sizes = NONE_YET, [mean - base.value for mean in MEANS.values()]
    if rows:
        least, most = (shown(f(row["shift"] for row in rows), "+.2f") for f in (min, max))
        reach = shown(max(row["together_shift_high"] for row in rows), "+.2f")
        numbers = f"{least} to {most} dm; no interval beyond {reach} dm"
    return Statement(
        "shift_size",
        MEANS_PLACE,
        f"and by {min(sizes):.2f} to {max(sizes):.2f} dm at COV {BASELINE:.2f}",
        {name: for_all(rows_of(n, name, BASELINE), verdict) for name in RUNOUTS},
        numbers,
        f"the printed mean less {base.value:.2f} dm, function by function",
    )


def _exceeding(n) -> Statement:
    printed = NUMBERS["exceeding"]

    def verdict(row):
        return judge(
            row["together_share_low"],
            row["together_share_high"],
            printed.low,
            printed.high,
            NO_SHARE,
        )

    rows = rows_of(n, n["runout"], BASELINE)
    return Statement(
        "exceeding",
        printed.place,
        "Between 55 and 68 % run farther than the deterministic column",
        {name: for_all(rows_of(n, name, BASELINE), verdict) for name in RUNOUTS},
        shares(rows) if rows else NONE_YET,
        "intervals with both doubts, of the share and of the deterministic value; no effect is"
        f" {100 * NO_SHARE[0]:.0f} % (Gumbel) to 50 % (symmetric)",
    )


def _one_share(n, key, acf, cov) -> Statement:
    printed = NUMBERS[key]
    found = {name: [r for r in rows_of(n, name, cov) if r["acf"] == acf] for name in RUNOUTS}
    rows = found[n["runout"]]
    numbers, why = NONE_YET, "a single deterministic run is a draw, and so is a share against it"
    if rows:
        alone = rows[0]["share_above_nominal"]
        numbers = f"{shares(rows)}; against the nominal run alone {shown(100 * alone, '.0f')} %"
        moved = abs(alone - rows[0]["share"])
        if np.isfinite(moved):
            why += f": here it moves the share by {100 * moved:.0f} points"
    return Statement(
        key,
        printed.place,
        f"{100 * printed.value:.0f} % exceed it with {acf.upper()} at COV {cov:.2f}",
        {
            name: of_all(
                judge(row["share_low"], row["share_high"], printed.low, printed.high, NO_SHARE)
                for row in rows_
            )
            for name, rows_ in found.items()
        },
        numbers,
        why,
    )


def _acf_pairs(n, runout, cov) -> list:
    return [
        row
        for row in n["pairs"]
        if row["runout"] == runout
        and row["by"] == "acf"
        and row["n"] > 1
        and np.isclose(row["cov"], cov)
    ]


def _against(rows, acf) -> list:
    """(other function, difference, low, high, p adjusted) of `acf` less each other one."""
    found = []
    for row in rows:
        if acf not in (row["acf"], row["other_acf"]):
            continue
        if row["acf"] == acf:
            ends = (row["mean"], row["low"], row["high"])
        else:
            ends = (-row["mean"], -row["high"], -row["low"])
        other = row["other_acf"] if row["acf"] == acf else row["acf"]
        found.append((other, *ends, row["p_adjusted"]))
    return found


def _largest_function(n, cov) -> Statement:
    top = max(MEANS, key=MEANS.get)
    verdicts = {}
    for name in RUNOUTS:
        found = _against(_acf_pairs(n, name, cov), top)
        got = of_all(direction(mean, p) for _, mean, _, _, p in found)
        is_whole = len(found) == len(ACFS) - 1
        verdicts[name] = OPEN if got == REPRODUCES and not is_whole else got
    found = _against(_acf_pairs(n, n["runout"], cov), top)
    texts = [
        f"less {other.upper()} {mean:+.2f} dm ({low:+.2f} to {high:+.2f})"
        for other, mean, low, high, _ in found
    ]
    return Statement(
        f"largest_function_{cov:.2f}",
        "4.2.1, Figs. 11 and 12; 5",
        f"{top.upper()} gives the largest runouts of all functions, COV {cov:.2f}",
        verdicts,
        f"{top.upper()} {'; '.join(texts)}" if texts else NONE_YET,
        "member by member on the same random numbers; p adjusted among all pairs (Holm)",
    )


def _size_between_functions(n) -> Statement:
    top, bottom = max(MEANS, key=MEANS.get), min(MEANS, key=MEANS.get)
    size, rounding = MEANS[top] - MEANS[bottom], 2.0 * MEANS_ROUNDING
    verdicts, numbers = {}, NONE_YET
    for name in RUNOUTS:
        found = {row[0]: row for row in _against(_acf_pairs(n, name, BASELINE), top)}
        _, mean, low, high, _ = found.get(bottom, ("", *[np.nan] * 4))
        verdicts[name] = judge(low, high, size - rounding, size + rounding, NO_SHIFT)
        if name == n["runout"] and bottom in found:
            numbers = f"{mean:+.2f} dm ({low:+.2f} to {high:+.2f})"
    return Statement(
        "size_between_functions",
        MEANS_PLACE,
        f"and {size:.2f} dm more than {bottom.upper()}, the least one",
        verdicts,
        numbers,
        "paired, 95 %",
    )


def _functions_differ(n, cov) -> Statement:
    """Of enough members any two functions differ: a difference counts unless it is known to be
    less than half of the largest printed one."""
    size = 0.5 * (max(MEANS.values()) - min(MEANS.values()))

    def reach_of(row):
        return max(abs(row["together_low"]), abs(row["together_high"]))

    def verdict(rows):
        counting = [row for row in rows if not reach_of(row) < size]
        if any(row["p_adjusted"] < LEVEL for row in counting):
            return REPRODUCES
        is_whole = len(rows) == len(ACFS) * (len(ACFS) - 1) // 2
        return DOES_NOT if is_whole and not counting else OPEN

    verdicts = {name: verdict(_acf_pairs(n, name, cov)) for name in RUNOUTS}
    rows, numbers, why = _acf_pairs(n, n["runout"], cov), NONE_YET, ""
    if rows:
        found = [row for row in rows if row["p_adjusted"] < LEVEL]
        largest = max(rows, key=lambda row: abs(row["mean"]))
        reach = max(reach_of(row) for row in rows)
        numbers = (
            f"{len(found)} of {len(rows)} pairs told apart; largest {largest['acf'].upper()} −"
            f" {largest['other_acf'].upper()} {largest['mean']:+.2f} dm ({largest['low']:+.2f} to"
            f" {largest['high']:+.2f})"
        )
        below = sum(row["below_noise"] for row in rows)
        why = (
            f"no interval, all at once, goes beyond {reach:.2f} dm; a difference counts unless it"
            f" is known to be less than {size:.2f} dm, half of the largest printed one; {below} of"
            f" {len(rows)} are less than one run scatters by"
        )
    return Statement(
        f"functions_differ_{cov:.2f}",
        "4.2.1, Fig. 12; 4.2.2; 5",
        f"The functions give dissimilar mean runouts, COV {cov:.2f}",
        verdicts,
        numbers,
        why or "paired, p adjusted among all pairs (Holm)",
    )


def _mean_grows(n) -> Statement:
    def steps(name):
        return [
            row
            for row in n["pairs"]
            if row["runout"] == name and row["by"] == "cov" and row["n"] > 1 and _is_step(row)
        ]

    verdicts = {}
    for name in RUNOUTS:
        rows = steps(name)
        got = of_all(direction(row["mean"], row["p_adjusted"]) for row in rows)
        is_whole = len(rows) == len(ACFS) * (len(COVS) - 1)
        verdicts[name] = OPEN if got == REPRODUCES and not is_whole else got
    rows, numbers = steps(n["runout"]), NONE_YET
    if rows:
        kinds = [direction(row["mean"], row["p_adjusted"]) for row in rows]
        numbers = (
            f"{kinds.count(REPRODUCES)} of {len(rows)} steps up, {kinds.count(DOES_NOT)} down,"
            f" {kinds.count(OPEN)} open; from {min(row['mean'] for row in rows):+.2f} to"
            f" {max(row['mean'] for row in rows):+.2f} dm a step"
        )
    return Statement(
        "mean_grows",
        "4.2.2, Fig. 13",
        "Every mean grows with the COV",
        verdicts,
        numbers,
        "0.05 to 0.10 and 0.10 to 0.15, paired; p adjusted among all pairs (Holm)",
    )


def _is_step(row) -> bool:
    """From one coefficient of variation of the paper to the next."""
    small, large = (int(np.argmin(np.abs(np.subtract(COVS, row[k])))) for k in ("other_cov", "cov"))
    return large == small + 1


def _spread_grows(n) -> Statement:
    def verdict_of(rows):
        got = of_all(
            direction(row["sd_large"] - row["sd_small"], row["p_adjusted"]) for row in rows
        )
        is_whole = len(rows) == len(ACFS) * (len(COVS) - 1)
        return OPEN if got == REPRODUCES and not is_whole else got

    rows = [row for row in n["spreads"] if row["runout"] == n["runout"] and row["n"] > 1]
    numbers = NONE_YET
    if rows:
        kinds = [direction(row["sd_large"] - row["sd_small"], row["p_adjusted"]) for row in rows]
        ratios = [row["sd_large"] / row["sd_small"] for row in rows if row["sd_small"] > 0.0]
        numbers = (
            f"{kinds.count(REPRODUCES)} of {len(rows)} steps up, {kinds.count(DOES_NOT)} down,"
            f" {kinds.count(OPEN)} open"
        )
        if ratios:
            numbers += f"; factors {min(ratios):.2f} to {max(ratios):.2f} a step"
    return Statement(
        "spread_grows",
        "4.2.2, Fig. 13; 5",
        "The standard deviation grows with the COV",
        {
            name: verdict_of([r for r in n["spreads"] if r["runout"] == name and r["n"] > 1])
            for name in RUNOUTS
        },
        numbers,
        "paired test of the distances from the medians (Grambsch 1994); p adjusted (Holm)",
    )


def _range(n) -> Statement:
    """Each end against those of as many members as Table 5 tells of, and of all: extremes grow with
    the number of members, which the paper leaves open."""
    printed, rows, numbers, verdict = NUMBERS["range"], rows_of(n, n["runout"], BASELINE), "", OPEN
    tables = [
        (min(b["minimum"] for b in table), max(b["maximum"] for b in table))
        for table in hundreds(n["blocks"])
    ]
    if rows:
        whole = min(r["minimum"] for r in rows), max(r["maximum"] for r in rows)
        numbers = f"{whole[0]:.1f} to {whole[1]:.1f} dm, {sum(r['n'] for r in rows)} members"
        if len(tables) >= _FEWEST_TABLES and is_complete(rows):
            ends = np.array([*tables, whole])
            verdict = of_all(
                judge(*span, end - printed.rounding, end + printed.rounding)
                for end, span in zip(printed.value, zip(ends.min(axis=0), ends.max(axis=0)))
            )
            widths = [high - low for low, high in tables]
            numbers += f"; {len(tables)} times {len(ACFS)} x {BLOCK} members: {min(widths):.1f} to"
            numbers += f" {max(widths):.1f} dm wide"
    wide = rows_of(n, n["runout"])
    if wide:
        numbers += f"; all COVs {min(r['minimum'] for r in wide):.1f} to"
        numbers += f" {max(r['maximum'] for r in wide):.1f} dm"
    return Statement(
        "range",
        printed.place,
        "Runouts at the baseline lie between 57 and 89 dm",
        {n["runout"]: verdict},
        numbers or NONE_YET,
        "each end against those of hundreds of members of each function, and of all",
    )


def _rest(n) -> Statement:
    printed, own = NUMBERS["rest"], n["settle_time"]
    numbers = "no homogeneous run at rest"
    if own["n"]:
        numbers = f"{own['mean']:.2f} s"
        if own["n"] > 1:
            numbers += f" ({own['mean_low']:.2f} to {own['mean_high']:.2f}; {own['n']} runs)"
    verdict = judge(own["mean_low"], own["mean_high"], printed.low, np.inf)
    if own["mean_low"] > printed.high:
        verdict = OPEN
    return Statement(
        "rest",
        printed.place,
        "The homogeneous column is stable at 4.2 s",
        {"": verdict},
        f"{numbers}, {damping_text(n['settings'])}",
        "here the kinetic energy stays below a share of its peak (`settle`), there it is not said"
        " below which: later in this sense may be in time by the eye, earlier is earlier",
    )


def _fronts(n) -> Statement:
    """Of drawn members, each of which is one of many: both ends within the usual ones."""
    rows, printed = [row for row in n["fronts"] if row["n"]], NUMBERS["fronts"]
    numbers, verdict, reached = NONE_YET, OPEN, ""
    if rows:
        low, high = min(r["p05"] for r in rows), max(r["p95"] for r in rows)
        ones = [r["member_1"] for r in rows if np.isfinite(r["member_1"])]
        numbers = f"90 % of members between {shown(low, '.1f')} and {shown(high, '.1f')} dm from"
        numbers += " the left wall"
        if ones:
            numbers += f"; members 1: {min(ones):.1f} to {max(ones):.1f} dm"
        verdict = of_all(judge(low, high, end, end) for end in printed.value)
        farthest = shown(max(r["farthest"] for r in rows), ".1f")
        reached = f"the farthest of {sum(r['n'] for r in rows)} members ends at {farthest} dm; "
    return Statement(
        "fronts",
        printed.place,
        'Deposits end between "about 110 dm to over 120 dm"',
        {"": verdict},
        numbers,
        f"{reached}either way runouts of some 60 dm are measured from the initial toe at 50 dm",
    )
