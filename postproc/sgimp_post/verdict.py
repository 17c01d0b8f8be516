"""The report in words: the answer, and what a reader must know before quoting it."""

from __future__ import annotations

import math

from .ensemble import RUNOUTS
from .fits import LAWS, rivals
from .law_choice import FEWEST_FOR_BOOTSTRAP, LawChoice
from .statistics import LEVEL


def verdict(summary: dict) -> list:
    """The answer in sentences: how many, how far, how sure, against what."""
    totals = summary["totals"]
    lines = [
        f"{totals['ok']} members ok, {totals['failed']} failed, {totals['unsettled']} not at rest"
        f" at the end, of {totals['planned']} planned."
    ]
    lines += _homogeneous_sentences(summary)
    for case in summary["cases"][:3] if len(summary["cases"]) <= 3 else []:
        lines.append(_case_sentence(case, summary))
    if len(summary["cases"]) > 3:
        lines.append(_study_sentence(summary))
    cost = summary["cost"]
    if cost["seconds"]["n"]:
        lines.append(
            f"Cost: {cost['seconds']['mean']:.2f} s a member,"
            f" {cost['core_hours']:.3g} core-hours in all."
        )
    return lines


def _homogeneous_sentences(summary: dict) -> list:
    name, floors = summary["primary"], summary["floors"]
    known = [f[name] for f in floors.values() if math.isfinite(f[name]["mean"])]
    if len(floors) > 1 and known:
        means, spreads = ([f[key] for f in known] for key in ("mean", "sd"))
        return [
            f"Homogeneous ground, {len(known)} cases: means from {min(means):.3f} m to"
            f" {max(means):.3f} m ({RUNOUTS[name]}), noise floors of {min(spreads):.3f} m to"
            f" {max(spreads):.3f} m."
        ]
    if not known:
        return []
    floor = known[0]
    line = f"Homogeneous ground: {floor['mean']:.3f} m ({RUNOUTS[name]})"
    if math.isfinite(floor["sd"]):
        line += (
            f", mean of {floor['n']} runs with a noise floor of {floor['sd']:.3f} m;"
            " the nominal run "
        )
        is_known = math.isfinite(floor["nominal"])
        line += f"alone gives {floor['nominal']:.3f} m" if is_known else "has no result"
    return [line + "."]


def _case_sentence(case: dict, summary: dict) -> str:
    runout, against = (case[key][summary["primary"]] for key in ("runouts", "against_floor"))
    weighted = next((w for w in summary["importance"] if w["label"] == case["label"]), None)
    if weighted:
        return _weighted_sentence(weighted)
    if runout["n"] == 0:
        return f"{case['label']}: no member has ended well yet."
    text = f"{case['label']}: mean {runout['mean']:.3f} m"
    if runout["n"] > 1:
        text += f" (95 %: {runout['mean_low']:.3f} to {runout['mean_high']:.3f})"
        text += f", sd {runout['sd']:.3f} m"
        if math.isfinite(against["noise_sd"]):
            text += f" beside a noise floor of {against['noise_sd']:.3f} m"
    share = against["exceedance"]
    if share["share"]["n"]:
        text += f"; {100 * share['share']['value']:.0f} % run farther than homogeneous ground"
        if math.isfinite(share["low"]):
            text += (
                f" (95 %: {100 * share['low']:.0f} to {100 * share['high']:.0f} %,"
                " with the doubt of that value)"
            )
    if case["best"]:
        text += f"; best law {LAWS[case['best']]}"
        if case["rivals"]:
            text += f", not told apart from {', '.join(LAWS[law] for law in case['rivals'])}"
        if case["law_is_refuted"]:
            text += ", but the members speak against it"
    return text + "."


def _weighted_sentence(weighted: dict) -> str:
    text = f"{weighted['label']}: {weighted['n']} weighted members"
    if not weighted["rows"]:
        return text + ", too few beyond any runout to tell its probability."
    row = min(weighted["rows"], key=lambda row: row["value"])
    return (
        f"{text}; P(runout > {row['threshold']:.3f} m) = {row['value']:.2g}"
        f" (95 %: {row['low']:.2g} to {row['high']:.2g})."
    )


def _study_sentence(summary: dict) -> str:
    name = summary["primary"]
    rows = [case for case in summary["cases"] if case["runouts"][name]["n"]]
    if summary["importance"]:
        return " ".join(_weighted_sentence(weighted) for weighted in summary["importance"][:3])
    if not rows:
        return "No heterogeneous member has ended well yet."
    means, spreads = ([case["runouts"][name][key] for case in rows] for key in ("mean", "sd"))
    shares = [case["exceedance"]["value"] for case in rows if case["exceedance"]["n"]]
    text = f"Heterogeneous ground, {len(rows)} cases:"
    text += f" means from {min(means):.3f} m to {max(means):.3f} m"
    known = [sd for sd in spreads if math.isfinite(sd)]
    if known:
        text += f", standard deviations from {min(known):.3f} m to {max(known):.3f} m"
    if shares:
        text += (
            f"; between {100 * min(shares):.0f} % and {100 * max(shares):.0f} % of the members run"
            " farther than homogeneous ground"
        )
    best = [case["best"] for case in rows if case["best"]]
    if best:
        counts = sorted(((best.count(law), LAWS[law]) for law in set(best)), reverse=True)
        text += "; best law " + ", ".join(f"{law} in {n}" for n, law in counts)
        refuted = sum(case["law_is_refuted"] for case in rows)
        if refuted:
            text += f" (in {refuted} of these cases the members speak against it)"
    return text + "."


def warnings(summary: dict) -> list:
    """What a reader must know before quoting a number."""
    totals, found = summary["totals"], []
    if not summary["complete"]:
        found.append(
            f"The run is {summary['state']}: statistics use the {totals['used']} members without a"
            " gap"
            f" from the first on, of {totals['done']} done."
        )
    if summary["sampling"] == "importance":
        found.append(
            "Importance sampling: members are drawn where the event is, not as often as nature"
            " draws them. Plain means, spreads, histograms and counts of such members mean nothing"
            " and are left out; what is told weighs each member."
        )
    elif line := dependence_sentence(summary["sampling"]):
        found.append(line + " Control variates are left out.")
    if summary["sampling"] == "antithetic":
        means = [
            f"{case['label']} {pair['mean']:.3f} m ({pair['mean_low']:.3f} to"
            f" {pair['mean_high']:.3f} m, {pair['n']} pairs)"
            for case in summary["cases"]
            if (pair := case["pairs_of_members"])["n"] > 1
        ]
        if means:
            found.append("Means with the interval of their mirrored pairs: " + "; ".join(means))
    if totals["unsettled"]:
        found.append(
            f"{totals['unsettled']} members were not at rest at end_time (`settle` is a share of"
            " their own largest kinetic energy); what still ran then makes a runout a lower bound."
        )
    if totals["wall_touched"]:
        found.append(
            f"{totals['wall_touched']} members touched a wall; it may have cut their runout short."
        )
    ended = [case["label"] for case in summary["cases"] if case["stop_rule_met"]]
    if ended:
        found.append(
            "The stop rule ended "
            + ", ".join(ended)
            + ": an interval that is looked at until it is"
            " short enough holds a little less often than it says."
        )
    name = summary["primary"]
    for label, floor in ((label, floor[name]) for label, floor in summary["floors"].items()):
        if not floor["nominal_is_outlier"]:
            continue
        which = "" if len(summary["floors"]) == 1 else f" of {label}"
        found.append(
            f"The nominal homogeneous run{which} ({floor['nominal']:.3f} m) lies far outside the"
            f" other {floor['others']['n']} ({floor['others']['mean']:.3f} ±"
            f" {floor['others']['sd']:.3f} m). It alone makes up most of the noise floor of"
            f" {floor['sd']:.3f} m: more homogeneous members (noise_members) are needed before a"
            " spread is called noise."
        )
    return found + _noise_warnings(summary)


def _noise_warnings(summary: dict) -> list:
    """What of the findings a single run would not show, and what of the spread is no soil."""
    name, found = summary["primary"], []
    shifts = {case["label"]: case["against_floor"][name]["shift"] for case in summary["cases"]}
    open_ = [label for label, shift in shifts.items() if shift["low"] <= 0.0 <= shift["high"]]
    if open_:
        found.append(
            "The mean is not told from that of homogeneous ground (95 %) in: "
            + _named(open_, summary)
            + "."
        )
    small = [
        case["label"]
        for case in summary["cases"]
        if case["shift_below_noise"] and case["label"] not in open_
    ]
    if small:
        found.append(
            "The mean is told from that of homogeneous ground, but differs by less than one run"
            " scatters by (the noise floor), in: " + _named(small, summary) + "."
        )
    pairs = [pair for pair in summary["pairs"] if pair["n"] and pair["by"] == "acf"]
    if pairs and all(pair["below_noise"] for pair in pairs):
        told = sum(pair["p_adjusted"] < LEVEL for pair in pairs)
        found.append(
            "All paired differences between autocorrelation functions are smaller than the noise"
            f" floor (largest {max(abs(pair['mean']) for pair in pairs):.3f} m against"
            f" {max(pair['noise'] for pair in pairs):.3f} m); {told} of {len(pairs)} are told from"
            " zero."
        )
    noisy = [case for case in summary["cases"] if case["noise_share"] > 0.5]
    if noisy:
        line = "More than half of the variance of the runout is discretisation noise in: " + _named(
            [case["label"] for case in noisy], summary
        )
        floors = [summary["floors"].get(case["noise_case"]) for case in noisy]
        if all(floor and floor[name]["nominal_is_outlier"] for floor in floors):
            share = max(
                (floor[name]["others"]["sd"] / case["runouts"][name]["sd"]) ** 2
                for floor, case in zip(floors, noisy)
            )
            line += f". Without the nominal homogeneous run it is at most {100.0 * share:.0f} %"
        found.append(line + ".")
    return found


def dependence_sentence(sampling: str) -> str:
    """Of a plan of members that depend on each other; '' for another."""
    if sampling not in ("antithetic", "latin_hypercube"):
        return ""
    return (
        f"The sampling plan is {sampling.replace('_', ' ')}: members are not independent, and the"
        " intervals and p values here, which take them to be, do not hold for means and exceedance"
        " (mostly they are too wide)."
    )


def _named(labels: list, summary: dict) -> str:
    """These cases; in one phrase if they are all."""
    count = len(summary["cases"])
    return f"all {count} cases" if len(labels) == count > 3 else ", ".join(labels)


def law_sentence(choice: LawChoice) -> str:
    """The chosen law and what is to be thought of it, in one sentence."""
    if not choice.law:
        return "No law could be fitted."
    best = next(fit for fit in choice.fits if fit.law == choice.law)
    text = f"{LAWS[best.law]} fits best (Akaike weight {best.weight:.2f}"
    if choice.wins:
        text += f", best in {100 * choice.wins[best.law]:.0f} % of the resamples"
    text += ")"
    close = rivals(choice.fits)
    if close:
        text += ", not told apart from " + ", ".join(LAWS[fit.law] for fit in close)
    if not choice.p_value:
        return text + f"; fewer than {FEWEST_FOR_BOOTSTRAP} members say no more."
    p = choice.p_value[best.law]
    passing = [LAWS[law] for law, value in choice.p_value.items() if value >= LEVEL]
    if not choice.is_refuted:
        return text + f"; the members do not speak against it (p = {p:.2g})."
    others = f"not against {', '.join(passing)}" if passing else "as against every other law here"
    return text + f"; but the members speak against it (p = {p:.2g}), {others}."
