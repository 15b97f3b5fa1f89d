import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.small_worlds import verdict_column, verdicts

from cdcore import Detection, Verdict
from replay.auditing.compare import compare
from replay.auditing.contact_counts import count_contacts, count_reports, grasped_counts, missed_partly, missed_whole
from replay.auditing.episodes import episodes
from replay.auditing.fault import FaultKind
from replay.auditing.matching import match_episodes
from replay.auditing.misses import missed_faults
from replay.auditing.outcome import Outcome
from replay.auditing.wilson import INTERVALS_CAPTION, proportion_of_clusters


@pytest.mark.parametrize(("reported", "missed", "late"), [(".CCC.", 0, 0), (".C.C.", 0, 1), (".....", 1, 0)])
def test_grasped_contact_is_detected_missed_or_late(reported, missed, late):
    """``reported``: a letter a frame, by the detector. The contact is in frames 1 to 3, and a hand holds the body."""
    subject, oracle = verdict_column(reported), verdict_column(".CCC.")
    contacts = episodes(oracle)
    comparison = compare(subject, oracle, holdings=contacts)
    counts = grasped_counts(comparison, (oracle.verdict, subject.verdict), contacts, [0])
    both = reported.count("C")
    contacts = {"contacts": 1, "contacts_missed": missed, "contacts_in_part": late}
    assert counts == {**contacts, "both": both, "missed": 3 - both, "invented": 0}


def test_contact_is_missed_whole_or_partly_or_not():
    """A row a contact: undecided, reported, missed, and both."""
    frames_by_outcome = np.zeros((4, len(Outcome)), dtype=int)
    frames_by_outcome[:, Outcome.MISSED] = [0, 0, 1, 1]
    frames_by_outcome[:, Outcome.BOTH] = [0, 1, 0, 1]
    assert missed_whole(frames_by_outcome).tolist() == [False, False, True, False]
    assert missed_partly(frames_by_outcome).tolist() == [False, False, False, True]


def by_hand(oracle, subject):
    """(in part, missed, undecided, with frames undecided, these frames) of one pair, by a walk over letters."""
    counts = np.zeros(5, dtype=int)
    for contact in re.finditer("C+", oracle):
        reported = subject[contact.start() : contact.end()]
        result, lost, left = (letter in reported for letter in "C.u")
        known = result or lost
        counts += [result and lost, lost and not result, not known, left, reported.count("u")]
    return counts


CODES = st.lists(st.tuples(st.sampled_from(".CCu"), st.sampled_from(".Cu")), min_size=1, max_size=40)


@given(CODES, CODES)
def test_missed_and_late_counts_agree_with_counting_by_hand(first, second):
    """Two pairs; ``CODES`` are (reference, detector) in each frame, which ``by_hand`` counts one by one."""
    size = min(len(first), len(second))
    rows = [["".join(two[k] for two in pair) for pair in zip(first[:size], second[:size], strict=True)] for k in (0, 1)]
    oracle, subject = (verdicts(side) for side in rows)
    comparison, truth, result = compare(subject, oracle), episodes(oracle), episodes(subject)
    item = count_contacts(comparison, truth)
    hand = sum(by_hand(*map("".join, zip(*column[:size], strict=True))) for column in (first, second))
    reported = [item.late_or_cut_short, item.missed, item.undecided, item.with_undecided_frames, item.frames_undecided]
    assert reported == hand.tolist() and item.contacts == len(truth)
    assert item.missed_numbers == list(match_episodes(comparison, truth, result, item).missed)
    lost = missed_faults(comparison=comparison, contacts=truth, names=[("a", "b"), ("a", "c")], times=oracle.times)
    assert item.missed_numbers == sorted({miss.contact for miss in lost if miss.kind == FaultKind.NEVER_REPORTED})
    assert item.late_or_cut_short == len({miss.contact for miss in lost}) - item.missed


def drawn_proportions(random, contacts, every=4, longest=0.8, unseen=0.0):
    """Shares missed, invented, and of faces listed, by a detector that looks at each ``every``-th frame of 90 Hz.

    A share ``unseen`` of the contacts is ten times as long, and missed whole.
    """
    frames = np.maximum(np.rint(90 * random.lognormal(np.log(0.12), longest, contacts)), 1).astype(int)
    lost = random.random(contacts) < unseen if unseen else np.zeros(contacts, dtype=bool)
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
        "invented": count_reports(comparison).proportion(Outcome.FALSE_CONTACT),
        "faces": proportion_of_clusters(random.binomial(faces, random.beta(8, 1, contacts)), faces),
    }


@pytest.mark.slow
@pytest.mark.parametrize(("contacts", "every", "longest"), [(18, 4, 0.8), (12, 4, 1.0), (18, 9, 0.8), (30, 4, 0.8)])
def test_intervals_cover_the_true_proportion_in_95_percent_of_sessions(contacts, every, longest):
    """400 sessions of so many contacts, sampled in each ``every``-th frame, beside 20,000 contacts as the truth."""
    random = np.random.default_rng(16)
    truth = drawn_proportions(random, contacts=20_000, every=every, longest=longest)
    sessions = [drawn_proportions(random, contacts, every, longest) for _ in range(400)]
    for what, of_all in truth.items():
        kept = [item[what].lower <= of_all.value <= item[what].upper for item in sessions]
        assert 0.93 <= np.mean(kept) <= 0.97, (what, np.mean(kept))


@pytest.mark.slow
@pytest.mark.parametrize("contacts, least, most", [(18, 0.5, 0.7), (60, 0.75, 0.9)])
def test_intervals_cover_less_where_misses_cluster_in_long_contacts(contacts, least, most):
    """One contact in twenty is ten times as long and missed whole. ``least``, ``most``: measured coverage."""
    random = np.random.default_rng(16)
    truth = drawn_proportions(random, contacts=20_000, unseen=0.05)["missed"].value
    sessions = [drawn_proportions(random, contacts, unseen=0.05)["missed"] for _ in range(200)]
    assert least <= np.mean([item.lower <= truth <= item.upper for item in sessions]) <= most
    assert "They are too narrow where contacts are few and the missed ones are long" in INTERVALS_CAPTION


def test_reports_are_counted_by_segments_joined_by_tolerance():
    """A string is a frame, a letter a pair. Frame 2 of pair 1 is within tolerance: it joins frames 1 and 3.

    Three segments are reported: frames 0 to 2 and frame 4 of pair 0, and frames 1 to 3 of pair 1. Of their 6 frames
    beside the one within tolerance 4 are false: 0 and 4 of pair 0, 1 and 3 of pair 1.
    """
    subject = verdicts(["C.", "CC", "CC", ".C", "C."])
    oracle = verdicts(["..", "C.", "C.", "..", ".."])
    within = lambda frames, columns: (frames == 2) & (columns == 1)  # noqa: E731
    counts = count_reports(compare(subject, oracle, within=within))
    pair_of_each_segment_by_time = counts.pairs.tolist()
    assert pair_of_each_segment_by_time == [0, 1, 0]
    false = counts.proportion(Outcome.FALSE_CONTACT)
    assert false.count == 4 and false.of == 6 and false.clusters == 3
