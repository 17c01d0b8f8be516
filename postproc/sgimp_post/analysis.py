"""Every number of the report, computed once: plain dictionaries for HTML, CSV and JSON."""

from __future__ import annotations

from dataclasses import asdict
from itertools import combinations

import numpy as np

from .ensemble import RUNOUTS, STATUS_TEXTS
from .fits import best_fit, fit_laws, rivals
from .statistics import (
    describe,
    describe_pairs,
    finite,
    holm,
    outlier_probability,
    paired_difference,
    probability_above,
    wilson,
)

#: Largest number of pairs that is listed.
MOST_PAIRS = 45
#: The nominal run is an outlier when its prediction t statistic, judged by the other homogeneous
#: runs, is beyond this two-sided probability.
OUTLIER = 0.001


def analyse(ensemble, primary: str) -> dict:
    """The numbers for all four runouts; fits, exceedance and pairs for the `primary` one."""
    cases = ensemble.for_statistics()
    homogeneous = next((case for case in cases if case.is_homogeneous), None)
    floor = {name: _noise_floor(homogeneous, name) for name in RUNOUTS}
    studied = [case for case in cases if not case.is_homogeneous]
    return {
        "primary": primary,
        "state": ensemble.state,
        "sampling": str(ensemble.attributes.get("sampling", "random")),
        "complete": ensemble.is_complete,
        "totals": _totals(ensemble),
        "deterministic": floor,
        "cases": [_case(case, primary, floor) for case in studied],
        "pairs": _pairs(studied, primary, floor[primary]["sd"]),
        "failures": _failures(ensemble),
        "cost": _cost(ensemble),
    }


def _noise_floor(case, name: str) -> dict:
    """Mean and spread of the homogeneous members for one runout, in m; beside them the nominal run
    and the others without it, since one far run of eight decides what the noise floor is."""
    values = np.array([]) if case is None else case.values(name)
    others, nominal = np.array([]), np.nan
    if case is not None:
        others = finite(case.column(name)[(case.id != 1) & case.ok])
        first = finite(case.column(name)[(case.id == 1) & case.ok])
        nominal = float(first[0]) if len(first) else np.nan
    return {
        "nominal": nominal,
        "nominal_is_outlier": bool(outlier_probability(nominal, others) < OUTLIER),
        "others": asdict(describe(others)),
        **asdict(describe(values)),
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


def _case(case, primary: str, floor: dict) -> dict:
    values = case.values(primary)
    deterministic = floor[primary]["mean"]
    fits = fit_laws(values)
    best = best_fit(fits)
    ok = case.ok
    noise = floor[primary]["sd"]
    sd = describe(values).sd
    shift = describe(values).mean - deterministic
    return {
        "label": case.label,
        "acf": case.acf,
        "cov": case.cov,
        "planned": case.planned,
        "done": case.count,
        "ok": int(ok.sum()),
        "failed": int((~ok).sum()),
        "failed_share": asdict(wilson(int((~ok).sum()), case.count)),
        "unsettled": int((case.column("settled")[ok] == 0).sum()),
        "wall_touched": int((case.column("wall_touched")[ok] == 1).sum()),
        "pairs_of_members": asdict(describe_pairs(case.id[ok], case.column(primary)[ok])),
        "runouts": {name: asdict(describe(case.values(name))) for name in RUNOUTS},
        "height_wall": asdict(describe(case.values("height_wall"))),
        "exceedance": asdict(probability_above(values, deterministic)),
        "fits": [asdict(fit) for fit in fits],
        "best": best.law if best else "",
        "rivals": [fit.law for fit in rivals(fits)],
        "noise_share": float((noise / sd) ** 2) if sd and sd > 0 and np.isfinite(noise) else np.nan,
        "shift": float(shift) if np.isfinite(shift) else np.nan,
        "shift_below_noise": bool(abs(shift) < noise) if np.isfinite(shift * noise) else False,
        "field_mean": asdict(describe(case.column("field_mean")[ok])),
        "field_min": float(np.nanmin(case.column("field_min")[ok], initial=np.inf)),
        "field_max": float(np.nanmax(case.column("field_max")[ok], initial=-np.inf)),
        "clipped": describe(case.column("field_clipped")[ok]).mean,
        "energy_error": float(np.nanmax(np.abs(case.column("energy_error")[ok]), initial=0.0)),
    }


def _pairs(cases: list, primary: str, noise: float) -> list:
    """Differences between cases that share random numbers and coefficient of variation."""
    rows = []
    for first, second in combinations(cases, 2):
        if first.cov != second.cov or len(rows) >= MOST_PAIRS:
            continue
        _, one, two = np.intersect1d(first.id, second.id, return_indices=True)
        good = first.ok[one] & second.ok[two]
        difference = paired_difference(
            first.column(primary)[one][good], second.column(primary)[two][good]
        )
        below = bool(abs(difference.mean) < noise)  # False where either is not known
        rows.append(
            {
                "first": first.label,
                "second": second.label,
                "below_noise": below,
                **asdict(difference),
            }
        )
    for row, adjusted in zip(rows, holm([row["p_value"] for row in rows])):
        row["p_adjusted"] = float(adjusted)
    return rows


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
    return {
        "seconds": asdict(describe(seconds)),
        "core_hours": float(np.nansum(seconds) / 3600.0),
        "steps": asdict(describe(steps)),
    }
