"""Faces called apart are apart by more than the pad, and faces clearly apart are called so.

GJK looks for an axis along which two triangles are apart, and begins with a given one; the answer is how many steps
that took, or MEETING where it found none.
"""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdcore import triangles_intersect
from cdcore.kernels.compiling import kernel
from cdcore.narrow.published_trees import gjk


@kernel
def steps(points, axis, pad):
    """Steps until GJK separates two triangles, points (6, 3), from a first axis on, which it changes in place."""
    return gjk.steps_to_separate(points.ravel(), axis, pad, np.empty(36))


def gap_along(points, axis):
    """Distance of two triangles along an axis; below 0 they overlap on it."""
    along = points @ (axis / np.linalg.norm(axis))
    return along[:3].min() - along[3:].max()


@pytest.mark.slow  # the kernel alone compiles longer than this runs
@settings(deadline=None, max_examples=100)
@given(st.integers(0, 2**32), st.sampled_from([1.0, 1e-6, 1e6]), st.sampled_from([0.0, 1e-3]))
def test_returned_axes_separate_by_more_than_the_pad(seed, scale, pad):
    """Two random triangles of this scale: where GJK says apart they do not meet, and are apart by the pad on its axis.

    The axis stays as it was where they meet, and where it separates them without a step.
    """
    rng = np.random.default_rng(seed)
    points = (rng.normal(size=(6, 3)) + np.repeat(rng.normal(size=(2, 3)), 3, axis=0)) * scale
    axis = rng.normal(size=3)
    first_axis = axis.copy()
    steps_taken = steps(points, axis, pad * scale)
    if steps_taken == gjk.MEETING:
        assert np.array_equal(axis, first_axis)
        return
    assert gap_along(points, axis) > pad * scale * (1 - 1e-9)
    assert not triangles_intersect(points.reshape(1, 2, 3, 3))[0]
    assert (steps_taken == 0) == np.array_equal(axis, first_axis)


@pytest.mark.slow  # the kernel alone compiles longer than this runs
def test_faces_that_do_not_meet_are_nearly_always_separated():
    """All of 4,000 random pairs that meet are MEETING, and at most one in 1,000 of the others."""
    rng, pad, first_axis = np.random.default_rng(0), 1e-12, np.array([1.0, 0, 0])
    points = rng.normal(size=(4000, 6, 3)) + np.repeat(rng.normal(size=(4000, 2, 3)) * 0.6, 3, axis=1)
    meet = triangles_intersect(points.reshape(-1, 2, 3, 3))
    assert 0.1 < meet.mean() < 0.9, "both kinds are frequent"
    answer = np.array([steps(pair, first_axis.copy(), pad) for pair in points])
    assert (answer[meet] == gjk.MEETING).all()
    assert (answer[~meet] == gjk.MEETING).mean() < 0.001


@pytest.mark.slow  # the kernel alone compiles longer than this runs
@pytest.mark.parametrize("scale", [1e200, 1e-200])
def test_gjk_claims_no_separation_when_floats_overflow_or_underflow(scale):
    """Two triangles 9 m apart along x at a scale at which products of coordinates are infinite or 0.

    GJK begins with the axis y, which does not separate them, and finds no other: it says MEETING, its word for "not
    known to be apart".
    """
    points = np.random.default_rng(2).normal(size=(6, 3)) + np.repeat([[0, 0, 0], [9.0, 0, 0]], 3, axis=0)
    first_axis, pad = np.array([0.0, 1.0, 0.0]), 1e-150
    assert steps(points * scale, first_axis, pad) == gjk.MEETING


def nearest_by_subsets(rows):
    """Rows of a simplex (n, 3) that carry its point nearest to the origin, and that point, by least squares."""
    candidates = []
    for size in range(1, len(rows) + 1):
        for subset in itertools.combinations(range(len(rows)), size):
            corners = rows[list(subset)]
            edges = (corners[1:] - corners[0]).T
            weights = np.linalg.lstsq(edges, -corners[0], rcond=None)[0] if size > 1 else np.zeros(0)
            if (weights > 0.0).all() and weights.sum() < 1.0:
                point = corners[0] + edges @ weights
                candidates.append((round(float(point @ point), 12), size, subset, point))
    return min(candidates, key=lambda candidate: candidate[:2])[2:]


@pytest.mark.parametrize("corners", [1, 2, 3, 4], ids=["point", "segment", "triangle", "tetrahedron"])
def test_nearest_point_of_a_simplex_is_that_of_least_squares(corners):
    """The point of a simplex nearest to the origin, and how many corners carry it, which then come first in ``room``.

    That begins with the corners; the rest of its 36 numbers is for the kernel's own use. ``nearest_by_subsets`` tries
    every face, edge and corner. 0 corners: the origin is inside a tetrahedron.
    """
    rng = np.random.default_rng(corners)
    counts_of_corners = set()
    for _ in range(150):
        rows = rng.normal(size=(corners, 3)) + rng.normal(size=3) * rng.uniform(0, 1.5)
        subset, expected = nearest_by_subsets(rows)
        room = np.concatenate([rows.ravel(), np.zeros(36 - 3 * corners)])
        used, point = gjk.nearest_on_simplex(room, corners)
        counts_of_corners.add(used)
        if len(subset) == 4:
            assert used == 0
            continue
        assert used == len(subset)
        assert point == pytest.approx(expected, abs=1e-9)
        assert {tuple(row) for row in room.reshape(-1, 3)[:used]} == {tuple(rows[k]) for k in subset}
    assert counts_of_corners == ({0, 1, 2, 3} if corners == 4 else set(range(1, corners + 1)))


@pytest.mark.parametrize("pad", [0.0, 0.01], ids="pad of {} m".format)
def test_few_steps_separate_faces_with_a_small_gap(pad):
    """40 random pairs of faces: at most six steps separate two, and the axis separates them at once the next time.

    Of those that do not meet at most one is left open, MEETING. Both bounds are by trial.
    """
    rng, left_open, room_of_the_kernel = np.random.default_rng(3), 0, np.empty(36)
    for _ in range(40):
        points = rng.normal(size=(6, 3)) + np.repeat(rng.normal(size=(2, 3)), 3, axis=0)
        axis = np.array([1.0, 0.0, 0.0])
        steps_taken = gjk.steps_to_separate(points.ravel(), axis, pad, room_of_the_kernel)
        if steps_taken == gjk.MEETING:
            left_open += not triangles_intersect(points.reshape(1, 2, 3, 3))[0]
            continue
        assert steps_taken <= 6
        assert gap_along(points, axis) > pad
        assert gjk.steps_to_separate(points.ravel(), axis, pad, room_of_the_kernel) == 0
    assert left_open <= 1
