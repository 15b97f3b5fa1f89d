import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.small_worlds import verdict_column, verdicts

from cdcore import Detection, Verdict
from replay.auditing.compare import compare
from replay.auditing.contact_counts import (
    ContactCounts,
    count_contacts,
    count_reports,
    grasped_counts,
    missed_partly,
    missed_whole,
)
from replay.auditing.episodes import episodes
from replay.auditing.fault import FaultKind
from replay.auditing.matching import match_episodes
from replay.auditing.misses import missed_faults
from replay.auditing.outcome import Outcome
from replay.auditing.wilson import INTERVALS_CAPTION, proportion_of_clusters


@pytest.mark.parametrize(
    ("reported", "missed", "late"),
    [
        pytest.param(".CCC.", 0, 0, id="detected"),
        pytest.param(".C.C.", 0, 1, id="interrupted"),
        pytest.param(".....", 1, 0, id="missed"),
    ],
)
def test_grasped_contact_is_detected_missed_or_late(reported, missed, late):
    """A hand holds a body, which it touches in frames 1 to 3. ``reported``: C where the detector says so.

    The one contact is counted as missed or late (``contacts_in_part``), its frames as reported by both or missed.
    """
    subject, oracle = verdict_column(reported), verdict_column(".CCC.")
    contacts = episodes(oracle)
    comparison = compare(subject, oracle, holdings=contacts)
    counts = grasped_counts(comparison, (oracle.verdict, subject.verdict), contacts, [0])
    both = reported.count("C")
    assert counts == {
        "contacts": 1,
        "contacts_missed": missed,
        "contacts_in_part": late,
        "both": both,
        "missed": 3 - both,
        "invented": 0,
    }


def test_contact_is_missed_whole_or_partly_or_not():
    """Four contacts have no counted frame, a reported one, a missed one, and one of each."""
    missed_frames, reported_frames = [0, 0, 1, 1], [0, 1, 0, 1]
    frames_by_outcome = np.zeros((4, len(Outcome)), dtype=int)
    frames_by_outcome[:, Outcome.MISSED] = missed_frames
    frames_by_outcome[:, Outcome.BOTH] = reported_frames
    assert missed_whole(frames_by_outcome).tolist() == [False, False, True, False]
    assert missed_partly(frames_by_outcome).tolist() == [False, False, False, True]


def by_hand(oracle, subject):
    """Counts of the contacts of one pair, by a walk over letters: C contact, . clear, u undecided.

    Contacts late or cut short, missed whole, undecided whole, undecided in some frame; and the frames undecided.
    """
    counts = np.zeros(5, dtype=int)
    for contact in re.finditer("C+", oracle):
        reported = subject[contact.start() : contact.end()]
        has_reported, has_missed, has_undecided = (letter in reported for letter in "C.u")
        late_or_cut_short = has_reported and has_missed
        missed = has_missed and not has_reported
        undecided = not has_missed and not has_reported
        counts += [late_or_cut_short, missed, undecided, has_undecided, reported.count("u")]
    return counts


CODES = st.lists(st.tuples(st.sampled_from(".CCu"), st.sampled_from(".Cu")), min_size=1, max_size=40)
"""What the reference and the detector say of a pair in each frame: C contact, . clear, u undecided."""


@given(CODES, CODES)
def test_missed_and_late_counts_agree_with_counting_by_hand(first_pair, second_pair):
    """Contacts of two pairs are counted as by ``by_hand``, and as misses and matches of the same comparison are."""
    frames = min(len(first_pair), len(second_pair))
    reference_rows, subject_rows = [], []
    for (reference_of_1, subject_of_1), (reference_of_2, subject_of_2) in zip(first_pair, second_pair, strict=False):
        reference_rows.append(reference_of_1 + reference_of_2)
        subject_rows.append(subject_of_1 + subject_of_2)
    oracle, subject = verdicts(reference_rows), verdicts(subject_rows)
    comparison, truth = compare(subject, oracle), episodes(oracle)

    counts = count_contacts(comparison, truth)
    expected = sum(by_hand(*map("".join, zip(*pair[:frames], strict=True))) for pair in (first_pair, second_pair))
    assert expected.tolist() == [
        counts.late_or_cut_short,
        counts.missed,
        counts.undecided,
        counts.with_undecided_frames,
        counts.frames_undecided,
    ]
    assert counts.contacts == len(truth)
    assert counts.missed_numbers == list(match_episodes(comparison, truth, episodes(subject), counts).missed)

    misses = missed_faults(comparison=comparison, contacts=truth, names=[("a", "b"), ("a", "c")], times=oracle.times)
    never_reported = {miss.contact for miss in misses if miss.kind == FaultKind.NEVER_REPORTED}
    assert counts.missed_numbers == sorted(never_reported)
    assert counts.late_or_cut_short == len({miss.contact for miss in misses}) - counts.missed


def drawn_proportions(random, contacts, every=4, length_spread=0.8, wholly_missed=0.0):
    """Proportions missed, false, and of faces listed, of a random session: the detector samples ``every``-th frame.

    Contacts last about 0.12 s at 90 Hz (lognormal, of this spread), with pauses of 20 to 89 frames. A fraction
    ``wholly_missed`` of the contacts is ten times as long, and missed whole.
    """
    frames = np.maximum(np.rint(90 * random.lognormal(np.log(0.12), length_spread, contacts)), 1).astype(int)
    lost = random.random(contacts) < wholly_missed if wholly_missed else np.zeros(contacts, dtype=bool)
    frames[lost] *= 10
    lasting = np.column_stack([random.integers(20, 90, contacts), frames]).ravel()
    truth = np.append(np.repeat(np.tile([False, True], contacts), lasting), [False] * every)
    at = np.arange(len(truth))
    reported = truth[np.maximum(at - (at - random.integers(every)) % every, 0)]
    reported[:-every] &= np.repeat(np.column_stack([~lost, ~lost]).ravel(), lasting)
    subject, oracle = (
        Detection("x", ("a", "b"), np.array([[0, 1]]), at / 90,
                  np.where(mask, Verdict.CONTACT, Verdict.CLEAR).astype(np.uint8)[:, None], "instants")
        for mask in (reported, truth)
    )  # fmt: skip
    comparison, faces = compare(subject, oracle), frames * random.integers(5, 50, contacts)
    return {
        "missed": count_contacts(comparison, episodes(oracle)).proportion(Outcome.MISSED),
        "false": count_reports(comparison).proportion(Outcome.FALSE_CONTACT),
        "faces": proportion_of_clusters(random.binomial(faces, random.beta(8, 1, contacts)), faces),
    }


@pytest.mark.slow
@pytest.mark.parametrize(
    ("contacts", "every", "length_spread"),
    [
        pytest.param(18, 4, 0.8, id="18 contacts, 22.5 Hz"),
        pytest.param(12, 4, 1.0, id="12 contacts of more unequal lengths"),
        pytest.param(18, 9, 0.8, id="18 contacts, 10 Hz"),
        pytest.param(30, 4, 0.8, id="30 contacts, 22.5 Hz"),
    ],
)
def test_intervals_cover_the_true_proportion_in_95_percent_of_sessions(contacts, every, length_spread):
    """400 random sessions; the proportion of 20,000 contacts stands for the true one.

    Of each proportion (missed, false, faces listed) 95 % of the intervals hold the true value. 2 points are allowed:
    about twice the standard error of 400 draws, sqrt(0.95 * 0.05 / 400) = 1.1 points.
    """
    random = np.random.default_rng(16)
    true = drawn_proportions(random, contacts=20_000, every=every, length_spread=length_spread)
    sessions = [drawn_proportions(random, contacts, every, length_spread) for _ in range(400)]
    for name, of_all in true.items():
        covered = np.mean([drawn[name].lower <= of_all.value <= drawn[name].upper for drawn in sessions])
        assert 0.93 <= covered <= 0.97, name


@pytest.mark.slow
@pytest.mark.parametrize(("contacts", "least_coverage", "most_coverage"), [(18, 0.5, 0.7), (60, 0.75, 0.9)])
def test_intervals_cover_less_where_misses_cluster_in_long_contacts(contacts, least_coverage, most_coverage):
    """One contact in twenty is ten times as long and missed whole; then intervals of 95 % cover about 60 or 85 %.

    Coverage was measured, and is of 200 random sessions. The caption of the intervals warns of this case.
    """
    random = np.random.default_rng(16)
    true = drawn_proportions(random, contacts=20_000, wholly_missed=0.05)["missed"].value
    sessions = [drawn_proportions(random, contacts, wholly_missed=0.05)["missed"] for _ in range(200)]
    covered = np.mean([drawn.lower <= true <= drawn.upper for drawn in sessions])
    assert least_coverage <= covered <= most_coverage
    assert "They are too narrow where contacts are few and the missed ones are long" in INTERVALS_CAPTION


def test_reports_are_counted_by_segments_joined_by_tolerance():
    """A string is a frame, a letter a pair. Frame 2 of pair 1 is within tolerance: it joins frames 1 and 3.

    Three segments are reported: frames 0 to 2 and frame 4 of pair 0, and frames 1 to 3 of pair 1. Of their 6 frames
    beside the one within tolerance 4 are false: 0 and 4 of pair 0, 1 and 3 of pair 1.
    """
    subject = verdicts(["C.", "CC", "CC", ".C", "C."])
    oracle = verdicts(["..", "C.", "C.", "..", ".."])

    def within_tolerance(frames, pairs):
        return (frames == 2) & (pairs == 1)

    counts = count_reports(compare(subject, oracle, within=within_tolerance))
    pair_of_each_segment_by_time = counts.pairs.tolist()
    assert pair_of_each_segment_by_time == [0, 1, 0]
    false = counts.proportion(Outcome.FALSE_CONTACT)
    assert (false.count, false.of, false.clusters) == (4, 6, 3)


def test_contacts_without_a_decided_frame_are_undecided():
    """Four contacts of two pairs: the first was left out in all its three frames, the second in one of three.

    The third was missed; the last lies within the tolerance alone. So one is undecided, and another has undecided
    frames: 4 in all.
    """
    frames = np.zeros((4, len(Outcome)), dtype=np.int64)
    frames[0, Outcome.LEFT_OUT] = 3
    frames[1, [Outcome.LEFT_OUT, Outcome.BOTH]] = 1, 2
    frames[2, Outcome.MISSED] = 2
    frames[3, Outcome.WITHIN_TOLERANCE] = 1
    counts = ContactCounts(np.arange(1, 5), np.array([0, 1, 0, 1]), frames)
    assert (counts.undecided, counts.with_undecided_frames, counts.frames_undecided) == (1, 2, 4)
    assert counts.missed_numbers == [3]
    assert [counts.of_pair(pair).numbers.tolist() for pair in (0, 1)] == [[1, 3], [2, 4]]
