"""Every number of the report, computed once: plain dictionaries for HTML, CSV and JSON."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from .ensemble import RUNOUTS, STATUS_TEXTS
from .events import EVENTS_NAME, rank_seconds, read_starts
from .fits import rivals
from .importance import (
    effective_size,
    exceedance_quantile,
    weighted_mean,
    weighted_probability,
    weighted_sd,
)
from .law_choice import choose_law
from .noise_floor import against_floor, noise_floor
from .pairs import paired_experiments
from .statistics import describe, describe_pairs, wilson
from .two_level import control_estimates
from .verdict import law_sentence

#: Of all ranks together, below which the share that members took is not told: the clock of the
#: events goes in seconds.
FEWEST_SECONDS = 100.0
#: Bootstrap samples of each kind behind the choice of a law; `sgimp-post fit` takes more.
LAW_SAMPLES = 199
#: Exceedances whose runout is looked up in a run with importance sampling.
RARE = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)


def analyse(ensemble, primary: str) -> dict:
    """The numbers for all four runouts; fits, exceedance and pairs for the `primary` one."""
    cases = ensemble.for_statistics()
    sampling = str(ensemble.attributes.get("sampling", "random"))
    homogeneous = {case.label: case for case in cases if case.is_homogeneous}
    floors = {label: noise_floor(case) for label, case in homogeneous.items()}
    unknown = noise_floor(None)
    studied = [case for case in cases if case.role == "study"]
    plain = [] if ensemble.is_weighted else studied
    noise = {c.label: floors.get(c.noise_case, unknown)[primary]["sd"] for c in studied}
    means = {c.label: floors.get(c.noise_case, unknown)[primary]["mean"] for c in studied}
    is_random = sampling in ("", "random")
    return {
        "primary": primary,
        "state": ensemble.state,
        "sampling": sampling,
        "complete": ensemble.is_complete,
        "totals": _totals(ensemble),
        "deterministic": next(iter(floors.values()), unknown),
        "floors": floors,
        "cases": [
            _case(case, primary, homogeneous.get(case.noise_case), ensemble.is_weighted)
            for case in studied
        ],
        "pairs": paired_experiments(plain, primary, noise),
        "controls": control_estimates(ensemble, cases, primary, means) if is_random else [],
        "importance": [_weighted(case, primary, means[case.label]) for case in studied]
        if ensemble.is_weighted
        else [],
        "failures": _failures(ensemble),
        "cost": _cost(ensemble),
    }


def _totals(ensemble) -> dict:
    cases = ensemble.cases
    ok = sum(int(case.ok.sum()) for case in cases)
    return {
        "planned": sum(case.planned for case in cases),
        "done": sum(case.count for case in cases),
        "ok": ok,
        "failed": sum(int(case.failed.sum()) for case in cases),
        "unsettled": sum(int((case.column("settled")[case.ok] == 0).sum()) for case in cases),
        "wall_touched": sum(
            int((case.column("wall_touched")[case.ok] == 1).sum()) for case in cases
        ),
        "used": sum(case.count for case in ensemble.for_statistics()),
    }


def _case(case, primary: str, homogeneous, is_weighted: bool) -> dict:
    """Plain statistics of members of importance sampling say nothing: theirs are of no values."""
    drawn = case.select(np.zeros(case.count, dtype=bool)) if is_weighted else case
    values = drawn.values(primary)
    floor = noise_floor(homogeneous)[primary]
    against = against_floor(drawn, homogeneous)
    choice = choose_law(values, LAW_SAMPLES, np.random.default_rng(case.order))
    ok = case.ok
    shift, noise = against[primary]["shift"]["mean"], floor["sd"]
    return {
        "label": case.label,
        "acf": case.acf,
        "cov": case.cov,
        "varied": case.varied,
        "noise_case": case.noise_case,
        "stop_rule_met": case.stop_rule_met,
        "planned": case.planned,
        "done": case.count,
        "ok": int(ok.sum()),
        "failed": int((~ok).sum()),
        "failed_share": asdict(wilson(int((~ok).sum()), case.count)),
        "unsettled": int((case.column("settled")[ok] == 0).sum()),
        "wall_touched": int((case.column("wall_touched")[ok] == 1).sum()),
        "pairs_of_members": asdict(
            describe_pairs(drawn.id[drawn.ok], drawn.column(primary)[drawn.ok])
        ),
        "runouts": {name: asdict(describe(drawn.values(name))) for name in RUNOUTS},
        "height_wall": asdict(describe(drawn.values("height_wall"))),
        "against_floor": against,
        "exceedance": against[primary]["exceedance"]["share"],
        "fits": [
            {
                **asdict(fit),
                "wins": choice.wins.get(fit.law, np.nan),
                "p_value": choice.p_value.get(fit.law, np.nan),
            }
            for fit in choice.fits
        ],
        "best": choice.law,
        "rivals": [fit.law for fit in rivals(choice.fits)],
        "law_is_refuted": choice.is_refuted,
        "law_sentence": law_sentence(choice),
        "noise_share": 1.0 - against[primary]["soil_share"]["value"],
        "shift": shift,
        "shift_below_noise": bool(abs(shift) < noise) if np.isfinite(shift * noise) else False,
        "field_mean": asdict(describe(case.column("field_mean")[ok])),
        "field_min": float(np.nanmin(case.column("field_min")[ok], initial=np.inf)),
        "field_max": float(np.nanmax(case.column("field_max")[ok], initial=-np.inf)),
        "clipped": describe(case.column("field_clipped")[ok]).mean,
        "energy_error": float(np.nanmax(np.abs(case.column("energy_error")[ok]), initial=0.0)),
    }


def _weighted(case, primary: str, deterministic: float) -> dict:
    """Of a case with importance sampling: moments as far as the weights carry them, P(S > s) for
    the deterministic value and for the runouts that are passed with the probabilities of RARE."""
    good = case.ok
    values, log_weights = case.column(primary)[good], case.column("log_weight")[good]
    thresholds = [("homogeneous mean", deterministic)]
    thresholds += [("", exceedance_quantile(values, log_weights, p)) for p in RARE]
    rows, seen = [], set()
    for origin, s in thresholds:
        got = weighted_probability(values, log_weights, s)
        if not got.is_supported or s in seen:
            continue
        seen.add(s)
        rows.append({"origin": origin, "threshold": float(s), **asdict(got)})
    return {
        "label": case.label,
        "n": len(values),
        "effective": effective_size(log_weights),
        "mean": asdict(weighted_mean(values, log_weights)),
        "sd": asdict(weighted_sd(values, log_weights)),
        "rows": rows,
    }


def _failures(ensemble) -> list:
    rows = []
    for case in ensemble.cases:
        for k in np.flatnonzero(case.failed):
            status = int(case.status[k])
            rows.append(
                {
                    "case": case.label,
                    "id": int(case.id[k]),
                    "status": STATUS_TEXTS.get(status, f"status {status}"),
                    "step": int(case.column("failure_step")[k]),
                    "point": int(case.column("failure_point")[k]),
                    "x": float(case.column("failure_x")[k]),
                    "y": float(case.column("failure_y")[k]),
                    "reason": case.reason[k],
                }
            )
    return rows


def _cost(ensemble) -> dict:
    seconds = np.concatenate([case.column("seconds") for case in ensemble.cases] or [[]])
    steps = np.concatenate([case.column("steps")[case.ok] for case in ensemble.cases] or [[]])
    starts = read_starts(ensemble.directory / EVENTS_NAME)
    spent, busy = rank_seconds(starts), float(np.nansum(seconds))
    return {
        "seconds": asdict(describe(seconds)),
        "core_hours": busy / 3600.0,
        "steps": asdict(describe(steps)),
        "starts": len(starts),
        "rank_hours": spent / 3600.0,
        "busy_share": busy / spent if spent >= FEWEST_SECONDS else np.nan,
    }
