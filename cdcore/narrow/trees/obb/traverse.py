"""A tree of oriented boxes that turn with their body: fifteen axes decide about two of them, else both are opened.

A box lies along the principal axes of its faces or along the body's axes, whichever box has the smaller surface.
"""

from typing import Final, NamedTuple

import numpy as np

from cdcore.kernels.box_axes import apart_on_all_axes, box_seen_from, pose_seen_from
from cdcore.kernels.compiling import kernel
from cdcore.narrow.face_pair import faces_meet, keep_found
from cdcore.narrow.level_tree import extents, grow_tree
from cdcore.numerics import ByteArray, FloatArray, IntArray

LEAF_FACES: Final = 4
"""A box test costs about as much as three face tests that planes dismiss, so leaves of several faces pay."""


class ObbTree(NamedTuple):
    """Boxes of n nodes in the body's frame.

    ``corners`` (f, 3, 3) faces in the order of the leaves, ``number`` (f,) their numbers in the mesh; ``child`` (n,)
    first of two neighbouring children or -1; ``start``, ``stop`` (n,) a node's faces; ``centre`` (n, 3), ``axes``
    (n, 3, 3) one axis a row, ``half`` (n, 3).
    """

    corners: FloatArray
    number: IntArray
    child: IntArray
    start: IntArray
    stop: IntArray
    centre: FloatArray
    axes: FloatArray
    half: FloatArray


def build_obb_tree(corners: FloatArray) -> tuple[ObbTree, int]:
    """Cut at the median of the centroids along the longest side of the box; the tree and its depth."""
    size = float(np.abs(corners).max())
    # Divided by their size, so that the covariance of a mesh of 1e-200 m neither vanishes nor overflows.
    scaled = corners / size if size > 0 else corners
    boxes: list[tuple[FloatArray, FloatArray, FloatArray]] = []

    def fit(faces: IntArray, node: IntArray, first: IntArray) -> FloatArray:
        axes, low, high = _tighter_boxes(scaled[faces], node, first)
        boxes.append((axes, low, high))
        longest = axes[np.arange(len(first)), np.argmax(high - low, axis=1)]
        return np.einsum("eci,ei->e", scaled[faces], longest[node])

    shape = grow_tree(len(corners), LEAF_FACES, fit, balanced=True)
    axes, low, high = (np.concatenate(part) for part in zip(*boxes, strict=True))
    unit = size if size > 0 else 1.0
    centre = np.einsum("nki,nk->ni", axes, low / 2 + high / 2) * unit
    ordered = np.ascontiguousarray(corners[shape.order])
    tree = ObbTree(
        ordered, shape.order, shape.child, shape.start, shape.stop, centre, axes, (high / 2 - low / 2) * unit
    )
    return tree, shape.depth


def _tighter_boxes(corners: FloatArray, node: IntArray, first: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Axes (n, 3, 3) and extents along them (n, 3) of n nodes; ``corners`` (E, 3, 3) of their faces, node by node."""
    sizes = np.diff(first, append=len(node))[:, None]
    mean = np.add.reduceat(corners.mean(axis=1), first) / sizes
    spread = corners - mean[node][:, None]
    covariance = np.add.reduceat(np.einsum("eci,ecj->eij", spread, spread), first)
    principal = np.ascontiguousarray(np.linalg.eigh(covariance)[1].transpose(0, 2, 1))
    body = np.broadcast_to(np.eye(3), principal.shape)
    turned = extents(np.einsum("eci,eki->eck", corners, principal[node]), first)
    straight = extents(corners, first)
    tighter = _half_surface(*turned) < _half_surface(*straight)
    low, high = (np.where(tighter[:, None], one, other) for one, other in zip(turned, straight, strict=True))
    return np.where(tighter[:, None, None], principal, body), low, high


def _half_surface(low: FloatArray, high: FloatArray) -> FloatArray:
    x, y, z = (high - low).T
    return x * y + y * z + z * x


@kernel
def search_rows(  # noqa: C901 - one loop with its stack
    tree_a: ObbTree, tree_b: ObbTree, stack: IntArray, turn_a: FloatArray, move_a: FloatArray, turn_b: FloatArray,
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
            if first_a >= 0 or first_b >= 0:
                for k in range(2 if first_a >= 0 else 1):
                    for l in range(2 if first_b >= 0 else 1):  # noqa: E741 - k of A, l of B
                        stack[depth, 0] = first_a + k if first_a >= 0 else a
                        stack[depth, 1] = first_b + l if first_b >= 0 else b
                        depth += 1
                continue
            done = False
            for face_a in range(tree_a.start[a], tree_a.stop[a]):
                for face_b in range(tree_b.start[b], tree_b.stop[b]):
                    if tests == budget:
                        truncated[row] = 1
                        done = True
                        break
                    tests += 1
                    counts[row, 1] += 1
                    answer = faces_meet(
                        tree_a.corners, face_a, turn_a[row], move_a[row], tree_b.corners, face_b, turn_b[row],
                        move_b[row], pair, digits,
                    )  # fmt: skip
                    if answer != 0:
                        found = keep_found(found, known, row, tree_a.number[face_a], tree_b.number[face_b], answer)
                        known += 1
                        if answer == 1 and not every:
                            done = True
                            break
                if done:
                    break
            if done:
                break
    return found[:known]
