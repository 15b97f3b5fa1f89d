import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp
from support.small_worlds import framed

from replay.errors import AssemblyError
from replay.prepare.assembly import PoseOrigin
from replay.prepare.interpolation import BRIDGE_NS, FilledFrames, filled, slerp
from replay.prepare.kinematics import PlacedFrames, Placing
from sessions import Status
from sessions.model.scene import Pose, Scene, SceneBody


def random_frames(bodies, frames=5, seed=0):
    rng = np.random.default_rng(seed)
    quaternion = Rotation.random(frames * bodies, rng=rng).as_quat().reshape(frames, bodies, 4)
    origin = np.full((frames, bodies), PoseOrigin.RECORDED, dtype=np.uint8)
    return FilledFrames(np.arange(frames), rng.normal(size=(frames, bodies, 3)), quaternion, origin)


def matrices(translation, rotation):
    matrix = np.zeros((*translation.shape[:-1], 4, 4))
    matrix[..., :3, :3], matrix[..., :3, 3], matrix[..., 3, 3] = rotation, translation, 1.0
    return matrix


def pose_matrix(pose):
    return matrices(np.array(pose.position), Rotation.from_quat(pose.quaternion_xyzw).as_matrix())


def random_pose(seed):
    rng = np.random.default_rng(seed)
    return Pose(tuple(rng.normal(size=3)), tuple(Rotation.random(rng=rng).as_quat()))


def test_child_offset_and_fixed_body_compose_as_matrices_do():
    offset, on_glass = random_pose(1), random_pose(2)
    scene = Scene(
        bodies=(
            SceneBody("hand", offset=random_pose(3)),
            SceneBody("glass", parent="hand", offset=offset),
            SceneBody("label", parent="glass", fixed=on_glass),
        )
    )
    frames = random_frames(2)
    placed = Placing(scene, ("hand", "glass"), ("hand", "glass", "label")).place(frames)
    own = matrices(
        frames.position, Rotation.from_quat(frames.quaternion_xyzw.reshape(-1, 4)).as_matrix().reshape(5, 2, 3, 3)
    )
    got = matrices(placed.translation, placed.rotation)
    glass = own[:, 0] @ own[:, 1]
    assert np.abs(got[:, 0] - own[:, 0] @ pose_matrix(scene.bodies[0].offset)).max() < 1e-14
    assert np.abs(got[:, 1] - glass @ pose_matrix(offset)).max() < 1e-14
    assert np.abs(got[:, 2] - glass @ pose_matrix(on_glass)).max() < 1e-14


def test_a_child_is_there_only_where_its_parent_is():
    frames = random_frames(2)
    origin = frames.origin.copy()
    origin[1, 0], origin[2, 1], origin[3, 0] = PoseOrigin.NONE, PoseOrigin.NONE, PoseOrigin.HELD
    frames = FilledFrames(frames.stamp_ns, frames.position, frames.quaternion_xyzw, origin)
    scene = Scene(bodies=(SceneBody("glass", parent="hand"), SceneBody("label", parent="hand", fixed=Pose())))
    placed = Placing(scene, ("hand", "glass"), ("hand", "glass", "label")).place(frames)
    assert placed.origin[:, 1].tolist() == [1, 0, 0, 1, 1]
    assert placed.origin[:, 2].tolist() == [1, 0, 1, 2, 1]
    assert placed.translation[1].tolist() == [[0.0] * 3, [0.0] * 3, [0.0] * 3]
    assert (placed.rotation[1] == np.eye(3)).all()


def test_a_fixed_body_of_the_world_is_there_in_every_frame():
    scene = Scene(bodies=(SceneBody("bench", fixed=Pose((0.0, 0.9, 0.0))),))
    placed = Placing(scene, ("hand",), ("hand", "bench")).place(random_frames(1))
    assert (placed.origin[:, 1] == PoseOrigin.FIXED).all()
    assert (placed.translation[:, 1] == [0.0, 0.9, 0.0]).all()


def test_bodies_without_parent_and_offset_keep_the_bits_of_their_position():
    frames = random_frames(2)
    placed = Placing(Scene(), ("a", "b"), ("b",)).place(frames)
    assert placed.translation[:, 0].tobytes() == frames.position[:, 1].tobytes()


def test_parts_and_joins_undo_each_other():
    placed = Placing(Scene(), ("a",), ("a",)).place(random_frames(1))
    joined = PlacedFrames.join([placed.part(0, 2), placed.part(2, 5)])
    for name in vars(placed):
        assert np.array_equal(getattr(placed, name), getattr(joined, name))


def test_a_parent_nobody_recorded_is_refused_by_name():
    scene = Scene(bodies=(SceneBody("glass", parent="hand"),))
    with pytest.raises(AssemblyError, match="body 'hand', parent of 'glass', has neither a track nor a fixed pose"):
        Placing(scene, ("glass",), ("glass",))


def test_a_circle_of_parents_is_refused_and_written_out():
    scene = Scene(bodies=(SceneBody("a", parent="b"), SceneBody("b", parent="a")))
    with pytest.raises(AssemblyError, match="a -> b -> a"):
        Placing(scene, ("a", "b"), ("a",))


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
    got = fill_column([V, A, L, A, V])
    assert got.origin[:, 0].tolist() == [1, 2, 0, 0, 1]
    assert got.position[1, 0, 0] == 0.0
    assert np.isnan(got.position[2:4]).all()


def test_before_the_first_sample_there_is_no_pose():
    assert fill_column([A, A, V]).origin[:, 0].tolist() == [0, 0, 1]


def test_what_the_source_held_or_interpolated_keeps_that_name():
    assert fill_column([V, H, I]).origin[:, 0].tolist() == [1, 2, 3]


def test_a_held_pose_is_the_latest_sample_before():
    got = fill_column([V, V, A], stamps=np.array([0, 10, 20]) * MS)
    assert got.position[2, 0, 0] == 1.0 and got.origin[2, 0] == PoseOrigin.HELD


@given(
    st.lists(st.lists(st.sampled_from([A, A, V, V, L, H]), min_size=2, max_size=2), min_size=1, max_size=30),
    st.lists(st.integers(1, 60), min_size=30, max_size=30),
    st.integers(1, 8),
)
@settings(max_examples=200, deadline=None)
def test_block_borders_change_no_bit(status, steps, block):
    stamps = np.cumsum(steps[: len(status)]) * MS
    rng = np.random.default_rng(len(status))
    position = rng.normal(size=(len(status), 2, 3))
    quaternion = Rotation.random(2 * len(status), rng=rng).as_quat().reshape(-1, 2, 4)
    session = framed(stamps, status, position, quaternion)
    whole, cut = fill(session), fill(session, block)
    for name in FilledFrames.__dataclass_fields__:
        assert getattr(whole, name).tobytes() == getattr(cut, name).tobytes(), name


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_slerp_is_scipys_slerp(seed):
    rng = np.random.default_rng(seed)
    ends = Rotation.random(2, rng=rng)
    share = rng.uniform(size=5)
    start, end = (np.tile(q, (5, 1)) for q in ends.as_quat())
    got = Rotation.from_quat(slerp(start, -end, share))
    want = Slerp([0, 1], ends)(share)
    assert (got * want.inv()).magnitude().max() < 1e-7


def test_slerp_between_nearly_equal_quaternions_is_finite_and_between():
    tiny = Rotation.from_rotvec([0, 0, 1e-9]).as_quat()[None]
    still = np.array([[0.0, 0.0, 0.0, 1.0]])
    assert slerp(still, tiny, np.array([0.5]))[0, 2] == pytest.approx(2.5e-10, rel=1e-6)
    assert slerp(still, still, np.array([0.5])).tolist() == still.tolist()


def test_the_bridge_is_50_ms():
    assert BRIDGE_NS == 50 * MS
