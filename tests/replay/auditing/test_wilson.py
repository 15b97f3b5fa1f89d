import numpy as np
import pytest
from scipy.stats import binomtest, norm, t

from replay.auditing.wilson import Proportion, pooled_proportion, proportion, proportion_of_clusters, wilson_interval


@pytest.mark.parametrize(("count", "of"), [(0, 5), (5, 5), (1, 7), (865, 1000), (3, 100_000)])
def test_interval_equals_scipys(count, of):
    """The interval is that of 95 %."""
    expected = binomtest(count, of).proportion_ci(0.95, method="wilson")
    assert wilson_interval(count, of) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_nothing_counted_leaves_everything_open():
    """A proportion of 0 trials may be anything from 0 to 1, and has no value."""
    assert wilson_interval(0, 0) == (0.0, 1.0)
    assert proportion(0, 0) == Proportion(count=0, of=0, value=None, lower=0.0, upper=1.0)


def bounds_of(part):
    """Both ends of the interval of a proportion."""
    return part.lower, part.upper


@pytest.mark.parametrize("frames", [1, 40])
def test_confidence_interval_counts_contacts_and_not_their_frames(frames):
    """0 of 18 contacts has Wilson's interval 0 to 17.6 %, whether each lasts 1 or 40 frames.

    All 18 of 18 have that of 18 trials too; a 19th contact of no frames changes nothing.
    """
    none, whole = proportion_of_clusters([0] * 18, [frames] * 18), proportion_of_clusters([frames] * 18, [frames] * 18)
    assert bounds_of(none) == wilson_interval(0, 18) == (0.0, pytest.approx(0.176, abs=5e-4))
    assert bounds_of(whole) == wilson_interval(18, 18) and (none.count, none.of, none.clusters) == (0, 18 * frames, 18)
    assert bounds_of(proportion_of_clusters([0] * 19, [frames] * 18 + [0])) == wilson_interval(0, 18)


def test_equal_fractions_in_every_contact_count_as_independent_frames():
    """10 % of each of three contacts, of 180 frames in all."""
    assert bounds_of(proportion_of_clusters([3, 6, 9], [30, 60, 90])) == pytest.approx(
        wilson_interval(18, 180), abs=1e-9
    )


def test_interval_of_wholly_missed_contacts_is_about_wilsons():
    """3 of 20 contacts are missed in all of their 10 frames."""
    lower, upper = bounds_of(proportion_of_clusters([10] * 3 + [0] * 17, [10] * 20))
    few_lower, few_upper = wilson_interval(3, 20)
    assert lower < few_lower and few_upper < upper < few_upper + 0.05


def test_equal_contacts_widen_the_interval_by_students_quantile():
    """3 of 20 equal contacts are missed whole: 19 degrees of freedom, and the mean over 19 of 20 contacts."""
    widening = t.ppf(0.975, df=19) / norm.ppf(0.975)
    draws = 19**2 / 20 / widening**2
    missed = proportion_of_clusters([10] * 3 + [0] * 17, [10] * 20)
    assert bounds_of(missed) == pytest.approx(wilson_interval(0.15 * draws, draws), rel=1e-6)


def test_single_or_dominating_contact_counts_as_a_single_draw():
    """Half of one contact is missed: as wide as half of a sample of one."""
    assert bounds_of(proportion_of_clusters([5], [10])) == wilson_interval(0.5, 1)
    assert bounds_of(proportion_of_clusters([500, 0], [1000, 1])) == pytest.approx(wilson_interval(0.5, 1), abs=1e-3)


def test_face_pairs_of_an_hour_do_not_overflow():
    """Counts of up to 3e10, whose squares exceed 64 bits, have the interval of counts of 3,000."""
    ends_of = [bounds_of(proportion_of_clusters([size, 0, 2 * size], [3 * size] * 3)) for size in (10**3, 10**10)]
    assert ends_of[0] == pytest.approx(ends_of[1])


def test_intervals_pooled_over_sessions_equal_one_over_all():
    """30 contacts in one session, or 11 in a first and 19 in a second."""
    random = np.random.default_rng(2)
    of = random.integers(1, 50, 30)
    counts = random.binomial(of, 0.3)
    pieces = [proportion_of_clusters(counts[a:b], of[a:b]) for a, b in ((0, 11), (11, 30))]
    assert pooled_proportion(pieces) == proportion_of_clusters(counts, of)
    assert pooled_proportion([proportion(1, 4), proportion(2, 5)]) == proportion(3, 9)
