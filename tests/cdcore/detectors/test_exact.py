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
"""Prints how many files and functions of cdcore a query enters, by detector."""


def test_small_closed_body_inside_a_large_body_is_contained():
    """A tetrahedron of 1 cm in one of 1 m; without containment it is clear."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float) - 0.25
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    bodies = [Body("in", TriangleMesh(corners * 0.01, faces)), Body("out", TriangleMesh(corners, faces))]
    motion = Motion.from_matrices([0.0], np.tile(np.eye(4), (1, 2, 1, 1)))
    assert create_detector("exact", bodies).detect(motion).verdict.tolist() == [[Verdict.CONTAINED]]
    assert create_detector("exact", bodies, containment=False).detect(motion).verdict.tolist() == [[Verdict.CLEAR]]


def test_boxes_spare_containment_tests_live_and_offline():
    """A ball of radius 0.1 m moves out of a box of 1 m, 1 cm a frame: it is inside for 40 frames, up to x = 0.4 m.

    Whether it is inside is asked in those, and, once it has crossed the wall, as long as the boxes of both overlap:
    a corner of the ball's box is at most 0.1 * (3**0.5 - 1) = 0.073 m farther out than the ball, 7 frames. Frame by
    frame (live) the answer is the same.
    """
    frames = 300
    bodies, positions = [Body("ball", ball_mesh(0.1)), Body("box", box_mesh())], np.zeros((frames, 2, 3))
    positions[:, 0, 0] = np.linspace(0.0, 3.0, frames)
    motion = unrotated_motion(positions)
    detector = create_detector("exact", bodies)
    answer = detector.detect(motion)
    contained = int((answer.verdict == Verdict.CONTAINED).sum())
    assert contained > 30
    assert contained <= answer.work["containment_tests"] <= contained + 7
    assert detect_live(detector, motion).digest == answer.digest


BODIES = [Body("ball", ball_mesh(0.5)), Body("box", box_mesh())]
"""A ball of radius 0.5 m and a box of 1 m: they meet where their middles are 1 m apart along x, or less."""


def motion_along_x(xs, angles=None):
    """The first of two bodies at these x, rotated about z by ``angles`` (radians); the second stays at the origin."""
    positions = np.zeros((len(xs), 2, 3))
    positions[:, 0, 0] = xs
    rotation = np.tile(np.eye(3), (len(xs), 2, 1, 1))
    if angles is not None:
        rotation[:, 0] = Rotation.from_rotvec(np.outer(angles, [0, 0, 1])).as_matrix()
    return Motion(np.arange(len(xs)), positions, rotation)


def queries_and_reuses(motion, bodies=BODIES, **settings):
    """In how many frames ``static`` tested the pair, and in how many it repeated its last answer.

    It tests after a pose has changed: at all, or by more than ``epsilon`` metres since the last test.
    """
    work = create_detector("static", bodies, **settings).detect(motion).work
    return work["pair_looks"], work["held"]


def test_frozen_frames_take_a_single_query():
    """A ball in the wall of a box for 100 frames of one pose: ``static`` queries once, and repeats 99 answers."""
    assert queries_and_reuses(motion_along_x([0.9] * 100)) == (1, 99)


def test_pose_that_differs_by_a_bit_is_a_change():
    """A ball at x = 0.9 m and at the next double: ``static``, which repeats an answer only at the same pose, queries
    twice.
    """
    assert queries_and_reuses(motion_along_x([0.9, np.nextafter(0.9, 1)])) == (2, 0)


@pytest.mark.parametrize("block", [1, 3, 20])
def test_blocks_of_a_stream_remember_the_pose_before(block):
    """A ball in the wall of a box for ten frames, and 2 m away for ten, in blocks of so many frames.

    ``static`` queries the pair twice, of which the first query needs the meshes, and repeats 18 answers.
    """
    motion = motion_along_x([0.9] * 10 + [2.0] * 10)
    detector = create_detector("static", BODIES)
    joined = join(detector.stream(motion.blocks(block), faces=True))
    assert [joined.work[counter] for counter in ("pair_looks", "held", "mesh_queries")] == [2, 18, 1]
    whole = detector.detect(motion, faces=True)
    assert (joined.digest, joined.faces_digest) == (whole.digest, whole.faces_digest)


def test_faces_of_every_pair_stay_across_blocks():
    """Three bodies at rest about one middle, six frames in blocks of two: ``static`` queries each of three pairs once,
    and lists the faces of the whole motion.
    """
    bodies = [*BODIES, Body("lid", box_mesh((0.5, 0.5, 2.0)))]
    motion = motion_at_rest(bodies, np.zeros((3, 3)), frames=6)
    detector = create_detector("static", bodies)
    joined = join(detector.stream(motion.blocks(2), faces=True))
    assert (joined.verdict == Verdict.CONTACT).all()
    assert joined.work["pair_looks"] == 3
    assert joined.faces_digest == detector.detect(motion, faces=True).faces_digest


def test_epsilon_compares_with_the_last_queried_pose():
    """``epsilon``: metres of a move up to which ``static`` repeats its answer.

    Each of 100 frames moves by 0.4 mm: without epsilon all are queried.

    With 1 mm every third is, which is 1.2 mm from the last that was: frames 0, 3, ..., 99, 34 in all.
    """
    creeping = motion_along_x(0.9 + 0.0004 * np.arange(100))
    assert queries_and_reuses(creeping) == (100, 0)
    assert queries_and_reuses(creeping, epsilon=1e-3) == (34, 66)


def test_epsilon_measures_rotation_at_the_outermost_point():
    """A ball of radius 0.5 m in 50 frames; ``static`` repeats its answer up to a move of 1 mm (epsilon): 49 rotations
    of 10 microradians move its rim by 0.25 mm.

    Each rotation of 10 milliradians moves it by 5 mm.
    """
    creeping, turning = 1e-5 * np.arange(50), 1e-2 * np.arange(50)
    assert queries_and_reuses(motion_along_x([0.9] * 50, angles=creeping), epsilon=1e-3) == (1, 49)
    assert queries_and_reuses(motion_along_x([0.9] * 50, angles=turning), epsilon=1e-3) == (50, 0)


def test_epsilon_skips_queries_of_pairs_that_move_together():
    """A ball and a box rotate and move as one in 40 frames: rounding alone changes their relative pose, by less than 1
    nm (epsilon), so that ``static`` queries once.

    Without an epsilon it queries in each frame.
    """
    steps = np.linspace(0, 1, 40)
    rotation = Rotation.from_rotvec(np.outer(steps, [0, 1, 0])).as_matrix()
    positions = np.zeros((40, 2, 3))
    positions[:, 0] = rotation @ [0.9, 0, 0]
    positions += steps[:, None, None]
    motion = Motion(steps, positions, np.repeat(rotation[:, None], 2, 1))
    assert queries_and_reuses(motion) == (40, 0)
    assert queries_and_reuses(motion, epsilon=1e-9) == (1, 39)


def test_epsilon_skips_queries_of_a_body_turning_about_its_middle():
    """A ball, whose middle is 10 m from its origin, turns about its middle, and its points by 0.25 mm in 50 frames.

    Its origin moves by 5 mm; both bodies drift by 0.5 m together. Up to a move of 1 mm (epsilon) ``static`` repeats its
    first answer.
    """
    middle, drift = np.array([10.0, 0.0, 0.0]), 0.01 * np.arange(50)[:, None] * [0.0, 1.0, 0.0]
    rotations = motion_along_x(np.zeros(50), angles=1e-5 * np.arange(50)).rotations
    positions = np.stack([[0.9, 0.0, 0.0] - rotations[:, 0] @ middle + drift, drift], axis=1)
    ball, box = BODIES
    bodies = [Body("ball", shift_mesh(ball.mesh, middle)), box]
    assert queries_and_reuses(Motion(np.arange(50), positions, rotations), bodies, epsilon=1e-3) == (1, 49)


def test_within_epsilon_a_verdict_is_at_most_that_far_off():
    """A ball comes nearer to a box by 0.4 mm a frame; ``static`` repeats its answer up to a move of 2 mm (epsilon), so
    that contact comes at most 2 / 0.4 = 5 frames late.
    """
    motion = motion_along_x(1.05 - 0.0004 * np.arange(300))
    first_contact = {}
    for epsilon in (0.0, 2e-3):
        contact = create_detector("static", BODIES, epsilon=epsilon).detect(motion).verdict[:, 0] == Verdict.CONTACT
        assert contact.any(), epsilon
        first_contact[epsilon] = int(np.argmax(contact))
    assert first_contact[0.0] <= first_contact[2e-3] <= first_contact[0.0] + 5


def test_exact_touch_and_gap_of_an_ulp_live_and_offline():
    """Boxes of 1 m: the second stands face to face, then corner to corner, then 2^-50 m off, then 1e80 m."""
    positions = np.zeros((4, 2, 3))
    positions[:, 1] = [[0, 0, 1], [1, 1, 1], [0.5, 0, 1 + 2.0**-50], [1e80, 0, 0]]
    motion = unrotated_motion(positions)
    detector = create_detector("exact", [Body("a", box_mesh()), Body("b", box_mesh())])
    whole = detector.detect(motion).verdict
    assert whole[:, 0].tolist() == [Verdict.CONTACT, Verdict.CONTACT, Verdict.CLEAR, Verdict.CLEAR]
    assert np.array_equal(detect_live(detector, motion).verdict, whole)


@pytest.mark.parametrize("name", ["exact", "collider"])
def test_live_session_without_pairs_answers_about_none(name):
    """Two bodies and an empty list of pairs: frame by frame (``live``) the answer has no verdicts."""
    assert create_detector(name, BODIES, pairs=[]).live().look(motion_along_x([0.0])).shape == (0,)


@pytest.mark.slow
def test_question_passes_few_files_and_functions():
    """A query of ``exact`` about two tetrahedra in one pose, uncompiled: a reader follows it through 11 files at most.

    Those are files of cdcore, with at most 50 functions.
    """
    printed = subprocess.check_output([sys.executable, CALL_COUNTS], text=True)
    files, functions = map(int, re.match(r"exact: (\d+) files, (\d+) functions", printed).groups())
    assert files <= 11
    assert functions <= 50
