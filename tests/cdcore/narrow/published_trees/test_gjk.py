"""Faces called apart are apart by more than the pad, and faces clearly apart are called so."""

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
    """Steps until GJK separates points, beginning with an axis."""
    return gjk.steps_to_separate(points.ravel(), axis, pad, np.empty(36))


def gap_along(points, axis):
    """Distance of two triangles along an axis; below 0 they overlap on it."""
    along = points @ (axis / np.linalg.norm(axis))
    return along[:3].min() - along[3:].max()


@pytest.mark.slow  # the kernel alone compiles longer than this runs
@settings(deadline=None, max_examples=100)
@given(st.integers(0, 2**32), st.sampled_from([1.0, 1e-6, 1e6]), st.sampled_from([0.0, 1e-3]))
def test_returned_axes_separate_by_more_than_the_pad(seed, scale, pad):
    """The axis of two random triangles is changed in place, unless they meet or it separates them as it is."""
    rng = np.random.default_rng(seed)
    points = (rng.normal(size=(6, 3)) + np.repeat(rng.normal(size=(2, 3)), 3, axis=0)) * scale
    axis = rng.normal(size=3)
    before = axis.copy()
    taken = steps(points, axis, pad * scale)
    if taken == gjk.MEETING:
        assert np.array_equal(axis, before)
        return
    assert gap_along(points, axis) > pad * scale * (1 - 1e-9)
    assert not triangles_intersect(points.reshape(1, 2, 3, 3))[0]
    assert (taken == 0) == np.array_equal(axis, before)


@pytest.mark.slow  # the kernel alone compiles longer than this runs
def test_faces_that_do_not_meet_are_nearly_always_separated():
    """At most one in 1,000 of the random pairs that do not meet is left open."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(4000, 6, 3)) + np.repeat(rng.normal(size=(4000, 2, 3)) * 0.6, 3, axis=1)
    meet = triangles_intersect(points.reshape(-1, 2, 3, 3))
    pad = 1e-12
    answer = np.array([steps(item, np.array([1.0, 0, 0]), pad) for item in points])
    assert (answer[meet] == gjk.MEETING).all()
    assert (answer[~meet] != gjk.MEETING).mean() > 0.999
    assert 0.1 < meet.mean() < 0.9


@pytest.mark.slow  # the kernel alone compiles longer than this runs
def test_gjk_claims_no_separation_when_floats_overflow_or_underflow():
    """At a scale of 1e200 or 1e-200 products of coordinates are infinite or 0."""
    points = np.random.default_rng(2).normal(size=(6, 3)) + np.repeat([[0, 0, 0], [9.0, 0, 0]], 3, axis=0)
    for scale in (1e200, 1e-200):
        pad = 1e-150
        assert steps(points * scale, np.array([0.0, 1.0, 0.0]), pad) == gjk.MEETING


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


@pytest.mark.parametrize("corners", [1, 2, 3, 4])
def test_nearest_point_of_a_simplex_is_that_of_least_squares(corners):
    """The point nearest to the origin; ``nearest_by_subsets`` tries every face, edge and corner."""
    rng = np.random.default_rng(corners)
    numbers_of_rows = set()
    for _ in range(150):
        rows = rng.normal(size=(corners, 3)) + rng.normal(size=3) * rng.uniform(0, 1.5)
        subset, expected = nearest_by_subsets(rows)
        room = np.concatenate([rows.ravel(), np.zeros(36 - 3 * corners)])
        used, point = gjk.nearest_on_simplex(room, corners)
        numbers_of_rows.add(used)
        if len(subset) == 4:
            assert used == 0, "the origin is inside"
            continue
        assert used == len(subset)
        assert point == pytest.approx(expected, abs=1e-9)
        assert {tuple(row) for row in room.reshape(-1, 3)[:used]} == {tuple(rows[k]) for k in subset}
    assert numbers_of_rows == set(range(1, corners + 1)) - {4} | ({0} if corners == 4 else set())


@pytest.mark.parametrize("pad", [0.0, 0.01])
def test_few_steps_separate_faces_with_a_small_gap(pad):
    """At most one of 40 random pairs of faces with a gap is left open; the axis found serves again."""
    rng, open_pairs = np.random.default_rng(3), 0
    for _ in range(40):
        points = rng.normal(size=(6, 3)) + np.repeat(rng.normal(size=(2, 3)), 3, axis=0)
        axis = np.array([1.0, 0.0, 0.0])
        steps_taken = gjk.steps_to_separate(points.ravel(), axis, pad, np.empty(36))
        if steps_taken == gjk.MEETING:
            open_pairs += not triangles_intersect(points.reshape(1, 2, 3, 3))[0]
            continue
        assert steps_taken <= 6
        assert gap_along(points, axis) > pad
        assert gjk.steps_to_separate(points.ravel(), axis, pad, np.empty(36)) == 0
    assert open_pairs <= 1
