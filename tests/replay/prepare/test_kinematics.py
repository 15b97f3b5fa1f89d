import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from replay.errors import AssemblyError
from replay.prepare.assembly import PoseOrigin
from replay.prepare.interpolation import FilledFrames
from replay.prepare.kinematics import Kinematics
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
    placed = Kinematics(scene, ("hand", "glass"), ("hand", "glass", "label")).place(frames)
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
    placed = Kinematics(scene, ("hand", "glass"), ("hand", "glass", "label")).place(frames)
    assert placed.origin[:, 1].tolist() == [1, 0, 0, 1, 1]
    assert placed.origin[:, 2].tolist() == [1, 0, 1, 2, 1]
    assert placed.translation[1].tolist() == [[0.0] * 3, [0.0] * 3, [0.0] * 3]
    assert (placed.rotation[1] == np.eye(3)).all()


def test_bodies_without_parent_and_offset_keep_the_bits_of_their_position():
    frames = random_frames(2)
    placed = Kinematics(Scene(), ("a", "b"), ("b",)).place(frames)
    assert placed.translation[:, 0].tobytes() == frames.position[:, 1].tobytes()


@pytest.mark.parametrize(
    ("tracked", "words"),
    [("a", "body 'b', parent of 'a', has neither a track nor a fixed pose"), ("ab", "a -> b -> a; break it")],
)
def test_a_parent_that_nobody_recorded_and_a_circle_of_parents_are_refused(tracked, words):
    scene = Scene(bodies=(SceneBody("a", parent="b"), SceneBody("b", parent="a")))
    with pytest.raises(AssemblyError, match=words):
        Kinematics(scene, tuple(tracked), ("a",))
