"""From one pair of each curve the flood fill finds exactly the pairs that meet, over the features of a mesh."""

import numpy as np
import pytest
from support.search_scenes import I3, NO_SEEDS, ball_of, colliding_poses, exact_pairs, search_of, torus_mesh
from support.shapes import box_mesh, rod_mesh

AT_ORIGIN = (I3, np.zeros(3))


def curve_from(search, pose, seeds):
    """Face pairs that the flood fill reaches from these."""
    search.search(pose, AT_ORIGIN, stamp=0.0, budget=1)
    search.state["hit_a"] = -1
    return {tuple(row) for row in search.curve(np.array(seeds, dtype=np.int64).reshape(-1, 2)).tolist()}


def components(search, pose, pairs):
    """The meeting pairs as sets, each reached from one of its own."""
    left, pieces = set(pairs), []
    while left:
        component = curve_from(search, pose, [min(left)])
        assert min(left) in component
        pieces.append(component)
        left -= component
    return pieces


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_flood_from_a_seed_per_curve_finds_all_faces(seed):
    """A curve: meeting pairs of faces that are neighbours; two bodies may cut in several."""
    torus, ball = torus_mesh(), ball_of(faces=1500, radius=0.5)
    search = search_of(torus, ball, variant="random")
    for pose in colliding_poses(torus, ball, count=4, seed=seed):
        truth = exact_pairs(search, torus, ball, pose, AT_ORIGIN)
        pieces = components(search, pose, truth)
        assert set().union(*pieces) == truth
        assert curve_from(search, pose, [min(component) for component in pieces]) == truth


def test_rod_through_a_ball_has_a_curve_per_seed():
    """The rod goes in and out: two curves, which are all faces that meet."""
    rod, ball = rod_mesh(radius=0.1, length=4.0, sides=12), ball_of(faces=2000)
    search = search_of(rod, ball, variant="random")
    pose = (I3, np.array([0.013, 0.007, -2.0]))
    truth = exact_pairs(search, rod, ball, pose, AT_ORIGIN)
    pieces = components(search, pose, truth)
    assert len(pieces) == 2
    assert set().union(*pieces) == truth


@pytest.mark.parametrize("offset", [(1.0, 0.25, 0.125), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (1.0, 1.0, 0.5)])
def test_resting_faces_edges_and_corners_are_filled_over_corners(offset):
    """A unit cube face on face with another, upon it, at its corner, along its edge: one hit leads to all that meet."""
    box = box_mesh()
    search = search_of(box, box, variant="local", budget=5000)
    pose = (I3, np.array(offset))
    truth = exact_pairs(search, box, box, pose, AT_ORIGIN)
    assert search.search(pose, AT_ORIGIN, stamp=0.0).hit in truth
    assert {tuple(row) for row in search.curve(NO_SEEDS).tolist()} == truth


def test_arrays_grow_with_thousands_of_pairs():
    """A ball on itself: every face meets itself and its neighbours."""
    ball = ball_of(faces=1000)
    search = search_of(ball, ball)
    truth = exact_pairs(search, ball, ball, AT_ORIGIN, AT_ORIGIN)
    assert len(truth) > 10_000
    assert search.search(AT_ORIGIN, AT_ORIGIN, stamp=0.0).hit is not None
    assert {tuple(row) for row in search.curve(NO_SEEDS).tolist()} == truth
