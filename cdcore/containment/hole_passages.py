"""In which intervals does a body pass through a hole of another, without touching its surface?

Containment is asked at the frames. A body that is outside at both ends of an interval may have been inside between
them, if a hole let it in and out; then it met the cap of that hole on the way.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from cdcore.containment.containment_stage import ContainmentStage, WindingQuestion
from cdcore.narrow.continuous.interval_search import FREE
from cdcore.narrow.continuous.segment_stage import SegmentStage
from cdcore.narrow.pair_frames import rows_of_columns
from cdcore.numerics import ByteArray, IntArray
from cdcore.protocol import Motion, Verdict


class HolePassages:
    """Searches intervals for a body that meets the cap of a hole of the other one.

    ``pairs`` (P, 2): as for ``SegmentStage``, which also takes ``tolerance``, metres, and ``effort``.
    """

    def __init__(self, containment: ContainmentStage, pairs: IntArray, *, tolerance: float, effort: int) -> None:
        self._containment, self._pairs = containment, pairs
        self._tolerance, self._effort = tolerance, effort

    def mark(self, motion: Motion, frames: IntArray, columns: IntArray, verdict: ByteArray) -> int:
        """Mark as UNRESOLVED in ``verdict`` (T, P) those of K intervals in which a body passes through a hole.

        Row t is the interval from frame t-1 to t. Only those that are CLEAR so far are searched; returns how many.
        """
        if not self._searches:
            return 0
        poses = motion.rotations, motion.translations
        count = 0
        for column, rows in rows_of_columns(columns):
            for search in self._searches.get(column, []):
                clear = frames[rows][verdict[frames[rows], column] == Verdict.CLEAR]
                answer = search.decide(motion.times, *poses, clear, np.zeros_like(clear))
                verdict[clear[answer.states != FREE], column] = Verdict.UNRESOLVED
                count += len(clear)
        return count

    @cached_property
    def _searches(self) -> dict[int, list[SegmentStage]]:
        """Searches for meetings with caps, for each pair with a hole by its column, one a body with holes."""
        questions = self._containment.winding_questions
        return {
            column: [self._search(column, question) for question in questions[column] if question.has_caps]
            for column in self._containment.holed
        }

    def _search(self, column: int, question: WindingQuestion) -> SegmentStage:
        """Searches the intervals of a pair for meetings of the inner body with caps of the outer one."""
        pair = self._pairs[column : column + 1]
        return SegmentStage(question.cap_trees, pair, tolerance=self._tolerance, effort=self._effort)
