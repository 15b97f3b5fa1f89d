"""A face pair is dropped in a lane only if it is disjoint there; nearly all that survive meet or almost do."""

import numpy as np
import pytest
from support.eight_frames import EightFrames

from cdcore.kernels.compiling import kernel
from cdcore.narrow.spacetime.leaf_test import survivors_of_leaves
from cdcore.narrow.spacetime.node_test import lanes_that_may_meet
from cdcore.narrow.triangles.predicates import triangles_intersect


@kernel
def survivors(tree_a, a, leaf_a, tree_b, b, leaf_b, relative, middle, chord, pad, found):
    offset, turned, moved, plane, span = np.empty(24), np.empty(72), np.empty(768), np.empty(32), np.empty(48)
    mask = lanes_that_may_meet(
        tree_a.boxes, a, tree_b.boxes, b, relative, middle, chord, pad, 255 + 0 * a, True, offset
    )
    if mask == 0:
        return 0
    return survivors_of_leaves(
        tree_a, leaf_a, tree_b, b, leaf_b, relative, offset, pad, mask, turned, moved, plane, span, found
    )


@pytest.mark.parametrize("seed", range(3))
def test_every_meeting_face_pair_survives_in_its_lanes_and_few_others_do(seed):
    scene = EightFrames(seed, size=0.6)
    a_tree, b_tree = scene.trees
    lanes = np.zeros((20, 30), dtype=int)
    found = np.empty(192, dtype=np.int64)
    for a in np.flatnonzero(a_tree.links[:, 1] >= 0):
        for b in np.flatnonzero(b_tree.links[:, 1] >= 0):
            count = survivors(
                scene.flat[0], a, int(a_tree.links[a, 1]), scene.flat[1], b, int(b_tree.links[b, 1]), scene.relative,
                scene.middle, scene.chord, scene.pad, found,
            )  # fmt: skip
            for face_a, face_b, left in found[: 3 * count].reshape(-1, 3):
                lanes[a_tree.faces[face_a], b_tree.faces[face_b]] = left
    meeting = 0
    for lane in range(8):
        first, second = scene.world(lane)
        pairs = np.array([[x, y] for x in first for y in second])
        meets = triangles_intersect(pairs).reshape(20, 30)
        assert (lanes[meets] >> lane & 1).all()
        meeting += meets.sum()
    survived = sum(bin(left).count("1") for left in lanes.ravel())
    assert meeting > 10
    assert survived < 4 * meeting
