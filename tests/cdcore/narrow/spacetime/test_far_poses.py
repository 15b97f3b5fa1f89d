"""One corrupt but finite pose changes no answer of any other frame, and costs the others nothing."""

from time import perf_counter

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cdcore import Body, Motion, TriangleMesh, create_detector
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.spacetime.far_poses import certainly_apart, far_poses, without
from cdcore.numerics import place_points

CORNERS = np.array([[x, y, z] for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (-0.05, 0.05)])
FACES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)
CUBE = TriangleMesh(CORNERS, FACES)
BODIES = [Body("still", CUBE), Body("swinging", CUBE)]


def swinging(frames=240):
    """A cube that swings through another three times, and rests a while."""
    at = np.zeros((frames, 2, 3))
    at[:, 1, 0] = 0.15 * np.sin(np.linspace(0.3, 3 * np.pi, frames))
    at[200:] = at[199]
    return at


def turns(frames):
    return np.tile(np.eye(3), (frames, 2, 1, 1))


def motion_of(at):
    return Motion(np.arange(len(at)) / 90.0, at, turns(len(at)))


def contacts(name, at, **settings):
    return create_detector(name, BODIES, **settings).detect(motion_of(at)).verdict[:, 0] == 1


def brute_force(at):
    """Every face against every face in every frame, by exact predicates."""
    placed = [[place_points(CORNERS, np.eye(3), pose)[FACES] for pose in frame] for frame in at]
    return np.array([len(meeting_faces_exhaustive(first, second)) > 0 for first, second in placed])


@pytest.mark.parametrize("size", [1e200, 1e154, 1e15, -1e308])
@pytest.mark.parametrize("detector", ["exact", "collider"])
def test_a_recording_with_one_far_pose_is_answered_like_one_without(detector, size):
    at = swinging()
    sound = contacts("obb", at)
    at[100, 1, 0] = size
    found = contacts(detector, at)
    rest = np.arange(len(at)) != 100
    assert sound.sum() > 60
    np.testing.assert_array_equal(found[rest], sound[rest])
    assert not found[100]


def exponents():
    return st.floats(-300.0, 300.0).map(lambda power: 10.0**power)


@settings(max_examples=40)
@given(st.integers(0, 59), st.integers(0, 1), st.integers(0, 2), exponents(), st.sampled_from([1.0, -1.0]))
@example(30, 1, 0, 1e-170, 1.0)
@example(0, 0, 2, 1e13, -1.0)
def test_one_corrupt_finite_pose_leaves_all_answers_those_of_brute_force(frame, body, axis, size, sign):
    at = swinging(240)[::4].copy()
    at[frame, body, axis] = sign * size
    np.testing.assert_array_equal(contacts("exact", at), brute_force(at))


@settings(max_examples=15)
@given(size=exponents(), rows=st.lists(st.integers(0, 59), min_size=1, max_size=20))
def test_both_bodies_may_be_far_at_once_and_meet_there(size, rows):
    at = swinging(240)[::4].copy()
    at[rows] += size
    np.testing.assert_array_equal(contacts("exact", at), brute_force(at))


@pytest.mark.parametrize("step", [1e-163, 1e-170, 1e-300])
def test_a_step_whose_square_underflows_is_a_step(step):
    """Two flat triangles meet only where both lie in one plane, and one leaves it by next to nothing."""
    flat = TriangleMesh([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[0, 1, 2]])
    at = np.zeros((40, 2, 3))
    at[1::2, 1, 2] = step
    found = create_detector("exact", [Body("a", flat), Body("b", flat)]).detect(motion_of(at)).verdict[:, 0] == 1
    np.testing.assert_array_equal(found, at[:, 1, 2] == 0.0)


def test_faces_are_those_without_the_far_pose():
    at = swinging()
    detector = create_detector("exact", BODIES)
    sound = detector.detect(motion_of(at), faces=True)
    at[100, 1, 0] = 1e200
    found = detector.detect(motion_of(at), faces=True)
    for frame in np.flatnonzero(contacts("obb", swinging())):
        if frame != 100:
            np.testing.assert_array_equal(found.faces(int(frame), 0), sound.faces(int(frame), 0))


def test_what_is_far_is_a_million_times_further_out_than_the_rest():
    at, valid, reach = swinging(), np.ones((240, 2), dtype=bool), np.array([0.1, 0.1])
    assert far_poses(at, valid, reach) is None
    at[7, 1, 1], at[9, 1, 1] = 1e7, 1e4
    far = far_poses(at, valid, reach)
    assert np.argwhere(far).tolist() == [[7, 1]]
    np.testing.assert_array_equal(without(at, far, valid)[7, 1], at[6, 1])


def test_poses_that_are_missing_are_not_far():
    at, valid = swinging(), np.ones((240, 2), dtype=bool)
    at[5, 0], valid[5, 0] = np.nan, False
    assert far_poses(at, valid, np.array([0.1, 0.1])) is None


def test_touching_bodies_are_never_certainly_apart():
    far, beside = np.array([[1e16, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0]])
    assert not certainly_apart(far, far + 2.0 * beside, 1.0).any()
    assert certainly_apart(far, far + 1e6 * beside, 1.0).all()


def test_a_body_so_small_that_squares_of_its_size_vanish_is_not_called_apart():
    small = np.array([[2.0**-600, 0.0, 0.0]])
    assert not certainly_apart(small, 0.0 * small, 0.0).any()


@pytest.mark.slow
@pytest.mark.parametrize("size", [1e13, 1e15, 1e200])
def test_a_far_pose_costs_the_other_frames_nothing(size):
    """On 5,400 frames; medians of seven, in turn with the sound motion."""
    sound, corrupt = swinging(5400), swinging(5400)
    corrupt[2000, 1, 0] = size
    detector = create_detector("exact", BODIES, containment=False)
    taken = {"sound": [], "corrupt": []}
    for _ in range(8):
        for name, at in (("sound", sound), ("corrupt", corrupt)):
            motion, start = motion_of(at), perf_counter()
            detector.detect(motion)
            taken[name].append(perf_counter() - start)
    assert np.median(taken["corrupt"][1:]) < 2.0 * np.median(taken["sound"][1:]) + 0.005
