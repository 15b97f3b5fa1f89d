"""Sorting keeps the count of shared axes right, touching ends included."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cdcore.broad.sweep_kernels import sort_ends
from cdcore.kernels.compiling import kernel


@kernel
def sorted_ends(ends, order, shared, axis):
    return sort_ends(ends, order, shared, axis)


def shared_axes(ends):
    low, high = ends[:, 0::2], ends[:, 1::2]
    return ((low[:, :, None] <= high[:, None, :]) & (low[:, None, :] <= high[:, :, None])).sum(axis=0)


@settings(deadline=None)
@given(
    st.lists(
        st.lists(st.tuples(st.integers(0, 4), st.integers(0, 3)), min_size=12, max_size=12), min_size=1, max_size=4
    )
)
def test_after_each_sort_shared_is_the_number_of_axes_on_which_boxes_overlap(frames):
    bodies = 4
    order = np.tile([0, 2, 4, 6, 1, 3, 5, 7], (3, 1))
    shared = np.full((bodies, bodies), 3)
    for frame in frames:
        low, size = np.array(frame, dtype=float).reshape(3, bodies, 2).transpose(2, 0, 1)
        ends = np.empty((3, 2 * bodies))
        ends[:, 0::2], ends[:, 1::2] = low, low + size
        before = shared.copy()
        events = sum(sorted_ends(ends, order, shared, axis)[1] for axis in range(3))
        want = shared_axes(ends)
        off = ~np.eye(bodies, dtype=bool)
        assert np.array_equal(shared[off], want[off])
        changed = ((before == 3) != (shared == 3))[np.triu_indices(bodies, 1)].sum()
        assert events >= changed and (events - changed) % 2 == 0
        assert sorted_ends(ends, order, shared, 0) == (0, 0)
