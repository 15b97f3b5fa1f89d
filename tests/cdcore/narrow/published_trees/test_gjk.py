"""Faces called apart are apart by more than the pad, and faces clearly apart are called so."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdcore import triangles_intersect
from cdcore.kernels.compiling import kernel
from cdcore.narrow.published_trees import gjk

pytestmark = pytest.mark.slow
"""The kept digests count these steps in every quick run; compiling the kernel alone takes longer than the tests."""


@kernel
def steps(points, axis, pad):
    return gjk.steps_to_separate(points.ravel(), axis, pad, np.empty(36))


def gap_along(points, axis):
    """Distance of two triangles along an axis; below 0 they overlap on it."""
    along = points @ (axis / np.linalg.norm(axis))
    return along[:3].min() - along[3:].max()


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


def test_faces_that_do_not_meet_are_nearly_always_separated():
    """At most one in 1,000 of the random pairs that do not meet is left open."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(4000, 6, 3)) + np.repeat(rng.normal(size=(4000, 2, 3)) * 0.6, 3, axis=1)
    meet = triangles_intersect(points.reshape(-1, 2, 3, 3))
    answer = np.array([steps(item, np.array([1.0, 0, 0]), pad=1e-12) for item in points])
    assert (answer[meet] == gjk.MEETING).all()
    assert (answer[~meet] != gjk.MEETING).mean() > 0.999
    assert 0.1 < meet.mean() < 0.9


def test_gjk_claims_no_separation_when_floats_overflow_or_underflow():
    """At a scale of 1e200 or 1e-200 products of coordinates are infinite or 0."""
    points = np.random.default_rng(2).normal(size=(6, 3)) + np.repeat([[0, 0, 0], [9.0, 0, 0]], 3, axis=0)
    for scale in (1e200, 1e-200):
        assert steps(points * scale, np.array([0.0, 1.0, 0.0]), pad=1e-150) == gjk.MEETING
