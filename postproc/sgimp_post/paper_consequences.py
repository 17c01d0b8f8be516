"""Where the paper contradicts itself, and what follows from its numbers without its saying so: not
its statements, so they are listed and counted apart from those."""

from __future__ import annotations

import numpy as np
from scipy import stats

from .ensemble import RUNOUTS
from .fits import LAWS
from .paper import BLOCK, WALL, together, wall_runout, wave_speed
from .paper_verdicts import (
    DOES_NOT,
    NONE_YET,
    OPEN,
    REPRODUCES,
    Statement,
    floor_text,
    for_all,
    hundreds,
    is_as_printed,
    judge,
    rows_of,
    shown,
    spans,
)
from .printed import ACFS, BASELINE, COVS, MEANS, MEANS_PLACE, NUMBERS, TABLE_5
from .statistics import LEVEL, wilson


def statements(n: dict) -> list:
    """Of the numbers of `compare_with_paper`."""
    return [
        _count(n),
        _contradiction(n),
        _own_differences(n),
        _time_step(n),
        _as_printed(n),
        _spread_size(n),
        _luck_of_hundred(n),
        _wall(n),
    ]


def _count(n) -> Statement:
    rows = n["implied"]
    low, high = min(r["n_low"] for r in rows), max(r["n_high"] for r in rows)
    members = NUMBERS["members"].value
    return Statement(
        "count",
        "4.2; 4.2.2; Table 5",
        f"Each case has {members} realizations",
        {"": DOES_NOT if not low <= members <= high else REPRODUCES},
        f"BIC − AIC in each row of Table 5 says N = {low:.1f} to {high:.1f}",
        f"BIC − AIC = 2 ln N − 4; and {len(TABLE_5)} functions x {len(COVS)} COVs x {members} are"
        f" not the {NUMBERS['simulations'].value} of section 4.2.2",
    )


def _contradiction(n) -> Statement:
    printed, one = NUMBERS["exceeding"], NUMBERS["exceeding_smk"]
    own = {row["acf"]: row["exceedance"] for row in n["implied"]}
    texts = ", ".join(f"{acf.upper()} {100 * share:.0f} %" for acf, share in own.items())
    is_outside = not printed.low <= one.value <= printed.high
    agrees = all(printed.low <= share <= printed.high for share in own.values())
    return Statement(
        "contradiction",
        f"{printed.place}; {one.place}",
        "Section 4.2.1 (55 to 68 %) and Fig. 14 (39 % with SMK) speak of the same members",
        {"": DOES_NOT if is_outside else REPRODUCES},
        f"by the paper's own means, spreads and Gumbel's law: {texts}",
        f"39 % lies outside 55 to 68 %; the paper's own law {'agrees' if agrees else 'disagrees'}"
        " with the range, so that the 39 % is the odd one",
    )


def _own_differences(n) -> Statement:
    own = {row["acf"]: row for row in n["implied"]}
    top, bottom = max(MEANS, key=MEANS.get), min(MEANS, key=MEANS.get)
    size = MEANS[top] - MEANS[bottom]
    error = np.hypot(own[top]["mean_error"], own[bottom]["mean_error"])
    many = error * np.sqrt(own[top]["n"] / NUMBERS["members"].value)
    pairs = len(ACFS) * (len(ACFS) - 1) // 2
    needed = stats.norm.ppf(0.5 + 0.5 * together(pairs))
    return Statement(
        "own_differences",
        f"{MEANS_PLACE}; Table 5",
        "The paper's own members tell its functions apart",
        {"": REPRODUCES if size > needed * error else OPEN},
        f"{top.upper()} − {bottom.upper()} = {size:.2f} dm, {size / error:.1f} standard errors of"
        f" {error:.2f} dm with N = {own[top]['n']}; {size / many:.1f} with N = 1000",
        f"of the largest of {pairs} differences {needed:.1f} would be needed (Bonferroni); spreads"
        " from Table 5; unpaired, as nothing is said of common random numbers",
    )


def _time_step(n) -> Statement:
    cell, printed = NUMBERS["cell_size"].value, NUMBERS["time_step"].value
    limit = cell / wave_speed()
    own = n["settle_time"]["time_step"]
    ours = f"; mean step here {own:.2e} s" if np.isfinite(own) else ""
    return Statement(
        "time_step",
        NUMBERS["time_step"].place,
        "The time increment is 2.0e-2 s",
        {"": DOES_NOT if printed > limit else REPRODUCES},
        f"c = {wave_speed():.2f} m/s, cells of {cell:g} m: CFL {printed / limit:.1f}, limit"
        f" {limit:.1e} s{ours}",
        "an explicit scheme cannot be stable there; perhaps a printing interval, or another unit",
    )


def _as_printed(n) -> Statement:
    """The homogeneous column with the printed damping, from whichever run has it."""
    printed, numbers = NUMBERS["homogeneous"], "no run with it among those given"
    verdicts = dict.fromkeys(RUNOUTS, OPEN)
    for one in (n, *n["sensitivities"]):
        if is_as_printed(one["settings"]):
            verdicts = {
                name: judge(floor["mean_low"], floor["mean_high"], printed.low, printed.high)
                for name, floor in one["homogeneous"].items()
            }
            numbers = f"{floor_text(one['homogeneous'][n['runout']])}, {one['directory']}"
    return Statement(
        "as_printed",
        NUMBERS["damping"].place,
        f"With the damping coefficient {NUMBERS['damping'].value:g}, read as 1/s, the homogeneous"
        f" column runs out {printed.value:.2f} dm",
        verdicts,
        numbers,
        "1/s is its unit in Eq. 14; a column that falls far short of 60.03 dm says that it is"
        " another unit, or another equation",
    )


def _spread_size(n) -> Statement:
    own = {row["acf"]: row for row in n["implied"]}

    def verdict(row):
        printed = own[row["acf"]]
        return judge(
            row["together_sd_low"],
            row["together_sd_high"],
            printed["together_sd_low"],
            printed["together_sd_high"],
        )

    rows, numbers, why = rows_of(n, n["runout"], BASELINE), NONE_YET, ""
    if rows:
        numbers = f"dm: {spans(rows, 'sd', 'sd_low', 'sd_high', '.2f')}; printed " + ", ".join(
            f"{own[row['acf']]['s']:.2f}" for row in rows
        )
        ratios = [own[row["acf"]]["sd"] / row["sd"] for row in rows if row["sd"] > 0.0]
        if ratios:
            why = (
                f"theirs are {min(ratios):.1f} to {max(ratios):.1f} times ours; the noise floor"
                f" here is {shown(rows[0]['noise_sd'])} dm"
            )
    return Statement(
        "spread_size",
        "Table 5",
        "The AIC of the normal law tells a spread at the baseline of "
        f"{min(r['s'] for r in own.values()):.2f} to {max(r['s'] for r in own.values()):.2f} dm",
        {name: for_all(rows_of(n, name, BASELINE), verdict) for name in RUNOUTS},
        numbers,
        why or "AIC = N (ln 2πs² + 1) + 4",
    )


def _luck_of_hundred(n) -> Statement:
    """Members of the same ids are not independent, so whole tables count."""
    blocks, numbers, verdict = n["blocks"], NONE_YET, OPEN
    if blocks:
        wins = {law: sum(b["best"] == law for b in blocks) for law in LAWS}
        won = ", ".join(f"{LAWS[law]} {count}" for law, count in wins.items() if count)
        numbers = f"{len(blocks)} hundreds: {won}"
        by_acf = [sum(b["best"] == "gumbel" for b in blocks if b["acf"] == acf) for acf in ACFS]
        numbers += "; Gumbel by function: "
        numbers += ", ".join(
            f"{acf.upper()} {won_}/{sum(b['acf'] == acf for b in blocks)}"
            for acf, won_ in zip(ACFS, by_acf)
        )
        tables = hundreds(blocks)
        whole = sum(all(b["best"] == "gumbel" for b in table) for table in tables)
        share = wilson(whole, len(tables))
        if share.n:
            verdict = judge(share.low, share.high, 0.5, 1.0, (0.5, 0.5))
            numbers += f"; with all functions {whole} of {share.n} times, {100 * share.low:.0f} to"
            numbers += f" {100 * share.high:.0f} %"
    return Statement(
        "luck_of_hundred",
        "Table 5",
        f"Most tables of N = {BLOCK} tell Gumbel's law with every function",
        {n["runout"]: verdict},
        numbers,
        "the members in order of id, a hundred at a time, the same of all functions a table; the"
        " share of tables (Wilson) against a half",
    )


def _wall(n) -> Statement:
    """Refuted by runs that show it alone: pairs that are all equal, or all members of the study."""
    rows = rows_of(n, "runout_max")
    wall, printed = wall_runout(), NUMBERS["range"].value[1]
    numbers, verdict, beyond = NONE_YET, OPEN, 0
    if rows:
        beyond, members = sum(r["beyond_wall"] for r in rows), sum(r["n"] for r in rows)
        numbers = f"{beyond} of {members} members run {wall:.0f} dm or farther"
        numbers += f", the farthest {max(r['maximum'] for r in rows):.1f} dm"
        is_whole = n["state"] == "complete" and not n["missing"]
        verdict = DOES_NOT if is_whole and not beyond else OPEN
    found = [
        (s, row)
        for s in n["sensitivities"]
        if s["settings"]["x_max"] is not None and np.isclose(s["settings"]["x_max"], WALL)
        for row in s["rows"]
        if row["runout"] == n["runout"] and row["role"] == "study" and row["n"] > 1
    ]
    if found:
        cut = [row for _, row in found if row["shift"] < 0.0 and row["p_adjusted"] < LEVEL]
        equal = sum(row["is_equal"] for _, row in found)
        worst = max((row for _, row in found), key=lambda row: abs(row["shift"]))
        numbers += (
            f"; {found[0][0]['directory']}: {len(cut)} of {len(found)} cases cut, {equal} equal to"
            f" the last bit, largest shift {worst['shift']:+.2f} dm ({worst['shift_low']:+.2f} to"
            f" {worst['shift_high']:+.2f})"
        )
        if cut:
            verdict = REPRODUCES
        elif not beyond and equal == len(found) and found[0][0]["state"] == "complete":
            verdict = DOES_NOT
    return Statement(
        "wall",
        NUMBERS["nodes"].place,
        "The grid of 10170 nodes ends at 14 m: its wall cuts runouts short",
        {n["runout"]: verdict},
        numbers,
        f"the wall stands at {wall:.0f} dm and the printed runouts end at {printed:.0f} dm: with"
        " their spread it may have cut some, with ours it is not reached"
        if verdict == DOES_NOT
        else f"the wall stands at {wall:.0f} dm, the printed runouts end at {printed:.0f} dm",
    )
