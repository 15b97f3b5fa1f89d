import numpy as np
import pytest
from pandas import DataFrame
from scipy import stats
from statsmodels.stats.multitest import multipletests

from replay.studies.class_study import groups
from replay.studies.class_study.groups import compare_groups

GROUP_NAMES = ("first", "second")


def comparison_and_refusals(first, second, seed=0):
    """The comparison of two groups of values, and what it refused."""
    refusals = []
    values, group = np.concatenate([first, second]), np.repeat(GROUP_NAMES, [len(first), len(second)])
    return compare_groups(DataFrame({"motivation": values}), group, GROUP_NAMES, seed, refusals), refusals


def test_paper_figures_come_from_a_single_pooled_predictor():
    """Two groups of 26 students; adjusted by 51/50, the degrees of freedom of 52 values and one predictor."""
    random = np.random.default_rng(0)
    first, second = random.normal(3.0, 1.0, 26), random.normal(3.8, 1.0, 26)
    ((item,), _) = comparison_and_refusals(first, second)
    line = stats.linregress(np.repeat([0.0, 1.0], 26), np.concatenate([first, second]))
    fit = 1 - (1 - line.rvalue**2) * 51 / 50
    assert (item.pooled_beta, item.pooled_fit, item.pooled_p) == pytest.approx((line.rvalue, fit, line.pvalue))
    assert (item.first_students, item.second_students) == (26, 26)
    assert (item.first_mean, item.second_mean) == pytest.approx((first.mean(), second.mean()))
    assert item.beta == pytest.approx(line.slope) and item.low < item.beta < item.high


@pytest.mark.slow
def test_p_is_that_of_permuting_a_studentised_difference():
    """Groups of 40 and 6 students of unequal spread, against SciPy's test."""
    random = np.random.default_rng(0)
    first, second = random.normal(3.0, 1.0, 40), random.normal(4.2, 5.0, 6)
    ((item,), _) = comparison_and_refusals(first, second)

    def welch(a, b, axis):
        return np.abs(stats.ttest_ind(a, b, axis=axis, equal_var=False).statistic)

    how = {"vectorized": True, "n_resamples": 20000, "alternative": "greater", "random_state": 0}
    other = stats.permutation_test((second, first), welch, **how).pvalue
    assert item.p == pytest.approx(other, abs=0.02)


def hc3_by_statsmodels(group, values):
    """Difference of two groups and its HC3 error, by statsmodels."""
    import statsmodels.api as sm

    fit = sm.OLS(values, sm.add_constant(group.astype(float))).fit(cov_type="HC3", use_t=True)
    return fit.params[1], fit.bse[1]


def hc3_by_hand(first, second):
    """The same, 100 times as fast: a mean of n values has the leverage 1 / n, by which HC3 divides residuals."""
    variances = [((group - group.mean()) ** 2).sum() / (len(group) - 1) ** 2 for group in (first, second)]
    return second.mean() - first.mean(), np.sqrt(sum(variances))


def unequal_groups(random):
    """Values of 5 and of 47 students; the five scatter eight times as much."""
    return random.normal(3.0, 8.0, 5), random.normal(3.0, 1.0, 47)


@pytest.mark.slow
def test_error_by_hand_is_that_of_statsmodels():
    """Groups of 5 and 47 students, the first with eight times the spread."""
    first, second = unequal_groups(np.random.default_rng(0))
    by_statsmodels = hc3_by_statsmodels(np.arange(52) >= 5, np.concatenate([first, second]))
    assert hc3_by_hand(first, second) == pytest.approx(by_statsmodels)


def test_interval_is_of_permuted_residual_quantiles():
    """Residuals of both groups are permuted; the standard error is HC3, computed by hand."""
    random = np.random.default_rng(0)
    first, second = unequal_groups(random)
    residuals = np.concatenate([first - first.mean(), second - second.mean()])
    drawn = [np.divide(*hc3_by_hand(*np.split(random.permutation(residuals), [5]))) for _ in range(800)]
    difference, error = hc3_by_hand(first, second)
    ((item,), _) = comparison_and_refusals(first, second)
    ends = difference - error * np.quantile(drawn, [0.975, 0.025])
    assert [item.low, item.high] == pytest.approx(ends.tolist(), rel=0.05)


def test_holm_is_across_all_outcomes_of_the_groups():
    """Three outcomes of 40 students in two groups; expected is Holm's correction by statsmodels."""
    random = np.random.default_rng(4)
    variables = DataFrame(random.normal(size=(40, 3)), columns=[*"abc"])
    result = compare_groups(variables, np.tile(GROUP_NAMES, 20), GROUP_NAMES, 0, [])
    expected = multipletests([item.p for item in result], method="holm")[1]
    assert [item.p_holm for item in result] == pytest.approx(expected.tolist())


def test_groups_with_constant_answers_are_not_compared():
    """All 18 students answer 3."""
    result, (refused,) = comparison_and_refusals(np.full(9, 3.0), np.full(9, 3.0))
    assert not result and refused.rule == "no-variance" and "between first and second" in refused.what


@pytest.mark.slow
def test_interval_of_skewed_unequal_groups_covers_the_true_difference(monkeypatch):
    """The true difference is 0; a 95 % interval covers it in more than 90 of 100 draws.

    Few permutations are enough, as p is not asked; quantiles of fewer draws are as right on average.
    """
    """The true difference is 0; a 95 % interval covers it in more than 90 of 100 draws."""
    monkeypatch.setattr(groups, "PERMUTATIONS", 9)
    monkeypatch.setattr(groups, "STUDENTISED_DRAWS", 499)
    names, kept = np.repeat(GROUP_NAMES, [47, 5]), []
    for number in range(100):
        values = np.random.default_rng([number, 5]).lognormal(size=52)
        (item,) = compare_groups(DataFrame({"y": values}), names, GROUP_NAMES, number, [])
        kept.append(item.low <= 0.0 <= item.high)
    assert np.mean(kept) > 0.90
