"""The search through two trees of oriented boxes, body pair by body pair."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from cdcore.narrow.exact_sums import new_digits
from cdcore.narrow.obb.traverse import search_rows
from cdcore.narrow.obb.tree import build_obb_tree
from cdcore.narrow.pair_search import PairPoses, Searched
from cdcore.numerics import FloatArray


class ObbSearch:
    """Boxes fitted once, fifteen axes a test, leaves of up to four faces."""

    counters: ClassVar[tuple[str, ...]] = ("node_tests", "leaf_tests")

    def __init__(self, corners: Sequence[FloatArray]) -> None:
        built = [build_obb_tree(one) for one in corners]
        self.trees = [tree for tree, _ in built]
        self._depths = [depth for _, depth in built]

    def search(self, a: int, b: int, poses: PairPoses, *, every: bool, budget: int) -> Searched:
        """Faces that meet in each pose."""
        counts = np.zeros((len(poses.pad), 2), dtype=np.int64)
        truncated = np.zeros(len(poses.pad), dtype=np.uint8)
        # a step takes one pair from the stack and puts at most four
        stack = np.empty((3 * max(self._depths[a], self._depths[b]) + 4, 2), dtype=np.int64)
        found = search_rows(
            self.trees[a], self.trees[b], stack, poses.turn_a, poses.move_a, poses.turn_b, poses.move_b, poses.pad,
            every, budget, new_digits(), counts, truncated,
        )  # fmt: skip
        return Searched(found, counts, truncated.astype(np.bool_))
