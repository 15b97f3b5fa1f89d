import numpy as np
import pytest
from scipy import stats

from replay.studies.class_study.groups import _welch, compare_groups

NAMES = ("first", "second")


def compared(first, second, seed=0):
    refusals = []
    values, group = np.concatenate([first, second]), ["first"] * len(first) + ["second"] * len(second)
    return compare_groups({"motivation": values}, group, NAMES, seed, refusals), refusals


def two(count, apart, spread=1.0, seed=0):
    random = np.random.default_rng(seed)
    return random.normal(3.0, 1.0, count), random.normal(3.0 + apart, spread, count)


def test_the_paper_s_figures_are_those_of_one_pooled_predictor():
    first, second = two(26, 0.8)
    ((one,), _) = compared(first, second)
    line = stats.linregress(np.repeat([0.0, 1.0], 26), np.concatenate([first, second]))
    fit = 1 - (1 - line.rvalue**2) * 51 / 50
    assert (one.pooled_beta, one.pooled_fit, one.pooled_p) == pytest.approx((line.rvalue, fit, line.pvalue))
    assert one.students == (26, 26) and one.means == pytest.approx((first.mean(), second.mean()))
    assert one.difference == pytest.approx(line.slope) and one.low < one.difference < one.high


def test_p_is_that_of_permuting_welchs_statistic_among_few_and_welchs_among_many():
    first, second = two(16, 0.7, spread=2.5)
    second = second[:9]
    ((one,), _) = compared(first, second)

    def welch(a, b, axis):
        return stats.ttest_ind(a, b, axis=axis, equal_var=False).statistic

    sizes = _welch(np.concatenate([first, second]), np.arange(25)[None] >= 16)
    assert sizes == pytest.approx([abs(welch(first, second, 0))])
    other = stats.permutation_test((second, first), welch, vectorized=True, n_resamples=20000, random_state=0).pvalue
    assert one.p_from == "permutation" and one.p == pytest.approx(other, abs=0.02)
    first, second = two(60, 0.4, spread=2.0)
    ((one,), _) = compared(first, second)
    assert one.p_from == "Welch's t"
    assert one.p == pytest.approx(stats.ttest_ind(second, first, equal_var=False).pvalue)


def test_holm_is_across_all_outcomes_of_the_groups():
    random = np.random.default_rng(4)
    variables = {name: random.normal(size=40) for name in ("a", "b", "c")}
    found = compare_groups(variables, NAMES * 20, NAMES, 0, [])
    ordered = sorted(found, key=lambda one: one.p)
    expected = np.maximum.accumulate([min(1.0, one.p * (3 - k)) for k, one in enumerate(ordered)])
    assert [one.p_holm for one in ordered] == pytest.approx(expected.tolist())


@pytest.mark.parametrize(
    ("first", "second", "rule"),
    [(20, 4, "small-cell"), (5, 5, ""), (4, 4, "small-cell"), (0, 20, "small-cell")],
)
def test_a_group_of_fewer_than_five_is_refused(first, second, rule):
    found, refusals = compared(*(np.arange(float(n)) for n in (first, second)))
    assert [one.rule for one in refusals] == ([rule] if rule else []) and len(found) == (not rule)
    if found:
        assert found[0].p_from == "permutation" and found[0].p == pytest.approx(1.0, abs=0.01)


def test_answers_that_are_all_equal_are_refused():
    found, (refused,) = compared(np.full(9, 3.0), np.full(9, 3.0))
    assert not found and refused.rule == "no-variance" and "between first and second" in refused.what


@pytest.mark.parametrize("count", [20, 60])
def test_groups_that_do_not_differ_are_told_apart_in_one_of_twenty(count):
    held = 0
    for seed in range(40):
        ((one,), _) = compared(*two(count // 2, 0.0, spread=3.0, seed=seed))
        held += one.low <= 0.0 <= one.high
    assert held >= 34
