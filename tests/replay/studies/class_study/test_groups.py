import numpy as np
import pytest
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
    assert (one.first_students, one.second_students) == (26, 26)
    assert (one.first_mean, one.second_mean) == pytest.approx((first.mean(), second.mean()))
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
    import statsmodels.api as sm

    fit = sm.OLS(values, sm.add_constant(group.astype(float))).fit(cov_type="HC3", use_t=True)
    return fit.params[1], fit.bse[1]


def test_interval_uses_statsmodels_errors_and_permuted_residual_quantiles():
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


@pytest.mark.slow
def test_a_difference_of_unequal_groups_of_skewed_answers_is_covered(monkeypatch):
    # p is not asked here, and quantiles of fewer draws are as right on average.
    monkeypatch.setattr(groups, "PERMUTATIONS", 9)
    monkeypatch.setattr(groups, "DRAWS", 499)
    names, held = np.repeat(NAMES, [47, 5]), []
    for number in range(100):
        values = np.random.default_rng([number, 5]).lognormal(size=52)
        (one,) = compare_groups(DataFrame({"y": values}), names, NAMES, number, [])
        held.append(one.low <= 0.0 <= one.high)
    assert np.mean(held) > 0.90
