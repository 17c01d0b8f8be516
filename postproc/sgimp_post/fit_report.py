"""`sgimp-post fit`: which law the runout of each case has, how sure that is, and its quantiles."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np

from .ensemble import RUNOUTS, Ensemble, read_ensemble
from .errors import PostError
from .fits import LAWS
from .law_choice import LawChoice, choose_law
from .tables import null_for_nan, write_table
from .verdict import law_sentence

#: Fewest bootstrap samples: with less, the ends of a 95 % interval are those of the samples.
FEWEST_SAMPLES = 100
#: Values beyond a quantile below which it is an extrapolation.
_FEW_BEYOND = 5
#: Of the run, in fit.json.
_PROVENANCE = ("program", "version", "git_hash", "config_hash", "seed", "sampling", "state")


def run(options) -> int:
    """Prints the tables and writes DIR/fit/{fits.csv, quantiles.csv, fit.json}; exit code 0."""
    if options.bootstrap < FEWEST_SAMPLES:
        raise PostError(f"--bootstrap must be {FEWEST_SAMPLES} or more")
    ensemble = read_ensemble(options.directory)
    if ensemble.is_weighted:
        raise PostError(
            f"{options.directory}: sampling='importance': members have weights, and the likelihood"
            " of a law takes each for one draw of it; `sgimp-post report` tells rare exceedances"
            " with the weights"
        )
    cases = _asked(ensemble, options.case)
    for line in _warnings(ensemble):
        print(f"sgimp-post: warning: {line}", file=sys.stderr)
    choices = {}
    for case in cases:
        rng = np.random.default_rng(case.order)  # the same numbers in every run
        choices[case.label] = choose_law(case.values(options.runout), options.bootstrap, rng)
    _write(Path(options.directory) / "fit", ensemble, choices, options)
    for label, choice in choices.items():
        for line in _lines(label, choice, options):
            print(line)
    return 0


def _asked(ensemble: Ensemble, label) -> list:
    cases = ensemble.for_statistics()
    found = [case for case in cases if (case.label == label if label else case.role == "study")]
    if not found:
        wrong = f"no case {label}" if label else "no case with random fields (--case takes any)"
        known = ", ".join(case.label for case in cases)
        raise PostError(f"{ensemble.directory}: {wrong}; there are: {known}")
    return found


def _warnings(ensemble: Ensemble):
    sampling = str(ensemble.attributes.get("sampling", ""))
    if sampling not in ("", "random"):
        yield (
            f"sampling='{sampling}': members are not independent; p values and intervals take"
            " them to be"
        )
    if not ensemble.is_complete:
        yield f"the run is {ensemble.state}: the members without a gap from the first on are used"


def _lines(label: str, choice: LawChoice, options):
    yield (
        f"{label}: {choice.fits[0].n} members, {options.runout} ({RUNOUTS[options.runout]}), m;"
        f" {options.bootstrap} bootstrap samples"
    )
    heads = f"{'dAIC':>7} {'weight':>7} {'wins':>6} {'A^2':>7} {'p':>6}"
    yield f"  {'law':<14} {'parameters':<34} {heads}"
    for fit in choice.fits:
        name = LAWS[fit.law]
        if fit.note:
            yield f"  {name:<14} {fit.note}"
            continue
        parameters = ", ".join(f"{key} {value:.5g}" for key, value in fit.parameters.items())
        line = f"  {name:<14} {parameters:<34} {fit.delta_aic:>7.2f} {fit.weight:>7.3f}"
        if choice.wins:
            line += f" {100 * choice.wins[fit.law]:>4.0f} % {choice.statistic[fit.law]:>7.3f}"
            line += f" {choice.p_value[fit.law]:>6.3f}"
        yield line
    yield "  " + law_sentence(choice)
    if not choice.wins:
        return
    yield f"  {'quantile':<10} {'value':>8}   {'95 %, law certain':<20} 95 %, with its choice"
    for q in choice.quantiles:
        line = f"  {100 * q.probability:>6.4g} %   {q.value:>8.3f}   "
        line += f"{q.low:.3f} to {q.high:.3f}".ljust(21)
        line += f"{q.choice_low:.3f} to {q.choice_high:.3f}"
        yield line + (f"   {q.beyond} members beyond" if q.beyond < _FEW_BEYOND else "")


def _write(directory: Path, ensemble: Ensemble, choices: dict, options) -> None:
    fits, quantiles, cases = [], [], []
    for label, choice in choices.items():
        rows = [_fit_row(fit, choice) for fit in choice.fits]
        fits += [{"case": label, **_two_parameters(row)} for row in rows]
        found = [asdict(quantile) for quantile in choice.quantiles]
        quantiles += [{"case": label, "law": choice.law, **row} for row in found]
        cases.append(
            {
                "case": label,
                "law": choice.law,
                "verdict": law_sentence(choice),
                "fits": rows,
                "quantiles": found,
            }
        )
    content = {
        "runout": options.runout,
        "bootstrap": options.bootstrap,
        "run": {name: ensemble.attributes.get(name, "") for name in _PROVENANCE},
        "cases": cases,
    }
    try:
        directory.mkdir(parents=True, exist_ok=True)
        write_table(directory / "fits.csv", fits)
        write_table(directory / "quantiles.csv", quantiles)
        (directory / "fit.json").write_text(json.dumps(null_for_nan(content), indent=1))
    except OSError as cause:
        raise PostError(f"{directory}: cannot be written ({cause.strerror})") from cause


def _fit_row(fit, choice: LawChoice) -> dict:
    return {
        **asdict(fit),
        "wins": choice.wins.get(fit.law, math.nan),
        "anderson_darling": choice.statistic.get(fit.law, math.nan),
        "p_value": choice.p_value.get(fit.law, math.nan),
    }


def _two_parameters(row: dict) -> dict:
    """The parameters by number, since their names differ from law to law."""
    pairs = [*row["parameters"].items(), ("", math.nan), ("", math.nan)][:2]
    named = {}
    for k, (name, value) in enumerate(pairs, start=1):
        named.update({f"parameter_{k}": name, f"value_{k}": value})
    flat = {key: value for key, value in row.items() if key != "parameters"}
    return {**flat, **named}
