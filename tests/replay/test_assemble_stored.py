import numpy as np
from small_worlds import cubes

from replay import assemble_stored
from replay.assemble import assemble, lay_out
from replay.assemble_stored import assemble_bounded
from replay.stored_motion import StoredMotion

PLACES = {"a": range(50), "b": [70] * 50}


def test_a_long_session_is_assembled_like_a_short_one_but_on_disk(monkeypatch):
    session = cubes(PLACES)
    layout = lay_out(session)
    held = assemble_bounded(session, layout, start=0.02, end=0.4)
    monkeypatch.setattr(assemble_stored, "HELD_FRAMES", 49)
    monkeypatch.setattr(assemble_stored, "BLOCK_FRAMES", 7)
    stored = assemble_bounded(session, layout, start=0.02, end=0.4)
    assert isinstance(stored.motion, StoredMotion) and not isinstance(held.motion, StoredMotion)
    for name in ("times", "translations", "rotations", "valid", "linked"):
        got, want = (np.asarray(getattr(one.motion, name)) for one in (stored, held))
        assert np.array_equal(got, want), name
    assert np.array_equal(stored.stamp_ns, held.stamp_ns) and np.array_equal(stored.origin, held.origin)
    assert stored.pairs.tolist() == held.pairs.tolist() == assemble(session).pairs.tolist()
