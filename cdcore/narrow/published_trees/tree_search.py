"""One search for all hierarchies: a tree per body, and which faces of two bodies meet at many poses, tests counted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from cdcore.narrow.published_trees.box_trees import TREE_KINDS
from cdcore.narrow.published_trees.tree_descent import PairPoses, search_rows
from cdcore.narrow.tree_builder import build_tree
from cdcore.narrow.triangles.sums import new_digits
from cdcore.numerics import BoolArray, FloatArray, IntArray

UNLIMITED: Final = int(np.iinfo(np.int64).max)
"""The budget of a search that runs to completion."""


class Searched(NamedTuple):
    """The result of a search at K poses.

    ``found`` (M, 4): row, face of A, face of B, and 1, or UNDECIDED where only integers can tell; in order of
    discovery. ``counts`` (K, C): tests of each row, in the order of the search's ``counters``. ``truncated`` (K,): the
    budget ended before the search did.
    """

    found: IntArray
    counts: IntArray
    truncated: BoolArray


class TreeSearch:
    """A tree of one kind, a row of ``TREE_KINDS``, over each body, and the way through two of them.

    ``corners`` (f, 3, 3) of each body, body frame.
    """

    def __init__(self, kind: str, corners: Sequence[FloatArray]) -> None:
        self._kind = TREE_KINDS[kind]
        self.undismissed = self._kind.undismissed
        self.counters = ("node_tests", "leaf_tests", *self._kind.more_counters)
        built = [build_tree(faces, self._kind.rule, self._kind.leaf_faces) for faces in corners]
        self.trees = [tree for tree, _ in built]
        # A step takes one pair from the stack and puts two, or four where both boxes are opened at once.
        self._stack = np.empty((3 * max(depth for _, depth in built) + 4, 2), dtype=np.int64)
        self._digits = new_digits()

    def search(self, a: int, b: int, poses: PairPoses, *, every: bool, budget: int) -> Searched:
        """Look for faces that meet: ``every`` one, or the first; at most ``budget`` node and leaf tests a row."""
        counts = np.zeros((len(poses.pad), len(self.counters)), dtype=np.int64)
        truncated = np.zeros(len(poses.pad), dtype=np.uint8)
        found = search_rows(
            self._kind.search, self.trees[a], self.trees[b], poses, every, budget, self._stack, self._digits, counts,
            truncated,
        )  # fmt: skip
        return Searched(found, counts, truncated.view(np.bool_))
