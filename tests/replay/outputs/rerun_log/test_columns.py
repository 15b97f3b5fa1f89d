"""Columns whose lengths do not fit are refused, and long sessions are strided except near misses."""

from dataclasses import replace

import numpy as np
import pytest
import rerun as rr

from replay.outputs.rerun_log.columns import RecordingClock, RecordingWriter, entity, ragged


@pytest.mark.parametrize("counts", [[1, 1], [1, 3], [3, 1]])
def test_counts_that_do_not_add_up_are_refused(counts):
    columns = rr.Points3D.columns(positions=np.zeros((3, 3)))
    with pytest.raises(AssertionError, match=f"{sum(counts)} values announced, 3 given"):
        ragged(columns, counts)


def test_values_that_rerun_drops_are_an_error(tmp_path):
    stream = rr.RecordingStream("test")
    writer = RecordingWriter(stream, RecordingClock(np.arange(3), np.arange(3)))
    with pytest.raises(ValueError, match="no columns for x"):
        writer.rows("x", [0, 1], rr.Points3D.columns())


def test_session_time_counts_from_the_first_frame_of_the_session(demo):
    clock = RecordingClock.of(demo.assembly)
    assert clock.ns[0] == 0
    assert clock.ns.tolist() == (demo.assembly.stamp_ns - demo.assembly.stamp_ns[0]).tolist()
    later = replace(demo.assembly, motion=demo.assembly.motion.frames(90, 180), stamp_ns=demo.assembly.stamp_ns[90:180])
    assert RecordingClock.of(later).ns.tolist() == clock.ns[90:180].tolist()


def test_a_long_session_is_strided_but_whole_around_a_miss(demo):
    clock = RecordingClock.of(demo.assembly, [(2.9, 2.95)], limit=100)
    times = demo.assembly.motion.times
    assert RecordingClock.of(demo.assembly, limit=270).kept.tolist() == list(range(270))
    near = np.flatnonzero((times >= 1.9) & (times <= 3.95))
    assert set(near) <= set(clock.kept.tolist())
    far = clock.kept[clock.kept < near[0]]
    assert far.tolist() == list(range(0, int(near[0]), 3))


def test_punctuation_in_names_stays_one_part_of_a_path():
    assert entity("world", "left hand/1") == r"world/left\ hand\/1"
