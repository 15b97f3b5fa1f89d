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
        pytest.param(sliding_grids, 6, id="two grids of 6 x 6 cells slide in one plane"),
        pytest.param(fans_at_their_hubs, 24, id="two cones of 24 faces touch with their tips"),
    ],
)
@pytest.mark.parametrize("name", ["exact", "obb", "aabb", "rapid-style", "solid-style"])
def test_ties_agree_in_every_mode(name, scene, size):
    """In some of 40 frames surfaces just touch, in the others they are a step of the grid or 1e-12 m apart.

    ``meets`` says in which, by how the scene is built. Detectors are asked for the whole motion, in blocks of 7 frames,
    frame by frame (live), for faces too, and for the last frame alone.
    """
    bodies, motion, meets = scene(size, frames=40)
    assert 0.2 < meets.mean() < 0.9, "both answers are frequent"
    detector = create_detector(name, bodies)
    answer_of_mode = {
        "whole": detector.detect(motion),
        "blocks": join(detector.stream(motion.blocks(7))),  # of 40 frames, so that the last block is shorter
        "live": detect_live(detector, motion),
        "faces": detector.detect(motion, faces=True),
    }
    for mode, answer in answer_of_mode.items():
        np.testing.assert_array_equal(answer.verdict[:, 0] == Verdict.CONTACT, meets, err_msg=mode)
    last_frame = motion.frames(len(motion) - 1, len(motion))
    assert (detector.detect(last_frame).verdict[0, 0] == Verdict.CONTACT) == meets[-1]


@pytest.mark.parametrize(
    ("scene", "size"),
    [
        pytest.param(sliding_grids, 12, id="two grids of 12 x 12 cells in one plane"),
        pytest.param(fans_at_their_hubs, 60, id="two cones of 60 faces with their tips together"),
    ],
)
def test_boolean_query_stops_at_first_exact_contact(scene, size):
    """Frames in which surfaces touch, asked for a verdict and for all face pairs: verdicts need at most a tenth of the
    tests.

    At the time of writing they needed a fortieth (``world_tests``: exact tests of two faces in the world's frame).
    """
    bodies, motion, meets = scene(size, frames=64)
    detector, touching = create_detector("exact", bodies), motion.take(np.flatnonzero(meets))
    tests_of_verdicts = detector.detect(touching, faces=False).work["world_tests"]
    tests_of_faces = detector.detect(touching, faces=True).work["world_tests"]
    assert 0 < tests_of_verdicts < tests_of_faces / 10
