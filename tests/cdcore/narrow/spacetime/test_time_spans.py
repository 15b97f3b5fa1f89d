"""A span holds every place of its frames, what it dismisses is apart, and a long recording takes a test a level."""

import numpy as np
import pytest

from cdcore.kernels.compiling import kernel
from cdcore.kernels.memory import words_of
from cdcore.narrow.spacetime.pose_lanes import pose_lanes
from cdcore.narrow.spacetime.time_spans import FAN, SPAN, SPAN_TESTS, first_near, first_near_of, span_count

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
