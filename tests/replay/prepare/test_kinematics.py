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
    """Poses from the tracks of a hand and a glass over five frames."""
    frames = FilledFrames(np.arange(5), POSITIONS, ROTATIONS.as_quat().reshape(5, 2, 4), origin)
    room = Placed.empty(5, len(bodies))
    Kinematics(scene, ("hand", "glass"), bodies).place(frames, room)
    return room


def homogeneous_matrices(translation, rotation):
    """Poses as matrices (..., 4, 4)."""
    matrix = np.zeros((*np.shape(translation)[:-1], 4, 4))
    matrix[..., :3, :3], matrix[..., :3, 3], matrix[..., 3, 3] = rotation, translation, 1.0
    return matrix


def test_child_offset_and_fixed_body_compose_as_matrices_do():
    """A hand with an offset, a glass whose recorded pose is relative to it, and a label fixed to the glass."""
    poses = [Pose(tuple(RNG.normal(size=3)), tuple(Rotation.random(rng=RNG).as_quat())) for _ in range(3)]
    first, offset, fixed = (
        homogeneous_matrices(item.position, Rotation.from_quat(item.quaternion_xyzw).as_matrix()) for item in poses
    )
    bodies = (
        SceneBody("hand", offset=poses[0]),
        SceneBody("glass", parent="hand", offset=poses[1]),
        SceneBody("label", parent="glass", fixed=poses[2]),
    )
    actual = bodies_placed(Scene(bodies=bodies), ("hand", "glass", "label"))
    own = homogeneous_matrices(POSITIONS, ROTATIONS.as_matrix().reshape(5, 2, 3, 3))
    glass = own[:, 0] @ own[:, 1]
    expected = np.stack([own[:, 0] @ first, glass @ offset, glass @ fixed], axis=1)
    assert np.abs(homogeneous_matrices(actual.translation, actual.rotation) - expected).max() < 1e-14
    alone = bodies_placed(Scene(), ("glass",))
    assert alone.translation[:, 0].tobytes() == POSITIONS[:, 1].tobytes(), "without parent and offset the bits stay"


def test_child_has_poses_only_where_its_parent_has():
    """Rows are the origins of glass and label, both carried by the hand: 1 recorded, 2 last pose held, 0 none.

    The hand has no pose in frame 1 and a held one in frame 3; the glass itself has none in frame 2.
    """
    origin = RECORDED.copy()
    origin[[1, 2, 3], [0, 1, 0]] = PoseOrigin.NONE, PoseOrigin.NONE, PoseOrigin.HELD
    scene = Scene(bodies=(SceneBody("glass", parent="hand"), SceneBody("label", parent="hand", fixed=Pose())))
    actual = bodies_placed(scene, ("hand", "glass", "label"), origin)
    assert actual.origin[:, 1:].T.tolist() == [[1, 0, 0, 1, 1], [1, 0, 1, 2, 1]]
    assert not actual.translation[1].any() and (actual.rotation[1] == np.eye(3)).all()
