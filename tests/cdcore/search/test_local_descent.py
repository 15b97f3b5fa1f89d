"""Local search goes down to ever closer face pairs; resting bodies are searched again only when they move."""

import numpy as np
import pytest
from support.search_scenes import I3, ball_of, search_of, torus_mesh
from support.shapes import box_mesh, random_rotations

from cdcore import Body, Motion, Verdict, create_detector
from cdcore.search.features import NEIGHBOURS, RADIUS, features_of
from cdcore.search.pair_search import FOLLOW, advance
from cdcore.search.stage import PROBE, budget_at_rest, distance_moved, lengths_at_rest

AT_ORIGIN = (I3, np.zeros(3))


def descent_from(search, i, j):
    """The face pair where a descent from (i, j) ends, its distance, and the evaluations it took."""
    state = search.state
    state["budget"], before, state["closest"] = 10**9, int(state["evaluations"]), np.inf
    advance(FOLLOW, i, j, 0, search.swarm, search.faces, search.states)
    end = int(state["best_a"]), int(state["best_b"])
    return end, float(state["closest"]), int(state["evaluations"]) - before


def starts_beside_each_other(directions=150):
    """A torus a little above another, where no face meets and many balls overlap: a fresh search, and random starts."""
    search = search_of(
        torus_mesh(major=1.0, minor=0.3, around=60, across=24),
        torus_mesh(major=1.0, minor=0.3, around=60, across=24),
        variant="local",
    )
    search.search((I3, np.array([0.02, 0.01, 0.62])), AT_ORIGIN, stamp=0.0, budget=0)
    draw = np.random.default_rng(4)
    return search, draw.integers(len(search.first), size=(directions, 2)).tolist()


def distances(search, firsts, seconds):
    """Distances of the features of both bodies at the current pose."""
    rotation, move = search.state["relative"][:9].reshape(3, 3), search.state["relative"][9:12]
    a, b = (features.rows[:, :3] for features in (search.first, search.second))
    return np.linalg.norm((a[firsts] @ rotation.T + move)[:, None] - b[seconds][None], axis=2)


@pytest.mark.slow
def test_descent_ends_only_at_local_minima():
    """Two tori a little apart, and 150 descents from random face pairs: no neighbour of either end is nearer.

    If the balls of both ends overlap, no pair of their neighbours is. A descent repeated from the same start ends after
    its first step, where an earlier one was: it evaluates the start and at most NEIGHBOURS of each of its faces.
    """
    search, starts = starts_beside_each_other()
    pose, rounding = (I3, np.array([0.02, 0.01, 0.62])), 1e-12
    ends, ends_with_overlapping_balls, longest = set(), 0, 0
    for i, j in starts:
        search.search(pose, AT_ORIGIN, stamp=0.0, budget=0)
        (a, b), distance, evaluations = descent_from(search, i, j)
        _end, _distance, evaluations_again = descent_from(search, i, j)
        assert evaluations_again <= 2 * NEIGHBOURS + 1
        ends.add((a, b))
        longest = max(longest, evaluations)
        near_a, near_b = (
            [face for face in features.near[end, :NEIGHBOURS].tolist() if face >= 0] + [end]
            for features, end in ((search.first, a), (search.second, b))
        )
        gaps = distances(search, near_a, near_b)  # the last row and column are those of a and b
        assert gaps[-1].min() >= distance * (1 - rounding)
        assert gaps[:, -1].min() >= distance * (1 - rounding)
        if distance < search.first.rows[a, RADIUS] + search.second.rows[b, RADIUS]:
            ends_with_overlapping_balls += 1
            assert gaps.min() >= distance * (1 - rounding)
    assert ends_with_overlapping_balls > 100
    assert len(ends) > 5
    assert longest > 10 * NEIGHBOURS


BALL = ball_of(faces=1200)


def ball_carried_in_a_ring(frames=200, aside=0.05, seed=3):
    """A ball in the hole of a ring, both in one hand that turns and moves: each pose is rounded anew."""
    rng = np.random.default_rng(seed)
    rotation = random_rotations(rng, frames)
    hand = rng.normal(size=(frames, 3))
    position = np.stack([hand, hand + rotation @ np.array([aside, 0.0, 0.0])], axis=1)
    bodies = [Body("a", torus_mesh()), Body("b", ball_of(faces=1200, radius=0.5))]
    return bodies, Motion(np.arange(frames) / 90, position, np.stack([rotation, rotation], axis=1))


def test_no_point_moves_farther_than_the_bound():
    """50 pairs of random poses, some 0.1 m apart: no vertex of a ball moves farther between them than bounded.

    A pose is a row of a rotation (9), a translation (3) and the distance of both bodies.
    """
    rng = np.random.default_rng(8)
    for _ in range(50):
        rotations, moves = random_rotations(rng, 2), rng.normal(size=(2, 3)) * 0.1
        first, second = (
            np.array([*rotation.ravel(), *move, 1.0]) for rotation, move in zip(rotations, moves, strict=True)
        )
        vertices_before, vertices_after = (BALL.vertices @ rotations[k].T + moves[k] for k in (0, 1))
        longest_move = np.linalg.norm(vertices_after - vertices_before, axis=1).max()
        assert longest_move <= distance_moved(first, second, features_of(BALL).size)


FULL_BUDGET = 2000
"""Evaluations of face pairs that a search may spend."""
BALL_FACE = 2 * features_of(BALL).mean_radius
"""Metres across a face of the ball."""
REST_LENGTHS = lengths_at_rest(features_of(BALL), features_of(BALL), 0.25)
"""Of two balls that are at rest while they move by less than a quarter of a face."""
POSE = np.array([*np.eye(3).ravel(), 2.1, 0.0, 0.0, 2.1])
"""A row of a rotation (9), a translation (3) and the distance of both bodies, metres."""
NO_POSE = np.full(13, np.nan)


def moved_along_x(pose, metres):
    """The pose, moved."""
    return pose + metres * np.eye(13)[9]


@pytest.mark.parametrize(
    ("pose", "of_last_search", "of_last_probe", "budget"),
    [
        pytest.param(POSE, NO_POSE, NO_POSE, FULL_BUDGET, id="never searched"),
        pytest.param(moved_along_x(POSE, 0.26 * BALL_FACE), POSE, POSE, FULL_BUDGET, id="moved by 0.26 faces"),
        pytest.param(moved_along_x(POSE, 0.24 * BALL_FACE), POSE, POSE, PROBE, id="moved by 0.24 faces: a probe"),
        pytest.param(
            moved_along_x(POSE, 0.24 * BALL_FACE),
            POSE,
            moved_along_x(POSE, 0.24 * BALL_FACE),
            FULL_BUDGET,
            id="at rest after such a move, already probed",
        ),
        pytest.param(moved_along_x(POSE, 1e-14), POSE, POSE, 0, id="moved by rounding"),
        pytest.param(NO_POSE, POSE, POSE, FULL_BUDGET, id="not a number"),
    ],
)
def test_budget_follows_how_far_bodies_moved(pose, of_last_search, of_last_probe, budget):
    """A pair whose last search, with all of its budget, found nothing: it gets that budget again after a move of a
    quarter face, or once it rests after a shorter one; on its way there it gets a probe, PROBE evaluations.

    After a move by rounding it gets nothing; a pose that is no number counts as moved.
    """
    assert budget_at_rest(pose, of_last_search, of_last_probe, REST_LENGTHS, FULL_BUDGET) == budget


def test_probe_spends_no_more_than_the_budget():
    """A budget of 50 evaluations is less than a probe's."""
    assert PROBE > 50
    moved = moved_along_x(POSE, 0.24 * BALL_FACE)
    assert budget_at_rest(moved, POSE, POSE, REST_LENGTHS, 50) == 50


def test_nested_bodies_moved_by_rounding_are_not_searched():
    """A body in the middle of another moves by 1e-13 m: their origins were the same, but rounding goes with the places
    of both bodies, about 1 m.
    """
    inside = np.array([*np.eye(3).ravel(), 0.0, 0.0, 0.0, 0.0])
    assert budget_at_rest(moved_along_x(inside, 1e-13), inside, inside, REST_LENGTHS, FULL_BUDGET) == 0


@pytest.mark.parametrize("ball_first", [True, False], ids=["ball first", "plate first"])
@pytest.mark.parametrize(("faces_moved", "budget"), [(0.24, PROBE), (0.26, FULL_BUDGET)])
def test_pair_counts_as_moved_by_faces_of_the_finer_mesh(ball_first, faces_moved, budget):
    """A ball and a plate with faces over five times as large: a move of a quarter of a face of the ball counts."""
    ball, plate = features_of(BALL), features_of(box_mesh((2.0, 0.1, 2.0)))
    assert plate.mean_radius > 5 * ball.mean_radius
    lengths = lengths_at_rest(ball, plate, 0.25) if ball_first else lengths_at_rest(plate, ball, 0.25)
    before = np.array([*np.eye(3).ravel(), 0.0, 1.2, 0.0, 1.2])
    after = moved_along_x(before, faces_moved * BALL_FACE)
    assert budget_at_rest(after, before, before, lengths, FULL_BUDGET) == budget


def test_rigidly_carried_pair_is_searched_once():
    """A ball of radius 0.5 m in the hole of a ring, which has 0.7 m, moves with it for 200 frames: the pair is at rest
    but for rounding.

    ``rest``: a pair that moved by less than this part of a face since its last search is not searched again; 0: always.
    """
    bodies, motion = ball_carried_in_a_ring(frames=200)
    resting, always = (create_detector("qaco", bodies, rest=rest).detect(motion) for rest in (0.25, 0.0))
    assert (resting.verdict == Verdict.NOT_FOUND).all()
    assert resting.digest == always.digest
    assert resting.work["looks"] == 1, "searches"
    assert always.work["looks"] == 200


def test_resting_contact_is_confirmed_in_every_frame():
    """A ball of radius 0.5 m, 0.4 m beside the middle of a ring whose hole has a radius of 0.7 m, is in its wall, and
    moves with it for 200 frames.

    Unlike a pair that is apart, it is searched in all of them.
    """
    bodies, motion = ball_carried_in_a_ring(frames=200, aside=0.4)
    answer = create_detector("qaco", bodies, rest=0.25).detect(motion)
    assert (answer.verdict == Verdict.CONTACT).all()
    assert answer.work["looks"] == 200, "searches"
