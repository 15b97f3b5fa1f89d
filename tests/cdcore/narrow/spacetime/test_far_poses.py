"""One corrupt but finite pose changes no answer of any other frame, and costs the others nothing."""

import os
import tracemalloc
from time import process_time

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support.motions import KINDS, motion_of
from support.shapes import ball_mesh

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.containment.containment_stage import any_part_inside
from cdcore.narrow.spacetime.far_poses import asked_apart, certainly_apart, far_poses, without
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


def unturned(at):
    return Motion(np.arange(len(at)) / 90.0, at, turns(len(at)))


def contacts(name, at, **settings):
    return create_detector(name, BODIES, **settings).detect(unturned(at)).verdict[:, 0] == 1


def brute_force(at):
    """Every face against every face in every frame, by exact predicates."""
    placed = [[place_points(CORNERS, np.eye(3), pose)[FACES] for pose in frame] for frame in at]
    return np.array([len(meeting_faces_exhaustive(first, second)) > 0 for first, second in placed])


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
    found = create_detector("exact", [Body("a", flat), Body("b", flat)]).detect(unturned(at)).verdict[:, 0] == 1
    np.testing.assert_array_equal(found, at[:, 1, 2] == 0.0)


def test_faces_are_those_without_the_far_pose():
    at = swinging()
    detector = create_detector("exact", BODIES)
    sound = detector.detect(unturned(at), faces=True)
    at[100, 1, 0] = 1e200
    found = detector.detect(unturned(at), faces=True)
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


def test_bodies_far_out_are_asked_as_far_apart_as_both_reach():
    places = np.array([[[1e9, 0, 0], [1e9 + away, 0, 0]] for away in (3.4, 1e4)])
    everywhere = np.ones((2, 2), dtype=bool)
    ((column, rows, asked),) = asked_apart(everywhere, everywhere, places, np.array([[0, 1]]), np.array([2.0, 1.5]))
    assert (column, rows.tolist(), asked.tolist()) == (0, [0, 1], [0])


def test_a_body_so_small_that_squares_of_its_size_vanish_is_not_called_apart():
    small = np.array([[2.0**-600, 0.0, 0.0]])
    assert not certainly_apart(small, 0.0 * small, 0.0).any()


SHAPES = {
    **KINDS,
    "ball": lambda rng: ball_mesh(rng.uniform(0.2, 2.0), 4, 6).triangles,
    "box": lambda rng: CUBE.triangles * 9,
}
SHORT = {"effort": 200}
MOTIONS = int(os.environ.get("CORRUPT_MOTIONS", "2000"))
"""Motions drawn by the slow test, five a second."""


def drawn(seed):
    """Three bodies on a random motion, and the same with one corrupt finite pose; the frame of that pose."""
    rng = np.random.default_rng([seed, 16])
    kinds = rng.choice(list(SHAPES), 3)
    bodies = []
    for k, kind in enumerate(kinds):
        corners = SHAPES[kind](rng).reshape(-1, 3)
        bodies.append(Body(f"body {k}", TriangleMesh(corners, np.arange(len(corners)).reshape(-1, 3))))
    turn, move = motion_of(rng.choice(["soup", "lattice"]), rng, 13, 3)
    frame, body, axis = rng.integers(13), rng.integers(3), rng.integers(3)
    corrupt = move.copy()
    corrupt[frame, body, axis] = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-300, 300)
    times = np.arange(13) / 90.0
    return bodies, Motion(times, move, turn), Motion(times, corrupt, turn), int(frame)


def answers(bodies, motion, pairs):
    """Verdict of every pair-frame by all faces against all faces, and where none meet by exact rays."""
    verdict = np.zeros((len(motion), len(pairs)), dtype=np.uint8)
    for frame in range(len(motion)):
        poses = [*zip(motion.rotations[frame], motion.translations[frame], strict=True)]
        world = [
            place_points(body.mesh.vertices, *pose)[body.mesh.faces] for body, pose in zip(bodies, poses, strict=True)
        ]
        for column, ends in enumerate(pairs.tolist()):
            i, j = ends
            if len(meeting_faces_exhaustive(world[i], world[j])):
                verdict[frame, column] = Verdict.CONTACT
            elif any(
                bodies[b].mesh.is_closed and any_part_inside(bodies[a].mesh, poses[a], bodies[b].mesh, poses[b])
                for a, b in (ends, ends[::-1])
            ):
                verdict[frame, column] = Verdict.CONTAINED
    return verdict


def check(seed):
    """What each detector says of all frames but the corrupt one, and of intervals that do not touch it."""
    bodies, sound, corrupt, frame = drawn(seed)
    exact, collider, between = (
        create_detector(name, bodies, **how) for name, how in (("exact", {}), ("collider", {}), ("continuous", SHORT))
    )
    rest, truth = np.arange(13) != frame, answers(bodies, sound, exact.pairs)
    hulls = answers(collider.colliders, sound, collider.pairs)
    np.testing.assert_array_equal(exact.detect(corrupt).verdict[rest], truth[rest], str(seed))
    np.testing.assert_array_equal(collider.detect(corrupt).verdict[rest], hulls[rest], str(seed))
    rest[1:] &= rest[:-1]
    found = between.detect(corrupt).verdict[rest]
    np.testing.assert_array_equal(found, between.detect(sound).verdict[rest], str(seed))
    touching = truth == Verdict.CONTACT
    touching[1:] |= touching[:-1]
    assert (found[touching[rest]] == Verdict.CONTACT).all(), seed


def test_detectors_equal_brute_force_on_all_other_frames_of_random_motions():
    for seed in range(5):
        check(seed)


@pytest.mark.slow
def test_detectors_equal_brute_force_on_all_other_frames_of_thousands_of_random_motions():
    for seed in range(5, MOTIONS):
        check(seed)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "size"),
    [("exact", 1e13), ("exact", 1e15), ("exact", 1e200), ("collider", 1e15), ("continuous", 1e15)],
)
def test_a_far_pose_costs_the_other_frames_nothing(name, size):
    """On 5,400 frames of 15 pairs: medians of seven, in turn with the sound motion, and the most memory."""
    frames = 5400
    sound = np.concatenate([swinging(frames), swinging(frames) + 0.1, swinging(frames) - [0.0, 0.1, 0.0]], axis=1)
    sound[:, ::2] += 0.001 * np.sin(np.arange(frames) / 50.0)[:, None, None]
    corrupt = sound.copy()
    corrupt[2000, 1, 0] = size
    detector = create_detector(name, [Body(str(k), CUBE) for k in range(6)])
    turn, taken, held = np.tile(np.eye(3), (frames, 6, 1, 1)), {"sound": [], "corrupt": []}, {}
    motions = {
        "sound": Motion(np.arange(frames) / 90.0, sound, turn),
        "corrupt": Motion(np.arange(frames) / 90.0, corrupt, turn),
    }
    for _ in range(8):
        for what, motion in motions.items():
            start = process_time()
            detector.detect(motion)
            taken[what].append(process_time() - start)
    for what, motion in motions.items():
        tracemalloc.start()
        detector.detect(motion)
        held[what] = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert np.median(taken["corrupt"][1:]) < 2.0 * np.median(taken["sound"][1:]) + 0.005
    assert held["corrupt"] < 3.0 * held["sound"]
