"""The loss of planted contacts: a closed form, and never greater for more samples of the same detector."""

from itertools import pairwise
from math import sqrt
from types import SimpleNamespace

import numpy as np
import pytest

from cdcore import Detection, Verdict
from replay.auditing.compare import compare
from replay.auditing.episodes import episodes
from replay.auditing.loss import fraction_of, loss, lost_contact
from replay.auditing.sampling_offsets import offset_counts
from replay.auditing.wilson import proportion

FRAME_RATE_HZ = 90
CYCLE = 45
"""Frames between two samples at 2 Hz; a multiple of the frames between samples at each rate below."""

RATES = (2, 6, 10, 18, 30, 90)


def detection(contact):
    """A detection of one pair at 90 Hz that sees contact in the frames for which ``contact`` (T,) is true."""
    verdict = np.where(contact, Verdict.CONTACT, Verdict.CLEAR).astype(np.uint8)[:, None]
    times = np.arange(len(contact)) / FRAME_RATE_HZ
    return Detection("own", ("a", "b"), np.array([[0, 1]]), times, verdict, "instants")


def losses_at_rates(contact, seen=None):
    """The loss of a detector at each of ``RATES`` that sees contact where ``seen`` is true, beside the true contact."""
    truth = detection(contact)
    contacts = episodes(truth)
    reference = SimpleNamespace(contacts=contacts, compare=lambda subject: compare(subject, truth))
    every = detection(contact if seen is None else seen)
    result = []
    for rate in RATES:
        fractions = offset_counts(rate, every, reference).proportions()
        result.append(loss(fractions["contacts_missed"], fractions["missed"], fractions["false_contact"]))
    return result


def at_every_phase(lengths):
    """Contacts of these lengths in frames, one at each phase of a cycle, far from one another."""
    blocks = [np.zeros(4 * CYCLE, np.bool_)]
    for length in lengths:
        for phase in range(CYCLE):
            block = np.zeros(CYCLE * (4 + length // CYCLE), np.bool_)
            block[CYCLE + phase : CYCLE + phase + length] = True
            blocks.append(block)
    return np.concatenate(blocks)


def closed_form(lengths, period):
    """The loss of contacts of lengths in frames, sampled at each phase of a period, without a single sample taken."""
    phases = np.arange(period)[:, None]
    first = np.minimum(phases, np.array(lengths))  # frames of a contact before the first sample in it
    missed = phases >= np.array(lengths)
    last = phases + (np.array(lengths) - 1 - phases) // period * period  # the last sample in it
    late = np.where(missed, 0, last + period - np.array(lengths))  # frames for which its answer stands after the end
    reported = np.where(missed, 0, np.array(lengths) - first)
    return missed.mean() + first.sum() / (period * sum(lengths)) + late.sum() / (late.sum() + reported.sum())


@pytest.mark.sampled(4)
@pytest.mark.parametrize("lengths", [(1,), (12,), (60,), (2, 9, 47)])
def test_planted_contacts_give_the_closed_form_of_the_loss(lengths):
    """Contacts of the given frames begin at every phase of the sampling; a lower rate loses more."""
    measured = losses_at_rates(at_every_phase(lengths))
    assert measured == pytest.approx([closed_form(lengths, FRAME_RATE_HZ // rate) for rate in RATES])
    assert all(slow >= quick for slow, quick in pairwise(measured)) and measured[-1] == 0.0


def test_more_samples_rank_no_worse_than_chance_allows():
    """Twelve random recordings, each sampled at rising rates by a detector with faults."""
    random = np.random.default_rng(7)
    differences = []
    for _ in range(12):
        contact, visited = np.zeros((2, 1500), np.bool_)
        for start in np.sort(random.integers(0, 1450, 8)):
            length = 1 + int(random.exponential(14))
            contact[start : start + length] = True
            # The detector has faults of its own: it begins early, ends early, or sees nothing.
            if random.random() > 0.1:
                visited[max(0, start - random.integers(0, 4)) : start + random.integers(1, length + 2)] = True
        differences.append(np.diff(losses_at_rates(contact, visited)))
    mean, error = np.mean(differences, axis=0), np.std(differences, axis=0, ddof=1) / sqrt(len(differences))
    # From rate to rate the loss grows by no more than twice the standard error of 12 recordings.
    assert (mean <= 2 * error).all() and mean[0] < 0


@pytest.mark.parametrize(
    ("missed", "time_missed", "time_false", "undecided", "total"),
    [
        (proportion(0, 18), proportion(0, 100), proportion(0, 100), 0.0, 0.0),
        (proportion(18, 18), proportion(100, 100), proportion(0, 0), 0.0, 2.0),
        (proportion(0, 18), proportion(0, 100), proportion(86, 100), 0.0, 0.86),
        (proportion(9, 18), proportion(25, 100), proportion(10, 100), 0.0, 0.85),
        (proportion(0, 18), proportion(0, 0), proportion(0, 0), 0.5, 0.5),
        (None, None, None, 0.0, 0.0),
    ],
)
def test_a_loss_adds_contacts_missed_time_missed_and_time_false(missed, time_missed, time_false, undecided, total):
    """Proportions are (count, of): 9 of 18, 25 of 100 and 10 of 100 add up to 0.5 + 0.25 + 0.10."""
    assert loss(missed, time_missed, time_false, undecided) == pytest.approx(total)
    assert lost_contact(missed, time_missed, undecided) <= total


def test_a_missed_tap_outweighs_missed_frames_of_long_contacts():
    """One frame and one contact of 18 are missed (0.001 + 0.056), or 50 of 1000 frames and no contact (0.05)."""
    tap = loss(contacts_missed=proportion(1, 18), time_missed=proportion(1, 1000), time_false=proportion(0, 0))
    frames = loss(contacts_missed=proportion(0, 18), time_missed=proportion(50, 1000), time_false=proportion(0, 0))
    assert tap > frames


def test_fraction_of_nothing_is_zero():
    """Nothing was counted, there is no whole to count of, and a quarter."""
    assert [fraction_of(counted) for counted in (None, proportion(0, 0), proportion(1, 4))] == [0.0, 0.0, 0.25]
