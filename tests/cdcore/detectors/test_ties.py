"""Surfaces in one plane, fans hub on hub: every face pair needs exact arithmetic, and every way of asking agrees."""

import numpy as np
import pytest
from support.shapes import fans_at_their_hubs, sliding_grids

from cdcore import Verdict, create_detector, join
from cdcore.protocol import detect_live


@pytest.mark.parametrize(("scene", "size"), [(sliding_grids, 6), (fans_at_their_hubs, 24)])
@pytest.mark.parametrize("name", ["exact", "obb", "aabb", "rapid-style", "solid-style"])
def test_ties_agree_in_every_mode(name, scene, size):
    bodies, motion, meets = scene(size, 40)
    assert 0.2 < meets.mean() < 0.9
    detector, last = create_detector(name, bodies), motion.frames(len(motion) - 1, len(motion))
    answers = {
        "whole": detector.detect(motion),
        "blocks": join(detector.stream(motion.blocks(7))),
        "live": detect_live(detector, motion),
        "faces": detector.detect(motion, faces=True),
    }
    for direction, answer in answers.items():
        np.testing.assert_array_equal(answer.verdict[:, 0] == Verdict.CONTACT, meets, err_msg=direction)
    assert (detector.detect(last).verdict[0, 0] == Verdict.CONTACT) == meets[-1]


@pytest.mark.parametrize(("scene", "size"), [(sliding_grids, 12), (fans_at_their_hubs, 60)])
def test_boolean_query_stops_at_first_exact_contact(scene, size):
    bodies, motion, meets = scene(size, 64)
    detector, touching = create_detector("exact", bodies), motion.take(np.flatnonzero(meets))
    requested = {faces: detector.detect(touching, faces=faces).work["world_tests"] for faces in (False, True)}
    assert requested[False] < requested[True] / 3
