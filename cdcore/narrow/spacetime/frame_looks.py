"""Pairs of bodies in one frame after another, exactly; nothing is set up for a frame but the poses of bodies."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from cdcore.narrow.spacetime.block import COUNTERS, BlockQuestion
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.spacetime.pair_job import Poses, bits_of, pad_between
from cdcore.narrow.spacetime.pose_lanes import Tracks, ends_of
from cdcore.narrow.spacetime.traverse import Workspace
from cdcore.narrow.spacetime.undecided import decide_by_integers
from cdcore.narrow.spacetime.whole_motion import decide_motion
from cdcore.numerics import IntArray, readonly
from cdcore.protocol import Motion, Verdict

FRAME = np.zeros(1, dtype=np.int64)
ONE_PLACE = readonly(np.eye(3)[None, None]), readonly(np.zeros((1, 1, 3)))


class FrameLooks:
    """Asks about pairs (P, 2) of bodies with a tree each, in a motion of one frame."""

    def __init__(self, trees: Sequence[BoxTree], pairs: IntArray) -> None:
        self._trees, self._pairs, self._workspace = trees, pairs, Workspace()
        self._tracks = [Tracks(*ONE_PLACE, FRAME, FRAME, ends_of([tree])) for tree in trees]
        self._numbers = np.arange(len(trees))[:, None]
        self._ready: list[Motion | None] = [None] * len(trees)
        self._marks, self._work = np.zeros((2, 1), dtype=np.uint8), np.zeros(COUNTERS, dtype=np.int64)
        # the smaller body is moved into the larger one's frame
        larger = [trees[i].boxes[0, 15] > trees[j].boxes[0, 15] for i, j in pairs.tolist()]
        self._ends = [(j, i) if turned else (i, j) for (i, j), turned in zip(pairs.tolist(), larger, strict=True)]
        # a row holds the address of the stack, so that comes first
        self._workspace.make_room(trees)
        self._rows = [self._row(a, b) for a, b in self._ends]

    def decide(self, now: Motion, column: int, _margin: float) -> tuple[int, bool]:
        """CONTACT or CLEAR for one pair, and False: to know how far it is apart costs more than to ask again."""
        a, b = self._ends[column]
        if self._ready[a] is not now:
            self._place(now, a)
        if self._ready[b] is not now:
            self._place(now, b)
        (size_a, skew_a, _), (size_b, skew_b, _) = (self._tracks[k].found[0].tolist() for k in (a, b))
        pad = pad_between((self._trees[a], self._trees[b]), size_a + size_b, skew_a + skew_b)
        self._marks[0, 0] = 0
        if pad < np.inf:
            self._workspace.traverse_one(self._rows[column], pad, partial(self._settle, a, b))
            return (CONTACT if self._marks[0, 0] else CLEAR), False
        # Sizes beyond the kernels are rare.
        poses = Poses(now.rotations, now.translations, now.valid)
        return (CONTACT if decide_motion(self._trees, self._pairs[[column]], poses).hits[0, 0] else CLEAR), False

    def _row(self, a: int, b: int) -> IntArray:
        trees, tracks = (self._trees[a], self._trees[b]), (self._tracks[a], self._tracks[b])
        question = BlockQuestion(0, 1, 0.0, False, *bits_of(trees))
        rows = (trees[0].row, trees[1].row), (tracks[0].rows, tracks[1].rows)
        return self._workspace.rows_of(*rows, question, self._marks[None], self._work)

    def _settle(self, a: int, b: int, _row: int, keys: IntArray) -> IntArray:
        trees, lanes = (self._trees[a], self._trees[b]), (self._tracks[a][0], self._tracks[b][0])
        return decide_by_integers(keys, bits_of(trees), 0, trees, lanes, self._marks[0])

    def _place(self, now: Motion, body: int) -> None:
        self._tracks[body].fill(now.rotations, now.translations, self._numbers[body], FRAME)
        self._ready[body] = now


CONTACT, CLEAR = int(Verdict.CONTACT), int(Verdict.CLEAR)
