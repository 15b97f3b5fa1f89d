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
"""Samples a second; each divides the 90 frames a second."""


def detection(contact):
    """A detection of one pair at 90 Hz that sees contact in the frames for which ``contact`` (T,) is true."""
    verdict = np.where(contact, Verdict.CONTACT, Verdict.CLEAR).astype(np.uint8)[:, None]
    times = np.arange(len(contact)) / FRAME_RATE_HZ
    return Detection("own", ("a", "b"), np.array([[0, 1]]), times, verdict, "instants")


def losses_at_rates(contact, seen=None):
    """The loss of a detector that samples at each of ``RATES``, over 16 offsets of the first sample.

    Contact is true in the frames of ``contact`` (T,); a sample reports it where ``seen`` is true, or where it is.
    """
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
    """The loss of contacts of these lengths, sampled each ``period`` frames: contacts and time missed, and false time.

    Each contact begins at every phase of the sampling once; no sample is taken here.
    """
    phases = np.arange(period)[:, None]  # frames from the begin of a contact to the next sample
    first = np.minimum(phases, np.array(lengths))  # frames of a contact before the first sample in it
    missed = phases >= np.array(lengths)
    last = phases + (np.array(lengths) - 1 - phases) // period * period  # the last sample in it
    late = np.where(missed, 0, last + period - np.array(lengths))  # frames for which its answer stands after the end
    reported = np.where(missed, 0, np.array(lengths) - first)
    contacts_missed = missed.mean()
    time_missed = first.sum() / (period * sum(lengths))
    time_false = late.sum() / (late.sum() + reported.sum())
    return contacts_missed + time_missed + time_false


@pytest.mark.sampled(4)
@pytest.mark.parametrize("lengths", [(1,), (12,), (60,), (2, 9, 47)])
def test_planted_contacts_give_the_closed_form_of_the_loss(lengths):
    """Contacts of these lengths in frames begin at every phase of the sampling; a lower rate loses more, 90 Hz nothing.

    A sample is taken each 90 / rate frames, at 2 to 90 Hz (RATES), and its answer stands until the next.
    """
    measured = losses_at_rates(at_every_phase(lengths))
    assert measured == pytest.approx([closed_form(lengths, FRAME_RATE_HZ // rate) for rate in RATES])
    assert all(slower >= faster for slower, faster in pairwise(measured))
    assert measured[-1] == 0.0


def test_more_samples_rank_no_worse_than_chance_allows():
    """Twelve random recordings of 10 s (900 frames) with 5 contacts, each sampled at the rising RATES by a detector.

    It reports a contact up to three frames early, ends it early or a frame late, and misses one in ten. From rate to
    rate the mean loss grows by no more than twice its standard error; from 2 to 6 Hz, the first two, it falls.
    """
    random = np.random.default_rng(7)
    recordings, frames = 12, 900
    growth_from_rate_to_rate = []
    for _ in range(recordings):
        contact, seen = np.zeros((2, frames), np.bool_)
        for start in np.sort(random.integers(0, frames - 50, 5)):
            length = 1 + int(random.exponential(14))
            contact[start : start + length] = True
            if random.random() > 0.1:
                seen[max(0, start - random.integers(0, 4)) : start + random.integers(1, length + 2)] = True
        growth_from_rate_to_rate.append(np.diff(losses_at_rates(contact, seen)))
    mean = np.mean(growth_from_rate_to_rate, axis=0)
    standard_error = np.std(growth_from_rate_to_rate, axis=0, ddof=1) / sqrt(recordings)
    assert (mean <= 2 * standard_error).all() and mean[0] < 0


@pytest.mark.parametrize(
    ("missed", "time_missed", "time_false", "undecided", "total"),
    [
        pytest.param((0, 18), (0, 100), (0, 100), 0.0, 0.0, id="right"),
        pytest.param((18, 18), (100, 100), (0, 0), 0.0, 1.0 + 1.0, id="blind"),
        pytest.param((0, 18), (0, 100), (86, 100), 0.0, 0.86, id="false alone"),
        pytest.param((9, 18), (25, 100), (10, 100), 0.0, 0.5 + 0.25 + 0.10, id="all three"),
        pytest.param((0, 18), (0, 0), (0, 0), 0.5, 0.5, id="half of the contacts undecided"),
    ],
)
def test_a_loss_adds_contacts_missed_time_missed_and_time_false(missed, time_missed, time_false, undecided, total):
    """Pairs are (count, of); ``undecided`` is a fraction of the contacts. What is false is no lost contact."""
    missed, time_missed, time_false = (proportion(count, of) for count, of in (missed, time_missed, time_false))
    assert loss(missed, time_missed, time_false, undecided) == pytest.approx(total)
    assert lost_contact(missed, time_missed, undecided) == pytest.approx(total - fraction_of(time_false))


def test_loss_of_nothing_measured_is_zero():
    """A loss adds proportions missed and false; without a reference none of them is known."""
    assert loss(contacts_missed=None, time_missed=None, time_false=None) == 0.0


def test_a_missed_tap_outweighs_missed_frames_of_long_contacts():
    """A tap of a frame is missed: 1 of 18 contacts and 1 of 1000 frames, 0.056 + 0.001; or 50 frames and no contact."""
    nothing_false = proportion(0, 0)
    tap = loss(contacts_missed=proportion(1, 18), time_missed=proportion(1, 1000), time_false=nothing_false)
    frames = loss(contacts_missed=proportion(0, 18), time_missed=proportion(50, 1000), time_false=nothing_false)
    assert tap == pytest.approx(1 / 18 + 1 / 1000) and frames == pytest.approx(0.05)
    assert tap > frames


def test_fraction_of_nothing_is_zero():
    """Nothing was counted, or there is no whole to count of; 1 of 4 is a quarter."""
    assert fraction_of(None) == fraction_of(proportion(0, 0)) == 0.0
    assert fraction_of(proportion(1, 4)) == 0.25
