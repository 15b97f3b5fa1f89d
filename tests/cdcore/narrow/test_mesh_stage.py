"""Meshes asked as placed: equal poses once, any order one answer, and every face pair is the predicate's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.random_worlds import bodies_of, face_soup, placed
from support.shapes import ball_mesh, box_mesh, random_rotations, rod_mesh

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


def ball_at_x(xs):
    """The ball at x, seen frame by frame; box and rod stand."""
    positions = np.zeros((len(xs), 3, 3))
    positions[:, 0, 0] = xs
    return Motion(np.arange(len(xs)), positions, np.tile(np.eye(3), (len(xs), 3, 1, 1)))


def answer_for_all_frames(stage, motion, column=0, faces=False):
    """The stage's answer for one pair in every frame."""
    frames = np.arange(len(motion))
    return stage.decide(motion, frames, np.full(len(frames), column), faces=faces)


@pytest.mark.parametrize("faces", [False, True])
def test_pose_repeated_bit_for_bit_takes_no_query(faces):
    """A pose is compared with that of the frame before: four of six are new, one of them in the last bit alone."""
    stage = MeshStage(BODIES, np.array([[0, 1]]))
    answer = answer_for_all_frames(stage, ball_at_x([0.9, 0.9, np.nextafter(0.9, 1), 3.0, 3.0, 0.9]), faces=faces)
    assert answer.hits.tolist() == [True, True, True, False, False, True]
    assert (answer.queries, answer.reused) == (4, 2)


def test_faces_of_several_pairs_stay_with_their_pair():
    """Three pairs in three frames, each by the exhaustive test; their counts differ, so that a mix-up would be seen."""
    pairs, rng = np.array([[0, 1], [0, 2], [1, 2]]), np.random.default_rng(3)
    rotations = np.tile(random_rotations(rng, 3), (3, 1, 1, 1))
    motion = Motion(np.arange(3), rng.uniform(-0.5, 0.5, (3, 3, 3)), rotations)
    frames, columns = (item.ravel() for item in np.meshgrid(np.arange(3), np.arange(3), indexing="ij"))
    sets = MeshStage(BODIES, pairs).decide(motion, frames, columns, faces=True).face_sets(frames, columns)
    counts = set()
    for frame, column in zip(frames.tolist(), columns.tolist(), strict=True):
        world = [
            placed(BODIES[k].mesh.triangles, rotations[frame, k], motion.translations[frame, k]) for k in pairs[column]
        ]
        want = meeting_faces_exhaustive(*world)
        assert np.array_equal(sets.at(frame, column), want)
        counts.add(len(want))
    assert len(counts) > 3


def test_reversed_pairs_have_reversed_faces():
    """Faces of the box are below 12; the ball has more."""
    motion = ball_at_x([0.9])
    forward = answer_for_all_frames(MeshStage(BODIES, np.array([[0, 1]])), motion, faces=True).sets[0]
    backward = answer_for_all_frames(MeshStage(BODIES, np.array([[1, 0]])), motion, faces=True).sets[0]
    assert sorted(forward[:, ::-1].tolist()) == backward.tolist()
    assert forward[:, 1].max() < 12 <= forward[:, 0].max()


def test_empty_query_has_an_empty_answer():
    """No frames are asked about: no hits, and no faces in the first frame of the first pair."""
    none = np.zeros(0, dtype=np.int64)
    answer = MeshStage(BODIES, np.array([[0, 1]])).decide(ball_at_x([0.0]), none, none, faces=True)
    assert answer.hits.shape == (0,)
    assert answer.face_sets(none, none).counts(1, 1).tolist() == [[0]]


@given(st.lists(st.integers(0, 5), max_size=40))
def test_each_column_comes_once_with_all_its_rows_in_order(columns):
    """Columns as drawn, and sorted."""
    given_columns = np.array(columns, dtype=np.int64)
    for order in (given_columns, np.sort(given_columns)):
        result = {column: rows.tolist() for column, rows in rows_of_columns(order)}
        expected = {k: np.flatnonzero(order == k).tolist() for k in sorted(set(columns))}
        assert result == expected
        assert list(result) == sorted(result)


def test_meeting_faces_equal_the_exhaustive_test():
    """Two soups of random faces in random poses."""
    rng = np.random.default_rng(1)
    a, b = face_soup(rng, count=60), face_soup(rng, count=50)
    meshes = [body.mesh for body in bodies_of([a, b])]
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = random_rotations(rng, 2), rng.normal(size=(2, 3)) * 0.3
    result = intersecting_faces(*meshes, *poses)
    want = meeting_faces_exhaustive(*(placed(t, p[:3, :3], p[:3, 3]) for t, p in zip((a, b), poses, strict=True)))
    assert result.dtype == np.int64
    assert len(want) > 5
    assert np.array_equal(result, want)


def test_pose_with_nan_is_refused_and_names_its_body():
    mesh = box_mesh()
    with pytest.raises(InvalidPoseError, match="body B"):
        intersecting_faces(mesh, mesh, np.eye(4), np.full((4, 4), np.nan))


def test_exhaustive_search_equals_the_triangle_predicate_pair_by_pair(monkeypatch):
    """Also in blocks of 40 of the 23 x 31 pairs."""
    rng = np.random.default_rng(0)
    first, second = face_soup(rng, count=23, size=1.0), face_soup(rng, count=31, size=1.0)
    every = np.array([[a, b] for a in first for b in second])
    want = np.argwhere(triangles_intersect(every).reshape(23, 31))
    assert len(want) > 10
    assert np.array_equal(meeting_faces_exhaustive(first, second), want)
    monkeypatch.setattr(exhaustive, "PAIRS_AT_ONCE", 40)
    assert np.array_equal(meeting_faces_exhaustive(first, second), want)
