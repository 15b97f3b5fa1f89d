"""Contact before surfaces meet: which pairs are no farther apart than a distance."""

from collections.abc import Sequence

import numpy as np

from cdcore.narrow.bvh.box_tree import BoxTree
from cdcore.narrow.continuous.clearance import certainly_separated
from cdcore.narrow.pair_frames import Poses, ask_changed_poses
from cdcore.numerics import BoolArray, IntArray
from cdcore.protocol import Motion


class ContactOffset:
    """Asks whether surfaces of ``pairs`` (P, 2) that do not meet are at most ``reach`` metres apart; a tree a body.

    Distances are computed in floats: between 1e-9 of the bodies' size below and above the reach either may be said.
    """

    def __init__(self, trees: Sequence[BoxTree], pairs: IntArray, reach: float) -> None:
        self._trees, self._pairs, self._reach = trees, np.sort(pairs, axis=1), reach

    def near(self, motion: Motion, frames: IntArray, columns: IntArray) -> BoolArray:
        """Marks the pair-frames without contact that are within reach, (K,)."""

        def separated(column: int, pose_a: Poses, pose_b: Poses) -> list[bool]:
            trees = [self._trees[body] for body in self._pairs[column]]
            answer: list[bool] = certainly_separated(
                trees, pose_a, pose_b, np.full(len(pose_a[0]), self._reach)
            ).tolist()
            return answer

        answers, which = ask_changed_poses(motion, self._pairs, frames, columns, separated)
        return ~np.array(answers, dtype=np.bool_)[which]
