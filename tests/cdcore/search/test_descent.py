"""Local search goes down to ever closer pairs, and its rounds end where none is closer."""

import numpy as np
from support.search_scenes import I3, ball_of, colliding_poses, search_of, torus_mesh

from cdcore.search import state
from cdcore.search.advance import follow
from cdcore.search.descent import DRAWS
from cdcore.search.features import NEIGHBOURS, RADIUS

HERE = (I3, np.zeros(3))


def walked(search, i, j):
    """The pair where a way down from (i, j) ends, its distance, and the evaluations it took."""
    count, number = search._count, search._number
    count[state.BUDGET], before = 10**9, int(count[state.EVALUATIONS])
    number[state.CLOSEST] = np.inf
    follow(True, i, j, *search._rows(), *search._near, search._pose, number, count, search._table)
    end = int(count[state.BEST_A]), int(count[state.BEST_B])
    return end, float(number[state.CLOSEST]), int(count[state.EVALUATIONS]) - before


def ways_beside_each_other(ways=150):
    """A torus a little above another, where no face meets and many balls overlap: a fresh search, and random starts."""
    search = search_of(torus_mesh(1.0, 0.3, 60, 24), torus_mesh(1.0, 0.3, 60, 24), variant="local")
    search._place((I3, np.array([0.02, 0.01, 0.62])), HERE, 0.0)
    draw = np.random.default_rng(4)
    return search, draw.integers(len(search.first), size=(ways, 2)).tolist()


def distances(search, firsts, seconds):
    turn, move = search._pose[24:33].reshape(3, 3), search._pose[33:36]
    a, b = (features.rows[:, :3] for features in (search.first, search.second))
    return np.linalg.norm((a[firsts] @ turn.T + move)[:, None] - b[seconds][None], axis=2)


def test_a_walk_over_convex_faces_ends_at_the_closest_pair_of_apart_balls():
    ball = ball_of(2000)
    search = search_of(ball, ball, variant="local", budget=20_000)
    look = search.look((I3, np.array([2.5, 0.1, 0.2])), (I3, np.zeros(3)), 0.0)
    centroids = search.first.rows[:, :3], search.second.rows[:, :3]
    gap = np.linalg.norm((centroids[0] + [2.5, 0.1, 0.2])[:, None] - centroids[1][None], axis=2)
    assert look.distance < 1.03 * gap.min()


def test_it_finds_a_contact_with_far_fewer_evaluations_than_random_draws():
    ball = ball_of(5000)
    poses = colliding_poses(ball, ball, 20, seed=11)
    spent = {}
    for variant in ("local", "random"):
        search = search_of(ball, ball, variant=variant, budget=20_000)
        spent[variant] = [search.look(pose, (I3, np.zeros(3)), k).evaluations for k, pose in enumerate(poses)]
    assert np.mean(spent["local"]) < 0.3 * np.mean(spent["random"])


def test_a_warm_start_at_the_contact_of_the_frame_before_needs_a_few_evaluations():
    ball = ball_of(5000)
    search = search_of(ball, ball, variant="local", budget=20_000)
    place = np.array([1.7, 0.3, 0.1])
    before = search.look((I3, place), (I3, np.zeros(3)), 0.0)
    after = search.look((I3, place + 0.002), (I3, np.zeros(3)), 1.0, start=before.hit)
    assert after.hit is not None
    assert after.evaluations < DRAWS * 2


def test_a_way_ends_only_where_no_neighbour_and_where_balls_overlap_no_two_neighbours_are_closer():
    search, starts = ways_beside_each_other()
    ends, overlapping = set(), 0
    for i, j in starts:
        search._place((I3, np.array([0.02, 0.01, 0.62])), HERE, 0.0)
        end, distance, _ = walked(search, i, j)
        ends.add(end)
        both = (search.first, end[0]), (search.second, end[1])
        around = [np.append(features.near[at, :NEIGHBOURS], at) for features, at in both]
        gaps = distances(search, *(places[places >= 0] for places in around))
        assert min(gaps[-1].min(), gaps[:, -1].min()) >= distance * (1 - 1e-12)
        if distance < search.first.rows[end[0], RADIUS] + search.second.rows[end[1], RADIUS]:
            overlapping += 1
            assert gaps.min() >= distance * (1 - 1e-12)
    assert overlapping > 100 and len(ends) > 5


def test_a_way_is_left_where_an_earlier_one_has_been_and_gone_again_in_the_next_frame():
    search, starts = ways_beside_each_other(20)
    for i, j in starts:
        search._place((I3, np.array([0.02, 0.01, 0.62])), HERE, 0.0)
        _, reached, whole = walked(search, i, j)
        _, _, again = walked(search, i, j)
        assert again <= 1 + 2 * NEIGHBOURS
        search._place((I3, np.array([0.02, 0.01, 0.62])), HERE, 1.0)
        assert walked(search, i, j)[1:] == (reached, whole)
        assert whole > again
