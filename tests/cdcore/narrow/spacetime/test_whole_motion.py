"""Over whole motions the answer equals the exhaustive exact test, face by face, however the work is cut."""

from time import perf_counter

import numpy as np
import pytest
from support.motions import KINDS, grid_plate, motion_of, placed, soup

from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.spacetime import whole_motion
from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.pair_job import Poses
from cdcore.narrow.spacetime.whole_motion import decide_motion

PAIRS = np.array([[0, 1], [2, 0], [1, 2]])
FRAMES = 45


def scene(kind, seed, scale=1.0):
    rng = np.random.default_rng(seed)
    meshes = [KINDS[kind](rng) * scale for _ in range(3)]
    turn, move = motion_of(kind, rng, FRAMES, 3)
    return meshes, turn, move * scale


def truth(meshes, turn, move, frame, pair):
    first, second = (placed(meshes[k], turn[frame, k], move[frame, k]) for k in pair)
    return meeting_faces_exhaustive(first, second)


def faces_at(answer, frame, column):
    entry = np.flatnonzero((answer.frame == frame) & (answer.pair == column))
    if len(entry) == 0:
        return np.zeros((0, 2), dtype=int)
    return answer.faces[answer.start[entry[0]] : answer.stop[entry[0]]]


def ask(meshes, turn, move, valid=None, pairs=PAIRS, **options):
    valid = np.ones(turn.shape[:2], dtype=bool) if valid is None else valid
    return decide_motion([build_box_tree(mesh) for mesh in meshes], pairs, Poses(turn, move, valid), **options)


# At the smallest scale the reference computes with integers of a thousand bits.
@pytest.mark.parametrize("scale", [1.0, 1e-6, 2.0**300, pytest.param(2.0**-320, marks=pytest.mark.slow)])
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", KINDS)
def test_every_pair_frame_equals_the_exhaustive_test(kind, seed, scale):
    meshes, turn, move = scene(kind, seed, scale)
    answer = ask(meshes, turn, move, faces=True)
    plain = ask(meshes, turn, move)
    contacts = 0
    for frame in range(0, FRAMES, 2):
        for column, pair in enumerate(PAIRS):
            want = truth(meshes, turn, move, frame, pair)
            assert np.array_equal(faces_at(answer, frame, column), want)
            assert answer.hits[frame, column] == plain.hits[frame, column] == (len(want) > 0)
            contacts += len(want)
    assert contacts > 0


def test_threads_blocks_and_the_order_of_pairs_change_nothing(monkeypatch):
    meshes, turn, move = scene("soup", 4)
    answer = ask(meshes, turn, move, faces=True)
    monkeypatch.setattr(whole_motion, "FRAMES_PER_TASK", 5)
    threaded = ask(meshes, turn, move, faces=True, threads=3)
    monkeypatch.setattr(whole_motion, "FRAMES_AT_ONCE", 7)
    cut = ask(meshes, turn, move, faces=True)
    for other in (threaded, cut):
        assert np.array_equal(answer.hits, other.hits)
        assert np.array_equal(answer.faces, other.faces)
        assert np.array_equal(answer.start, other.start)
    turned = ask(meshes, turn, move, pairs=PAIRS[::-1, ::-1], faces=True)
    assert np.array_equal(answer.hits, turned.hits[:, ::-1])
    for frame in range(FRAMES):
        swapped = faces_at(turned, frame, 2)[:, ::-1]
        assert np.array_equal(faces_at(answer, frame, 0), swapped[np.lexsort((swapped[:, 1], swapped[:, 0]))])


@pytest.mark.parametrize("faces", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_all_pairs_in_one_call_find_what_each_pair_alone_finds(kind, faces, monkeypatch):
    meshes, turn, move = scene(kind, 6)
    move = move + 2.0**-20 * np.arange(len(move))[:, None, None]  # no pose repeats
    searched, search = [], whole_motion.search_together

    def spied(*given):
        columns, found = search(*given)
        searched.extend(columns.tolist())
        return columns, found

    monkeypatch.setattr(whole_motion, "search_together", spied)
    together, alone = (ask(meshes, turn, move, faces=faces, threads=threads) for threads in (1, 2))
    assert searched == list(range(len(PAIRS)))
    assert together.work == alone.work and np.array_equal(together.near, alone.near)
    for name in ("hits", "frame", "pair", "start", "stop", "faces"):
        assert np.array_equal(getattr(together, name), getattr(alone, name)), name


def test_frames_without_a_pose_are_not_asked_and_do_not_disturb_others():
    meshes, turn, move = scene("soup", 5)
    valid = np.random.default_rng(0).random((FRAMES, 3)) > 0.2
    whole = ask(meshes, turn, move)
    turn, move = turn.copy(), move.copy()
    turn[~valid], move[~valid] = np.eye(3), 0.0
    some = ask(meshes, turn, move, valid)
    both = np.stack([valid[:, i] & valid[:, j] for i, j in PAIRS], axis=1)
    assert np.array_equal(some.hits, whole.hits & both)


def test_a_body_at_rest_on_another_is_asked_once_and_keeps_its_faces_in_every_frame():
    plate = grid_plate()
    turn, move = np.tile(np.eye(3), (500, 2, 1, 1)), np.zeros((500, 2, 3))
    answer = ask([plate, plate + np.array([0.5, 0.25, 0])], turn, move, pairs=np.array([[0, 1]]), faces=True)
    want = meeting_faces_exhaustive(plate, plate + np.array([0.5, 0.25, 0]))
    assert answer.hits.all()
    assert answer.work["reused"] == 499
    assert len(answer.faces) == len(want) > 100
    assert np.array_equal(faces_at(answer, 499, 0), want)


def test_distant_bodies_are_skipped_along_their_paths():
    rng = np.random.default_rng(6)
    meshes = [soup(rng), soup(rng) + 100.0]
    turn, move = motion_of("soup", rng, 2_000, 2)
    answer = ask(meshes, turn, move, pairs=np.array([[0, 1]]))
    assert not answer.hits.any()
    assert answer.work["skipped"] == 2_000
    assert answer.work["blocks"] == 0


def test_the_search_among_distant_wanderers_grows_by_a_test_where_frames_grow_eightfold():
    rng = np.random.default_rng(8)
    meshes = [soup(rng), soup(rng) + 20.0, soup(rng) + 40.0]
    turn, move = motion_of("soup", rng, 512, 3)
    turn, move = (np.tile(some, (16, *(1,) * (some.ndim - 1))) for some in (turn, move))
    work = [ask(meshes, turn[:frames], move[:frames]).work for frames in (1_024, 8_192)]
    assert [one["span_tests"] for one in work] == [3 * 3, 3 * 4]
    assert [one["skipped"] for one in work] == [3 * 1_024, 3 * 8_192]
    assert all(one["gap_tests"] == one["blocks"] == 0 for one in work)


def test_near_frames_between_spans_that_are_dismissed_are_found():
    rng = np.random.default_rng(9)
    meshes = [soup(rng), soup(rng)]
    turn, move = motion_of("soup", rng, 1_500, 2)
    away = np.where(np.arange(1_500) // 100 % 5 == 2, 0.0, 30.0)
    move[:, 1, 0] += away
    pairs = np.array([[0, 1]])
    answer = ask(meshes, turn, move, pairs=pairs)
    touching = np.flatnonzero(answer.hits[:, 0])
    assert set(touching // 100 % 5) == {2}
    for frame in range(200, 300, 7):
        assert answer.hits[frame, 0] == (len(truth(meshes, turn, move, frame, pairs[0])) > 0)
    assert answer.work["skipped"] > 900


def test_the_stages_take_the_time_of_the_call_and_exact_arithmetic_takes_some_where_plates_rest():
    plate = grid_plate()
    turn, move = np.tile(np.eye(3), (300, 2, 1, 1)), np.zeros((300, 2, 3))
    move[:, 0, 0] = 1e-3 * np.arange(300)
    begin = perf_counter()
    answer = ask([plate, plate], turn, move, pairs=np.array([[0, 1]]), faces=True)
    spent = perf_counter() - begin
    assert set(answer.seconds) == set(whole_motion.STAGES)
    assert 0.2 * spent < sum(answer.seconds.values()) <= spent
    assert answer.seconds["exact"] > 0


def test_an_empty_motion_has_an_empty_answer():
    meshes, turn, move = scene("soup", 7)
    answer = ask(meshes, turn[:0], move[:0], faces=True)
    assert answer.hits.shape == (0, 3)
    assert len(answer.frame) == len(answer.faces) == 0
