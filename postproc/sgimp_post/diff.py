"""`sgimp-post diff A B`: in which keys two runs differ, and whether their results do."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .ensemble import RUNOUTS, Case, Ensemble, read_ensemble
from .merge import PROGRAM
from .namelist import by_key, differing_keys, identity_by_key, read_namelist, resolved_text
from .noise_floor import noise_floor
from .pairs import paired_values
from .statistics import LEVEL, holm
from .two_samples import TwoSamples, compare

#: Fewest exchanges within pairs.
_SHUFFLES = 1999
_LONGEST_VALUE = 60


@dataclass(frozen=True)
class Comparison:
    """One case and runout. p values adjusted among all comparisons of the same kind (Holm);
    `noise`: sd of the noise floor in m, the larger of the two, NaN if either is not known."""

    label: str
    runout: str
    samples: TwoSamples
    noise: float
    mean_p: float = np.nan
    spread_p: float = np.nan
    distance_p: float = np.nan

    @property
    def has_other_mean(self) -> bool:
        return self.mean_p < LEVEL

    @property
    def is_beyond_noise(self) -> bool:
        """False where the noise is not known."""
        return abs(self.samples.mean.mean) > self.noise

    @property
    def is_finding(self) -> bool:
        return min(self.mean_p, self.spread_p, self.distance_p) < LEVEL  # False for NaN


def run(options) -> int:
    """Prints what differs; exit code 0 either way."""
    first, second = (read_ensemble(directory) for directory in (options.first, options.second))
    lines = [f"A: {first.directory} ({first.state})", f"B: {second.directory} ({second.state})"]
    lines += [*_key_lines(first, second), *_program_lines(first, second)]
    if first.is_weighted or second.is_weighted:
        lines.append(
            "results are not compared: with sampling='importance' members have weights, and plain"
            " means say nothing (`sgimp-post report` weighs them)"
        )
    else:
        lines += _result_lines(first, second)
    for line in lines:
        print(line)
    return 0


def _key_lines(first: Ensemble, second: Ensemble):
    keys = [by_key(read_namelist(*resolved_text(ensemble))) for ensemble in (first, second)]
    found = differing_keys(*keys)
    if not found:
        yield "namelists: no key differs"
        return
    texts = [str(ensemble.attributes.get("identity", "")) for ensemble in (first, second)]
    deciding = set().union(*map(identity_by_key, texts)) if all(texts) else None
    parts = {"keys": found}  # earlier versions do not say what results depend on
    if deciding is not None:
        parts = {
            "keys that results depend on": [row for row in found if row[0] in deciding],
            "other keys": [row for row in found if row[0] not in deciding],
        }
    for title, rows in parts.items():
        if rows:
            yield f"{title}:"
            yield from (f"  {key}: {_shown(one)} -> {_shown(two)}" for key, one, two in rows)


def _shown(value) -> str:
    text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    return text if len(text) <= _LONGEST_VALUE else text[: _LONGEST_VALUE - 3] + "..."


def _program_lines(first: Ensemble, second: Ensemble):
    for name in PROGRAM:
        one, two = (str(ensemble.attributes.get(name, "")) for ensemble in (first, second))
        if one != two:
            yield f"{name}: {one or '(not known)'} -> {two or '(not known)'}"


def _result_lines(first: Ensemble, second: Ensemble):
    samplings = {str(ensemble.attributes.get("sampling", "")) for ensemble in (first, second)}
    for sampling in sorted(samplings - {"", "random"}):
        yield f"sampling='{sampling}': members are not independent; the tests take them to be"
    yield from _unmatched(first, second)
    found = compare_runs(first, second)
    label = ""
    for one in found:
        if one.label != label:
            label = one.label
            yield ""
            yield f"{label}: {_how(one.samples)}"
            yield (
                f"  {'':<16} {'mean A':>8} {'B':>8} {'B - A (95 %)':>25} {'p':>6} {'sd A':>7}"
                f" {'B':>7} {'p':>6} {'KS':>6} {'p':>6}"
            )
        yield _row(one)
        yield f"  {'':<16} {words(one)}"
    yield ""
    yield overall(found)
    if found:
        yield (
            "p: of means, standard deviations and distributions, each adjusted for its"
            f" {len(found)} comparisons (Holm)"
        )


def compare_runs(first: Ensemble, second: Ensemble) -> list:
    """Comparison of each case that both runs have, for each runout, in the order of the first."""
    is_paired = has_same_numbers(first, second)
    cases = [
        {case.label: case for case in ensemble.for_statistics()} for ensemble in (first, second)
    ]
    floors = [_floors(known) for known in cases]
    common = [label for label in cases[0] if label in cases[1]]
    # So many exchanges that the smallest p value they can give is a finding after adjustment.
    shuffles = max(_SHUFFLES, int(2.0 / LEVEL * len(common) * len(RUNOUTS)) - 1)
    found = []
    for label in common:
        pair = [known[label] for known in cases]
        for name in RUNOUTS:
            samples = compare(
                *_values(*pair, name, is_paired),
                is_paired,
                np.random.default_rng(pair[0].order),  # the same numbers in every run
                shuffles,
            )
            noise = float(np.max([floor[label][name]["sd"] for floor in floors]))
            found.append(Comparison(label, name, samples, noise))
    adjusted = [
        holm([kind(one.samples) for one in found])
        for kind in (lambda s: s.mean.p_value, lambda s: s.spread_p, lambda s: s.distance_p)
    ]
    return [
        replace(one, mean_p=p, spread_p=q, distance_p=r) for one, p, q, r in zip(found, *adjusted)
    ]


def has_same_numbers(first: Ensemble, second: Ensemble) -> bool:
    """The same id has the same random numbers in both."""
    names = ["seed", "sampling"]
    if first.attributes.get("sampling") == "latin_hypercube":
        names.append("realizations")
    return all(first.attributes.get(name) == second.attributes.get(name) for name in names)


def _floors(cases: dict) -> dict:
    """Noise floor by label of the case; a homogeneous case is its own."""
    homogeneous = {label: case for label, case in cases.items() if case.is_homogeneous}
    return {
        label: noise_floor(homogeneous.get(label if case.is_homogeneous else case.noise_case))
        for label, case in cases.items()
    }


def _values(first: Case, second: Case, name: str, is_paired: bool):
    if not is_paired:
        return first.values(name), second.values(name)
    return paired_values(first, second, name)


def _unmatched(first: Ensemble, second: Ensemble):
    labels = [[case.label for case in ensemble.cases] for ensemble in (first, second)]
    for name, mine, others in (("A", *labels), ("B", *labels[::-1])):
        alone = [label for label in mine if label not in others]
        if alone:
            yield f"only in {name}: " + ", ".join(alone)


def _how(samples: TwoSamples) -> str:
    if samples.is_paired:
        return f"{samples.n_first} pairs of the same random numbers"
    return f"{samples.n_first} and {samples.n_second} members, independent"


def _row(one: Comparison) -> str:
    s = one.samples
    interval = f"{s.mean.mean:+.4f} ({s.mean.low:+.4f}, {s.mean.high:+.4f})"
    return (
        f"  {one.runout:<16} {s.mean_first:>8.4f} {s.mean_second:>8.4f} {interval:>25}"
        f" {_shown_p(one.mean_p)} {s.sd_first:>7.4f} {s.sd_second:>7.4f} {_shown_p(one.spread_p)}"
        f" {s.distance:>6.3f} {_shown_p(one.distance_p)}"
    )


def _shown_p(p: float) -> str:
    return "<0.001" if p < 0.0005 else f"{p:>6.3f}"


def words(one: Comparison) -> str:
    """The verdict of one comparison."""
    s = one.samples
    if s.is_equal:
        return "equal to the last bit"
    if not np.isfinite(one.mean_p):
        return "too few members to compare"
    found = []
    if one.has_other_mean:
        text = f"B runs {'farther' if s.mean.mean > 0.0 else 'less far'} by"
        text += f" {abs(s.mean.mean):.3g} m, "
        if np.isfinite(one.noise):
            beyond = "beyond" if one.is_beyond_noise else "within"
            text += f"{beyond} the noise floor of {one.noise:.3g} m"
        else:
            text += "noise floor not known"
        found.append(text)
    if one.spread_p < LEVEL:
        found.append(f"B spreads {'more' if s.sd_second > s.sd_first else 'less'}")
    if one.distance_p < LEVEL:
        found.append("the distributions differ")
    return "; ".join(found) if found else "no difference found"


def overall(found: list) -> str:
    """The verdict of all comparisons."""
    if not found:
        return "No case is in both runs."
    judged = [one for one in found if np.isfinite(one.mean_p)]
    if not judged:
        return "Too few members to compare."
    if all(one.samples.is_equal for one in judged):
        return "Every member that both runs have is equal to the last bit."
    findings = [one for one in judged if one.is_finding]
    if not findings:
        return f"No difference beyond chance in {len(judged)} comparisons of cases and runouts."
    means = [one for one in findings if one.has_other_mean]
    beyond = [one for one in means if one.is_beyond_noise]
    return (
        f"Beyond chance: {len(findings)} of {len(judged)} comparisons of cases and runouts;"
        f" {len(means)} of the means, {len(beyond)} of these beyond the noise floor."
    )
