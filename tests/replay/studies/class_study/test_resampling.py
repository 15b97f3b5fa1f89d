import numpy as np
import pytest
from scipy import stats

from replay.auditing.wilson import wilson_interval
from replay.studies.class_study.resampling import Resampling, interval


def test_ratio_is_sum_over_sum_of_students_with_a_base():
    """Students missed 1 of 4, 3 of 4 and 0 of 2 contacts; five others have no contact, though one of them misses 9."""
    missed = np.array([1, 3, 0, 0, 0, 0, 0, 9])
    contacts = np.array([4, 4, 2, 0, 0, 0, 0, 0])
    result = Resampling(students=8).ratio(missed, contacts)
    assert (result.value, result.students) == ((1 + 3 + 0) / (4 + 4 + 2), 3)
    assert 0.0 <= result.low < result.value < result.high <= 1.0


@pytest.mark.parametrize("fraction", [0, 1])
def test_all_or_nothing_has_an_interval(fraction):
    """Each of 12 students misses 3 of 3 contacts, or each none, so that all resamples are equal.

    The interval is then Wilson's of 12 students, of whom all or none missed.
    """
    contacts = np.full(12, 3.0)
    result = Resampling(students=12).ratio(contacts * fraction, contacts)
    assert (result.low, result.high) == wilson_interval(12 * fraction, 12)
    assert result.low < result.high


@pytest.mark.slow
def test_intervals_hold_the_truth_in_about_95_of_100_classes():
    """30 students with 5 to 39 contacts each, who miss them with a chance of their own, 2 / (2 + 6) on average.

    Students differ more than their contacts do: an interval over contacts alone would hold the truth in 60 of 100.
    Around 95 % the bounds leave 5 % below and 3.5 % above: three standard errors of 300 classes are 3.8 %.
    """
    random, covered, classes = np.random.default_rng(1), 0, 300
    for seed in range(classes):
        contacts, chances = random.integers(5, 40, 30), random.beta(2, 6, 30)
        missed = random.binomial(contacts, chances)
        result = Resampling(students=30, seed=seed).ratio(missed, contacts)
        covered += result.low <= 2 / (2 + 6) <= result.high
    assert 0.90 <= covered / classes <= 0.985


EVEN = np.linspace(0.0, 2.0, 2001)
"""Bootstrap estimates that lie evenly between 0 and 2, about the estimate 1."""


def test_ties_with_the_estimate_count_half_on_either_side():
    """Eight resamples are even about the estimate 1, four of them equal to it: so the interval is even about 1."""
    resamples = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0])
    lower, upper = interval(resamples, estimate=1.0, jackknife_estimates=np.array([0.9, 1.0, 1.1]))
    assert lower + upper == pytest.approx(2.0)
    assert lower < 1.0


def test_interval_is_widened_for_few_students():
    """Four students: quantiles of Student's t with three degrees of freedom, times the root of 4/3.

    The estimates without each student are even about 1, so that nothing else moves the interval. A quantile q of
    resamples that lie evenly from 0 to 2 is 2 q.
    """
    lower, upper = interval(EVEN, estimate=1.0, jackknife_estimates=np.array([0.8, 0.9, 1.1, 1.2]))
    quantiles = stats.norm.cdf(np.sqrt(4 / 3) * stats.t.ppf([0.025, 0.975], df=3))
    assert (lower, upper) == pytest.approx(tuple(2.0 * quantiles), abs=1e-6)


def test_interval_reaches_farther_where_a_student_raises_the_estimate():
    """The estimate of thirty students is 1; without one of them it is 0.7, without any other 1.1.

    Resamples lie evenly from 0 to 2, so that ends that are even about 1 would sum to 2; the upper end is farther away.
    With all estimates mirrored at 1 the ends are mirrored.
    """
    estimate, without_each = 1.0, np.array([1.1] * 29 + [0.7])
    lower, upper = interval(EVEN, estimate, without_each)
    assert lower + upper > 2.01, "farther by more than rounding"
    mirrored = interval(2.0 - EVEN, 2.0 - estimate, 2.0 - without_each)
    assert mirrored == pytest.approx((2.0 - upper, 2.0 - lower))


@pytest.mark.parametrize(
    ("resamples", "students"),
    [(EVEN, 2), (np.full(9, np.nan), 9)],
    ids=["two students", "no resample with an estimate"],
)
def test_two_students_or_no_estimates_have_no_interval(resamples, students):
    """``resamples``: estimates of each resample; those without each student lie evenly from 0.9 to 1.1."""
    ends = interval(resamples, estimate=1.0, jackknife_estimates=np.linspace(0.9, 1.1, students))
    assert np.isnan(ends).all()


@pytest.mark.parametrize(("estimate", "nearest"), [(3.0, 2.0), (-1.0, 0.0)])
def test_estimate_beyond_all_resamples_has_the_interval_of_their_end(estimate, nearest):
    """Resamples lie from 0 to 2, and the estimate is larger, or smaller, than all of them."""
    ends = interval(EVEN, estimate, jackknife_estimates=np.linspace(0.9, 1.1, 30))
    assert ends == pytest.approx((nearest, nearest), abs=1e-5)
