"""``exact`` and ``static`` say CONTACT where the exhaustive test does, whatever their settings."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.motions import KINDS, exhaustive, grid_plate, motion_of, placed
from support.shapes import ball_mesh, beaker_mesh, box_mesh, lab, merged, moved

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector, join
from cdcore.protocol import detect_live

FRAMES = 40


def body_of(name, triangles):
    return Body(name, TriangleMesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)))


def scene(kind):
    rng = np.random.default_rng(11)
    meshes = [KINDS[kind](rng) for _ in range(3)]
    turn, move = motion_of(kind, rng, FRAMES, 3)
    return meshes, [body_of(f"b{k}", mesh) for k, mesh in enumerate(meshes)], Motion(np.arange(FRAMES) / 90, move, turn)


@pytest.mark.parametrize("kind", KINDS)
def test_verdicts_and_faces_equal_the_exhaustive_test(kind):
    meshes, bodies, motion = scene(kind)
    detection = create_detector("exact", bodies).detect(motion, faces=True)
    for frame, column, want in exhaustive(detection, meshes, motion, 3):
        section = detection.section(frame, column)
        assert section.shape == (len(want), 2, 3) and np.isfinite(section).all()


@pytest.mark.parametrize("settings", [{"threads": 2}, {"containment": False}])
def test_settings_change_no_answer(settings):
    _, bodies, motion = scene("soup")
    plain = create_detector("exact", bodies).detect(motion, faces=True)
    other = create_detector("exact", bodies, **settings).detect(motion, faces=True)
    assert other.digest == plain.digest
    assert other.faces_digest == plain.faces_digest


def test_a_small_closed_body_inside_a_large_one_is_contained():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float) - 0.25
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    bodies = [Body("in", TriangleMesh(corners * 0.01, faces)), Body("out", TriangleMesh(corners, faces))]
    motion = Motion.from_matrices([0.0], np.tile(np.eye(4), (1, 2, 1, 1)))
    assert create_detector("exact", bodies).detect(motion).verdict.tolist() == [[Verdict.CONTAINED]]
    assert create_detector("exact", bodies, containment=False).detect(motion).verdict.tolist() == [[Verdict.CLEAR]]


def crossings_are_odd(point, triangles):
    """Whether a closed surface winds round a point an odd number of times, from solid angles (van Oosterom)."""
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    turns = np.arctan2((a * np.cross(b, c)).sum(1), below).sum() / (2 * np.pi)
    return round(turns) % 2 == 1


@pytest.mark.parametrize("seed", range(6))
def test_containment_of_nested_motions_is_the_parity_of_every_pair_frame(seed):
    rng = np.random.default_rng(seed)
    beads = merged(*(moved(ball_mesh(0.05, 4, 6), [x, 0, 0]) for x in (-0.3, 0.3)))
    meshes = [beads, box_mesh(), beaker_mesh(0.7, 1.2, 0.4), ball_mesh(0.02, 3, 4)]
    frames, parts = 60, [[0, -1], [0], [0], [0]]
    turn = Rotation.from_rotvec(np.cumsum(rng.normal(size=(frames * 4, 3)) * 0.05, axis=0)).as_matrix()
    place = np.cumsum(rng.normal(size=(frames, 4, 3)) * 0.06, axis=0) + rng.uniform(-0.5, 0.5, (4, 3))
    place[:, 1] = place[0, 1]
    place[10:20] = place[10]
    place[33, 0] = 1e9
    turn = turn.reshape(frames, 4, 3, 3)
    turn[:, 1] = turn[0, 1]
    turn[10:20] = turn[10]
    valid = rng.random((frames, 4)) > 0.03
    bodies = [Body(f"b{k}", mesh) for k, mesh in enumerate(meshes)]
    found = create_detector("exact", bodies).detect(Motion(np.arange(frames), place, turn, valid))
    world = [[placed(mesh.triangles, turn[f, k], place[f, k]) for k, mesh in enumerate(meshes)] for f in range(frames)]
    apart = (found.verdict == Verdict.CLEAR) | (found.verdict == Verdict.CONTAINED)
    for frame, column in np.argwhere(apart).tolist():
        ends = found.pairs[column].tolist()
        inside = any(
            crossings_are_odd(world[frame][inner][part, 0], world[frame][outer])
            for inner, outer in (ends, ends[::-1])
            for part in parts[inner]
        )
        assert (found.verdict[frame, column] == Verdict.CONTAINED) == inside
    asked = found.work["containment_tests"]
    assert (found.verdict == Verdict.CONTAINED).sum() <= asked < apart.sum()


def test_a_body_that_bounding_boxes_keep_apart_is_not_asked_about():
    bodies, places = [Body("in", ball_mesh(0.1)), Body("out", box_mesh())], np.zeros((300, 2, 3))
    places[:, 0, 0] = np.linspace(0.0, 3.0, 300)
    motion = Motion(np.arange(300), places, np.tile(np.eye(3), (300, 2, 1, 1)))
    found = create_detector("exact", bodies).detect(motion)
    contained = int((found.verdict == Verdict.CONTAINED).sum())
    assert 30 < contained <= found.work["containment_tests"] < contained + 8


def test_a_glass_at_rest_on_a_table_is_asked_once_a_stretch_of_frames():
    plate = grid_plate(10) * 0.01
    bodies = [body_of("table", plate), body_of("glass", plate + np.array([0.003, 0.001, 0.0]))]
    frames = 20_000
    turn, move = np.tile(np.eye(3), (frames, 2, 1, 1)), np.zeros((frames, 2, 3))
    detection = create_detector("exact", bodies).detect(Motion(np.arange(frames) / 90, move, turn), faces=True)
    assert (detection.verdict == Verdict.CONTACT).all()
    assert detection.work["reused"] >= frames - 2  # two stretches
    assert len(detection.face_sets.faces) == 2 * len(detection.faces(0, 0)) > 400
    assert np.array_equal(detection.faces(frames - 1, 0), detection.faces(0, 0))


BODIES = [Body("ball", ball_mesh(0.5)), Body("box", box_mesh())]


def along(xs, turns=None):
    places = np.zeros((len(xs), 2, 3))
    places[:, 0, 0] = xs
    turn = np.tile(np.eye(3), (len(xs), 2, 1, 1))
    if turns is not None:
        turn[:, 0] = Rotation.from_rotvec(np.outer(turns, [0, 0, 1])).as_matrix()
    return Motion(np.arange(len(xs)), places, turn)


def work(motion, **settings):
    done = create_detector("static", BODIES, **settings).detect(motion).work
    return done["queries"], done["cached"]


def test_frozen_frames_are_one_query():
    assert work(along([0.9] * 100)) == (1, 99)


def test_a_move_and_the_way_back_are_two_more():
    assert work(along([0.9] * 10 + [0.95] * 10 + [0.9] * 10)) == (3, 27)


def test_a_pose_one_bit_off_is_a_change():
    assert work(along([0.9, np.nextafter(0.9, 1)])) == (2, 0)


def test_blocks_of_a_stream_remember_the_pose_before():
    motion = along([0.9] * 10 + [2.0] * 10)
    detector = create_detector("static", BODIES)
    for block in (1, 3, 20):
        joined = join(detector.stream(motion.blocks(block), faces=True))
        assert joined.work == {"queries": 2, "cached": 18, "mesh_queries": 1}
        whole = detector.detect(motion, faces=True)
        assert (joined.digest, joined.faces_digest) == (whole.digest, whole.faces_digest)


def test_missing_poses_between_equal_ones_ask_nothing_new():
    motion = along([0.9] * 9)
    valid = np.ones((9, 2), dtype=bool)
    valid[3:6, 0] = False
    gap = Motion(motion.times, motion.translations, motion.rotations, valid)
    detection = create_detector("static", BODIES).detect(gap)
    assert detection.work == {"queries": 1, "cached": 5, "mesh_queries": 1}
    assert detection.verdict[:, 0].tolist() == [1] * 3 + [Verdict.NO_POSE] * 3 + [1] * 3


def test_epsilon_lets_small_moves_pass_and_does_not_let_them_add_up():
    creeping = along(0.9 + 0.0004 * np.arange(100))
    assert work(creeping) == (100, 0)
    queries, cached = work(creeping, epsilon=1e-3)
    assert (queries, cached) == (34, 66)


def test_epsilon_sees_a_turn_by_the_way_of_the_outermost_point():
    assert work(along([0.9] * 50, turns=1e-5 * np.arange(50)), epsilon=1e-3)[0] == 1
    assert work(along([0.9] * 50, turns=1e-2 * np.arange(50)), epsilon=1e-3)[0] == 50


def test_epsilon_does_not_ask_again_when_both_move_as_one():
    steps = np.linspace(0, 1, 40)
    turn = Rotation.from_rotvec(np.outer(steps, [0, 1, 0])).as_matrix()
    places = np.zeros((40, 2, 3))
    places[:, 0] = turn @ [0.9, 0, 0]
    places += steps[:, None, None]
    motion = Motion(steps, places, np.repeat(turn[:, None], 2, 1))
    assert work(motion)[0] == 40
    assert work(motion, epsilon=1e-9) == (1, 39)


def test_within_epsilon_a_verdict_is_at_most_that_far_off():
    xs = 1.05 - 0.0004 * np.arange(300)
    exact = create_detector("static", BODIES).detect(along(xs)).verdict[:, 0]
    loose = create_detector("static", BODIES, epsilon=2e-3).detect(along(xs)).verdict[:, 0]
    first = [int(np.argmax(verdict == Verdict.CONTACT)) for verdict in (exact, loose)]
    assert first[0] <= first[1] <= first[0] + 5


@pytest.mark.parametrize("block", [1, 13])
def test_epsilon_in_blocks_gives_the_same_answers(block):
    bodies, motion = lab(120)
    detector = create_detector("static", bodies, epsilon=2e-3)
    whole, joined = detector.detect(motion), join(detector.stream(motion.blocks(block)))
    assert joined.digest == whole.digest
    assert joined.work == whole.work


def test_asked_live_ties_and_sizes_beyond_the_kernels_are_decided_as_in_the_whole_motion():
    places = np.zeros((4, 2, 3))
    places[:, 1] = [[0, 0, 1], [1, 1, 1], [0.5, 0, 1 + 2.0**-50], [1e80, 0, 0]]
    motion = Motion(np.arange(4), places, np.tile(np.eye(3), (4, 2, 1, 1)))
    detector = create_detector("exact", [Body("a", box_mesh()), Body("b", box_mesh())])
    whole = detector.detect(motion).verdict
    assert whole[:, 0].tolist() == [Verdict.CONTACT, Verdict.CONTACT, Verdict.CLEAR, Verdict.CLEAR]
    assert np.array_equal(detect_live(detector, motion).verdict, whole)
