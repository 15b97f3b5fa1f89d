"""Whether two faces meet at one instant of a way: exactly, on the points that count at the poses of that instant."""

from __future__ import annotations

import numpy as np

from cdcore.kernels.compiling import kernel, stay_one_function
from cdcore.kernels.memory import doubles_of, words_of
from cdcore.narrow.exact_sums import exponents_are_moderate
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.triangle_exact import pair_intersects_exact
from cdcore.narrow.triangle_filter import UNDECIDED, pair_intersects_filtered
from cdcore.numerics import FloatArray, IntArray


@kernel
def place_corners(tree: BoxTree, face: int, pose: FloatArray, pair: FloatArray, first: int) -> None:
    """World corners of a face (leaf order) at a pose (12,), rows ``first`` to ``first + 2`` of ``pair``."""
    stay_one_function()
    placed = tree.placed
    for corner in range(3):
        x, y, z = placed[face, corner], placed[face, 4 + corner], placed[face, 8 + corner]
        for k in range(3):
            total = (pose[3 * k] * x + pose[3 * k + 1] * y) + pose[3 * k + 2] * z
            pair[first + corner, k] = total + pose[9 + k]


@kernel
def faces_meet_at(
    tree_a: BoxTree, face_a: int, pose_a: FloatArray, tree_b: BoxTree, face_b: int, pose_b: FloatArray,
    pair: FloatArray, digits: IntArray,
) -> bool:  # fmt: skip
    """Whether two faces meet; False also where their exponents lie too far apart for exact sums.

    ``pair`` (6, 3) and ``digits`` are scratch.
    """
    stay_one_function()
    first = int(np.int64(0))
    place_corners(tree_a, face_a, pose_a, pair, first)
    place_corners(tree_b, face_b, pose_b, pair, first + 3)
    corners = doubles_of(pair)
    answer = pair_intersects_filtered(corners)
    if answer != UNDECIDED:
        return bool(answer == 1)
    moderate = exponents_are_moderate(corners, int(np.int64(18)))
    return bool(moderate and pair_intersects_exact(corners, words_of(digits)))
