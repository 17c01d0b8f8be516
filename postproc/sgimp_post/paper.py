"""The numbers beside the paper's: what its own numbers imply, and what the members of a run say to
each. Runouts in dm, as there, since a likelihood depends on the unit of its values."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
from scipy import integrate, stats

from .analysis import analyse
from .autocorrelation import Correlation, rho
from .diff import compare_runs, has_same_numbers
from .ensemble import RUNOUTS, Ensemble
from .errors import PostError
from .fits import PARAMETERS, best_fit, fit_laws
from .law_choice import choose_law
from .namelist import by_key, differing_keys, read_namelist, resolved_text
from .noise_floor import noise_floor
from .pairs import paired_experiments, paired_values
from .printed import ACFS, BASELINE, COVS, MEANS, NUMBERS, TABLE_5, TABLE_5_ROUNDING
from .statistics import (
    CONFIDENCE,
    LEVEL,
    describe,
    holm,
    paired_difference,
    probability_above,
    probability_above_mean,
    sd_error,
    sd_interval,
    variance_ratio,
    welch_difference,
)
from .two_samples import compare

DECIMETRES = 10.0
#: Where the grid of 10170 nodes ends, in m: 113 x 45 x 2 nodes of 0.125 m are 14 m x 5.5 m.
WALL = 14.0
#: Members behind each row of Table 5, as BIC - AIC tells.
BLOCK = 100
#: Bootstrap samples of the test whether runouts can be of a law.
_SAMPLES = 500
#: Kurtosis of Gumbel's law, which the paper finds, for the doubt of its standard deviations.
_GUMBEL_KURTOSIS = 5.4
#: P(S > its mean) without any effect: half of a symmetric law, less of Gumbel's.
NO_SHARE = (1.0 - float(np.exp(-np.exp(-np.euler_gamma))), 0.5)
#: Keys in which runs may differ without another result.
_IDLE_GROUPS = ("case", "output", "study")
_IDLE_KEYS = ("monte_carlo(1)%realizations", "monte_carlo(1)%noise_members")


def together(count: int) -> float:
    """Level at which `count` intervals hold CONFIDENCE all at once (Bonferroni)."""
    return 1.0 - (1.0 - CONFIDENCE) / count


def in_decimetres(ensemble: Ensemble) -> Ensemble:
    """The same run with its runouts in dm."""
    cases = [
        replace(
            case,
            columns={
                name: values * DECIMETRES if name in RUNOUTS else values
                for name, values in case.columns.items()
            },
        )
        for case in ensemble.cases
    ]
    return replace(ensemble, cases=cases)


def compare_with_paper(ensemble: Ensemble, others: list, name: str) -> dict:
    """All numbers of a run (runouts in dm) by the runout `name`, where not by all four; `others`:
    runs that differ from it in what they are called for."""
    for one in (ensemble, *others):
        if one.is_weighted:
            raise PostError(
                f"{one.directory}: sampling='importance': members have weights, and the paper's"
                " plain means and shares have no counterpart"
            )
    summary = analyse(ensemble, name)
    cases = paper_cases(ensemble)
    if any(case.varied for case in cases):
        raise PostError(
            f"{ensemble.directory}: the study varies other keys than acf and cov, so that its cases"
            " are not the paper's one by one"
        )
    known = {case.label: case for case in ensemble.for_statistics()}
    homogeneous = {case.label: known.get(case.noise_case) for case in cases}
    baseline = [case for case in cases if is_baseline(case)]
    there = {(case.acf, round(case.cov, 6)) for case in cases if len(case.values(name))}
    return {
        "runout": name,
        "unit": "dm",
        "directory": ensemble.directory.name,
        "state": ensemble.state,
        "totals": summary["totals"],
        "sampling": summary["sampling"],
        "settings": settings(ensemble),
        "missing": [
            f"{acf} at COV {cov:.2f}" for acf in ACFS for cov in COVS if (acf, cov) not in there
        ],
        "homogeneous": summary["deterministic"],
        "settle_time": _settle_time(ensemble, summary),
        "seconds": summary["cost"]["seconds"],
        "cases": [
            _row(case, homogeneous[case.label], word, together(len(_at(cases, case.cov))))
            for case in cases
            for word in RUNOUTS
        ],
        "clipped": _clipped(summary, cases),
        "pairs": [row for word in RUNOUTS for row in _pairs(cases, homogeneous, word)],
        "spreads": [row for word in RUNOUTS for row in _spreads(cases, word)],
        "implied": implied(),
        "table_5": [row for case in baseline for row in table_5_rows(case.acf, case.values(name))],
        "laws": [_laws(case, name) for case in baseline if len(case.values(name))],
        "blocks": [row for case in baseline for row in block_winners(case.acf, case.values(name))],
        "convergence": [
            {"acf": case.acf, **convergence(case.values(name), together(2 * len(baseline)))}
            for case in baseline
            if len(case.values(name)) > 1
        ],
        "fronts": _fronts(baseline, ensemble.geometry.toe),
        "shapes": shapes(),
        "sensitivities": [_sensitivity(ensemble, one) for one in others],
    }


def paper_cases(ensemble: Ensemble) -> list:
    """The study cases of the paper's functions and coefficients of variation, in its order."""
    found = [
        case
        for case in ensemble.for_statistics()
        if case.role == "study" and case.acf in ACFS and np.isclose(COVS, case.cov).any()
    ]
    return sorted(found, key=lambda case: (round(case.cov, 6), ACFS.index(case.acf)))


def is_baseline(case) -> bool:
    return bool(np.isclose(case.cov, BASELINE))


def _at(cases, cov) -> list:
    return [case for case in cases if np.isclose(case.cov, cov)]


def settings(ensemble: Ensemble) -> dict:
    """Keys of the run that the paper leaves open or prints; None where its namelist is silent."""
    keys = by_key(read_namelist(*resolved_text(ensemble)))
    wanted = {
        "grid": ("x_max", "y_max", "cell_size"),
        "material": ("cohesion", "dilation_angle", "tension_strength"),
        "loading": ("damping", "initial_stress"),
        "solver": ("weighting", "scheme", "precision", "cfl", "end_time", "settle"),
        "random_field": ("averaging", "lower", "upper", "scale_x", "scale_y"),
        "monte_carlo": ("realizations", "noise_members", "seed"),
    }
    found = {key: keys.get(f"{group}(1)%{key}") for group, names in wanted.items() for key in names}
    return {**found, "point_spacing": ensemble.geometry.point_spacing}


def wave_speed() -> float:
    """Of compression waves in m/s, of the printed sand, laterally confined."""
    young, poisson, density = (NUMBERS[key].value for key in ("young", "poisson", "density"))
    return float(np.sqrt(young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson) * density)))


# What the paper's own numbers imply


def implied_count(aic: float, bic: float):
    """(N, low, high) of BIC - AIC = k ln N - 2 k, both numbers rounded."""
    at = np.array([0.0, -2.0, 2.0]) * TABLE_5_ROUNDING + bic - aic
    return tuple(float(n) for n in np.exp(at / PARAMETERS + 2.0))


def implied_sd(aic: float, n: float) -> float:
    """Standard deviation (over n) of the values whose normal law has this AIC: AIC = n (ln(2 pi
    s^2) + 1) + 2 k."""
    return float(np.exp(0.5 * ((aic - 2.0 * PARAMETERS) / n - 1.0 - np.log(2.0 * np.pi))))


def implied() -> list:
    """Of each row of Table 5: N; `s`, the standard deviation over N, and `sd`, over N - 1, with the
    interval that so many values of Gumbel's law give it (Bonett), alone and `together_` with the
    other rows; P(S > 60.03 dm) by Gumbel's law of that mean and spread."""
    found = []
    for acf, laws in TABLE_5.items():
        counts = [implied_count(*pair) for pair in laws.values()]
        n = round(counts[0][0])
        s = implied_sd(laws["normal"][0], n)
        sd = s * np.sqrt(n / (n - 1.0))
        c, error = sd_error(n, _GUMBEL_KURTOSIS)
        ends = {
            f"{word}sd_{end}": float(
                sd * np.sqrt(c) * np.exp(0.5 * sign * stats.norm.ppf(0.5 + 0.5 * level) * error)
            )
            for word, level in (("", CONFIDENCE), ("together_", together(len(TABLE_5))))
            for end, sign in (("low", -1.0), ("high", 1.0))
        }
        found.append(
            {
                "acf": acf,
                "n": n,
                "n_low": min(low for _, low, _ in counts),
                "n_high": max(high for _, _, high in counts),
                "mean": MEANS[acf],
                "mean_error": float(sd / np.sqrt(n)),
                "s": s,
                "sd": float(sd),
                **ends,
                "exceedance": float(gumbel_of(MEANS[acf], sd).sf(NUMBERS["homogeneous"].value)),
            }
        )
    return found


def gumbel_of(mean: float, sd: float):
    """Gumbel's law with these moments (Eqs. 18 and 19)."""
    scale = sd * np.sqrt(6.0) / np.pi
    return stats.gumbel_r(mean - np.euler_gamma * scale, scale)


# What the members say


def _row(case, homogeneous, name: str, level: float) -> dict:
    """Of a case and a runout. `together_`: intervals of that level, which hold for all functions at
    once, as a statement about all of them needs."""
    values = case.values(name)
    noise = np.array([]) if homogeneous is None else homogeneous.values(name)
    own, all_sds = describe(values), sd_interval(values, level)
    shift, all_shifts = (welch_difference(values, noise, c) for c in (CONFIDENCE, level))
    share, all_shares = (probability_above_mean(values, noise, c) for c in (CONFIDENCE, level))
    floor = noise_floor(homogeneous)[name]
    above = probability_above(values, floor["nominal"])
    return {
        "case": case.label,
        "acf": case.acf,
        "cov": case.cov,
        "is_baseline": is_baseline(case),
        "runout": name,
        "n": own.n,
        **{key: getattr(own, key) for key in ("mean", "mean_low", "mean_high")},
        **{key: getattr(own, key) for key in ("sd", "sd_low", "sd_high", "minimum", "maximum")},
        "together_sd_low": all_sds[0],
        "together_sd_high": all_sds[1],
        "noise_sd": floor["sd"],
        "shift": shift.mean,
        "shift_low": shift.low,
        "shift_high": shift.high,
        "together_shift_low": all_shifts.low,
        "together_shift_high": all_shifts.high,
        "share": share.share.value,
        "wilson_low": share.share.low,
        "wilson_high": share.share.high,
        "share_low": share.low,
        "share_high": share.high,
        "together_share_low": all_shares.low,
        "together_share_high": all_shares.high,
        "share_above_nominal": above.value,
        "beyond_wall": int(np.count_nonzero(values >= wall_runout())),
    }


def wall_runout() -> float:
    """Runout in dm at which the wall of the grid of 10170 nodes stands."""
    return DECIMETRES * (WALL - NUMBERS["width"].value)


def _pairs(cases, homogeneous, name: str) -> list:
    """Paired differences of functions at each coefficient of variation, and of neighbouring
    coefficients of each function; p adjusted among those of a kind (Holm). `together_`: intervals
    that hold for all pairs of functions of a coefficient at once."""
    noise = {label: noise_floor(case)[name]["sd"] for label, case in homogeneous.items()}
    by_label = {case.label: case for case in cases}
    level = together(len(ACFS) * (len(ACFS) - 1) // 2)
    found = []
    for row in paired_experiments(cases, name, noise):
        first, second = by_label[row["first"]], by_label[row["second"]]
        if row["by"] == "cov":  # the larger less the smaller
            row.update(
                first=second.label,
                second=first.label,
                mean=-row["mean"],
                low=-row["high"],
                high=-row["low"],
            )
        wide = paired_difference(*paired_values(first, second, name), level)
        found.append(
            {
                "runout": name,
                "acf": first.acf,
                "other_acf": second.acf,
                "cov": max(first.cov, second.cov),
                "other_cov": min(first.cov, second.cov),
                **row,
                "together_low": wide.low,
                "together_high": wide.high,
            }
        )
    return found


def _spreads(cases, name: str) -> list:
    """Does the spread grow with the coefficient of variation? Paired by id; p adjusted (Holm)."""
    found = []
    for acf in ACFS:
        own = [case for case in cases if case.acf == acf]
        for small, large in zip(own, own[1:]):
            got = compare(*paired_values(small, large, name), True, None, 0)
            found.append(
                {
                    "runout": name,
                    "acf": acf,
                    "small": small.cov,
                    "large": large.cov,
                    "n": got.n_first,
                    "sd_small": got.sd_first,
                    "sd_large": got.sd_second,
                    "p_value": got.spread_p,
                }
            )
    for row, adjusted in zip(found, holm([row["p_value"] for row in found])):
        row["p_adjusted"] = float(adjusted)
    return found


def table_5_rows(acf: str, values) -> list:
    """AIC and BIC of the four laws, of the first members, as many as Table 5 has, and of all,
    beside those printed."""
    found = []
    for sample in dict.fromkeys((min(BLOCK, len(values)), len(values))):
        fits = fit_laws(values[:sample])
        best = best_fit(fits)
        for fit in fits:
            aic, bic = TABLE_5[acf][fit.law]
            found.append(
                {
                    "acf": acf,
                    "law": fit.law,
                    "n": fit.n,
                    "aic": fit.aic,
                    "bic": fit.bic,
                    "delta_aic": fit.delta_aic,
                    "is_best": bool(best and best.law == fit.law),
                    "printed_aic": aic,
                    "printed_bic": bic,
                    "printed_delta_aic": aic - min(pair[0] for pair in TABLE_5[acf].values()),
                }
            )
    return found


def _laws(case, name: str) -> dict:
    """Best law of all members, by how much, and the p value of each law against them; `least_p` is
    the least that so many samples can give."""
    choice = choose_law(case.values(name), _SAMPLES, np.random.default_rng(case.order))
    return {
        "acf": case.acf,
        "n": choice.fits[0].n,
        "best": choice.law,
        "delta_aic": {fit.law: fit.delta_aic for fit in choice.fits},
        "p_value": choice.p_value,
        "least_p": 1.0 / (1.0 + _SAMPLES),
        "none_fits": bool(choice.is_refuted and max(choice.p_value.values()) < LEVEL),
    }


def block_winners(acf: str, values) -> list:
    """The best law of each hundred members in order of id, with its lead over Gumbel's."""
    found = []
    for k in range(len(values) // BLOCK):
        block = values[k * BLOCK : (k + 1) * BLOCK]
        fits = fit_laws(block)
        best = best_fit(fits)
        if not best:
            continue
        gumbel = next(fit for fit in fits if fit.law == "gumbel")
        found.append(
            {
                "acf": acf,
                "block": k + 1,
                "first": k * BLOCK + 1,
                "last": (k + 1) * BLOCK,
                "best": best.law,
                "gumbel_delta_aic": gumbel.delta_aic,
                "sd": float(np.std(block, ddof=1)),
                "minimum": float(block.min()),
                "maximum": float(block.max()),
                **{f"aic_over_gumbel_{fit.law}": fit.aic - gumbel.aic for fit in fits},
            }
        )
    return found


def convergence(values, level: float = CONFIDENCE) -> dict:
    """Mean and spread after the paper's 700 members and after all, and those of the later members
    against the first 700, with intervals of that level; the first member at which its rule holds
    (mean and variance both change by less than 1e-3, in dm and dm^2), and how well the mean is
    known there. NaN where there are not so many."""
    early, final = NUMBERS["converged"].value, describe(values)
    first, later = values[:early] if len(values) > early else [], values[early:]
    then, shift = describe(first), welch_difference(later, first, level)
    ratio = variance_ratio(later, first, level)
    count = np.arange(1, len(values) + 1)
    mean = np.cumsum(values) / count
    squares = np.cumsum((values - values.mean()) ** 2) / count
    variance = (squares - (mean - values.mean()) ** 2)[1:] * count[1:] / (count[1:] - 1.0)
    tolerance = NUMBERS["tolerance"].value
    is_met = (np.abs(np.diff(mean[1:])) < tolerance) & (np.abs(np.diff(variance)) < tolerance)
    met = int(np.argmax(is_met)) + 3 if is_met.any() else 0
    stopped = describe(values[:met])
    return {
        "n": final.n,
        "mean": final.mean,
        "half_width": final.half_width,
        "sd": final.sd,
        "sd_low": final.sd_low,
        "sd_high": final.sd_high,
        "early_n": then.n,
        "early_mean": then.mean,
        "early_half_width": then.half_width,
        "early_sd": then.sd,
        "early_sd_low": then.sd_low,
        "early_sd_high": then.sd_high,
        "later_n": len(later),
        "later_shift": shift.mean,
        "later_shift_low": shift.low,
        "later_shift_high": shift.high,
        "later_sd_ratio": float(np.sqrt(ratio.value)),
        "later_sd_ratio_low": float(np.sqrt(ratio.low)),
        "later_sd_ratio_high": float(np.sqrt(ratio.high)),
        "rule_n": met,
        "rule_mean": stopped.mean,
        "rule_half_width": stopped.half_width,
    }


def _clipped(summary: dict, cases) -> list:
    labels = [case.label for case in cases]
    keys = ("acf", "cov", "field_min", "field_max", "clipped")
    return [
        {key: case[key] for key in keys}
        for case in summary["cases"]
        if case["label"] in labels and case["ok"]
    ]


def _settle_time(ensemble: Ensemble, summary: dict) -> dict:
    """Of the homogeneous runs: when they come to rest, and their mean time step; in s."""
    cases = [case for case in ensemble.for_statistics() if case.is_homogeneous]
    time, steps = (
        np.concatenate([case.column(name)[case.ok] for case in cases] or [[]])
        for name in ("settle_time", "steps")
    )
    return {**asdict(describe(time)), "time_step": describe(time / np.maximum(steps, 1)).mean}


def _fronts(cases, toe) -> list:
    """Place of the farthest point in dm from the left wall: of member 1, which is drawn, and
    between which places 90 % of the members lie."""
    start = np.nan if toe is None else DECIMETRES * toe
    found = []
    for case in cases:
        all_of = describe(case.values("runout_max"))
        first = case.column("runout_max")[(case.id == 1) & case.ok]
        found.append(
            {
                "acf": case.acf,
                "n": all_of.n,
                "member_1": start + float(first[0]) if len(first) else np.nan,
                "p05": start + all_of.p05,
                "p95": start + all_of.p95,
                "farthest": start + all_of.maximum,
            }
        )
    return found


def shapes() -> list:
    """Of each function in units of the scale: twice its integral, which is 1 by definition; its
    slope at the origin; correlation at half a scale along an axis and along the diagonal."""
    found = []
    for acf in ACFS:
        reach = 1.0 if acf == "bin" else 40.0
        area = integrate.quad(lambda t, acf=acf: rho(acf, t), 0.0, reach, limit=200)[0]
        field = Correlation(acf, 1.0, 1.0)
        tiny, lag = 1e-6, 0.5
        along = float(field.at(lag, 0.0))
        diagonal = float(field.at(lag / np.sqrt(2.0), lag / np.sqrt(2.0)))
        found.append(
            {
                "acf": acf,
                "twice_integral": 2.0 * area,
                "slope": float((rho(acf, tiny) - 1.0) / tiny),
                "along_axis": along,
                "along_diagonal": diagonal,
            }
        )
    return found


def _sensitivity(ensemble: Ensemble, other: Ensemble) -> dict:
    """`other` less `ensemble`, member by member where labels and random numbers agree."""
    first, second = (by_key(read_namelist(*resolved_text(one))) for one in (ensemble, other))
    changed = {}
    for key, one, two in differing_keys(first, second):
        group = key.split("%")[0]
        if group.split("(")[0] in _IDLE_GROUPS or key in _IDLE_KEYS:
            continue
        there = [any(known.startswith(f"{group}%") for known in keys) for keys in (first, second)]
        if all(there):
            changed[key] = {"key": key, "here": one, "there": two}
        else:  # a group that one run does not have is one difference
            words = ["set" if is_there else "(not set)" for is_there in there]
            changed[group] = {"key": group, "here": words[0], "there": words[1]}
    known = [{case.label: case for case in one.for_statistics()} for one in (ensemble, other)]
    rows = []
    for one in compare_runs(ensemble, other):
        pair = [cases[one.label] for cases in known]
        s = one.samples
        members = paired_values(*pair, one.runout)
        shares = [
            _share(case, values, cases, one.runout)
            for case, values, cases in zip(pair, members, known)
        ]
        rows.append(
            {
                "case": one.label,
                "acf": pair[0].acf,
                "cov": pair[0].cov,
                "role": pair[0].role,
                "runout": one.runout,
                "is_paired": s.is_paired,
                "n": s.n_second,
                "is_equal": s.is_equal,
                "mean_here": s.mean_first,
                "mean_there": s.mean_second,
                "shift": s.mean.mean,
                "shift_low": s.mean.low,
                "shift_high": s.mean.high,
                "p_adjusted": one.mean_p,
                "noise": one.noise,
                "sd_here": s.sd_first,
                "sd_there": s.sd_second,
                "sd_ratio": s.sd_second / s.sd_first if s.sd_first > 0.0 else np.nan,
                "spread_p_adjusted": one.spread_p,
                **{
                    f"share_{where}{end}": share[k]
                    for where, share in zip(("here", "there"), shares)
                    for k, end in enumerate(("", "_low", "_high"))
                },
            }
        )
    return {
        "directory": other.directory.name,
        "state": other.state,
        "changed": list(changed.values()),
        "settings": settings(other),
        "has_same_numbers": has_same_numbers(ensemble, other),
        "homogeneous": _homogeneous(other),
        "rows": rows,
    }


def _homogeneous(ensemble: Ensemble) -> dict:
    cases = [case for case in ensemble.for_statistics() if case.is_homogeneous]
    return noise_floor(cases[0] if cases else None)


def _share(case, values, cases: dict, name: str):
    """P(S > own homogeneous mean) with both doubts; of a homogeneous case nothing."""
    homogeneous = cases.get(case.noise_case)
    if case.is_homogeneous or homogeneous is None:
        return np.nan, np.nan, np.nan
    got = probability_above_mean(values, homogeneous.values(name))
    return got.share.value, got.low, got.high
