"""Sweep and prune keeps every pair whose bodies touch, and its swaps are few while bodies move little."""

import numpy as np
from shapes import box_mesh, lab, random_rotations

from cdcore import Body, Motion, Verdict, create_detector
from cdcore.bounding.box import box_by_body_axes
from cdcore.broad.sweep_stage import SweepStage
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
