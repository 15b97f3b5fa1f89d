"""Meshes asked as placed: equal poses once, any order one answer, and every face pair is the predicate's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.random_worlds import bodies_of, face_soup, placed
from support.shapes import ball_mesh, box_mesh, random_rotations, rod_mesh, unrotated_motion

from cdcore import Body, Motion, intersecting_faces
from cdcore.errors import InvalidPoseError
from cdcore.narrow import brute_force as exhaustive
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.mesh_stage import MeshStage
from cdcore.narrow.pair_frames import rows_of_columns
from cdcore.triangles.decide import triangles_intersect

BODIES = [
    Body("b ball", ball_mesh(0.5, rings=6, sides=9)),
    Body("a box", box_mesh()),
    Body("c rod", rod_mesh(radius=0.1, length=2)),
]
BALL_AND_BOX = np.array([[0, 1]])


def ball_at_x(xs):
    """The ball, of radius 0.5 m, at these x, frame by frame; the box of 1 m and the rod stand at the origin."""
    positions = np.zeros((len(xs), 3, 3))
    positions[:, 0, 0] = xs
    return unrotated_motion(positions)


def answer_for_first_pair(stage, motion, faces=False):
    """The stage's answer for its first pair in every frame."""
    frames = np.arange(len(motion))
    return stage.decide(motion, frames, 0 * frames, faces=faces)


@pytest.mark.parametrize("faces", [False, True], ids=["verdicts", "verdicts and faces"])
def test_pose_repeated_bit_for_bit_takes_no_query(faces):
    """A ball of radius 0.5 m at six x beside a box of 1 m, which it meets up to 1 m; a pose is compared with that of
    the frame before.

    Four of the six are new, one of them in the last bit alone.
    """
    motion = ball_at_x([0.9, 0.9, np.nextafter(0.9, 1), 3.0, 3.0, 0.9])
    answer = answer_for_first_pair(MeshStage(BODIES, BALL_AND_BOX), motion, faces=faces)
    assert answer.hits.tolist() == [True, True, True, False, False, True]
    assert (answer.queries, answer.reused) == (4, 2)


def test_faces_of_several_pairs_stay_with_their_pair():
    """Three pairs of three bodies in three frames; an exhaustive test gives the faces of each that meet.

    There are more than three different counts of them, so that a mix-up would be seen.
    """
    pairs, rng = np.array([[0, 1], [0, 2], [1, 2]]), np.random.default_rng(3)
    rotations = np.tile(random_rotations(rng, 3), (3, 1, 1, 1))
    motion = Motion(np.arange(3), rng.uniform(-0.5, 0.5, (3, 3, 3)), rotations)
    frames, columns = (item.ravel() for item in np.meshgrid(np.arange(3), np.arange(3), indexing="ij"))
    sets = MeshStage(BODIES, pairs).decide(motion, frames, columns, faces=True).face_sets(frames, columns)
    counts = set()
    for frame, column in zip(frames.tolist(), columns.tolist(), strict=True):
        first, second = (
            placed(BODIES[k].mesh.triangles, rotations[frame, k], motion.translations[frame, k]) for k in pairs[column]
        )
        expected = meeting_faces_exhaustive(first, second)
        assert np.array_equal(sets.at(frame, column), expected), (frame, column)
        counts.add(len(expected))
    assert len(counts) > 3


def test_reversed_pairs_have_reversed_faces():
    """Ball and box 0.9 m apart, and box and ball: face pairs with both numbers exchanged; the box has 12 faces, the
    ball more.
    """
    motion = ball_at_x([0.9])
    ball_and_box, box_and_ball = (
        answer_for_first_pair(MeshStage(BODIES, np.array([pair])), motion, faces=True).sets[0]
        for pair in ([0, 1], [1, 0])
    )
    assert box_and_ball.tolist() == sorted(ball_and_box[:, ::-1].tolist())
    assert ball_and_box[:, 1].max() < 12 <= ball_and_box[:, 0].max()


def test_empty_query_has_an_empty_answer():
    """No frames are queried: no hits, and no faces in the first frame of the first pair."""
    no_frames = np.zeros(0, dtype=np.int64)
    answer = MeshStage(BODIES, BALL_AND_BOX).decide(ball_at_x([0.0]), no_frames, no_frames, faces=True)
    assert answer.hits.shape == (0,)
    assert answer.face_sets(no_frames, no_frames).counts(frames=1, pairs=1).tolist() == [[0]]


@given(st.lists(st.integers(0, 5), max_size=40))
def test_each_column_comes_once_with_all_its_rows_in_order(columns):
    """Column numbers of some rows, as drawn and sorted, are grouped: column -> its rows, ascending."""
    for order in (np.array(columns, dtype=np.int64), np.sort(np.array(columns, dtype=np.int64))):
        rows_by_column = [(column, rows.tolist()) for column, rows in rows_of_columns(order)]
        assert rows_by_column == [(k, np.flatnonzero(order == k).tolist()) for k in sorted(set(columns))]


def test_meeting_faces_equal_the_exhaustive_test():
    """Two soups of random faces in random poses: ``intersecting_faces`` lists int64 pairs of faces that meet."""
    rng = np.random.default_rng(1)
    first, second = face_soup(rng, count=60), face_soup(rng, count=50)
    first_pose, second_pose = poses = np.tile(np.eye(4), (2, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = random_rotations(rng, 2), rng.normal(size=(2, 3)) * 0.3
    first_mesh, second_mesh = (body.mesh for body in bodies_of([first, second]))
    faces = intersecting_faces(first_mesh, second_mesh, first_pose, second_pose)
    expected = meeting_faces_exhaustive(
        placed(first, first_pose[:3, :3], first_pose[:3, 3]), placed(second, second_pose[:3, :3], second_pose[:3, 3])
    )
    assert faces.dtype == np.int64
    assert len(expected) > 5
    assert np.array_equal(faces, expected)


def test_pose_with_nan_is_refused_and_names_its_body():
    """Two meshes are bodies A and B; the position of the second is not a number."""
    mesh, pose_b = box_mesh(), np.eye(4)
    pose_b[:3, 3] = np.nan
    with pytest.raises(InvalidPoseError, match=r"body B: translation .* is not finite"):
        intersecting_faces(mesh, mesh, pose_a=np.eye(4), pose_b=pose_b)


@pytest.mark.parametrize("pairs_at_once", [None, 40], ids=["all at once", "blocks of 40 pairs"])
def test_exhaustive_search_equals_the_triangle_predicate_pair_by_pair(pairs_at_once, monkeypatch):
    """All 23 x 31 pairs of two soups of random faces, tested all at once, or in blocks of 40 pairs."""
    if pairs_at_once:
        monkeypatch.setattr(exhaustive, "PAIRS_AT_ONCE", pairs_at_once)
    rng = np.random.default_rng(0)
    first, second = face_soup(rng, count=23, size=1.0), face_soup(rng, count=31, size=1.0)
    meets = triangles_intersect(np.array([[a, b] for a in first for b in second]))
    expected = np.argwhere(meets.reshape(23, 31))
    assert len(expected) > 10
    assert np.array_equal(meeting_faces_exhaustive(first, second), expected)
