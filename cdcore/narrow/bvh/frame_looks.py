"""The whole-motion search in one frame after the other, as a live engine asks: nothing is set up but the poses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdcore.narrow.bvh.block import COUNTERS
from cdcore.narrow.bvh.box_tree import BoxTree
from cdcore.narrow.bvh.pose_lanes import Tracks
from cdcore.narrow.bvh.traverse import Workspace
from cdcore.narrow.bvh.tree_memory import BEYOND
from cdcore.narrow.bvh.whole_motion import decide_motion, rows_of_pairs
from cdcore.numerics import IntArray
from cdcore.protocol import Motion, Verdict

CONTACT, CLEAR = int(Verdict.CONTACT), int(Verdict.CLEAR)


class FrameLooks:
    """Asks about pairs (P, 2) of bodies with a tree each, in a motion of one frame."""

    def __init__(self, trees: Sequence[BoxTree], pairs: IntArray) -> None:
        self._trees, self._pairs = trees, pairs
        self._workspace = Workspace(trees, np.zeros(COUNTERS, dtype=np.int64))
        self._tracks = Tracks(trees, np.arange(len(trees)), 1, np.ones(len(trees), dtype=np.bool_))
        self._ready: Motion | None = None
        self._marks = np.zeros((len(pairs), 3, 1), dtype=np.uint8)
        self._rows = list(rows_of_pairs(trees, pairs, self._tracks.rows, self._marks, every=False)[:, None])

    def decide(self, now: Motion, column: int, _margin: float) -> tuple[int, bool]:
        """CONTACT or CLEAR for one pair, and False: to know how far it is apart costs more than to ask again."""
        if self._ready is not now:
            self._tracks.fill(now.rotations, now.translations, now.valid)
            self._ready = now
            self._marks[:] = 0
        self._workspace.search(self._rows[column])
        hit, volumes, _ = self._marks[column, :, 0].tolist()
        if volumes == BEYOND:
            hit = decide_motion(self._trees, self._pairs[[column]], now).hits[0, 0]
        return (CONTACT if hit else CLEAR), False
