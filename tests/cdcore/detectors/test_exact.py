"""``exact`` and ``static`` say CONTACT where the exhaustive test does, whatever their settings."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.shapes import ball_mesh, box_mesh, motion_at_rest, shift_mesh, unrotated_motion

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector, join
from cdcore.protocol import detect_live

CALL_COUNTS = Path(__file__).parents[3] / ".ci" / "call_counts.py"
FRAMES = 40


def body_of_triangles(name, triangles):
    """A body whose faces are these triangles (n, 3, 3)."""
    return Body(name, TriangleMesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)))


def test_small_closed_body_inside_a_large_body_is_contained():
    """A tetrahedron of 1 cm in one of 1 m; without containment it is clear."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float) - 0.25
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    bodies = [Body("in", TriangleMesh(corners * 0.01, faces)), Body("out", TriangleMesh(corners, faces))]
    motion = Motion.from_matrices([0.0], np.tile(np.eye(4), (1, 2, 1, 1)))
    assert create_detector("exact", bodies).detect(motion).verdict.tolist() == [[Verdict.CONTAINED]]
    assert create_detector("exact", bodies, containment=False).detect(motion).verdict.tolist() == [[Verdict.CLEAR]]


def test_boxes_spare_containment_tests_live_and_offline():
    """A ball inside a box leaves it; at most seven more frames than those inside ask for containment."""
    bodies, positions = [Body("in", ball_mesh(0.1)), Body("out", box_mesh())], np.zeros((300, 2, 3))
    positions[:, 0, 0] = np.linspace(0.0, 3.0, 300)
    motion = unrotated_motion(positions)
    detector = create_detector("exact", bodies)
    answer = detector.detect(motion)
    assert detect_live(detector, motion).digest == answer.digest
    contained = int((answer.verdict == Verdict.CONTAINED).sum())
    assert 30 < contained <= answer.work["containment_tests"] < contained + 8


BODIES = [Body("ball", ball_mesh(0.5)), Body("box", box_mesh())]


def motion_along_x(xs, turns=None):
    """The first of two bodies at these places on X, rotated about Z by ``turns``; the second stays at the origin."""
    positions = np.zeros((len(xs), 2, 3))
    positions[:, 0, 0] = xs
    rotation = np.tile(np.eye(3), (len(xs), 2, 1, 1))
    if turns is not None:
        rotation[:, 0] = Rotation.from_rotvec(np.outer(turns, [0, 0, 1])).as_matrix()
    return Motion(np.arange(len(xs)), positions, rotation)


def pair_samples_and_skips(motion, bodies=BODIES, **settings):
    """How many samples of pairs were tested, and how many kept their last answer."""
    done = create_detector("static", bodies, **settings).detect(motion).work
    return done["pair_looks"], done["held"]


def test_frozen_frames_take_a_single_query():
    """100 frames of one pose: one sample, 99 answers kept."""
    assert pair_samples_and_skips(motion_along_x([0.9] * 100)) == (1, 99)


def test_pose_that_differs_by_a_bit_is_a_change():
    """Two frames, two samples, no answer kept."""
    assert pair_samples_and_skips(motion_along_x([0.9, np.nextafter(0.9, 1)])) == (2, 0)


def test_blocks_of_a_stream_remember_the_pose_before():
    """Two poses, ten frames each: two samples, 18 repeated answers, one query of meshes, whatever the block."""
    motion = motion_along_x([0.9] * 10 + [2.0] * 10)
    detector = create_detector("static", BODIES)
    for block in (1, 3, 20):
        joined = join(detector.stream(motion.blocks(block), faces=True))
        assert [joined.work[key] for key in ("pair_looks", "held", "mesh_queries")] == [2, 18, 1]
        whole = detector.detect(motion, faces=True)
        assert (joined.digest, joined.faces_digest) == (whole.digest, whole.faces_digest)


def test_faces_of_every_pair_stay_across_blocks():
    """Three bodies at rest about one middle: each pair is queried once, in the first block."""
    bodies = [*BODIES, Body("lid", box_mesh((0.5, 0.5, 2.0)))]
    motion = motion_at_rest(bodies, np.zeros((3, 3)), frames=6)
    detector = create_detector("static", bodies)
    joined = join(detector.stream(motion.blocks(2), faces=True))
    assert (joined.verdict == Verdict.CONTACT).all() and joined.work["pair_looks"] == 3
    assert joined.faces_digest == detector.detect(motion, faces=True).faces_digest


def test_epsilon_compares_with_the_last_queried_pose():
    """Each of 100 frames moves 0.4 mm: with epsilon 1 mm every third is queried, 34 in all, and 66 are reused."""
    creeping = motion_along_x(0.9 + 0.0004 * np.arange(100))
    assert pair_samples_and_skips(creeping) == (100, 0)
    queries, cached = pair_samples_and_skips(creeping, epsilon=1e-3)
    assert (queries, cached) == (34, 66)


def test_epsilon_measures_rotation_at_the_outermost_point():
    """49 steps of 10 microradians stay within 1 mm at the rim of a ball of 0.5 m; a step of 10 milliradians is 5 mm."""
    assert pair_samples_and_skips(motion_along_x([0.9] * 50, turns=1e-5 * np.arange(50)), epsilon=1e-3)[0] == 1
    assert pair_samples_and_skips(motion_along_x([0.9] * 50, turns=1e-2 * np.arange(50)), epsilon=1e-3)[0] == 50


def test_epsilon_skips_queries_of_pairs_that_move_together():
    """Both rotate and move as one: rounding alone changes their relative pose, by less than an epsilon of 1e-9."""
    steps = np.linspace(0, 1, 40)
    rotation = Rotation.from_rotvec(np.outer(steps, [0, 1, 0])).as_matrix()
    positions = np.zeros((40, 2, 3))
    positions[:, 0] = rotation @ [0.9, 0, 0]
    positions += steps[:, None, None]
    motion = Motion(steps, positions, np.repeat(rotation[:, None], 2, 1))
    assert pair_samples_and_skips(motion)[0] == 40
    assert pair_samples_and_skips(motion, epsilon=1e-9) == (1, 39)


def test_epsilon_skips_queries_of_a_body_turning_about_its_middle():
    """The middle of the ball is 10 m from its origin; its points move by 0.25 mm, and both bodies drift by 0.5 m."""
    middle, drift = np.array([10.0, 0.0, 0.0]), 0.01 * np.arange(50)[:, None] * [0.0, 1.0, 0.0]
    motion = motion_along_x(np.zeros(50), turns=1e-5 * np.arange(50))
    positions = np.stack([[0.9, 0.0, 0.0] - motion.rotations[:, 0] @ middle + drift, drift], axis=1)
    bodies = [Body("ball", shift_mesh(ball_mesh(0.5), middle)), BODIES[1]]
    assert pair_samples_and_skips(Motion(motion.times, positions, motion.rotations), bodies, epsilon=1e-3) == (1, 49)


def test_within_epsilon_a_verdict_is_at_most_that_far_off():
    """Steps of 0.4 mm: within an epsilon of 2 mm contact comes at most five frames late."""
    xs = 1.05 - 0.0004 * np.arange(300)
    exact = create_detector("static", BODIES).detect(motion_along_x(xs)).verdict[:, 0]
    free = create_detector("static", BODIES, epsilon=2e-3).detect(motion_along_x(xs)).verdict[:, 0]
    first = [int(np.argmax(verdict == Verdict.CONTACT)) for verdict in (exact, free)]
    assert first[0] <= first[1] <= first[0] + 5


def test_exact_touch_and_gap_of_an_ulp_live_and_offline():
    """Unit boxes touch face to face and corner to corner, then are apart by 2^-50, then by 1e80."""
    positions = np.zeros((4, 2, 3))
    positions[:, 1] = [[0, 0, 1], [1, 1, 1], [0.5, 0, 1 + 2.0**-50], [1e80, 0, 0]]
    motion = unrotated_motion(positions)
    detector = create_detector("exact", [Body("a", box_mesh()), Body("b", box_mesh())])
    whole = detector.detect(motion).verdict
    assert whole[:, 0].tolist() == [Verdict.CONTACT, Verdict.CONTACT, Verdict.CLEAR, Verdict.CLEAR]
    assert np.array_equal(detect_live(detector, motion).verdict, whole)


@pytest.mark.parametrize("name", ["exact", "collider"])
def test_live_session_without_pairs_answers_about_none(name):
    """Two bodies and an empty list of pairs: an answer of no verdicts."""
    assert create_detector(name, BODIES, pairs=[]).live().look(motion_along_x([0.0])).shape == (0,)


@pytest.mark.slow
def test_question_passes_few_files_and_functions():
    """A query about two tetrahedra in one pose enters at most 11 files and 50 functions of cdcore, uncompiled."""
    printed = subprocess.check_output([sys.executable, CALL_COUNTS], text=True)
    files, functions = map(int, re.match(r"exact: (\d+) files, (\d+) functions", printed).groups())
    assert files <= 11
    assert functions <= 50
