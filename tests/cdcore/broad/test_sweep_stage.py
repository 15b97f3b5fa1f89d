"""Sweep and prune keeps every pair whose bodies touch, and its swaps are few while bodies move little."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from support.shapes import box_mesh, lab, random_rotations

from cdcore import Body, Motion, Verdict, create_detector
from cdcore.bounding.box import Box, box_by_body_axes
from cdcore.broad.sweep_stage import SweepStage, sort_ends
from cdcore.kernels.compiling import kernel
from cdcore.protocol import counts_as_contact, resolve_pairs


def stage_of(bodies):
    return SweepStage([box_by_body_axes(body.mesh) for body in bodies], resolve_pairs(bodies, None))


def test_every_contact_is_among_the_candidates_whatever_the_blocks():
    bodies, motion = lab(200)
    stage = stage_of(bodies)
    whole = stage.candidates(motion, stage.fresh_memory())
    found = counts_as_contact(create_detector("exact", bodies).detect(motion).verdict)
    assert found.any() and (whole.verdict[found] == Verdict.CANDIDATE).all()
    assert (whole.verdict == Verdict.CLEAR).any() and (whole.verdict == Verdict.NO_POSE).any()
    memory = stage.fresh_memory()
    parts = [stage.candidates(block, memory) for block in motion.blocks(7)]
    assert np.array_equal(np.concatenate([part.verdict for part in parts]), whole.verdict)
    assert (sum(part.swaps for part in parts), sum(part.events for part in parts)) == (whole.swaps, whole.events)


def test_boxes_that_touch_in_a_corner_are_candidates_far_from_the_origin_too():
    bodies = [Body("a", box_mesh()), Body("b", box_mesh())]
    for away in (0.0, 1.0, 1e3, 1e6):
        rotation = random_rotations(np.random.default_rng(int(away)))
        corner = rotation @ np.ones(3)
        places = np.array([[[0, 0, 0], corner]]) + away
        motion = Motion([0.0], places, np.tile(rotation, (1, 2, 1, 1)))
        stage = stage_of(bodies)
        assert stage.candidates(motion, stage.fresh_memory()).verdict.tolist() == [[Verdict.CANDIDATE]]


def test_bodies_that_stand_still_swap_nothing_after_the_first_frame():
    bodies, motion = lab(40)
    stage, memory = stage_of(bodies), None
    memory = stage.fresh_memory()
    stage.candidates(motion.frames(0, 1), memory)
    again = stage.candidates(motion.frames(0, 1), memory)
    assert (again.swaps, again.events) == (0, 0)


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


def test_boxes_that_touch_far_from_their_own_origin_are_candidates():
    # Made by hand, without the slack of a fit: only the pad in their size covers the rounding of their places.
    boxes = [Box(np.array([1e3 + k, 7.0, -3.0]), np.eye(3), np.array([0.5, 0, 0])) for k in (0, 1)]
    stage = SweepStage(boxes, np.array([[0, 1]]))
    for turn in random_rotations(np.random.default_rng(0), 50):
        motion = Motion([0.0], np.zeros((1, 2, 3)), np.tile(turn, (1, 2, 1, 1)))
        assert stage.candidates(motion, stage.fresh_memory()).verdict.tolist() == [[Verdict.CANDIDATE]]
