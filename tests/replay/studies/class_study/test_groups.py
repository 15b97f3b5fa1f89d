import numpy as np
import pytest
import statsmodels.api as sm
from pandas import DataFrame
from scipy import stats
from statsmodels.stats.multitest import multipletests

from replay.studies.class_study import groups
from replay.studies.class_study.groups import compare_groups

NAMES = ("first", "second")


def compared(first, second, seed=0):
    refusals = []
    values, group = np.concatenate([first, second]), np.repeat(NAMES, [len(first), len(second)])
    return compare_groups(DataFrame({"motivation": values}), group, NAMES, seed, refusals), refusals


def test_the_paper_s_figures_are_those_of_one_pooled_predictor():
    random = np.random.default_rng(0)
    first, second = random.normal(3.0, 1.0, 26), random.normal(3.8, 1.0, 26)
    ((one,), _) = compared(first, second)
    line = stats.linregress(np.repeat([0.0, 1.0], 26), np.concatenate([first, second]))
    fit = 1 - (1 - line.rvalue**2) * 51 / 50
    assert (one.pooled_beta, one.pooled_fit, one.pooled_p) == pytest.approx((line.rvalue, fit, line.pvalue))
    assert one.sizes == (26, 26) and one.means == pytest.approx((first.mean(), second.mean()))
    assert one.beta == pytest.approx(line.slope) and one.low < one.beta < one.high


def test_p_is_that_of_permuting_a_studentised_difference():
    random = np.random.default_rng(0)
    first, second = random.normal(3.0, 1.0, 40), random.normal(4.2, 5.0, 6)
    ((one,), _) = compared(first, second)

    def welch(a, b, axis):
        return np.abs(stats.ttest_ind(a, b, axis=axis, equal_var=False).statistic)

    how = {"vectorized": True, "n_resamples": 20000, "alternative": "greater", "random_state": 0}
    other = stats.permutation_test((second, first), welch, **how).pvalue
    assert one.p == pytest.approx(other, abs=0.02)


def hc3(group, values):
    """Difference of two groups and its HC3 error, by statsmodels."""
    fit = sm.OLS(values, sm.add_constant(group.astype(float))).fit(cov_type="HC3", use_t=True)
    return fit.params[1], fit.bse[1]


def test_the_interval_has_the_errors_of_statsmodels_and_the_quantiles_of_permuted_residuals():
    random = np.random.default_rng(0)
    first, second = random.normal(3.0, 8.0, 5), random.normal(3.0, 1.0, 47)
    group = np.arange(52) >= 5
    residuals = np.concatenate([first - first.mean(), second - second.mean()])
    drawn = [np.divide(*hc3(group, random.permutation(residuals))) for _ in range(800)]
    difference, error = hc3(group, np.concatenate([first, second]))
    ((one,), _) = compared(first, second)
    ends = difference - error * np.quantile(drawn, [0.975, 0.025])
    assert [one.low, one.high] == pytest.approx(ends.tolist(), rel=0.05)


def test_holm_is_across_all_outcomes_of_the_groups():
    random = np.random.default_rng(4)
    variables = DataFrame(random.normal(size=(40, 3)), columns=[*"abc"])
    found = compare_groups(variables, np.tile(NAMES, 20), NAMES, 0, [])
    expected = multipletests([one.p for one in found], method="holm")[1]
    assert [one.p_holm for one in found] == pytest.approx(expected.tolist())


def test_answers_that_are_all_equal_are_refused():
    found, (refused,) = compared(np.full(9, 3.0), np.full(9, 3.0))
    assert not found and refused.rule == "no-variance" and "between first and second" in refused.what


STUDENTS = 52
KINDS = {
    "normal": (lambda random: random.normal(size=STUDENTS), 1.0),
    "lognormal": (lambda random: random.lognormal(size=STUDENTS), float(np.sqrt((np.e - 1) * np.e))),
}
"""Answers, and their standard deviation."""


def covered(kind, second, effect, count):
    """Whether the intervals of classes hold the truth; ``second`` of 52 students answer higher by ``effect``."""
    draw, spread = KINDS[kind]
    group = np.arange(STUDENTS) >= STUDENTS - second
    for number in range(count):
        random = np.random.default_rng([number, second, round(10 * effect), len(kind)])
        values = draw(random) + effect * spread * group
        names = np.where(group, "second", "first")
        (one,) = compare_groups(DataFrame({"y": values}), names, NAMES, int(random.integers(10**9)), [])
        yield one.low <= effect * spread <= one.high


@pytest.fixture
def few_draws(monkeypatch):
    """Thousands of classes in seconds: p is not asked here, and quantiles of fewer draws are as right on average."""
    monkeypatch.setattr(groups, "PERMUTATIONS", 9)
    monkeypatch.setattr(groups, "DRAWS", 499)


def test_a_difference_of_unequal_groups_of_skewed_answers_is_covered(few_draws):
    assert np.mean([*covered("lognormal", 5, 0.0, 100)]) > 0.90


@pytest.mark.slow
def test_of_four_thousand_classes_intervals_hold_the_truth_in_93_to_97_of_100(few_draws):
    held = {
        (kind, second, effect): [*covered(kind, second, effect, 223)]
        for kind in KINDS for second in (5, 10, 26) for effect in (0.0, 0.5, 0.8)
    }  # fmt: skip
    for side in (lambda key: key[0], lambda key: key[1] == 26, lambda key: key[2] > 0.0):
        for part in {*map(side, held)}:
            share = np.mean([inside for key in held if side(key) == part for inside in held[key]])
            assert 0.93 <= share <= 0.97, part
