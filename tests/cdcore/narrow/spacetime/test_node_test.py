"""A lane is dropped only if the faces below both nodes are disjoint in its frame; and most that are, are dropped."""

import numpy as np
import pytest
from support.eight_frames import EightFrames

from cdcore.kernels.compiling import kernel
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.spacetime.certificates import faces_below
from cdcore.narrow.spacetime.node_test import lanes_that_may_meet


@kernel
def asked(boxes_a, a, boxes_b, b, relative, middle, chord, pad, mask, leaves, offset):
    return lanes_that_may_meet(boxes_a, a, boxes_b, b, relative, middle, chord, pad, mask, leaves, offset)


@pytest.mark.parametrize("leaves", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_no_lane_with_contact_is_dropped_and_most_others_are(seed, leaves):
    scene = EightFrames(seed)
    a_tree, b_tree = scene.trees
    worlds = [scene.world(lane) for lane in range(8)]
    dropped = clear = 0
    for a in range(0, len(a_tree.boxes), 3):
        for b in range(0, len(b_tree.boxes), 3):
            left = asked(
                a_tree.boxes, a, b_tree.boxes, b, scene.relative, scene.middle, scene.chord, scene.pad, 255, leaves,
                np.empty(24),
            )  # fmt: skip
            below = faces_below(a_tree, a), faces_below(b_tree, b)
            for lane in range(8):
                first, second = worlds[lane][0][below[0]], worlds[lane][1][below[1]]
                meets = len(meeting_faces_exhaustive(first, second)) > 0
                assert not meets or left >> lane & 1
                clear += not meets
                dropped += not left >> lane & 1
    assert dropped > 0.3 * clear


def test_lanes_that_were_not_asked_stay_out():
    scene = EightFrames(0)
    a, b = scene.trees
    left = asked(
        a.boxes, 0, b.boxes, 0, scene.relative, scene.middle, scene.chord, scene.pad, 0b101, False, np.empty(24)
    )
    assert left & ~0b101 == 0
