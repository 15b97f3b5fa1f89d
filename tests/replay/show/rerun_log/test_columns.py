"""Columns whose lengths do not fit are refused, and long sessions are strided except near misses."""

from dataclasses import replace

import numpy as np
import pytest
import rerun as rr

from replay.show.rerun_log.recording_file import RecordingClock, RecordingWriter, partition_rows
from replay.show.rerun_log.scene import log_contacts


@pytest.mark.parametrize("counts", [[1, 1], [1, 3], [3, 1]])
def test_counts_that_do_not_add_up_are_refused(counts):
    """Three points, and how many of them each row is said to have."""
    columns = rr.Points3D.columns(positions=np.zeros((3, 3)))
    with pytest.raises(AssertionError, match=f"{sum(counts)} values announced, 3 given"):
        partition_rows(columns, counts)


def test_values_that_rerun_drops_are_an_error(tmp_path):
    """No values are given for two rows of the entity x."""
    stream = rr.RecordingStream("test")
    writer = RecordingWriter(stream, RecordingClock(np.arange(3), np.arange(3), np.arange(0)))
    with pytest.raises(ValueError, match="no columns for x"):
        writer.rows("x", [0, 1], rr.Points3D.columns())


@pytest.mark.slow
def test_a_long_session_is_strided_but_for_its_moments(demo):
    """270 frames with room for 100: every third is drawn, and the frames 100 and 200 of misses."""
    assert RecordingClock.of(demo.assembly, limit=270).drawn_frames.tolist() == list(range(270))
    drawn_frames = RecordingClock.of(demo.assembly, [200, 100], limit=100).drawn_frames.tolist()
    assert drawn_frames == sorted({*range(0, 270, 3), 100, 200})


@pytest.mark.parametrize("lacks", ["face_sets", "section_source"])
def test_contacts_without_faces_or_curves_are_not_drawn(demo, lacks):
    """A whole detection sends messages; one that lacks either sends none more."""
    stream = rr.RecordingStream("test")
    memory, writer = stream.memory_recording(), RecordingWriter(stream, RecordingClock.of(demo.assembly))
    log_contacts(writer, "exact", demo.detections[demo.oracle], comparison=None)
    sent = memory.num_msgs()
    log_contacts(writer, "exact", replace(demo.detections[demo.oracle], **{lacks: None}), comparison=None)
    assert memory.num_msgs() == sent > 0
