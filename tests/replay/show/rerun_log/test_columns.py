"""Columns whose lengths do not fit are refused, and long sessions are strided except near misses."""

from dataclasses import replace

import numpy as np
import pytest
import rerun as rr

from replay.show.rerun_log.recording_file import RecordingClock, RecordingWriter, partition_rows
from replay.show.rerun_log.scene import log_contacts


@pytest.mark.parametrize("counts", [[1, 1], [1, 3], [3, 1]])
def test_counts_that_do_not_add_up_are_refused(counts):
    """Three points are to be sent in two rows, of so many points each, which are two or four together."""
    columns = rr.Points3D.columns(positions=np.zeros((3, 3)))
    with pytest.raises(AssertionError, match=f"{sum(counts)} values announced, 3 given"):
        partition_rows(columns, counts)


def test_values_that_rerun_drops_are_an_error():
    """Two rows of the entity x, in frames 0 and 1, for which there are no values; Rerun would drop them silently."""
    clock = RecordingClock(ns=np.arange(3), drawn_frames=np.arange(3), moments=np.arange(0))
    writer = RecordingWriter(rr.RecordingStream("test"), clock)
    with pytest.raises(ValueError, match="no columns for x"):
        writer.rows("x", [0, 1], rr.Points3D.columns())


@pytest.mark.slow
def test_a_long_session_is_strided_but_for_its_moments(demo):
    """A clock chooses the frames that are drawn, of 90 at most 30: every third.

    Frames 40 and 50, which are moments of misses, are drawn in any case.
    """
    drawn_frames = RecordingClock.of(demo.assembly, [50, 40], limit=30).drawn_frames.tolist()
    assert drawn_frames == sorted({*range(0, 90, 3), 40, 50})


@pytest.mark.slow
def test_session_within_the_limit_is_drawn_frame_by_frame(demo):
    """A clock chooses the frames that are drawn, of 90 at most 90: all."""
    assert RecordingClock.of(demo.assembly, limit=90).drawn_frames.tolist() == list(range(90))


@pytest.mark.parametrize(
    "absent",
    [
        pytest.param("face_sets", id="faces in contact"),
        pytest.param("section_source", id="curves where surfaces meet"),
    ],
)
def test_contacts_without_faces_or_curves_are_not_drawn(demo, absent):
    """Contacts of a detection are drawn by messages to a recording; of one that lacks either part, none is sent."""
    stream = rr.RecordingStream("test")
    memory, writer = stream.memory_recording(), RecordingWriter(stream, RecordingClock.of(demo.assembly))
    detection = demo.detections[demo.oracle]
    log_contacts(writer, "exact", detection, comparison=None)
    sent_of_whole_detection = memory.num_msgs()
    log_contacts(writer, "exact", replace(detection, **{absent: None}), comparison=None)
    assert sent_of_whole_detection > 0
    assert memory.num_msgs() == sent_of_whole_detection
