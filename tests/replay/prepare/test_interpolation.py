import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp
from support.small_worlds import framed

from replay.prepare.assembly import PoseOrigin
from replay.prepare.interpolation import FilledFrames, blended, filled
from sessions import Status

A, V, L, H, I = (int(s) for s in (Status.ABSENT, Status.VALID, Status.LOST, Status.HELD, Status.INTERPOLATED))  # noqa: E741
MS = 1_000_000


def fill(session, block=1000) -> FilledFrames:
    parts = list(filled(session.blocks(block)))
    return FilledFrames(*(np.concatenate([getattr(p, k) for p in parts]) for k in FilledFrames.__dataclass_fields__))


def fill_column(status, stamps=None):
    stamps = np.arange(len(status)) * 10 * MS if stamps is None else stamps
    return fill(framed(stamps, np.array(status)[:, None]))


def test_a_recorded_sample_is_used_as_it_is():
    session = framed([0, 7], [[V], [V]], position=[[[0.1, 0.2, 0.3]], [[0.4, 0.5, 0.6]]])
    got = fill(session)
    assert got.position.tobytes() == session.frames.position.tobytes()
    assert got.quaternion_xyzw.tobytes() == session.frames.quaternion_xyzw.tobytes()
    assert (got.origin == PoseOrigin.RECORDED).all()


def test_between_near_samples_the_position_is_linear_in_time():
    got = fill_column([V, A, A, V], stamps=np.array([0, 10, 30, 40]) * MS)
    assert got.position[:, 0, 0].tolist() == [0.0, 0.75, 2.25, 3.0]
    assert got.origin[:, 0].tolist() == [1, 3, 3, 1]


@pytest.mark.parametrize(("gap", "bridged"), [(50 * MS, True), (50 * MS + 1, False)])
def test_a_neighbour_counts_up_to_50_ms_and_not_a_nanosecond_longer(gap, bridged):
    got = fill_column([V, A, V], stamps=np.array([0, 20 * MS, 20 * MS + gap]))
    assert got.origin[1, 0] == (PoseOrigin.INTERPOLATED if bridged else PoseOrigin.HELD)
    got = fill_column([V, A], stamps=np.array([0, gap]))
    assert got.origin[1, 0] == (PoseOrigin.HELD if bridged else PoseOrigin.NONE)
    assert np.isnan(got.position[1]).all() == (not bridged)


def test_nothing_is_held_or_interpolated_across_a_lost_sample():
    assert fill_column([V, H, I]).origin[:, 0].tolist() == [1, 2, 3], "what the source held keeps that name"
    got = fill_column([V, A, L, A, V])
    assert got.origin[:, 0].tolist() == [1, 2, 0, 0, 1]
    assert got.position[1, 0, 0] == 0.0
    assert np.isnan(got.position[2:4]).all()


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_a_blend_is_straight_and_turns_as_scipys_slerp(seed):
    rng = np.random.default_rng(seed)
    ends, share = Rotation.random(2, rng=rng), rng.uniform(size=5)
    start, end = (np.tile([*place, *q], (5, 1)) for place, q in zip(np.eye(3)[:2], ends.as_quat(), strict=True))
    end[:, 3:] *= -1.0005  # as another program may have written it
    got = blended(start, end, share)
    assert (Rotation.from_quat(got[:, 3:]) * Slerp([0, 1], ends)(share).inv()).magnitude().max() < 1e-7
    assert np.allclose(got[:, :3], np.outer(1 - share, [1, 0, 0]) + np.outer(share, [0, 1, 0]))
