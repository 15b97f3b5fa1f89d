import numpy as np
import pytest
from pandas import DataFrame
from scipy import stats
from statsmodels.stats.multitest import multipletests

from replay.studies.class_study import groups
from replay.studies.class_study.groups import compare_groups

GROUP_NAMES = ("first", "second")


def comparison_and_refusals(first, second):
    """The comparison of motivation in two groups, the values of a student each; and what was refused."""
    refusals = []
    values, group = np.concatenate([first, second]), np.repeat(GROUP_NAMES, [len(first), len(second)])
    return compare_groups(DataFrame({"motivation": values}), group, GROUP_NAMES, seed=0, refusals=refusals), refusals


def test_paper_figures_come_from_a_single_pooled_predictor():
    """A published paper regresses all students on their group, 0 or 1; here 26 students each.

    Expected is SciPy's line; its fit is adjusted by (52 - 1) / (52 - 2), for 52 students and one predictor. The
    difference of means, beta, is the slope of that line, with an interval of its own.
    """
    random = np.random.default_rng(0)
    first, second = random.normal(3.0, 1.0, 26), random.normal(3.8, 1.0, 26)
    ((result,), _) = comparison_and_refusals(first, second)
    line = stats.linregress(np.repeat([0.0, 1.0], 26), np.concatenate([first, second]))
    adjusted_fit = 1 - (1 - line.rvalue**2) * 51 / 50
    pooled_figures = (result.pooled_beta, result.pooled_fit, result.pooled_p)
    assert pooled_figures == pytest.approx((line.rvalue, adjusted_fit, line.pvalue))
    assert (result.first_students, result.second_students) == (26, 26)
    assert (result.first_mean, result.second_mean) == pytest.approx((first.mean(), second.mean()))
    assert result.beta == pytest.approx(line.slope) and result.low < result.beta < result.high


@pytest.mark.slow
def test_p_is_that_of_permuting_a_studentised_difference():
    """Groups of 40 and 6 students of unequal spread: expected is SciPy's permutation test of Welch's statistic.

    The product divides by another error, HC3, and draws other permutations: 0.02 for both.
    """
    random = np.random.default_rng(0)
    first, second = random.normal(3.0, 1.0, 40), random.normal(4.2, 5.0, 6)
    ((result,), _) = comparison_and_refusals(first, second)

    def welch(a, b, axis):
        return np.abs(stats.ttest_ind(a, b, axis=axis, equal_var=False).statistic)

    expected = stats.permutation_test(
        (second, first), welch, vectorized=True, n_resamples=20_000, alternative="greater", random_state=0
    )
    assert result.p == pytest.approx(expected.pvalue, abs=0.02)


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
    """Groups of 5 and 47 students, the first with eight times the spread: difference of means and its HC3 error."""
    first, second = unequal_groups(np.random.default_rng(0))
    is_second = np.arange(5 + 47) >= 5
    by_statsmodels = hc3_by_statsmodels(is_second, np.concatenate([first, second]))
    assert hc3_by_hand(first, second) == pytest.approx(by_statsmodels)


def test_interval_is_of_permuted_residual_quantiles():
    """Residuals of 5 and 47 students are permuted, and give the quantiles of difference / error; the error is HC3.

    800 permutations here, others than the product's: 5 % for that.
    """
    random = np.random.default_rng(0)
    first, second = unequal_groups(random)
    residuals = np.concatenate([first - first.mean(), second - second.mean()])
    ratios = []
    for _ in range(800):
        shuffled_first, shuffled_second = np.split(random.permutation(residuals), [5])
        difference, error = hc3_by_hand(shuffled_first, shuffled_second)
        ratios.append(difference / error)
    upper, lower = np.quantile(ratios, [0.975, 0.025])
    difference, error = hc3_by_hand(first, second)
    ((result,), _) = comparison_and_refusals(first, second)
    assert (result.low, result.high) == pytest.approx(
        (difference - error * upper, difference - error * lower), rel=0.05
    )


def test_holm_is_across_all_outcomes_of_the_groups(monkeypatch):
    """Three outcomes, a to c, of 40 students who are in two groups in turn; expected is Holm's rule by statsmodels.

    Few permutations do: the rule takes any p.
    """
    monkeypatch.setattr(groups, "PERMUTATIONS", 199)
    monkeypatch.setattr(groups, "STUDENTISED_DRAWS", 99)
    outcomes = DataFrame(np.random.default_rng(4).normal(size=(40, 3)), columns=["a", "b", "c"])
    groups_in_turn = np.tile(GROUP_NAMES, 20)
    results = compare_groups(outcomes, groups_in_turn, GROUP_NAMES, seed=0, refusals=[])
    _, corrected, *_ = multipletests([result.p for result in results], method="holm")
    assert [result.p_holm for result in results] == pytest.approx(corrected.tolist())


def test_groups_with_constant_answers_are_not_compared():
    """Two groups of nine students, who all answer 3: the rule is called no-variance."""
    results, (refused,) = comparison_and_refusals(np.full(9, 3.0), np.full(9, 3.0))
    assert not results
    assert refused.rule == "no-variance" and "between first and second" in refused.what


@pytest.mark.slow
def test_interval_of_skewed_unequal_groups_covers_the_true_difference(monkeypatch):
    """The true difference of 47 and 5 lognormal students is 0: a 95 % interval covers it in over 90 of 100 classes.

    Over 90, as 95 of 100 classes scatter by 2.2 (a standard error). Fewer permutations than usual save time: p is not
    looked at, and quantiles of 499 draws are as right on average.
    """
    monkeypatch.setattr(groups, "PERMUTATIONS", 9)
    monkeypatch.setattr(groups, "STUDENTISED_DRAWS", 499)
    group_of_student, covered = np.repeat(GROUP_NAMES, [47, 5]), 0
    for seed in range(100):
        values = np.random.default_rng([seed, 5]).lognormal(size=52)
        (result,) = compare_groups(DataFrame({"y": values}), group_of_student, GROUP_NAMES, seed, refusals=[])
        covered += result.low <= 0.0 <= result.high
    assert covered > 90
