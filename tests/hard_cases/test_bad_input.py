"""Hard cases 35 to 38: odd quaternions, odd meshes and far places change no answer."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.shapes import ball_mesh, box_mesh, moved, still, without_faces

from cdcore import DETECTORS, Body, Motion, TriangleMesh, Verdict, create_detector
from cdcore.protocol import counts_as_contact

BODIES = [Body("ball", ball_mesh(0.5)), Body("box", box_mesh())]
STILL = np.tile(np.eye(3), (3, 2, 1, 1))
NAMES = ["sphere", "hybrid", "static", "discrete", "exact"]


def test_35_float32_quaternions_do_not_stretch_the_body():
    q = Rotation.from_euler("xyz", np.random.default_rng(0).uniform(-3, 3, (200, 3))).as_quat().astype(np.float32)
    motion = Motion.from_quaternions(np.arange(200), np.zeros((200, 1, 3)), q[:, None])
    raw = np.abs(np.linalg.norm(q.astype(float), axis=1) - 1).max()
    lengths = np.linalg.norm(motion.rotations[:, 0] @ [0.3, 0.4, 0.5], axis=1) / np.linalg.norm([0.3, 0.4, 0.5])
    assert raw > 1e-9
    assert np.abs(lengths - 1).max() < 1e-15


def test_35_the_other_sign_of_a_quaternion_is_the_same_pose():
    q = Rotation.from_euler("xyz", [[0.1, 0.2, 0.3]]).as_quat()
    both = Motion.from_quaternions([0.0, 1.0], np.zeros((2, 1, 3)), np.stack([q, -q]))
    assert both.rotations[0].tobytes() == both.rotations[1].tobytes()


@pytest.mark.parametrize("name", NAMES)
def test_37_a_mesh_without_any_area_is_survived(name):
    bodies = [Body(one, TriangleMesh(np.zeros((3, 3)), [[0, 1, 2], [0, 0, 0]])) for one in "ab"]
    detection = create_detector(name, bodies).detect(still(bodies, np.zeros((2, 3))), faces=True)
    assert detection.verdict.shape == (1, 1)


@pytest.mark.parametrize("name", NAMES)
def test_37_zero_area_faces_among_good_ones_change_no_verdict(name):
    box = box_mesh()
    spoiled = TriangleMesh(box.vertices, [*box.faces.tolist(), [0, 0, 1], [3, 3, 3]])
    motion = Motion(np.arange(3), [[[0, 0, 0], [0, 0, 0]], [[0.9, 0, 0], [0, 0, 0]], [[3, 0, 0], [0, 0, 0]]], STILL)
    good = create_detector(name, BODIES).detect(motion)
    bad = create_detector(name, [BODIES[0], Body("box", spoiled)]).detect(motion)
    assert good.digest == bad.digest


@pytest.mark.parametrize("name", NAMES[1:])
def test_37_faces_listed_twice_give_each_pair_once(name):
    box = box_mesh()
    doubled = TriangleMesh(box.vertices, np.concatenate([box.faces, box.faces]))
    motion = Motion([0.0], [[[0.9, 0, 0], [0, 0, 0]]], STILL[:1])
    faces = create_detector(name, [BODIES[0], Body("box", doubled)]).detect(motion, faces=True).faces(0, 0)
    plain = create_detector(name, BODIES).detect(motion, faces=True).faces(0, 0)
    assert len(faces) == 2 * len(plain) > 0
    assert len(np.unique(faces, axis=0)) == len(faces)


@pytest.mark.parametrize("name", NAMES)
def test_37_unmerged_vertices_and_turned_faces_change_no_verdict(name):
    box = box_mesh()
    loose = TriangleMesh(box.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    turned = TriangleMesh(box.vertices, box.faces[:, ::-1])
    motion = Motion(np.arange(3), [[[0, 0, 0], [0, 0, 0]], [[0.9, 0, 0], [0, 0, 0]], [[3, 0, 0], [0, 0, 0]]], STILL)
    verdicts = [
        create_detector(name, [Body("ball", ball_mesh(0.2)), Body("box", mesh)]).detect(motion).verdict
        for mesh in (box, loose, turned)
    ]
    assert counts_as_contact(verdicts[0])[0]
    assert np.array_equal(verdicts[0], verdicts[1])
    assert np.array_equal(verdicts[0], verdicts[2])


@pytest.mark.parametrize("name", NAMES)
def test_37_a_far_vertex_that_no_face_uses_inflates_nothing(name):
    stray = TriangleMesh([*box_mesh().vertices.tolist(), [50.0, 0, 0]], box_mesh().faces)
    bodies = [Body("ball", ball_mesh(0.5)), Body("box", stray)]
    verdict = create_detector(name, bodies).detect(still(bodies, [[3.0, 0, 0], [0, 0, 0]])).verdict
    assert verdict[0, 0] == Verdict.CLEAR


@pytest.mark.parametrize("name", NAMES[1:])
def test_37_an_open_mesh_refuses_containment_by_name_and_keeps_contact(name):
    bodies = [Body("ball", ball_mesh(0.1)), Body("crate", without_faces(box_mesh(), 1))]
    motion = Motion(np.arange(2), [[[0, 0, 0], [0, 0, 0]], [[0.5, 0.1, 0.2], [0, 0, 0]]], STILL[:2])
    detection = create_detector(name, bodies).detect(motion)
    assert detection.verdict[:, 0].tolist() == [Verdict.CLEAR, Verdict.CONTACT]
    assert detection.containment == ("refused: crate is open",)


@pytest.mark.parametrize("name", NAMES[1:])
def test_37_an_edge_of_three_faces_is_not_closed(name):
    fan = TriangleMesh([*box_mesh().vertices.tolist(), [-3.0, -3, 0]], [*box_mesh().faces.tolist(), [0, 1, 8]])
    bodies = [Body("ball", ball_mesh(0.1)), Body("fan", fan)]
    detection = create_detector(name, bodies).detect(still(bodies, np.zeros((2, 3))))
    assert detection.containment == ("refused: fan is open",)
    assert detection.verdict[0, 0] == Verdict.CLEAR


@pytest.mark.parametrize("name", [name for name in NAMES if name in DETECTORS])
@pytest.mark.parametrize("shift", [1e3, 1e5, 1e7])
@pytest.mark.parametrize("baked", [False, True], ids=["in the pose", "in the vertices"])
def test_38_far_from_the_origin_no_contact_is_lost(name, shift, baked):
    # Overlap and clearance of a centimetre are far above the spacing of float64 at 1e7 m (2 nanometres).
    offset = np.array([shift, -shift, shift])
    ball, box = ball_mesh(0.5, 8, 16), box_mesh()
    bodies = [Body("ball", moved(ball, offset) if baked else ball), Body("box", moved(box, offset) if baked else box)]
    base = np.zeros(3) if baked else offset
    places = np.array([[[0.99, 0, 0], [0, 0, 0]], [[1.01, 0, 0], [0, 0, 0]]]) + base
    verdict = create_detector(name, bodies).detect(Motion([0.0, 1.0], places, STILL[:2])).verdict[:, 0]
    assert counts_as_contact(verdict)[0]
    if name != "sphere":
        assert verdict[1] == Verdict.CLEAR


@pytest.mark.parametrize("local", [0.0, 1.0, 1e3])
@pytest.mark.parametrize("world", [0.0, 1.0, 1e3, 1e6])
def test_38_tangent_spheres_of_touching_bodies_overlap(local, world):
    # Two octahedra share one vertex, at which their bounding spheres are exactly tangent.
    rng = np.random.default_rng(7)
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    faces = [[a, b, c] for a in (0, 3) for b in (1, 4) for c in (2, 5)]
    shift = rng.normal(size=3) * local
    one, other = (TriangleMesh(corners * 0.25 + shift + [x, 0, 0], faces) for x in (0.0, 0.5))
    bodies = [Body("one", one), Body("other", other)]
    count = 1000
    turn = Rotation.random(count, random_state=3).as_matrix()
    place = rng.normal(size=(count, 3)) * world
    place[: count // 2] -= turn[: count // 2] @ shift
    motion = Motion(np.arange(count), np.repeat(place[:, None], 2, 1), np.repeat(turn[:, None], 2, 1))
    for mode in ("paper", "best"):
        verdict = create_detector("sphere", bodies, sphere=mode).detect(motion).verdict
        assert (verdict == Verdict.CANDIDATE).all()
