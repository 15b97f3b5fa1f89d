"""A pair searched in vain is searched anew when it has moved by a share of its faces, and not by rounding."""

import numpy as np
from support.crossing_paths import crossing_paths
from support.search_scenes import ball_of, torus_mesh
from support.shapes import box_mesh, random_rotations

from cdcore import Body, Motion, Verdict, create_detector, join
from cdcore.search.features import features_of
from cdcore.search.resting_contact import Rest, distance_moved, relative_of
from cdcore.search.sample_control import PROBE

BALL = ball_of(1200)


def carried(frames=200, aside=0.05, seed=3):
    """A ball in the hole of a ring, both in one hand that turns and moves: each pose is rounded anew."""
    rng = np.random.default_rng(seed)
    turn = random_rotations(rng, frames)
    hand = rng.normal(size=(frames, 3))
    place = np.stack([hand, hand + turn @ np.array([aside, 0.0, 0.0])], axis=1)
    bodies = [Body("a", torus_mesh()), Body("b", ball_of(1200, 0.5))]
    return bodies, Motion(np.arange(frames) / 90, place, np.stack([turn, turn], axis=1))


def test_relative_poses_place_the_first_body_in_the_frame_of_the_second():
    _, motion = carried(5)
    (poses,) = relative_of(motion, np.ones((5, 1), dtype=bool), [(0, 1)])
    point = np.array([0.3, -0.2, 0.7])
    for frame, pose in enumerate(poses):
        world = motion.rotations[frame, 0] @ point + motion.translations[frame, 0]
        expected = motion.rotations[frame, 1].T @ (world - motion.translations[frame, 1])
        assert np.allclose(pose[:9].reshape(3, 3) @ point + pose[9:12], expected, atol=1e-14)
        assert pose[12] == np.abs(motion.translations[frame]).max()


def test_no_point_of_the_body_moves_farther_than_the_bound_says():
    rng = np.random.default_rng(8)
    for _ in range(50):
        turns, moves = random_rotations(rng, 2), rng.normal(size=(2, 3)) * 0.1
        first, second = (np.array([*turn.ravel(), *move, 1.0]) for turn, move in zip(turns, moves, strict=True))
        points = BALL.vertices
        moved = np.linalg.norm(points @ turns[0].T + moves[0] - points @ turns[1].T - moves[1], axis=1).max()
        assert moved <= distance_moved(first, second, features_of(BALL).size)


def test_the_budget_is_whole_for_news_short_for_little_and_none_where_nothing_has_moved():
    features = features_of(BALL)
    rest = Rest(features, features, 0.25)
    face = 2 * features.mean_radius
    before = np.array([*np.eye(3).ravel(), 2.1, 0.0, 0.0, 2.1])

    def after(distance):
        return before + distance * np.eye(13)[9]

    assert rest.budget(before, None, None, 2000) == 2000
    assert rest.budget(after(0.26 * face), before, before, 2000) == 2000
    assert rest.budget(after(0.24 * face), before, before, 2000) == PROBE
    assert rest.budget(after(0.24 * face), before, after(0.24 * face), 2000) == 2000
    assert rest.budget(after(0.24 * face), before, before, 50) == 50
    assert rest.budget(after(1e-14), before, before, 2000) == 0
    assert rest.budget(after(np.nan), before, before, 2000) == 2000


def test_the_finer_mesh_says_what_is_news_in_either_order():
    ball, plate = features_of(BALL), features_of(box_mesh((2.0, 0.1, 2.0)))
    face = 2 * ball.mean_radius
    assert plate.mean_radius > 5 * ball.mean_radius
    before = np.array([*np.eye(3).ravel(), 0.0, 1.2, 0.0, 1.2])
    for bodies in ((ball, plate), (plate, ball)):
        rest = Rest(*bodies, 0.25)
        budgets = [rest.budget(before + share * face * np.eye(13)[10], before, before, 2000) for share in (0.24, 0.26)]
        assert budgets == [PROBE, 2000]


def test_what_rides_on_a_hand_is_searched_once_and_stays_not_found():
    bodies, motion = carried()
    resting, anew = (create_detector("qaco", bodies, rest=rest).detect(motion) for rest in (0.25, 0.0))
    assert (resting.verdict == Verdict.NOT_FOUND).all()
    assert resting.digest == anew.digest
    assert (resting.work["looks"], anew.work["looks"]) == (1, 200)


def test_a_contact_is_confirmed_anew_in_every_frame_of_a_pair_at_rest():
    bodies, motion = carried(aside=0.4)
    answer = create_detector("qaco", bodies, rest=0.25).detect(motion)
    assert (answer.verdict == Verdict.CONTACT).all()
    assert answer.work["looks"] == 200


def test_resting_pairs_cost_less_lose_next_to_nothing_and_are_the_same_for_any_block():
    bodies, path = crossing_paths(5)
    # each of a hundred frames seven times, so that every pair rests now and then
    frame = np.repeat(np.arange(0, 300, 3), 7)
    motion = Motion(np.arange(700) / 90, path.translations[frame], path.rotations[frame])
    motion = Motion(motion.times, motion.translations + np.arange(700)[:, None, None] * 1e-5, motion.rotations)
    resting, anew = (create_detector("qaco", bodies, rest=rest) for rest in (0.1, 0.0))
    rested, full = resting.detect(motion), anew.detect(motion)
    assert join(list(resting.stream(motion.blocks(7)))).digest == rested.digest
    found = [(answer.verdict == Verdict.CONTACT).sum() for answer in (rested, full)]
    assert found[0] >= 0.98 * found[1] > 0
    assert rested.work["evaluations"] < 0.5 * full.work["evaluations"]
