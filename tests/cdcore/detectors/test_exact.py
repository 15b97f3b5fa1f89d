"""``exact`` says CONTACT where the exhaustive test does, CONTAINED where it can, and the same whatever its settings."""

import numpy as np
import pytest
from support.motions import KINDS, grid_plate, motion_of, placed

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector, join
from cdcore.errors import InvalidSettingError
from cdcore.narrow.brute_force import meeting_faces_exhaustive

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
    for frame in range(0, FRAMES, 3):
        world = [
            placed(mesh, motion.rotations[frame, k], motion.translations[frame, k]) for k, mesh in enumerate(meshes)
        ]
        for column, (i, j) in enumerate(detection.pairs.tolist()):
            want = meeting_faces_exhaustive(world[i], world[j])
            assert np.array_equal(detection.faces(frame, column), want)
            assert (detection.verdict[frame, column] == Verdict.CONTACT) == (len(want) > 0)
            section = detection.section(frame, column)
            assert section.shape == (len(want), 2, 3)
            assert np.isfinite(section).all()


@pytest.mark.parametrize("settings", [{"threads": 2}, {"verify": True}, {"containment": False}])
def test_settings_change_no_answer(settings):
    _, bodies, motion = scene("soup")
    plain = create_detector("exact", bodies).detect(motion, faces=True)
    other = create_detector("exact", bodies, **settings).detect(motion, faces=True)
    assert other.digest == plain.digest
    assert other.faces_digest == plain.faces_digest


@pytest.mark.parametrize("block", [1, 3, 17])
def test_a_stream_in_blocks_has_the_digests_of_the_whole(block):
    _, bodies, motion = scene("degenerate")
    detector = create_detector("exact", bodies)
    whole, joined = detector.detect(motion, faces=True), join(detector.stream(motion.blocks(block), faces=True))
    assert joined.digest == whole.digest
    assert joined.faces_digest == whole.faces_digest


def test_threads_below_one_are_refused():
    with pytest.raises(InvalidSettingError, match="threads"):
        create_detector("exact", [body_of("a", grid_plate(1))], threads=0)


def test_a_small_closed_body_inside_a_large_one_is_contained():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float) - 0.25
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    bodies = [Body("in", TriangleMesh(corners * 0.01, faces)), Body("out", TriangleMesh(corners, faces))]
    motion = Motion.from_matrices([0.0], np.tile(np.eye(4), (1, 2, 1, 1)))
    assert create_detector("exact", bodies).detect(motion).verdict.tolist() == [[Verdict.CONTAINED]]
    assert create_detector("exact", bodies, containment=False).detect(motion).verdict.tolist() == [[Verdict.CLEAR]]


def test_a_glass_at_rest_on_a_table_is_asked_once_for_an_hour():
    plate = grid_plate(10) * 0.01
    bodies = [body_of("table", plate), body_of("glass", plate + np.array([0.003, 0.001, 0.0]))]
    frames = 20_000
    turn, move = np.tile(np.eye(3), (frames, 2, 1, 1)), np.zeros((frames, 2, 3))
    detection = create_detector("exact", bodies).detect(Motion(np.arange(frames) / 90, move, turn), faces=True)
    assert (detection.verdict == Verdict.CONTACT).all()
    assert detection.work["reused"] == frames - 1
    assert len(detection.face_sets.faces) == len(detection.faces(0, 0)) > 200
    assert np.array_equal(detection.faces(frames - 1, 0), detection.faces(0, 0))
