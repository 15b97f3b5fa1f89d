"""Contact before surfaces meet: which pairs are no farther apart than a distance."""

from collections.abc import Sequence

import numpy as np

from cdcore.narrow.bvh.box_tree import BoxTree
from cdcore.narrow.margins.margin_kernels import boxes_of, certainly_apart
from cdcore.narrow.pair_frames import poses_to_ask
from cdcore.numerics import BoolArray, IntArray
from cdcore.protocol import Motion


class ContactOffset:
    """Asks whether surfaces of ``pairs`` (P, 2) that do not meet are at most ``reach`` metres apart; a tree a body.

    Distances are computed in floats: between 1e-9 of the bodies' size below and above the reach either may be said.
    """

    def __init__(self, trees: Sequence[BoxTree], pairs: IntArray, reach: float) -> None:
        self._trees = [(boxes_of(tree), tree) for tree in trees]
        self._pairs, self._reach = np.sort(pairs, axis=1), reach

    def near(self, motion: Motion, frames: IntArray, columns: IntArray) -> BoolArray:
        """Which of K pair-frames without contact are within reach, (K,)."""
        found = np.zeros(len(frames), dtype=np.bool_)
        for column, rows, pose_a, pose_b, number in poses_to_ask(motion, self._pairs, frames, columns):
            (turn_a, move_a), (turn_b, move_b) = pose_a, pose_b
            back = turn_b.transpose(0, 2, 1)
            turns = np.ascontiguousarray(back @ turn_a)
            moves = np.ascontiguousarray((back @ (move_a - move_b)[..., None])[..., 0])
            apart = np.empty(len(turns), dtype=np.bool_)
            reach = np.full(len(turns), self._reach)
            (boxes_a, tree_a), (boxes_b, tree_b) = (self._trees[body] for body in self._pairs[column])
            certainly_apart(boxes_a, tree_a, boxes_b, tree_b, turns, moves, reach, True, apart)
            found[rows] = ~apart[number]
        return found
