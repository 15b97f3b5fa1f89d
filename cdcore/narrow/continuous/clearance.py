"""Whether two surfaces at rest certainly keep a distance: the search between frames, of a path without motion.

Where the nearest features are a face, edges or corners, a direction that the search tries lies along the distance. So
what is apart by more than a reach is proven, but for rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cdcore.kernels.compiling import kernel
from cdcore.kernels.memory import integers_of
from cdcore.narrow.bvh.box_tree import BoxTree
from cdcore.narrow.continuous.interval_search import make_room, nodes_left, search_at
from cdcore.narrow.pair_frames import Poses, ask_changed_poses
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.poses import relative_pose
from cdcore.protocol import Motion


class ClearanceSearch:
    """Asks whether two surfaces, a tree each, certainly keep a distance; in memory of its own, so one a thread."""

    def __init__(self, tree_a: BoxTree, tree_b: BoxTree) -> None:
        room = make_room(tree_a, tree_b, most_items=0)
        # Kept because the row names them by address; to make both takes longer than most searches.
        self._memory = tree_a, tree_b, room
        self._row = room.search_row(tree_a, tree_b)

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy has memory of its own."""
        return ClearanceSearch, self._memory[:2]

    def separated(self, pose_a: Poses, pose_b: Poses, reach: FloatArray) -> BoolArray:
        """Whether the surfaces keep more than ``reach`` (K,), metres, at each of K poses of both, (K,)."""
        (rotation_a, move_a), (rotation_b, move_b) = pose_a, pose_b
        rotation, move = relative_pose(rotation_b, move_b, rotation_a, move_a)
        poses = np.concatenate([rotation.reshape(-1, 9), move], axis=1)
        separated = np.empty(len(reach), dtype=np.bool_)
        keep_reach(self._row, poses, reach, separated)
        return separated


@kernel
def keep_reach(search_row: IntArray, poses: FloatArray, reach: FloatArray, separated: BoolArray) -> None:
    """Fill ``separated`` (K,) for poses (K, 12) of A seen from B; a room without items ends it at the first."""
    search = search_at(integers_of(search_row), 0)
    for k in range(len(poses)):
        for entry in range(12):
            search.poses[entry] = search.poses[12 + entry] = poses[k, entry]
        separated[k] = nodes_left(search, 0.0, reach[k], 0.0, 0, 0, 0) == 0


class ContactOffset:
    """Asks whether surfaces of ``pairs`` (P, 2) that do not meet are at most ``reach`` metres apart; a tree a body.

    Distances are computed in floats: between 1e-9 of the bodies' size below and above the reach either may be said.
    """

    def __init__(self, trees: Sequence[BoxTree], pairs: IntArray, reach: float) -> None:
        self._trees, self._pairs, self._reach = trees, np.sort(pairs, axis=1), reach
        self._idle = [list[ClearanceSearch]() for _ in pairs]

    def near(self, motion: Motion, frames: IntArray, columns: IntArray) -> BoolArray:
        """Marks the pair-frames without contact that are within reach, (K,)."""

        def separated(column: int, pose_a: Poses, pose_b: Poses) -> list[bool]:
            idle = self._idle[column]
            search = idle.pop() if idle else ClearanceSearch(*(self._trees[body] for body in self._pairs[column]))
            answer: list[bool] = search.separated(pose_a, pose_b, np.full(len(pose_a[0]), self._reach)).tolist()
            idle.append(search)
            return answer

        answers, which = ask_changed_poses(motion, self._pairs, frames, columns, separated)
        return ~np.array(answers, dtype=np.bool_)[which]
