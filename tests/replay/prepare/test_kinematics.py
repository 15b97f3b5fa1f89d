import numpy as np
from scipy.spatial.transform import Rotation

from replay.prepare.assembly import PoseOrigin
from replay.prepare.interpolation import FilledFrames
from replay.prepare.kinematics import Kinematics, Placed
from sessions.model.scene import Pose, Scene, SceneBody

RNG = np.random.default_rng(0)
ROTATIONS = Rotation.random(10, rng=RNG)
POSITIONS = RNG.normal(size=(5, 2, 3))
RECORDED = np.full((5, 2), PoseOrigin.RECORDED, dtype=np.uint8)


def bodies_placed(scene, bodies, origin=RECORDED):
    """Poses of ``bodies`` by the scene, from the random tracks of a hand (0) and a glass (1) over five frames."""
    frames = FilledFrames(np.arange(5), POSITIONS, ROTATIONS.as_quat().reshape(5, 2, 4), origin)
    room = Placed.empty(5, len(bodies))
    Kinematics(scene, ("hand", "glass"), bodies).place(frames, room)
    return room


def homogeneous_matrices(translation, rotation):
    """Poses as matrices (..., 4, 4)."""
    matrix = np.zeros((*np.shape(translation)[:-1], 4, 4))
    matrix[..., :3, :3], matrix[..., :3, 3], matrix[..., 3, 3] = rotation, translation, 1.0
    return matrix


def matrix_of(pose):
    """A pose of a scene as a matrix (4, 4)."""
    return homogeneous_matrices(pose.position, Rotation.from_quat(pose.quaternion_xyzw).as_matrix())


def test_child_offset_and_fixed_body_compose_as_matrices_do():
    """A hand with an offset, a glass whose recorded pose is relative to the hand's, and a label fixed to the glass.

    Poses are random; the expected ones are products of 4 x 4 matrices.
    """
    hand_offset, glass_offset, on_the_glass = (
        Pose(tuple(RNG.normal(size=3)), tuple(Rotation.random(rng=RNG).as_quat())) for _ in range(3)
    )
    bodies = (
        SceneBody("hand", offset=hand_offset),
        SceneBody("glass", parent="hand", offset=glass_offset),
        SceneBody("label", parent="glass", fixed=on_the_glass),
    )
    actual = bodies_placed(Scene(bodies=bodies), ("hand", "glass", "label"))

    recorded = homogeneous_matrices(POSITIONS, ROTATIONS.as_matrix().reshape(5, 2, 3, 3))
    hand = recorded[:, 0]
    glass = hand @ recorded[:, 1]
    expected = np.stack(
        [hand @ matrix_of(hand_offset), glass @ matrix_of(glass_offset), glass @ matrix_of(on_the_glass)], axis=1
    )
    assert np.abs(homogeneous_matrices(actual.translation, actual.rotation) - expected).max() < 1e-14


def test_body_without_parent_and_offset_has_its_recorded_bits():
    """A scene that declares nothing: the track of the glass, as it was recorded, is its motion."""
    alone = bodies_placed(Scene(), ("glass",))
    glass = 1
    assert alone.translation[:, 0].tobytes() == POSITIONS[:, glass].tobytes()


def test_child_has_poses_only_where_its_parent_has():
    """A recorded glass and a fixed label are carried by the hand, in five frames.

    The hand has no pose in frame 1, and in frame 3 its last one stands in; the glass itself has none in frame 2.
    Where a body has no pose, it stands unrotated at the origin.
    """
    none, recorded, last_pose = (int(origin) for origin in (PoseOrigin.NONE, PoseOrigin.RECORDED, PoseOrigin.HELD))
    hand, glass, label = 0, 1, 2
    origin = RECORDED.copy()
    origin[1, hand], origin[2, glass], origin[3, hand] = none, none, last_pose
    scene = Scene(bodies=(SceneBody("glass", parent="hand"), SceneBody("label", parent="hand", fixed=Pose())))
    actual = bodies_placed(scene, ("hand", "glass", "label"), origin)
    assert actual.origin[:, glass].tolist() == [recorded, none, none, recorded, recorded]
    assert actual.origin[:, label].tolist() == [recorded, none, recorded, last_pose, recorded]
    assert not actual.translation[1].any()
    assert (actual.rotation[1] == np.eye(3)).all()
