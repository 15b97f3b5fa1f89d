"""Surfaces in one plane, fans hub on hub: every face pair needs exact arithmetic, and every way of asking agrees."""

import numpy as np
import pytest
from support.shapes import fans_at_their_hubs, sliding_grids

from cdcore import Verdict, create_detector, join
from cdcore.protocol import detect_live


@pytest.mark.sampled(10)
@pytest.mark.parametrize(
    ("scene", "size"),
    [
        (sliding_grids, 6),  # cells a side
        (fans_at_their_hubs, 24),  # faces a cone
    ],
)
@pytest.mark.parametrize("name", ["exact", "obb", "aabb", "rapid-style", "solid-style"])
def test_ties_agree_in_every_mode(name, scene, size):
    """Truth is how the scene was built: bodies meet in some frames, and are a step or 1e-12 m apart in the others."""
    bodies, motion, meets = scene(size, frames=40)
    assert 0.2 < meets.mean() < 0.9, "both answers are asked for often"
    detector, last = create_detector(name, bodies), motion.frames(len(motion) - 1, len(motion))
    answer_of_mode = {
        "whole": detector.detect(motion),
        "blocks": join(detector.stream(motion.blocks(7))),  # of 40 frames, so that the last block is shorter
        "live": detect_live(detector, motion),
        "faces": detector.detect(motion, faces=True),
    }
    for mode, answer in answer_of_mode.items():
        np.testing.assert_array_equal(answer.verdict[:, 0] == Verdict.CONTACT, meets, err_msg=mode)
    assert (detector.detect(last).verdict[0, 0] == Verdict.CONTACT) == meets[-1]


@pytest.mark.parametrize(("scene", "size"), [(sliding_grids, 12), (fans_at_their_hubs, 60)])
def test_boolean_query_stops_at_first_exact_contact(scene, size):
    """A first contact took a fortieth of the exact tests of all faces that meet; a tenth leaves it room."""
    bodies, motion, meets = scene(size, frames=64)
    detector, touching = create_detector("exact", bodies), motion.take(np.flatnonzero(meets))
    exact_tests = {faces: detector.detect(touching, faces=faces).work["world_tests"] for faces in (False, True)}
    assert exact_tests[False] < exact_tests[True] / 10
