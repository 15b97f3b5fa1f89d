"""Why two bodies are apart in a frame: how the search went, as a string of steps that a reader can walk again.

A front is a walk through both trees, from both roots: ``X`` two nodes are apart, ``F`` their faces were asked, ``A`` or
``B`` the children of the first or second node take its place, the second child first. Nothing is left out on such a
walk, so it is a proof as soon as every ``X`` and ``F`` is checked.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import numpy as np

from cdcore.narrow.spacetime.block import ASKED, BY_BOX, BY_SPAN, OPEN_A, OPEN_B
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.spacetime.pair_job import PairJob, Poses
from cdcore.narrow.spacetime.simd import LANES
from cdcore.narrow.spacetime.traverse import Workspace
from cdcore.numerics import FloatArray, IntArray

SLACK: Final = 2.0**-20
"""What a front keeps beside rounding, as a share of the size: whoever checks it may round axes to float32."""
FRAMES_AT_ONCE: Final = 4096
"""Bounds the list of steps: 1,000 a frame, as between close bodies of 50,000 faces, make 130 MB."""
APART: Final = b"X"
EVERY_FACE: Final = b"F"
"""The front where sizes are not for the kernels: all faces are to be asked."""


class PairFronts:
    """Fronts of one pair; ``nodes``: the nodes of each body's tree that they speak of, the roots among them."""

    def __init__(self, trees: tuple[BoxTree, BoxTree]) -> None:
        self._trees, self._workspace = trees, Workspace()
        self._seen = tuple(np.zeros(len(tree.links), dtype=np.bool_) for tree in trees)
        for seen in self._seen:
            seen[0] = True

    @property
    def nodes(self) -> tuple[IntArray, IntArray]:
        """Numbers of the nodes of both trees."""
        first, second = (np.flatnonzero(seen) for seen in self._seen)
        return first, second

    def of(self, rotations: FloatArray, translations: FloatArray) -> tuple[list[bytes], IntArray]:
        """Fronts of K frames without contact, from (K, 2, 3, 3) and (K, 2, 3), and which of them is each frame's."""
        count = len(rotations)
        poses = Poses(rotations, translations, np.ones((count, 2), dtype=np.bool_))
        job = PairJob(self._trees, 0, 1, poses, [None, None], faces=False, verify=False, slack=SLACK)
        fronts = [APART] * job.count
        for start in range(0, job.count, FRAMES_AT_ONCE):
            stop = min(start + FRAMES_AT_ONCE, job.count)
            records = job.records(start, stop, self._workspace)
            if records is None:
                fronts[start:stop] = [EVERY_FACE] * (stop - start)
            else:
                self._walk(job.turned, records, fronts)
        return fronts, job.which

    def _walk(self, turned: bool, records: IntArray, fronts: list[bytes]) -> None:
        """Put down the fronts of the frames that were searched; others are apart."""
        steps = records[(records[:, 0] == BY_BOX) | (records[:, 0] > BY_SPAN)]
        sides = [steps[:, 3] >> 32, steps[:, 3] & 0xFFFFFFFF]
        for seen, nodes in zip(self._seen[:: -1 if turned else 1], sides, strict=True):
            seen[nodes] = True
        letters = np.zeros(ASKED + 1, dtype=np.uint8)
        letters[[BY_BOX, OPEN_A, OPEN_B, ASKED]] = [*(b"XBAF" if turned else b"XABF")]
        letter, lanes = letters[steps[:, 0]], (steps[:, 2, None] >> np.arange(LANES) & 1).astype(np.bool_)
        # the steps of a block of frames follow each other
        border = np.flatnonzero(np.diff(steps[:, 1], prepend=-1, append=-1)).tolist()
        for low, high in pairwise(border):
            first = int(steps[low, 1])
            for lane in np.flatnonzero(lanes[low:high].any(axis=0)).tolist():
                fronts[first + lane] = letter[low:high][lanes[low:high, lane]].tobytes()
