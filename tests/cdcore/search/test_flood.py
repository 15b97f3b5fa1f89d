"""From one pair of each curve the flood fill finds exactly the pairs that meet, over the faces of two meshes.

A curve is a set of face pairs that meet and hang together: both faces of a pair are those of the next, or neighbours.
"""

import numpy as np
import pytest
from support.search_scenes import I3, NO_SEEDS, ball_of, colliding_poses, exact_pairs, search_of, torus_mesh
from support.shapes import box_mesh, rod_mesh

AT_ORIGIN = (I3, np.zeros(3))


def curve_from(search, pose, seeds):
    """Face pairs that the flood fill reaches from some that meet, with both bodies at a pose and at the origin."""
    search.search(pose, AT_ORIGIN, stamp=0.0, budget=1)
    search.state["hit_a"] = -1  # a hit of this search would be another seed
    return {tuple(row) for row in search.curve(np.array(seeds, dtype=np.int64).reshape(-1, 2)).tolist()}


def curves_of(search, pose, pairs):
    """The meeting pairs as curves, each reached from its smallest pair."""
    remaining, curves = set(pairs), []
    while remaining:
        seed = min(remaining)
        curve = curve_from(search, pose, [seed])
        assert seed in curve
        curves.append(curve)
        remaining -= curve
    return curves


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_flood_from_a_seed_per_curve_finds_all_faces(seed):
    """A torus and a ball in four random poses in contact, where they may cross in several curves.

    One pair of each leads to all pairs that ``intersecting_faces`` lists.
    """
    torus, ball = torus_mesh(), ball_of(faces=1500, radius=0.5)
    search = search_of(torus, ball, variant="random")
    for pose in colliding_poses(torus, ball, count=4, seed=seed):
        meeting = exact_pairs(search, torus, ball, pose, AT_ORIGIN)
        curves = curves_of(search, pose, meeting)
        assert set().union(*curves) == meeting
        assert curve_from(search, pose, seeds=[min(curve) for curve in curves]) == meeting


def test_rod_through_a_ball_has_a_curve_per_seed():
    """A rod of 4 m goes into a ball of radius 1 m and out again: two curves, which are all face pairs that meet."""
    rod, ball = rod_mesh(radius=0.1, length=4.0, sides=12), ball_of(faces=2000)
    search = search_of(rod, ball, variant="random")
    pose = (I3, np.array([0.013, 0.007, -2.0]))
    meeting = exact_pairs(search, rod, ball, pose, AT_ORIGIN)
    curves = curves_of(search, pose, meeting)
    assert len(curves) == 2
    assert set().union(*curves) == meeting


@pytest.mark.parametrize(
    "offset",
    [
        pytest.param((1.0, 0.25, 0.125), id="face on face"),
        pytest.param((0.0, 0.0, 0.0), id="upon each other"),
        pytest.param((1.0, 1.0, 1.0), id="corner on corner"),
        pytest.param((1.0, 1.0, 0.5), id="edge on edge"),
    ],
)
def test_resting_faces_edges_and_corners_are_filled_over_corners(offset):
    """A cube of 1 m stands at an offset from another: from the hit of a search the fill leads to all
    pairs that meet.
    """
    box = box_mesh()
    search = search_of(box, box, variant="local", budget=5000)
    pose = (I3, np.array(offset))
    meeting = exact_pairs(search, box, box, pose, AT_ORIGIN)
    assert search.search(pose, AT_ORIGIN, stamp=0.0).hit in meeting
    assert {tuple(row) for row in search.curve(NO_SEEDS).tolist()} == meeting


def test_arrays_grow_with_thousands_of_pairs():
    """A ball of 1,000 faces on itself: every face meets itself and its neighbours, more than 10,000 pairs."""
    ball = ball_of(faces=1000)
    search = search_of(ball, ball)
    meeting = exact_pairs(search, ball, ball, AT_ORIGIN, AT_ORIGIN)
    assert len(meeting) > 10_000
    assert search.search(AT_ORIGIN, AT_ORIGIN, stamp=0.0).hit is not None
    assert {tuple(row) for row in search.curve(NO_SEEDS).tolist()} == meeting
