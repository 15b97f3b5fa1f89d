"""Repeated and missing poses come back in the answer; poses in lanes and spans of time are those that were given."""

import numpy as np
import pytest
from support.motions import grid_plate, motion_of, placed, soup

from cdcore.kernels.compiling import kernel
from cdcore.kernels.memory import words_of
from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.pair_job import PairJob, Poses
from cdcore.narrow.spacetime.pose_lanes import pose_lanes
from cdcore.narrow.spacetime.time_spans import FAN, SPAN, SPAN_TESTS, first_near, first_near_of, span_count
from cdcore.narrow.spacetime.traverse import Workspace

TREES = [build_box_tree(grid_plate(2)), build_box_tree(grid_plate(4))]


def poses(places, valid=None):
    move = np.zeros((len(places), 2, 3))
    move[:, 0, 2] = places
    turn = np.tile(np.eye(3), (len(places), 2, 1, 1))
    return Poses(turn, move, np.ones((len(places), 2), dtype=bool) if valid is None else valid)


def answered(one, start=0, stop=None):
    """The hits and the answer of a stretch."""
    marks, stop = np.zeros((2, one.count), dtype=np.uint8), one.count if stop is None else stop
    found = one.stretch(start, stop, Workspace(), marks)
    return marks[0, start:stop].astype(bool), found


def job(given, i=0, j=1):
    return PairJob(TREES, i, j, given, [None, None], faces=True)


def test_repeats_are_asked_once():
    asked = job(poses([1, 1, 1, 0, 0, 2, 2, 2]))
    assert asked.count == 3
    assert asked.which.tolist() == [0, 0, 0, 1, 1, 2, 2, 2]
    assert answered(asked)[0].tolist() == [False, True, False]


def test_frames_without_a_pose_are_left_out():
    valid = np.ones((4, 2), dtype=bool)
    valid[1, 0] = valid[2, 1] = False
    asked = job(poses([0, 0, 0, 1], valid))
    assert asked.frames.tolist() == [0, 3]


def test_faces_come_in_the_order_of_the_pair_whichever_body_is_larger():
    forward, backward = answered(job(poses([0.0])))[1], answered(job(poses([0.0]), 1, 0))[1]
    assert len(forward.faces) > 8
    assert forward.faces[:, 0].max() < 8 <= forward.faces[:, 1].max()
    assert sorted(map(tuple, forward.faces[:, ::-1].tolist())) == [tuple(row) for row in backward.faces.tolist()]


def test_bodies_that_spans_keep_apart_are_asked_frame_by_frame_without_looking_for_repeats():
    given = poses([5.0] * 40 + [6.0] * 60)
    lanes = [
        pose_lanes(given.rotations, given.translations, k, given.everywhere, TREES[k].boxes[0], 9.0) for k in (0, 1)
    ]
    asked = PairJob(TREES, 0, 1, given, lanes, faces=False)
    assert asked.count == 100
    assert asked.first_near(0) == asked.first_near(63) == 100
    assert not answered(asked)[0].any()


@pytest.mark.parametrize("scale", [1e-101, 1e76])
def test_bodies_too_small_or_too_large_for_the_bounds_are_decided_exhaustively(scale):
    trees = [build_box_tree(grid_plate(size) * scale) for size in (2, 4)]
    move = np.zeros((3, 2, 3))
    move[1, 0, 2] = scale
    given = Poses(np.tile(np.eye(3), (3, 2, 1, 1)), move, np.ones((3, 2), dtype=bool))
    asked = PairJob(trees, 0, 1, given, [None, None], faces=False)
    hits, found = answered(asked)
    assert hits.tolist() == [True, False, True]
    assert not found.work.any()


def test_any_stretch_answers_as_the_whole_does():
    asked = job(poses([0, 0.5, -0.5, 0, 1e-300, 0.25]))
    hits, whole = answered(asked)
    of_parts, parts = zip(*(answered(asked, k, k + 2) for k in range(0, asked.count, 2)), strict=True)
    assert np.array_equal(hits, np.concatenate(of_parts))
    assert np.array_equal(whole.faces, np.concatenate([part.faces for part in parts]))
    assert np.array_equal(whole.frame, np.concatenate([part.frame for part in parts]))


FRAMES = np.arange(61)


@pytest.fixture(scope="module")
def moving():
    rng = np.random.default_rng(1)
    mesh = soup(rng) + 3.0
    turn, move = motion_of("soup", rng, len(FRAMES), 2)
    tree = build_box_tree(mesh)
    return mesh, turn, move, tree, pose_lanes(turn, move, 1, FRAMES, tree.boxes[0], tree.reach)


def test_entries_are_the_poses_bit_for_bit_with_the_last_one_repeated(moving):
    _, turn, move, tree, lanes = moving
    rows = np.append(lanes.entries, lanes.centres).reshape(15, lanes.stride)
    assert np.array_equal(rows[:9, : len(FRAMES)].T.reshape(-1, 3, 3), turn[:, 1])
    assert np.array_equal(rows[9:12, : len(FRAMES)].T, move[:, 1])
    assert (rows[:, len(FRAMES) :] == rows[:, len(FRAMES) - 1 :][:, :1]).all()
    assert lanes.stride >= len(FRAMES) + 7
    centre = turn[:, 1] @ tree.boxes[0, :3] + move[:, 1]
    assert np.allclose(rows[12:, : len(FRAMES)].T, centre, atol=1e-14)


def test_the_path_bounds_every_points_way_between_any_two_frames(moving):
    mesh, turn, move, _, lanes = moving
    points = np.array([placed(mesh, turn[f, 1], move[f, 1]).reshape(-1, 3) for f in FRAMES])
    for f in range(0, len(FRAMES), 7):
        for h in range(f, len(FRAMES), 5):
            way = np.linalg.norm(points[h] - points[f], axis=1).max()
            assert way <= lanes.path[h] - lanes.path[f]


def test_the_path_grows_exactly_where_the_pose_changes(moving):
    _, turn, move, _, lanes = moving
    changes = (turn[1:, 1] != turn[:-1, 1]).any(axis=(1, 2)) | (move[1:, 1] != move[:-1, 1]).any(axis=1)
    assert not changes.all()
    assert np.array_equal(np.diff(lanes.path) > 0, changes)


def test_a_change_in_the_last_bit_counts_as_one():
    turn, move = np.tile(np.eye(3), (9, 1, 1, 1)), np.ones((9, 1, 3))
    move[5:, 0, 1] = np.nextafter(1.0, 2.0)
    lanes = pose_lanes(turn, move, 0, np.arange(9), build_box_tree(np.zeros((1, 3, 3))).boxes[0], 0.0)
    assert np.flatnonzero(np.diff(lanes.path)).tolist() == [4]


def test_a_body_that_never_moves_is_one_pose():
    turn, move = np.tile(np.eye(3), (100, 1, 1, 1)), np.ones((100, 1, 3))
    tree = build_box_tree(soup(np.random.default_rng(0)))
    lanes = pose_lanes(turn, move, 0, np.arange(100), tree.boxes[0], tree.reach)
    assert (lanes.step, len(lanes.path), lanes.stride) == (0, 1, 16)
    assert lanes.size == pytest.approx(np.sqrt(3))


def test_skew_is_the_distance_from_orthonormal():
    turn, move = np.tile(np.eye(3), (20, 1, 1, 1)), np.zeros((20, 1, 3))
    turn[7, 0, 0, 0] = 1 + 1e-8
    lanes = pose_lanes(turn, move, 0, np.arange(20), np.zeros(16), 1.0)
    assert lanes.skew == pytest.approx(2e-8, rel=1e-3)


def test_poses_in_any_order_of_memory_give_the_same_entries(moving):
    _, turn, move, tree, lanes = moving
    turned, placed_ = np.asfortranarray(turn), np.asfortranarray(move)
    other = pose_lanes(turned, placed_, 1, FRAMES, tree.boxes[0], tree.reach)
    assert np.array_equal(other.entries, lanes.entries)
    assert np.array_equal(other.path, lanes.path)


POINT = np.zeros(16)
POINT[[3, 7, 11]] = 1.0


@kernel
def near_of(pose_a, pose_b, frame, reach, work):
    return first_near(pose_a, pose_b, frame, reach, words_of(work))


def track(places):
    """A point without size that takes these places (F, 3)."""
    move = np.asarray(places, dtype=float)[:, None]
    turn = np.tile(np.eye(3), (len(move), 1, 1, 1))
    return pose_lanes(turn, move, 0, np.arange(len(move)), POINT, 0.0)


def wander(seed, frames, x=0.0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, (frames, 3)) + np.array([x, 0, 0])


@pytest.mark.parametrize(
    "frames", [1, 2, SPAN - 1, SPAN, SPAN + 1, 3 * SPAN + 5, FAN * SPAN + 1, FAN * FAN * SPAN + 77]
)
def test_every_level_holds_the_least_and_the_largest_of_its_frames(frames):
    places = wander(frames, frames)
    ranges = track(places).ranges.reshape(-1, 6)
    assert len(ranges) == span_count(frames)
    row, width = 0, SPAN
    while True:
        for first in range(0, frames, width):
            some = places[first : first + width]
            assert ranges[row].tolist() == [*some.min(axis=0), *some.max(axis=0)]
            row += 1
        if width >= frames:
            break
        width *= FAN
    assert row == len(ranges)


@pytest.mark.parametrize("frame", [0, 5, SPAN, 1_000])
def test_distant_wanderers_take_one_test_a_level_however_long_they_wander(frame):
    for frames, levels in ((SPAN * FAN**2, 3), (SPAN * FAN**4, 5)):
        a, b = (track(np.tile(wander(k, 64, x), (frames // 64, 1))) for k, x in ((1, 0.0), (2, 5.0)))
        work = np.zeros(SPAN_TESTS + 1, dtype=np.int64)
        assert near_of(a, b, frame, 2.9, work) == frames
        assert work[SPAN_TESTS] == work.sum() == levels


@pytest.mark.parametrize("seed", range(6))
def test_what_is_dismissed_is_apart_in_every_frame_and_stops_at_a_span_that_is_not(seed):
    rng = np.random.default_rng(seed)
    frames = int(rng.integers(2_000, 9_000))
    way = np.cumsum(rng.normal(0, 0.02, (2, frames, 3)), axis=1)
    a, b = track(way[0]), track(way[1] + [1.5, 0, 0])
    apart = np.linalg.norm(way[1] + [1.5, 0, 0] - way[0], axis=1)
    dismissed = 0
    for frame in range(0, frames, 37):
        near, tests = first_near_of(a.row, b.row, frame, 0.3)
        assert (apart[frame:near] > 0.3).all()
        assert near in (frame, frames) or near % SPAN == 0
        assert tests >= 1
        dismissed += near - frame
    assert dismissed > 0


def test_a_body_at_rest_is_one_span_that_holds_at_all_times():
    still, moving = track(np.zeros((700, 3))), track(wander(3, 700, 4.0))
    assert still.frames == 1
    assert first_near_of(still.row, moving.row, 0, 2.9) == (700, 3)
    assert first_near_of(still.row, moving.row, 0, 4.0) == (0, 1)


def test_spans_exactly_as_far_apart_as_the_reach_are_not_dismissed():
    a, b = track(np.zeros((3, 3))), track(np.tile([0.0, 2.0, 0.0], (3, 1)))
    assert first_near_of(a.row, b.row, 0, 2.0) == (0, 1)
    assert first_near_of(a.row, b.row, 0, np.nextafter(2.0, 0)) == (1, 1)
