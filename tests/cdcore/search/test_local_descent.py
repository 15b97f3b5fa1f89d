"""Local search goes down to ever closer pairs; resting pairs are searched again only when they move."""

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
    """The pair where a way down from (i, j) ends, its distance, and the evaluations it took."""
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
    """150 descents: no neighbour of either end is nearer; if the balls of both ends overlap, no pair of neighbours is.

    A descent repeated from the same start is short, as an earlier path is followed to its end.
    """
    search, starts = starts_beside_each_other()
    ends, overlapping, longest = set(), 0, 0
    for i, j in starts:
        search.search((I3, np.array([0.02, 0.01, 0.62])), AT_ORIGIN, stamp=0.0, budget=0)
        end, distance, spent = descent_from(search, i, j)
        ends.add(end)
        *_, again = descent_from(search, i, j)
        assert again <= 2 * NEIGHBOURS + 1, "an earlier way is followed to its end"
        longest = max(longest, spent)
        both = (search.first, end[0]), (search.second, end[1])
        around = [np.append(features.near[at, :NEIGHBOURS], at) for features, at in both]
        gaps = distances(search, *(positions[positions >= 0] for positions in around))
        assert min(gaps[-1].min(), gaps[:, -1].min()) >= distance * (1 - 1e-12)
        if distance < search.first.rows[end[0], RADIUS] + search.second.rows[end[1], RADIUS]:
            overlapping += 1
            assert gaps.min() >= distance * (1 - 1e-12)
    assert overlapping > 100 and len(ends) > 5 and longest > 10 * NEIGHBOURS


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
    """Random rotations and moves of 0.1 m, and every vertex of a ball."""
    rng = np.random.default_rng(8)
    for _ in range(50):
        rotations, moves = random_rotations(rng, 2), rng.normal(size=(2, 3)) * 0.1
        first, second = (
            np.array([*rotation.ravel(), *move, 1.0]) for rotation, move in zip(rotations, moves, strict=True)
        )
        points = BALL.vertices
        moved = np.linalg.norm(points @ rotations[0].T + moves[0] - points @ rotations[1].T - moves[1], axis=1).max()
        assert moved <= distance_moved(first, second, features_of(BALL).size)


def test_budget_follows_how_far_bodies_moved():
    """Arguments: pose, poses of last search and last probe, lengths, budget; spent from a move of a quarter face on."""
    features = features_of(BALL)
    lengths, never = lengths_at_rest(features, features, 0.25), np.full(13, np.nan)
    face = 2 * features.mean_radius
    before = np.array([*np.eye(3).ravel(), 2.1, 0.0, 0.0, 2.1])

    def after(distance):
        return before + distance * np.eye(13)[9]

    assert budget_at_rest(before, never, never, lengths, 2000) == 2000
    assert budget_at_rest(after(0.26 * face), before, before, lengths, 2000) == 2000
    assert budget_at_rest(after(0.24 * face), before, before, lengths, 2000) == PROBE
    assert budget_at_rest(after(0.24 * face), before, after(0.24 * face), lengths, 2000) == 2000
    assert budget_at_rest(after(0.24 * face), before, before, lengths, 50) == 50
    assert budget_at_rest(after(1e-14), before, before, lengths, 2000) == 0
    inside = np.array([*np.eye(3).ravel(), 0.0, 0.0, 0.0, 0.0])  # two poses at 1 m are rounded there all the same
    assert budget_at_rest(inside + 1e-13 * np.eye(13)[9], inside, inside, lengths, 2000) == 0
    assert budget_at_rest(after(np.nan), before, before, lengths, 2000) == 2000


def test_pair_counts_as_moved_by_faces_of_the_finer_mesh():
    """A move below a quarter of a face of the ball, the finer mesh, only probes; a larger one takes all the budget."""
    ball, plate = features_of(BALL), features_of(box_mesh((2.0, 0.1, 2.0)))
    face = 2 * ball.mean_radius
    assert plate.mean_radius > 5 * ball.mean_radius
    before = np.array([*np.eye(3).ravel(), 0.0, 1.2, 0.0, 1.2])
    for bodies in ((ball, plate), (plate, ball)):
        a_quarter_of_a_face = 0.25
        lengths = lengths_at_rest(*bodies, a_quarter_of_a_face)
        poses = [before + fraction * face * np.eye(13)[10] for fraction in (0.24, 0.26)]
        budgets = [budget_at_rest(pose, before, before, lengths, 2000) for pose in poses]
        assert budgets == [PROBE, 2000]


def test_rigidly_carried_pair_is_searched_once():
    """``rest``: a pair that moved less than this part of a face since its last search is not searched again; 0: always.

    A ball in the hole of a ring moves with it, so that the pair is at rest but for rounding.
    """
    bodies, motion = ball_carried_in_a_ring(frames=200)
    resting, anew = (create_detector("qaco", bodies, rest=rest).detect(motion) for rest in (0.25, 0.0))
    assert (resting.verdict == Verdict.NOT_FOUND).all()
    assert resting.digest == anew.digest
    searches, searches_anew = resting.work["looks"], anew.work["looks"]
    assert (searches, searches_anew) == (1, 200)


def test_resting_contact_is_confirmed_in_every_frame():
    """0.4 m aside the ball is in the ring: unlike a pair that is apart, it is searched in all 200 frames."""
    bodies, motion = ball_carried_in_a_ring(aside=0.4)
    answer = create_detector("qaco", bodies, rest=0.25).detect(motion)
    assert (answer.verdict == Verdict.CONTACT).all()
    assert answer.work["looks"] == 200
