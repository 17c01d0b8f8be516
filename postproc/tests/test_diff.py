"""Two samples against exact levels and enumeration, and `sgimp-post diff`."""

from itertools import product

import numpy as np
import pytest
from scipy import stats
from synthetic import sample, write_ensemble

from sgimp_post.cli import main
from sgimp_post.diff import compare_runs
from sgimp_post.ensemble import read_ensemble
from sgimp_post.statistics import holm
from sgimp_post.two_samples import _largest_steps, compare

RESOLVED = "&case\n name = 't'\n/\n&grid\n cell_size = 0.125\n/\n&material\n young = 2.6e6\n/\n"
IDENTITY = "grid(1)%cell_size = 0.125\nmaterial(1)%young = 2.6e6\n"


def rng(seed=1):
    return np.random.default_rng(seed)


def test_independent_samples_are_scipys():
    a, b = rng(1).gumbel(5.0, 0.2, 60), rng(2).gumbel(5.1, 0.3, 40)
    got = compare(a, b, False, rng(), 10)
    expected = stats.ttest_ind(b, a, equal_var=False)
    assert got.mean.mean == pytest.approx(b.mean() - a.mean(), rel=1e-12)
    assert got.mean.p_value == pytest.approx(expected.pvalue, rel=1e-9)
    distances = [np.abs(x - np.median(x)) for x in (a, b)]
    expected = stats.ttest_ind(*distances, equal_var=False)
    assert got.spread_p == pytest.approx(expected.pvalue, rel=1e-9)
    expected = stats.ks_2samp(a, b)
    assert (got.distance, got.distance_p) == (expected.statistic, expected.pvalue)
    assert (got.n_first, got.n_second) == (60, 40)
    assert not compare(a, a, False, rng(), 10).is_equal


@pytest.mark.parametrize("values", [sample(1, 16), np.round(sample(1, 16), 1)])
def test_the_exchange_of_pairs_is_the_enumeration(values):
    """All 256 exchanges of eight pairs, distances by scipy; 40000 random ones give the p value to
    four standard errors."""
    a, b = values[:8] - 0.05, values[8:] + 0.05
    signs = np.array(list(product([1, -1], repeat=8)), dtype=np.int32)
    distances = [
        stats.ks_2samp(np.where(s > 0, a, b), np.where(s > 0, b, a)).statistic for s in signs
    ]
    assert _largest_steps(a, b, signs) / 8 == pytest.approx(np.array(distances), abs=1e-12)
    got = compare(a, b, True, rng(), 40000)
    assert got.distance == pytest.approx(distances[0], abs=1e-12)
    p = np.mean(np.array(distances) >= distances[0] - 1e-9)
    assert got.distance_p == pytest.approx(p, abs=4 * np.sqrt(p * (1 - p) / 40000) + 1e-4)


@pytest.mark.parametrize("is_paired", [True, False])
def test_the_tests_hold_their_level_on_skewed_values(is_paired):
    """600 pairs of Gumbel samples of 40 of one law, with correlation where paired: 5 % of p values
    below 0.05 within four standard errors (0.9 %), for the mean and the spread."""
    generator, found = rng(4), []
    for _ in range(600):
        common = generator.gumbel(0.0, 0.2 if is_paired else 0.0, 40)
        a, b = (5.0 + common + generator.gumbel(0.0, 0.1, 40) for _ in range(2))
        got = compare(a, b, is_paired, generator, 1)
        found.append((got.mean.p_value, got.spread_p))
    shares = np.mean(np.array(found) < 0.05, axis=0)
    assert shares == pytest.approx([0.05, 0.05], abs=0.036)


def test_pairs_see_what_independent_samples_do_not():
    """A shift of a tenth of the spread, and a spread of a tenth more, pair by pair."""
    a = sample(5, 100, 5.0, 0.3)
    b = 5.03 + 1.1 * (a - 5.0) + sample(6, 100, 0.0, 0.02)
    paired, alone = (compare(a, b, is_paired, rng(), 1999) for is_paired in (True, False))
    assert max(paired.mean.p_value, paired.spread_p) < 1e-6 and paired.distance_p < 0.05
    assert min(alone.mean.p_value, alone.spread_p, alone.distance_p) > 0.05


def test_pairs_with_a_value_missing_and_few_values():
    a, b = np.r_[sample(1, 9), np.nan], np.r_[np.nan, sample(2, 9)]
    got = compare(a, b, True, rng(), 99)
    assert got.n_first == got.n_second == 8
    assert got.mean.mean == pytest.approx(np.mean(b[1:9] - a[1:9]), rel=1e-12)
    for n in (0, 1):
        for is_paired in (True, False):
            few = compare(a[:n], a[:n], is_paired, rng(), 99)
            assert np.isnan(few.mean.p_value) and np.isnan(few.distance_p)
    assert np.isnan(compare(a[:7], a[1:8], True, rng(), 99).spread_p)


def write(directory, values, resolved=RESOLVED, state="complete", label="snx", **more):
    cases = [
        {"label": "deterministic", "values": [5.0, 5.1, 5.2, 5.0, 5.1, 5.2, 5.1, 5.1]},
        {"label": label, "values": values, **more.pop("case", {})},
    ]
    attributes = {"resolved_namelist": resolved, "identity": IDENTITY, "sampling": "random", **more}
    return str(write_ensemble(directory, cases, state, **attributes))


def diff(tmp_path, first, second, capsys):
    """Output for two dictionaries of what `write` takes."""
    one, two = (write(tmp_path / name, **d) for name, d in (("a", first), ("b", second)))
    assert main(["diff", one, two]) == 0
    return capsys.readouterr().out


VALUES = sample(1, 100)


def test_a_run_is_equal_to_itself(tmp_path, capsys):
    out = diff(tmp_path, {"values": VALUES}, {"values": VALUES}, capsys)
    assert "namelists: no key differs" in out
    assert "snx: 100 pairs of the same random numbers" in out
    assert "Every member that both runs have is equal to the last bit." in out


def test_keys_are_told_by_what_they_decide(tmp_path, capsys):
    other = RESOLVED.replace("0.125", "0.25").replace("'t'", "'u'")
    other += "&material\n young = 1\n/\n"
    identity = IDENTITY + "material(2)%young = 1\n"
    two = {"values": VALUES, "resolved": other, "identity": identity, "git_hash": "def"}
    out = diff(tmp_path, {"values": VALUES}, two, capsys).splitlines()
    deciding, others = out.index("keys that results depend on:"), out.index("other keys:")
    assert out[deciding + 1 : others] == [
        "  grid(1)%cell_size: 0.125 -> 0.25",
        "  material(2)%young: (not set) -> 1",
    ]
    assert out[others + 1 : others + 3] == ["  case(1)%name: t -> u", "git_hash: abc -> def"]


def test_resolved_nml_goes_before_the_attribute(tmp_path, capsys):
    one, two = write(tmp_path / "a", VALUES), write(tmp_path / "b", VALUES)
    (tmp_path / "b" / "resolved.nml").write_text(RESOLVED.replace("2.6e6", "3"))
    assert main(["diff", one, two]) == 0
    assert "material(1)%young: 2600000.0 -> 3" in capsys.readouterr().out


@pytest.mark.parametrize(("shift", "where"), [(0.05, "within"), (-0.2, "beyond")])
def test_a_shift_is_told_against_the_noise_floor(shift, where, tmp_path, capsys):
    """The noise floor is the standard deviation of the homogeneous runs, root of 0.04/7 m^2."""
    scatter = sample(9, 100, 0.0, 0.01)
    other = VALUES + shift + scatter - scatter.mean()
    more = {"case": {"more": {"noise_case": "deterministic"}}}
    out = diff(tmp_path, {"values": VALUES, **more}, {"values": other, **more}, capsys)
    way = "farther" if shift > 0 else "less far"
    assert f"B runs {way} by {abs(shift):.3g} m, {where} the noise floor of 0.0756 m" in out
    beyond = 4 if where == "beyond" else 0
    assert "Beyond chance: 4 of 8 comparisons of cases and runouts; 4 of the means," in out
    assert f"{beyond} of these beyond the noise floor" in out


def test_ids_are_matched_and_failed_members_left_out(tmp_path):
    ids = np.arange(1, 101)
    one = write(tmp_path / "a", VALUES, case={"ids": ids, "failed": [7]})
    order = rng().permutation(100)[:90]
    two = write(tmp_path / "b", VALUES[order] + 0.5, case={"ids": ids[order], "failed": [8, 9]})
    found = compare_runs(read_ensemble(one), read_ensemble(two))
    got = next(c for c in found if (c.label, c.runout) == ("snx", "runout_max"))
    assert (
        got.samples.is_paired and got.samples.n_first == 90 - np.isin([7, 8, 9], ids[order]).sum()
    )
    assert got.samples.mean.low == pytest.approx(0.5, abs=1e-9)
    for kind, raw in (
        ("mean_p", [c.samples.mean.p_value for c in found]),
        ("spread_p", [c.samples.spread_p for c in found]),
        ("distance_p", [c.samples.distance_p for c in found]),
    ):
        adjusted = [getattr(c, kind) for c in found]
        assert adjusted == pytest.approx(list(holm(raw)), nan_ok=True)


@pytest.mark.parametrize(
    ("first", "second", "is_paired"),
    [
        ({"seed": 1}, {"seed": 2}, False),
        ({"sampling": "antithetic"}, {}, False),
        ({"sampling": "antithetic"}, {"sampling": "antithetic"}, True),
        ({"realizations": 100}, {"realizations": 200}, True),
        (
            {"sampling": "latin_hypercube", "realizations": 100},
            {"sampling": "latin_hypercube", "realizations": 200},
            False,
        ),
    ],
)
def test_only_the_same_random_numbers_are_paired(first, second, is_paired, tmp_path, capsys):
    one, two = {"values": VALUES, **first}, {"values": sample(2, 100), **second}
    out = diff(tmp_path, one, two, capsys)
    assert ("snx: 100 pairs" in out) is is_paired
    assert ("snx: 100 and 100 members, independent" in out) is not is_paired
    assert ("not independent" in out) is ("sampling" in first)
    assert "No difference beyond chance in 8 comparisons" in out


def test_cases_of_one_run_only_and_unfinished_runs(tmp_path, capsys):
    out = diff(tmp_path, {"values": VALUES}, {"values": VALUES, "label": "sqx"}, capsys)
    assert "only in A: snx" in out and "only in B: sqx" in out
    ids = [*range(1, 11), *range(12, 102)]
    running = {"values": VALUES, "state": "running", "case": {"ids": ids}}
    out = diff(tmp_path / "2", {"values": VALUES}, running, capsys)
    assert "b (running)" in out and "snx: 10 pairs" in out


def test_members_with_weights_are_not_compared(tmp_path, capsys):
    runs = {"values": VALUES}, {"values": VALUES, "sampling": "importance"}
    for one, two in (runs, runs[::-1]):
        out = diff(tmp_path, one, two, capsys)
        assert "results are not compared: with sampling='importance'" in out and "pairs" not in out


def test_bad_input_is_refused(tmp_path, capsys):
    assert main(["diff", write(tmp_path / "a", VALUES), str(tmp_path / "none")]) == 2
    assert "no such directory" in capsys.readouterr().err
    assert main(["diff", str(tmp_path / "a"), write(tmp_path / "b", VALUES, "&case name='t'")]) == 2
    assert "resolved_namelist: &case has no end" in capsys.readouterr().err
