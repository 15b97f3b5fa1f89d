"""RAPID's descent: test two boxes on fifteen axes, open the larger, first child first, one face against one face.

Source: S. Gottschalk, M. C. Lin, D. Manocha, OBBTree (1996), section 5.
"""

from __future__ import annotations

import numpy as np

from cdcore.kernels.box_axes import apart_on_all_axes, box_seen_from, pose_seen_from
from cdcore.kernels.compiling import kernel
from cdcore.narrow.face_pair import faces_meet, keep_found
from cdcore.narrow.rapid_style.tree import RapidTree
from cdcore.numerics import ByteArray, FloatArray, IntArray


@kernel
def search_rows(  # noqa: C901 - one loop with its stack
    tree_a: RapidTree, tree_b: RapidTree, stack: IntArray, turn_a: FloatArray, move_a: FloatArray, turn_b: FloatArray,
    move_b: FloatArray, pad: FloatArray, every: bool, budget: int, digits: IntArray, counts: IntArray,
    truncated: ByteArray,
) -> IntArray:  # fmt: skip
    """Faces that meet, (M, 4), in K poses."""
    turn, move, m, d = np.empty((3, 3)), np.empty(3), np.empty((3, 3)), np.empty(3)
    pair = np.empty((6, 3))
    found, known = np.empty((64, 4), dtype=np.int64), 0
    for row in range(len(pad)):
        pose_seen_from(turn_a[row], move_a[row], turn_b[row], move_b[row], turn, move)
        tests, depth = 0, 1
        stack[0, 0], stack[0, 1] = 0, 0
        while depth > 0:
            if tests == budget:
                truncated[row] = 1
                break
            depth -= 1
            a, b = stack[depth, 0], stack[depth, 1]
            tests += 1
            counts[row, 0] += 1
            box_seen_from(tree_a.centre[a], tree_a.axes[a], tree_b.centre[b], tree_b.axes[b], turn, move, m, d)
            if apart_on_all_axes(m, d, tree_a.half[a], tree_b.half[b], pad[row]):
                continue
            first_a, first_b = tree_a.child[a], tree_b.child[b]
            if first_a < 0 and first_b < 0:
                if tests == budget:
                    truncated[row] = 1
                    break
                tests += 1
                counts[row, 1] += 1
                face_a, face_b = tree_a.leaf[a], tree_b.leaf[b]
                answer = faces_meet(
                    tree_a.corners, face_a, turn_a[row], move_a[row], tree_b.corners, face_b, turn_b[row],
                    move_b[row], pair, digits,
                )  # fmt: skip
                if answer != 0:
                    found = keep_found(found, known, row, face_a, face_b, answer)
                    known += 1
                    if answer == 1 and not every:
                        break
                continue
            open_a = first_b < 0 or (first_a >= 0 and tree_a.size[a] > tree_b.size[b])
            for k in range(2):
                stack[depth, 0] = first_a + 1 - k if open_a else a
                stack[depth, 1] = b if open_a else first_b + 1 - k
                depth += 1
    return found[:known]
