from dataclasses import replace

import numpy as np
from support.small_worlds import cubes

from replay.prepare import assemble_stored
from replay.prepare.assemble import assemble, lay_out
from replay.prepare.assemble_stored import assemble_bounded, decoded_once
from replay.prepare.stored_motion import StoredMotion
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
