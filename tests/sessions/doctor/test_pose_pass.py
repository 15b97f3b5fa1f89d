import numpy as np
import pytest
from support.planted_faults import FAULTS, clean

from sessions import Frames, Status
from sessions.doctor.pose_pass import LOOKS_PER_BLOCK, look_through, sampled_poses
from sessions.doctor.track_watch import Mark


def broken():
    draft = clean()
    for at, name in enumerate(("nan position", "zero quaternion", "non-unit quaternion", "identity while lost")):
        FAULTS[name](draft, 0, 100 + 100 * at)
    draft.arrays["status"][700:720, 1] = Status.LOST
    draft.arrays["status"][::3, 2] = Status.ABSENT
    return draft.session()


@pytest.mark.parametrize("size", [1, 7, 100, 899])
def test_the_marks_do_not_depend_on_blocks(size):
    session = broken()
    whole, parts = look_through([session.frames]), look_through(session.frames.blocks(size))
    assert np.array_equal(whole.marks, parts.marks)
    assert np.array_equal(whole.steps, parts.steps, equal_nan=True)
    assert np.array_equal(whole.worst_norm, parts.worst_norm)


def test_each_odd_sample_has_its_mark():
    looked = look_through([broken().frames])
    where = {mark: np.argwhere(looked.has(mark)).tolist() for mark in Mark}
    assert where[Mark.NOT_FINITE] == [[row, 0] for row in (100, 101, 102)]
    assert where[Mark.ZERO_QUATERNION] == [[200, 0]]
    assert where[Mark.NON_UNIT] == [[row, 0] for row in range(300, 305)]
    assert where[Mark.IDENTITY] == [[row, 0] for row in range(400, 420)]
    assert where[Mark.LOST] == [[row, 1] for row in range(700, 720)]
    assert looked.worst_norm[0] == pytest.approx(1.1)
    assert not looked.usable[100, 0] and not looked.usable[700, 1] and not looked.usable[0, 2] and looked.usable[0, 0]


def test_a_body_that_appears_later_gets_a_column():
    frames = clean().session().frames
    few = Frames(
        frames.names[:1], frames.stamp_ns[:50], frames.log_ns[:50], frames.sample_ns[:50, :1],
        frames.position[:50, :1], frames.quaternion_xyzw[:50, :1], frames.status[:50, :1],
    )  # fmt: skip
    looked = look_through([few, frames.part(50, 900)])
    assert looked.names == frames.names and looked.marks.shape == (900, 3)
    assert not looked.has(Mark.PRESENT)[:50, 1].any() and looked.has(Mark.PRESENT)[50:, 1].all()


def test_nothing_is_looked_at_without_frames():
    looked = look_through([])
    assert len(looked.stamp_ns) == 0 and looked.names == ()


def test_the_poses_kept_are_few_and_none_is_lost():
    frames = broken().frames
    kept = sampled_poses(frames)
    assert len(kept) <= LOOKS_PER_BLOCK and kept[0, 0, :3].tolist() == frames.position[0, 0].tolist()
    assert np.isnan(kept[:, 1]).any() and np.isfinite(frames.position[:, 1]).all()
