"""Pairs of bodies in one frame after another, exactly; nothing is set up for a frame but the poses of bodies."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cdcore.kernels.memory import row_of
from cdcore.narrow.spacetime.block import BlockQuestion
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.spacetime.pair_job import Poses, bits_of, pad_between
from cdcore.narrow.spacetime.pose_lanes import ONE_POSE, ROWS, fill_lanes
from cdcore.narrow.spacetime.simd import LANES
from cdcore.narrow.spacetime.traverse import Workspace
from cdcore.narrow.spacetime.whole_motion import decide_motion
from cdcore.numerics import ByteArray, FloatArray, IntArray
from cdcore.protocol import Motion, Verdict

FRAME = np.zeros(1, dtype=np.int64)


class _Track(NamedTuple):
    """The pose of one body as ``PoseLanes`` keeps it, in arrays that are filled again for every frame."""

    entries: FloatArray
    path: FloatArray
    changed: ByteArray
    ranges: FloatArray
    scratch: FloatArray
    row: IntArray


def _track() -> _Track:
    entries, path, ranges = np.empty(ROWS * ONE_POSE), np.empty(ONE_POSE), np.empty(6)
    row = row_of([entries, ONE_POSE, 0, path, ranges, 1])
    return _Track(entries, path, np.ones(1, dtype=np.uint8), ranges, np.empty(2 * LANES), row)


class FrameLooks:
    """Asks about pairs (P, 2) of bodies with a tree each, in a motion of one frame."""

    def __init__(self, trees: Sequence[BoxTree], pairs: IntArray) -> None:
        self._trees, self._pairs, self._workspace = trees, pairs, Workspace()
        self._tracks = [_track() for _ in trees]
        self._sizes = [(0.0, 0.0)] * len(trees)
        self._ready: list[Motion | None] = [None] * len(trees)
        self._marks = np.zeros((2, 1), dtype=np.uint8)
        # the smaller body is moved into the larger one's frame
        larger = [trees[i].boxes[0, 15] > trees[j].boxes[0, 15] for i, j in pairs.tolist()]
        self._ends = [(j, i) if turned else (i, j) for (i, j), turned in zip(pairs.tolist(), larger, strict=True)]
        # a row holds the address of the stack, so that comes first
        for a, b in self._ends:
            self._workspace.make_room(trees[a], trees[b])
        self._rows = [self._row(a, b) for a, b in self._ends]

    def decide(self, now: Motion, column: int, _margin: float) -> tuple[int, bool]:
        """CONTACT or CLEAR for one pair, and False: to know how far it is apart costs more than to ask again."""
        a, b = self._ends[column]
        if self._ready[a] is not now:
            self._place(now, a)
        if self._ready[b] is not now:
            self._place(now, b)
        (size_a, skew_a), (size_b, skew_b) = self._sizes[a], self._sizes[b]
        pad = pad_between((self._trees[a], self._trees[b]), size_a + size_b, skew_a + skew_b)
        self._marks[0, 0] = 0
        if pad < np.inf and (self._workspace.traverse_one(self._rows[column], pad) or self._marks[0, 0]):
            return (CONTACT if self._marks[0, 0] else CLEAR), False
        # Sizes beyond the kernels and ties that only exact arithmetic decides are rare.
        poses = Poses(now.rotations, now.translations, now.valid)
        return (CONTACT if decide_motion(self._trees, self._pairs[[column]], poses).hits[0, 0] else CLEAR), False

    def _row(self, a: int, b: int) -> IntArray:
        trees = self._trees[a], self._trees[b]
        question = BlockQuestion(0, 1, 0.0, False, False, *bits_of(trees))
        row = self._workspace.row_of_pair(
            trees[0], self._tracks[a].row, trees[1], self._tracks[b].row, question, self._marks
        )
        return row.copy()

    def _place(self, now: Motion, body: int) -> None:
        tree, track = self._trees[body], self._tracks[body]
        _, _, size, skew = fill_lanes(
            now.rotations, now.translations, body, FRAME, tree.boxes[0], tree.reach, *track[:5]
        )
        self._sizes[body], self._ready[body] = (size, skew), now


CONTACT, CLEAR = int(Verdict.CONTACT), int(Verdict.CLEAR)
