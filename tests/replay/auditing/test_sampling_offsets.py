"""The offset whose moments a run shows is one of the sixteen, typical of all, and shows the fault that is named."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x, verdict_column

from replay.auditing.compare import compare
from replay.auditing.outcome import Outcome
from replay.auditing.sampling_offsets import OFFSET_COUNT, OffsetCounts, has_offsets, offset_counts, sampling_offsets
from replay.auditing.wilson import proportion
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import MOST_FRAMES_IN_MEMORY
from replay.engine import compute


def bumps(seed, frames=120):
    """Two unit cubes that overlap by 0.1 m eight times, for one to six frames of 10 ms, and else are 2 m apart."""
    rng = np.random.default_rng(seed)
    positions = np.full(frames, 3.0)
    for first in np.cumsum(rng.integers(7, 20, 8)):
        positions[first : first + rng.integers(1, 7)] = 0.9
    return unit_cubes_on_x({"a": [0.0] * frames, "b": positions.tolist()})


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("detector", "rate_hz", "seed"),
    [
        ("discrete", 12.0, 0),
        ("collider[shape=hull]", 20.0, 1),
        ("collider[shape=box]", 33.0, 2),
        ("collider[shape=hull]", 12.0, 3),
        ("collider[shape=box]", 20.0, 4),
        ("discrete", 33.0, 5),
    ],
)
def test_displayed_counts_come_from_the_offset_nearest_the_mean(detector, rate_hz, seed):
    """A detector of a low rate is counted at 16 offsets of its first sample; the run displays what happens at one.

    No other offset that shows the larger fault (missed or false contact) is nearer the mean of all offsets in each of
    three counts: missed frames, missed contacts, false fraction. A detector with a fault has a sentence why, and a
    moment that shows it.
    """
    settings = detector.removesuffix("]") + (",rate_hz=" if "[" in detector else "[rate_hz=") + f"{rate_hz}]"
    result = compute(bumps(seed), detectors=f"slow={settings}")
    offsets, audit = result.phases["slow"], result.document.audit["slow"]
    displayed_offset_s = result.document.detectors["slow"].settings["sampling_offset_s"]
    displayed = int(np.flatnonzero(offsets.seconds == displayed_offset_s)[0])
    assert len(offsets.seconds) == OFFSET_COUNT
    # What the run shows and what was counted at that offset are the same frames.
    assert np.array_equal(result.counts["slow"].frames_by_outcome, offsets.frames_by_outcome[displayed])
    assert audit.false_contact.value == pytest.approx(offsets.false_fractions[displayed])

    missed_frames = offsets.frames_by_outcome.sum(axis=1)[:, Outcome.MISSED]
    missed_contacts = offsets.faults["contacts_missed"].sum(axis=1)
    counts_at_offsets = np.stack([missed_frames, missed_contacts, offsets.false_fractions])
    from_the_mean = np.abs(counts_at_offsets - counts_at_offsets.mean(axis=1, keepdims=True))
    rank = result.ranking[0]
    shows_fault = offsets.false_fractions > 0 if rank.leads_false else missed_frames > 0
    assert shows_fault[displayed] or not shows_fault.any()
    is_nearer = (from_the_mean < from_the_mean[:, [displayed]] - 1e-12).all(axis=0)
    assert not (is_nearer & shows_fault).any(), "another offset that shows the fault is nearer the mean in every count"

    (answer,) = result.answers
    assert bool(answer.why) == bool(rank.loss) == (answer.moment is not None)
    if rank.loss:
        assert answer.moment.kind == ("false" if rank.leads_false else "miss")


@pytest.mark.slow
@pytest.mark.parametrize("offset_s", [0.0, 0.013])
def test_requested_offset_is_kept(offset_s):
    """A detector samples at 20 Hz from ``offset_s`` on; every frame has the exact answer of the last sample.

    Samples are the first frames at or after each multiple of 50 ms, to a microsecond.
    """
    result = compute(bumps(seed=1), detectors=f"slow=discrete[rate_hz=20,sampling_offset_s={offset_s}]")
    assert result.document.detectors["slow"].settings["sampling_offset_s"] == offset_s
    times = result.assembly.motion.times
    ticks = np.floor((times - offset_s + 1e-6) * 20.0)
    sampled = np.flatnonzero(np.diff(ticks, prepend=-np.inf) > 0)
    last_sample = sampled[np.searchsorted(sampled, np.arange(len(times)), side="right") - 1]
    verdict = result.detections["slow"].verdict
    assert np.array_equal(verdict, result.detections["exact"].verdict[last_sample])


def test_false_contacts_of_each_offset_are_counted():
    """Sampled at every frame: a false contact from the first frame, a second one, and a true contact.

    4 of 5 reported frames are false, 64 of 80 over the 16 offsets; the clusters are the three reports.
    """
    truth, reported = verdict_column("........C."), verdict_column("CC..CC..C.")
    reference = SimpleNamespace(contacts=(), compare=lambda subject: compare(subject, truth))
    rate_of_the_frames_hz = 100.0
    counts = offset_counts(rate_of_the_frames_hz, reported, reference)
    assert counts.false_contacts.tolist() == [2] * OFFSET_COUNT
    assert counts.false_fractions == pytest.approx([4 / 5] * OFFSET_COUNT)
    false_contact = counts.false_contact
    assert (false_contact.count, false_contact.of, false_contact.clusters) == (4 * 16, 5 * 16, 3)


def counts_at_offsets(missed, both, false_fractions):
    """Counts of one contact: frames missed and reported at each offset; the offsets are 0, 1, 2, ... seconds."""
    frames_by_outcome = np.zeros((len(missed), 1, len(Outcome)), dtype=int)
    frames_by_outcome[:, 0, Outcome.MISSED], frames_by_outcome[:, 0, Outcome.BOTH] = missed, both
    number = np.arange(len(missed))
    return OffsetCounts(
        frames_by_outcome=frames_by_outcome,
        false_contact=proportion(0, 1),
        false_contacts=np.zeros_like(number),
        false_fractions=np.array(false_fractions),
        seconds=number.astype(float),
    )


@pytest.mark.parametrize(
    ("missed", "both", "false_fractions", "typical"),
    [
        # Missed are 0.5, 0.6 and 0.2 of the contact, 0.43 in the mean.
        pytest.param((5, 3, 2), (5, 2, 8), (0.0, 0.0, 0.0), 0, id="time missed"),
        # The mean of what is false is 0.43.
        pytest.param((0, 0, 0), (9, 9, 9), (0.1, 0.4, 0.8), 1, id="time false"),
        # The mean is nearest to no fault, and a fault is displayed.
        pytest.param((0, 0, 0, 4), (4, 4, 4, 0), (0.0, 0.0, 0.0, 0.0), 3, id="missed at one offset"),
        pytest.param((0, 0, 0, 0), (4, 4, 4, 4), (0.0, 0.0, 0.4, 0.0), 2, id="false at one offset"),
        # A quarter of the contacts and a quarter of their time, 0.5, is more than the 0.3 of the reports that is false.
        pytest.param((0, 0, 0, 4), (4, 4, 4, 0), (0.4, 0.4, 0.4, 0.0), 3, id="more missed than false"),
        # More is false, 0.6, than missed.
        pytest.param((0, 0, 0, 4), (4, 4, 4, 0), (0.8, 0.8, 0.8, 0.0), 0, id="more false than missed"),
        pytest.param((0, 0), (4, 4), (0.0, 0.0), 0, id="no fault"),
    ],
)
def test_typical_offset_displays_the_larger_fault_nearest_its_mean(missed, both, false_fractions, typical):
    """``missed``, ``both``: frames of one contact that are missed, and reported, at each of some sampling offsets.

    ``false_fractions``: of what is reported at each. ``typical``: number of the offset that a run shows.
    """
    assert counts_at_offsets(missed, both, false_fractions).typical_offset == typical


def test_missed_time_is_counted_over_all_offsets():
    """A contact has 5 of 10, 3 of 5 and 2 of 10 frames missed at three sampling offsets: 10 of 25."""
    counts = counts_at_offsets(missed=(5, 3, 2), both=(5, 2, 8), false_fractions=(0.0, 0.0, 0.0))
    assert counts.proportions()["missed"].value == pytest.approx(10 / 25)


@pytest.mark.parametrize(
    ("name", "settings", "frames", "is_counted"),
    [
        pytest.param("discrete", {"rate_hz": 20.0}, MOST_FRAMES_IN_MEMORY, True, id="a rate"),
        pytest.param("discrete", {}, 9, False, id="every frame"),
        pytest.param("discrete", {"rate_hz": 20.0}, MOST_FRAMES_IN_MEMORY + 1, False, id="more than an hour"),
        pytest.param("own.Own", {"rate_hz": 20.0}, 9, False, id="a user's own detector"),
    ],
)
def test_only_detectors_of_a_rate_are_counted_at_offsets(name, settings, frames, is_counted):
    """A user's own detector and one of a recording of more than an hour keep the offset they have, rate or not."""
    assert has_offsets(DetectorSpec("slow", name, settings), frames) == is_counted


def test_offsets_are_spread_evenly_over_a_sample():
    """At 50 Hz, 20 ms apart: the first by half of a sixteenth of it, the last as far before the next sample."""
    offsets = sampling_offsets(50.0)
    assert len(offsets) == OFFSET_COUNT == 16
    assert offsets == pytest.approx(np.linspace(0.02 / 32, 0.02 - 0.02 / 32, 16))
