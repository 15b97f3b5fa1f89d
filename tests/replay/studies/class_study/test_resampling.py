import numpy as np
import pytest
from scipy import stats

from replay.auditing.wilson import wilson_interval
from replay.studies.class_study.resampling import Resampling, interval


def test_ratio_is_sum_over_sum_of_students_with_a_base():
    """1 of 4, 3 of 4 and 0 of 2; five students have nothing to count."""
    result = Resampling(8).ratio(np.array([1, 3, 0, 0, 0, 0, 0, 9]), np.array([4, 4, 2, 0, 0, 0, 0, 0]))
    assert (result.value, result.students) == (4 / 10, 3)
    assert 0.0 <= result.low < 0.4 < result.high <= 1.0


@pytest.mark.parametrize("fraction", [0, 1])
def test_all_or_nothing_has_an_interval(fraction):
    """All of 12 students lose 3 of 3 contacts, or none does: Wilson's interval of 12."""
    result = Resampling(12).ratio(np.full(12, 3.0 * fraction), np.full(12, 3.0))
    assert (result.low, result.high) == wilson_interval(12 * fraction, 12) and result.low < result.high


@pytest.mark.slow
def test_intervals_hold_the_truth_in_about_95_of_100_classes():
    """Students differ more than their contacts do: an interval over contacts alone would hold it in 60."""
    random, kept, classes = np.random.default_rng(1), 0, 300
    for seed in range(classes):
        contacts, tendency = random.integers(5, 40, 30), random.beta(2, 6, 30)
        lost = random.binomial(contacts, tendency)
        result = Resampling(30, seed).ratio(lost, contacts)
        kept += result.low <= 0.25 <= result.high
    assert 0.90 <= kept / classes <= 0.985, kept


EVEN = np.linspace(0.0, 2.0, 2001)
"""Bootstrap estimates that lie evenly about 1."""


def test_ties_with_the_estimate_count_half_on_either_side():
    """Resamples are even about the estimate 1, half of them equal to it: so is the interval."""
    lower, upper = interval(np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0]), 1.0, np.array([0.9, 1.0, 1.1]))
    assert lower + upper == pytest.approx(2.0) and lower < 1.0


def test_interval_is_widened_for_few_students():
    """Four students: quantiles of Student's t with three degrees of freedom, times the root of 4/3."""
    lower, upper = interval(EVEN, 1.0, np.array([0.8, 0.9, 1.1, 1.2]))
    expected = stats.norm.cdf(np.sqrt(4 / 3) * stats.t.ppf([0.025, 0.975], 3))
    assert (lower, upper) == pytest.approx(tuple(2.0 * expected), abs=1e-6)


def test_interval_reaches_farther_where_a_student_raises_the_estimate():
    """The estimate of thirty students is 1; without this student it is 0.7, without any other 1.1.

    Bootstrap estimates lie evenly about 1, so that an interval which reached as far on both sides would sum to 2.
    """
    estimate, without_each = 1.0, np.array([1.1] * 29 + [0.7])
    lower, upper = interval(EVEN, estimate, without_each)
    assert lower + upper > 2.01
    mirrored = interval(2.0 - EVEN, 2.0 - estimate, 2.0 - without_each)
    assert mirrored == pytest.approx((2.0 - upper, 2.0 - lower))


@pytest.mark.parametrize(("estimates", "students"), [(EVEN, 2), (np.full(9, np.nan), 9)])
def test_two_students_or_no_estimates_have_no_interval(estimates, students):
    """``estimates``: of the resamples; the estimates without each student lie evenly from 0.9 to 1.1."""
    assert np.isnan(interval(estimates, 1.0, np.linspace(0.9, 1.1, students))).all()


@pytest.mark.parametrize(("estimate", "nearest"), [(3.0, 2.0), (-1.0, 0.0)])
def test_estimate_beyond_all_resamples_has_the_interval_of_their_end(estimate, nearest):
    """Resamples lie from 0 to 2, and the estimate is larger, or smaller, than all of them."""
    ends = interval(EVEN, estimate, np.linspace(0.9, 1.1, 30))
    assert ends == pytest.approx((nearest, nearest), abs=1e-5)
