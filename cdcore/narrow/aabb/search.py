"""The search through two trees of world boxes, body pair by body pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdcore.narrow.aabb.traverse import search_rows
from cdcore.narrow.exact_sums import new_digits
from cdcore.narrow.level_tree import extents, grow_tree
from cdcore.narrow.pair_search import PairPoses, Searched
from cdcore.numerics import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class WorldBoxTree:
    """Which faces share a box; the boxes themselves belong to a pose.

    Parameters
    ----------
    corners : (f, 3, 3), body frame.
    child : (n,) first of two neighbouring children, -1 at a leaf.
    leaf : (n,) the one face of a leaf.
    depth : levels.
    """

    corners: FloatArray
    child: IntArray
    leaf: IntArray
    depth: int


def build_world_box_tree(corners: FloatArray) -> WorldBoxTree:
    """Cut at the median of the centroids along the longest side of their box; one face a leaf."""
    centroids = corners[:, 0] / 3 + corners[:, 1] / 3 + corners[:, 2] / 3

    def along_longest_side(faces: IntArray, node: IntArray, first: IntArray) -> FloatArray:
        low, high = extents(centroids[faces, None], first)
        keys: FloatArray = centroids[faces, np.argmax(high / 2 - low / 2, axis=1)[node]]
        return keys

    shape = grow_tree(len(corners), 1, along_longest_side, balanced=True)
    return WorldBoxTree(corners, shape.child, shape.order[shape.start], shape.depth)


class AabbSearch:
    """Boxes refitted to each pose; needs no pad, costs all faces of both bodies once a pose."""

    counters: ClassVar[tuple[str, ...]] = ("node_tests", "leaf_tests", "boxes_fitted")

    def __init__(self, corners: Sequence[FloatArray]) -> None:
        self.trees = [build_world_box_tree(one) for one in corners]

    def search(self, a: int, b: int, poses: PairPoses, *, every: bool, budget: int) -> Searched:
        """Faces that meet in each pose."""
        first, second = self.trees[a], self.trees[b]
        counts = np.zeros((len(poses.pad), 3), dtype=np.int64)
        truncated = np.zeros(len(poses.pad), dtype=np.uint8)
        stack = np.empty((first.depth + second.depth + 2, 2), dtype=np.int64)
        found = search_rows(
            first.corners, first.child, first.leaf, second.corners, second.child, second.leaf, stack, poses.turn_a,
            poses.move_a, poses.turn_b, poses.move_b, every, budget, new_digits(), counts, truncated,
        )  # fmt: skip
        return Searched(found, counts, truncated.astype(np.bool_))
