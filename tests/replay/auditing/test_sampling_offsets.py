"""The offset whose moments a run shows is one of the sixteen, typical of all, and shows the fault that is named."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x, verdict_column

from replay.auditing.compare import compare
from replay.auditing.outcome import Outcome
from replay.auditing.sampling_offsets import OFFSET_COUNT, OffsetCounts, has_offsets, offset_counts
from replay.auditing.wilson import proportion
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import MOST_FRAMES_IN_MEMORY
from replay.engine import compute


def bumps(seed, frames=120):
    """Two cubes that meet now and then for one to six frames."""
    rng = np.random.default_rng(seed)
    positions = np.full(frames, 3.0)
    for first in np.cumsum(rng.integers(7, 20, 8)):
        positions[first : first + rng.integers(1, 7)] = 0.9
    return unit_cubes_on_x({"a": [0.0] * frames, "b": positions.tolist()})


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    ("detector", "seed"),
    [
        ("discrete", 0),
        ("collider[shape=hull]", 1),
        ("collider[shape=box]", 2),
        ("collider[shape=hull]", 3),
        ("collider[shape=box]", 4),
        ("discrete", 5),
    ],
)
def test_displayed_counts_come_from_the_offset_nearest_the_mean(detector, seed):
    """No offset that shows the fault is nearer the mean in missed frames, missed contacts and false fraction alike."""
    rate = (12.0, 20.0, 33.0)[seed % 3]
    name, _, settings = detector.rstrip("]").partition("[")
    requested = f"slow={name}[{settings}{',' if settings else ''}rate_hz={rate}]"
    result = compute(bumps(seed), detectors=requested)
    offsets, audit = result.phases["slow"], result.document.audit["slow"]
    displayed = result.document.detectors["slow"].settings["sampling_offset_s"]
    number = int(np.flatnonzero(offsets.seconds == displayed)[0])
    assert len(offsets.seconds) == OFFSET_COUNT
    # What the run shows and what was counted at that offset are the same frames.
    assert np.array_equal(result.counts["slow"].frames_by_outcome, offsets.frames_by_outcome[number])
    assert audit.false_contact.value == pytest.approx(offsets.false_fractions[number])
    (answer,), rank = result.answers, result.ranking[0]
    missed, never = (
        offsets.frames_by_outcome.sum(axis=1)[:, Outcome.MISSED],
        offsets.faults["contacts_missed"].sum(axis=1),
    )
    away = np.abs([counts - counts.mean() for counts in (missed, never, offsets.false_fractions)])
    shows = offsets.false_fractions > 0 if rank.leads_false else missed > 0
    assert shows[number] or not shows.any()
    nearer = (away < away[:, [number]] - 1e-12).all(axis=0) & shows
    assert not nearer.any(), "another offset that shows the fault is nearer the mean in every count"
    assert bool(answer.why) == bool(rank.loss) == (answer.moment is not None)
    if rank.loss:
        assert answer.moment.kind == ("false" if rank.leads_false else "miss")


@pytest.mark.slow
def test_requested_offset_is_kept():
    """Sampled at 20 Hz from ``offset`` on (to 1 us), every frame has the exact answer of the last sample."""
    for offset in (0.0, 0.013):
        result = compute(bumps(seed=1), detectors=f"slow=discrete[rate_hz=20,sampling_offset_s={offset}]")
        assert result.document.detectors["slow"].settings["sampling_offset_s"] == offset
        times = result.assembly.motion.times
        ticks = np.floor((times - offset + 1e-6) * 20.0)
        sampled = np.flatnonzero(np.diff(ticks, prepend=-np.inf) > 0)
        last = sampled[np.searchsorted(sampled, np.arange(len(times)), side="right") - 1]
        verdict = result.detections["slow"].verdict
        assert np.array_equal(verdict, result.detections["exact"].verdict[last])


def test_false_contacts_of_each_offset_are_counted():
    """Sampled at every frame: a false contact from the first frame, a second one, and a true contact.

    4 of 5 reported frames are false, 64 of 80 over the 16 offsets; the clusters are the three reports.
    """
    truth, reported = verdict_column("........C."), verdict_column("CC..CC..C.")
    reference = SimpleNamespace(contacts=(), compare=lambda subject: compare(subject, truth))
    counts = offset_counts(100.0, reported, reference)
    assert counts.false_contacts.tolist() == [2] * OFFSET_COUNT
    assert counts.false_fractions == pytest.approx([4 / 5] * OFFSET_COUNT)
    assert (counts.false_contact.count, counts.false_contact.of, counts.false_contact.clusters) == (64, 80, 3)


def counts_at_offsets(missed, both, false_fractions):
    """Counts of one contact: frames missed and reported at each offset; the offsets are 0, 1, 2, ... seconds."""
    frames_by_outcome = np.zeros((len(missed), 1, len(Outcome)), dtype=int)
    frames_by_outcome[:, 0, Outcome.MISSED], frames_by_outcome[:, 0, Outcome.BOTH] = missed, both
    offsets = np.arange(len(missed))
    return OffsetCounts(frames_by_outcome, proportion(0, 1), offsets, np.array(false_fractions), offsets.astype(float))


@pytest.mark.parametrize(
    ("missed", "both", "false_fractions", "typical"),
    [
        # Missed are 0.5, 0.6 and 0.2 of the contact, 0.43 in the mean.
        ((5, 3, 2), (5, 2, 8), (0.0, 0.0, 0.0), 0),
        # The mean of what is false is 0.43.
        ((0, 0, 0), (9, 9, 9), (0.1, 0.4, 0.8), 1),
        # The mean is nearest to no fault, and a fault is displayed.
        ((0, 0, 0, 4), (4, 4, 4, 0), (0.0, 0.0, 0.0, 0.0), 3),
        ((0, 0, 0, 0), (4, 4, 4, 4), (0.0, 0.0, 0.4, 0.0), 2),
        # A quarter of the contacts and of their time is missed, more than the 0.3 of the reports that are false.
        ((0, 0, 0, 4), (4, 4, 4, 0), (0.4, 0.4, 0.4, 0.0), 3),
        # More is false, 0.6, than missed.
        ((0, 0, 0, 4), (4, 4, 4, 0), (0.8, 0.8, 0.8, 0.0), 0),
        ((0, 0), (4, 4), (0.0, 0.0), 0),
    ],
)
def test_typical_offset_displays_the_larger_fault_nearest_its_mean(missed, both, false_fractions, typical):
    """``missed``, ``both``: frames of a contact at each offset; ``typical``: number of the offset that a run shows."""
    counts = counts_at_offsets(missed, both, false_fractions)
    assert counts.typical_offset == typical
    assert counts.proportions()["missed"].value == pytest.approx(sum(missed) / sum(missed + both))


def test_only_detectors_of_a_rate_are_counted_at_offsets():
    """A detector that is none of the table and a recording of more than an hour keep the offset they have."""
    rated, hour = {"rate_hz": 20.0}, MOST_FRAMES_IN_MEMORY
    requests = [("discrete", rated, hour), ("discrete", rated, hour + 1), ("discrete", {}, 9), ("own.Own", rated, 9)]
    answers = [has_offsets(DetectorSpec("slow", name, settings), frames) for name, settings, frames in requests]
    assert answers == [True, False, False, False]
