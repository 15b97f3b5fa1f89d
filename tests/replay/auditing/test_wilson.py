import numpy as np
import pytest
from scipy.stats import binomtest, norm, t

from replay.auditing.wilson import Proportion, pooled_proportion, proportion, proportion_of_clusters, wilson_interval


@pytest.mark.parametrize(("count", "of"), [(0, 5), (5, 5), (1, 7), (865, 1000), (3, 100_000)])
def test_interval_equals_scipys(count, of):
    """Wilson's interval at 95 % of ``count`` of ``of``, none and all of them included."""
    expected = binomtest(count, of).proportion_ci(confidence_level=0.95, method="wilson")
    assert wilson_interval(count, of) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_nothing_counted_leaves_everything_open():
    """A proportion of 0 trials may be anything from 0 to 1, and has no value."""
    assert wilson_interval(0, 0) == (0.0, 1.0)
    assert proportion(0, 0) == Proportion(count=0, of=0, value=None, lower=0.0, upper=1.0)


def bounds_of(counted):
    """Both ends of the interval of a proportion."""
    return counted.lower, counted.upper


def missed_of_contacts(missed_frames, frames):
    """The proportion of contact frames that are missed, frames drawn in contacts: missed and all frames of each."""
    return proportion_of_clusters(counts=missed_frames, cluster_wholes=frames)


@pytest.mark.parametrize("frames", [1, 40])
def test_confidence_interval_counts_contacts_and_not_their_frames(frames):
    """0 of 18 contacts missed has Wilson's interval of 0 of 18, 0 to 17.6 %, whether each lasts 1 or 40 frames.

    All 18 missed has that of 18 of 18 trials too.
    """
    none_missed = missed_of_contacts([0] * 18, [frames] * 18)
    all_missed = missed_of_contacts([frames] * 18, [frames] * 18)
    assert bounds_of(none_missed) == wilson_interval(0, 18) == (0.0, pytest.approx(0.176, abs=5e-4))
    assert bounds_of(all_missed) == wilson_interval(18, 18)
    assert (none_missed.count, none_missed.of, none_missed.clusters) == (0, 18 * frames, 18)


def test_contact_without_frames_changes_no_interval():
    """A 19th contact, of no frames, beside 18 of 40 frames each, none of them missed."""
    assert bounds_of(missed_of_contacts([0] * 19, [40] * 18 + [0])) == wilson_interval(0, 18)


def test_equal_fractions_in_every_contact_count_as_independent_frames():
    """10 % of each of three contacts is missed: contacts do not differ, so the 180 frames count one by one."""
    proportion_missed = missed_of_contacts([3, 6, 9], [30, 60, 90])
    assert bounds_of(proportion_missed) == pytest.approx(wilson_interval(18, 180), abs=1e-9)


def test_interval_of_wholly_missed_contacts_is_about_wilsons():
    """3 of 20 contacts of 10 frames are missed whole: Wilson's interval of 3 of 20, a little wider at both ends."""
    lower, upper = bounds_of(missed_of_contacts([10] * 3 + [0] * 17, [10] * 20))
    wilsons_lower, wilsons_upper = wilson_interval(3, 20)
    a_little = 0.05
    assert wilsons_lower - a_little < lower < wilsons_lower
    assert wilsons_upper < upper < wilsons_upper + a_little


def test_equal_contacts_widen_the_interval_by_students_quantile():
    """3 of 20 equal contacts are missed whole: the interval is wider than Wilson's as Student's t is than the normal.

    By Rao and Scott's formula 20 contacts, each compared with the mean of the other 19, count as 19^2 / 20 draws; t has
    19 degrees of freedom.
    """
    t_over_normal = t.ppf(0.975, df=19) / norm.ppf(0.975)
    draws = 19**2 / 20 / t_over_normal**2
    missed = missed_of_contacts([10] * 3 + [0] * 17, [10] * 20)
    assert bounds_of(missed) == pytest.approx(wilson_interval(3 / 20 * draws, draws), rel=1e-6)


def test_single_or_dominating_contact_counts_as_a_single_draw():
    """Half of one contact is missed, alone or beside a contact of a single frame: as wide as half of a sample of 1."""
    assert bounds_of(missed_of_contacts([5], [10])) == wilson_interval(0.5, 1)
    beside_a_tap = missed_of_contacts([500, 0], [1000, 1])
    assert bounds_of(beside_a_tap) == pytest.approx(wilson_interval(0.5, 1), abs=1e-3)


def test_face_pairs_of_an_hour_do_not_overflow():
    """Three contacts of which a third, nothing and two thirds is missed have one interval for counts of any size.

    The squares of counts of up to 3e10 exceed 64 bits; those of up to 3,000 do not.
    """
    few, many = (missed_of_contacts([size, 0, 2 * size], [3 * size] * 3) for size in (10**3, 10**10))
    assert bounds_of(few) == pytest.approx(bounds_of(many))


def test_intervals_pooled_over_sessions_equal_one_over_all():
    """30 random contacts, 30 % of their frames missed: of one session, or 11 of a first and 19 of a second."""
    random = np.random.default_rng(2)
    frames = random.integers(1, 50, 30)
    missed = random.binomial(frames, 0.3)
    sessions = [missed_of_contacts(missed[:11], frames[:11]), missed_of_contacts(missed[11:], frames[11:])]
    assert pooled_proportion(sessions) == missed_of_contacts(missed, frames)


def test_counts_without_clusters_are_pooled_by_their_sums():
    """1 of 4 in one session and 2 of 5 in another, each drawn by itself, are 3 of 9, with the interval of that."""
    assert pooled_proportion([proportion(1, 4), proportion(2, 5)]) == proportion(3, 9)
