"""Local search goes down to ever closer pairs, and its rounds end where none is closer."""

import numpy as np
from search_scenes import I3, ball_of, colliding_poses, search_of

from cdcore.search.descent import DRAWS


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
