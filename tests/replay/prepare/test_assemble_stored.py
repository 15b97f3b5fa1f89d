import gc
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from support.small_worlds import cubes

from cdcore import Motion, create_detector
from cdcore.protocol import Body
from replay.prepare import assemble_stored
from replay.prepare.assemble import assemble, lay_out
from replay.prepare.assemble_stored import StoredMotion, StoredRows, assemble_bounded, decoded_once
from sessions import Frames

PLACES = {"a": range(50), "b": [70] * 50}


def test_a_long_session_is_assembled_like_a_short_one_but_on_disk(monkeypatch):
    session = cubes(PLACES)
    layout = lay_out(session)
    held = assemble_bounded(session, layout, start=0.02, end=0.4)
    monkeypatch.setattr(assemble_stored, "HELD_FRAMES", 38)
    monkeypatch.setattr(assemble_stored, "BLOCK_FRAMES", 7)
    stored = assemble_bounded(session, layout, start=0.02, end=0.4)
    assert isinstance(stored.motion, StoredMotion) and not isinstance(held.motion, StoredMotion)
    for name in ("times", "translations", "rotations", "valid", "linked"):
        got, want = (np.asarray(getattr(one.motion, name)) for one in (stored, held))
        assert np.array_equal(got, want), name
    assert np.array_equal(stored.stamp_ns, held.stamp_ns) and np.array_equal(stored.origin, held.origin)
    assert stored.pairs.tolist() == held.pairs.tolist() == assemble(session).pairs.tolist()


class Counted:
    """A source that counts how often its frames are read."""

    def __init__(self, source):
        self.source, self.names, self.passes = source, source.names, 0

    def blocks(self, frames):
        self.passes += 1
        return self.source.blocks(frames)


def test_a_file_is_decoded_once_while_its_frames_can_be_held(monkeypatch):
    session = cubes(PLACES)
    assert decoded_once(session) is session
    source = Counted(session.source)
    held = decoded_once(replace(session, source=source))
    passes = [Frames.join(list(held.blocks(size))) for size in (20, 3, 64)]
    assert source.passes == 1 and max(map(len, held.blocks(7))) == 7
    for again in passes:
        assert np.array_equal(again.position, session.frames.position, equal_nan=True)
    monkeypatch.setattr(assemble_stored, "HELD_FRAMES", 49)
    long = decoded_once(replace(session, source=source))
    assert [sum(map(len, long.blocks(20))) for _ in range(2)] == [50, 50] and source.passes == 3


def stored(array, cuts=(3, 7)):
    rows = StoredRows(array.shape[1:])
    for part in np.split(array, cuts):
        rows.append(part)
    return rows


ARRAY = np.random.default_rng(0).normal(size=(20, 3, 2))
KEYS = [
    0, -1, np.int64(5), (4, 1), (4, 1, 0), (-3, slice(0, 2)), slice(None), slice(2, 9), slice(15, 99),
    slice(None, None, 4), (slice(None, None, 4), 1),
    slice(9, 2, -2), (slice(3, 12), 1), (slice(None), 2, 1), (slice(None), slice(1, 3)), np.array([5, 6, 7, 1]),
    [2, 3, -1], (np.array([0, 19, 4]), 2), (np.array([0, 19, 4]), np.array([0, 1, 2])), np.arange(20) % 3 == 0,
    (np.arange(20) > 16, 1), np.zeros(0, dtype=np.int64), (np.zeros(0, dtype=np.int64), 1), ARRAY[:, :, 0] > 0, ...,
    (..., 0), (slice(2, 4), np.array([0, 2])),
]  # fmt: skip


@pytest.mark.parametrize("key", KEYS, ids=str)
def test_rows_on_disk_answer_as_the_array_does(key, monkeypatch):
    for chunk in (2, 1000):
        monkeypatch.setattr(assemble_stored, "ROWS_AT_ONCE", chunk)
        got, want = stored(ARRAY)[key], ARRAY[key]
        assert np.shape(got) == np.shape(want) and np.array_equal(got, want)


@given(st.lists(st.integers(-20, 19), max_size=30))
@settings(max_examples=100)
def test_any_selection_of_rows_is_the_arrays(rows):
    rows = np.array(rows, dtype=np.int64)
    assert np.array_equal(stored(ARRAY)[rows], ARRAY[rows])


def test_shape_length_and_the_whole_are_the_arrays():
    rows = stored(ARRAY)
    assert (rows.shape, len(rows), rows.ndim, rows.dtype) == (ARRAY.shape, 20, 3, ARRAY.dtype)
    assert np.asarray(rows).tobytes() == ARRAY.tobytes()


@pytest.mark.parametrize("key", [20, -21, [3, 20]])
def test_a_row_that_is_not_there_is_refused(key):
    with pytest.raises(IndexError):
        stored(ARRAY)[key]


def test_the_file_is_gone_when_the_array_is():
    before = set(Path(tempfile.gettempdir()).glob("replay-poses-*"))
    rows = stored(ARRAY)
    del rows
    gc.collect()
    assert set(Path(tempfile.gettempdir()).glob("replay-poses-*")) <= before


def random_motion(frames=40, bodies=3):
    rng = np.random.default_rng(1)
    turn = Rotation.random(frames * bodies, rng=rng).as_matrix().reshape(frames, bodies, 3, 3)
    linked = rng.random((frames, bodies)) > 0.3
    valid = rng.random((frames, bodies)) > 0.2
    return Motion(np.arange(frames) / 90, rng.normal(size=(frames, bodies, 3)), turn, valid, linked=linked)


def same(one, other):
    fields = ("times", "translations", "rotations", "valid", "linked")
    return all(np.array_equal(np.asarray(getattr(one, name)), np.asarray(getattr(other, name))) for name in fields)


def test_a_stored_motion_is_the_motion_whole_in_parts_and_in_selections():
    motion = random_motion()
    got = StoredMotion(motion.blocks(7))
    assert same(got, motion) and len(got) == 40 and got.body_count == 3
    assert same(got.frames(5, 22), motion.frames(5, 22))
    assert same(got.take(np.array([0, 1, 9, 39])), motion.take(np.array([0, 1, 9, 39])))
    assert all(same(a, b) for a, b in zip(got.blocks(9), motion.blocks(9), strict=True))


def test_nothing_to_store_is_refused():
    with pytest.raises(ValueError, match="at least one motion"):
        StoredMotion([])


def test_a_detector_answers_alike_on_stored_and_held_poses():
    assembly = assemble(cubes({"a": [0] * 40, "b": np.abs(np.linspace(-3, 3, 40))}))
    detector = create_detector("hybrid", [Body(b.name, b.mesh) for b in assembly.bodies], pairs=assembly.pairs)
    held = detector.detect(assembly.motion, faces=True)
    got = list(detector.stream(StoredMotion(assembly.motion.blocks(6)).blocks(11), faces=True))
    assert np.array_equal(np.concatenate([part.verdict for part in got]), held.verdict)
