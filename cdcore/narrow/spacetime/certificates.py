"""The debug mode of the whole-motion search: tests every dismissed pair again, face by face in exact arithmetic."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.spacetime.block import BY_BOX, BY_SPAN
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.spacetime.simd import LANES
from cdcore.numerics import FloatArray, IntArray

FramePlacer = Callable[[int], tuple[FloatArray, FloatArray]]
"""Distinct frame -> world triangles of A and of B, by face number."""


class FalseDismissalError(AssertionError):
    """A certificate was wrong: a defect of this package, never of the input. Report it with the session."""


def count_verified(trees: tuple[BoxTree, BoxTree], records: IntArray, placed: FramePlacer) -> int:
    """Number of dismissals asked again, all of them right.

    ``records`` (4 m,): kind, frame, lanes or last frame, nodes, as the traversal notes them.

    Raises
    ------
    FalseDismissalError
        Two faces meet that a certificate had kept apart; names frame and faces.
    """
    verified = 0
    rows = records.reshape(-1, 4)
    for kind, first, extent, nodes in rows[rows[:, 0] <= BY_SPAN].tolist():
        frames = [first + k for k in range(LANES) if extent >> k & 1] if kind == BY_BOX else range(first, extent + 1)
        below = [faces_below(tree, node) for tree, node in zip(trees, (nodes >> 32, nodes & 0xFFFFFFFF), strict=True)]
        for frame in frames:
            a, b = placed(frame)
            meet = meeting_faces_exhaustive(a[below[0]], b[below[1]])
            if len(meet):
                faces = below[0][meet[0, 0]], below[1][meet[0, 1]]
                raise FalseDismissalError(f"distinct frame {frame}: faces {faces[0]} and {faces[1]} meet, kind {kind}")
            verified += 1
    return verified


def faces_below(tree: BoxTree, node: int) -> IntArray:
    """Faces, by their number in the mesh, in the leaves below a node."""
    todo, found = [node], []
    while todo:
        child, leaf = tree.links[todo.pop()].tolist()
        if leaf >= 0:
            start, count = tree.leaves[leaf, :2].tolist()
            found.append(tree.faces[start : start + count])
        else:
            todo += [child, child + 1]
    return np.sort(np.concatenate(found)).astype(np.int64)
