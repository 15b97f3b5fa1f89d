"""Equal poses are asked once, every order of bodies gets one answer, and faces name the bodies as the pair does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.shapes import ball_mesh, box_mesh, lab, rod_mesh

from cdcore import Body, Motion
from cdcore.narrow.fcl_meshes import FclMeshes
from cdcore.narrow.mesh_stage import MeshStage
from cdcore.narrow.pair_frames import rows_of_columns

BODIES = [Body("b ball", ball_mesh(0.5, 6, 9)), Body("a box", box_mesh()), Body("c rod", rod_mesh(0.1, 2))]


def motion_of(xs):
    """The ball at x, seen frame by frame; box and rod stand."""
    places = np.zeros((len(xs), 3, 3))
    places[:, 0, 0] = xs
    return Motion(np.arange(len(xs)), places, np.tile(np.eye(3), (len(xs), 3, 1, 1)))


def decide(stage, motion, column=0, faces=False):
    frames = np.arange(len(motion))
    return stage.decide(motion, frames, np.full(len(frames), column), faces=faces)


@pytest.mark.parametrize("faces", [False, True])
def test_frames_of_equal_poses_are_one_query(faces):
    stage = MeshStage(BODIES, np.array([[0, 1]]))
    answer = decide(stage, motion_of([0.9, 0.9, 0.9, 3.0, 3.0, 0.9]), faces=faces)
    assert answer.hits.tolist() == [True, True, True, False, False, True]
    assert (answer.queries, answer.reused) == (3, 3)


def test_a_pose_that_differs_in_its_last_bit_is_asked_again():
    answer = decide(MeshStage(BODIES, np.array([[0, 1]])), motion_of([0.9, np.nextafter(0.9, 1), 0.9]))
    assert answer.queries == 3


def test_frames_that_share_an_answer_share_its_faces():
    answer = decide(MeshStage(BODIES, np.array([[0, 1]])), motion_of([0.9, 0.9, 3.0, 0.9]), faces=True)
    assert answer.which.tolist() == [0, 0, 1, 2]
    sets = answer.face_sets(np.arange(4), np.zeros(4, dtype=np.int64))
    assert sets.at(0, 0).tolist() == sets.at(1, 0).tolist() == sets.at(3, 0).tolist()
    assert len(sets.at(0, 0)) > 0
    assert len(sets.at(2, 0)) == 0


def test_a_pair_written_the_other_way_round_has_its_faces_the_other_way_round():
    motion = motion_of([0.9])
    forward = decide(MeshStage(BODIES, np.array([[0, 1]])), motion, faces=True).sets[0]
    backward = decide(MeshStage(BODIES, np.array([[1, 0]])), motion, faces=True).sets[0]
    assert sorted(forward[:, ::-1].tolist()) == backward.tolist()
    assert forward[:, 1].max() < 12 <= forward[:, 0].max()


def test_the_engine_is_asked_in_one_order(monkeypatch):
    asked = []
    plain = FclMeshes.touch_along
    monkeypatch.setattr(
        FclMeshes, "touch_along", lambda self, a, b, *poses: asked.append((a, b)) or plain(self, a, b, *poses)
    )
    for pairs in ([[0, 1], [2, 0]], [[1, 0], [0, 2]]):
        stage = MeshStage(BODIES, np.array(pairs))
        decide(stage, motion_of([0.9]), 0)
        decide(stage, motion_of([0.9]), 1)
    assert asked == [(1, 0), (0, 2), (1, 0), (0, 2)]


def test_a_single_look_gives_the_answer_of_the_whole():
    bodies, motion = lab(60, gaps=False)
    pairs = np.array([[3, 1], [1, 2]])
    stage = MeshStage(bodies, pairs)
    for column in range(2):
        answer = decide(stage, motion, column, faces=True)
        for frame in range(60):
            hit, faces = stage.look(motion, frame, column, faces=True)
            assert hit == answer.hits[frame] == stage.look(motion, frame, column)[0]
            assert faces.tolist() == answer.sets[answer.which[frame]].tolist()


def test_nothing_asked_is_nothing_answered():
    none = np.zeros(0, dtype=np.int64)
    answer = MeshStage(BODIES, np.array([[0, 1]])).decide(motion_of([0.0]), none, none, faces=True)
    assert answer.hits.shape == (0,)
    assert answer.face_sets(none, none).counts(1, 1).tolist() == [[0]]


@given(st.lists(st.integers(0, 5), max_size=40))
def test_each_column_comes_once_with_all_its_rows_in_order(columns):
    given_columns = np.array(columns, dtype=np.int64)
    for order in (given_columns, np.sort(given_columns)):
        found = {column: rows.tolist() for column, rows in rows_of_columns(order)}
        expected = {k: np.flatnonzero(order == k).tolist() for k in sorted(set(columns))}
        assert found == expected
        assert list(found) == sorted(found)
