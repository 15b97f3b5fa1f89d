"""SOLID's search, body pair by body pair."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from cdcore.narrow.exact_sums import new_digits
from cdcore.narrow.pair_search import PairPoses, Searched
from cdcore.narrow.solid_style.traverse import search_rows
from cdcore.narrow.solid_style.tree import build_solid_tree
from cdcore.numerics import FloatArray


class SolidSearch:
    """Trees in the bodies' frames, six axes a test, GJK with a cached separating axis at the leaves.

    The axis is kept from leaf to leaf and from pose to pose within one call.
    """

    counters: ClassVar[tuple[str, ...]] = ("node_tests", "leaf_tests", "cache_hits", "gjk_steps", "exact_tests")

    def __init__(self, corners: Sequence[FloatArray]) -> None:
        built = [build_solid_tree(one) for one in corners]
        self.trees = [tree for tree, _ in built]
        self._depths = [depth for _, depth in built]

    def search(self, a: int, b: int, poses: PairPoses, *, every: bool, budget: int) -> Searched:
        """Faces that meet in each pose."""
        counts = np.zeros((len(poses.pad), len(self.counters)), dtype=np.int64)
        truncated = np.zeros(len(poses.pad), dtype=np.uint8)
        stack = np.empty((self._depths[a] + self._depths[b] + 2, 2), dtype=np.int64)
        found = search_rows(
            self.trees[a], self.trees[b], stack, poses.turn_a, poses.move_a, poses.turn_b, poses.move_b, poses.pad,
            every, budget, new_digits(), counts, truncated,
        )  # fmt: skip
        return Searched(found, counts, truncated.astype(np.bool_))
