"""RAPID's tree and its descent: boxes along the principal axes of the surface, cut through its mean.

Two boxes are tested on fifteen axes; the larger is opened, its first child first; a leaf is one face.

Source: S. Gottschalk, M. C. Lin, D. Manocha, OBBTree: a hierarchical structure for rapid interference detection (1996),
sections 4 and 5. Differs: the covariance is that of the triangles themselves, as in the library, not of their convex
hull.
"""

from typing import NamedTuple

import numpy as np

from cdcore.kernels.box_axes import apart_on_all_axes, box_seen_from, pose_seen_from
from cdcore.kernels.compiling import kernel
from cdcore.narrow.face_pair import faces_meet, keep_found
from cdcore.narrow.level_tree import extents, grow_tree
from cdcore.numerics import ByteArray, FloatArray, IntArray


class RapidTree(NamedTuple):
    """Boxes of n nodes in the body's frame, one face a leaf.

    ``corners`` (f, 3, 3); ``child`` (n,) first of two neighbouring children or -1; ``leaf`` (n,) face of a leaf;
    ``centre`` (n, 3), ``axes`` (n, 3, 3) one axis a row, ``half`` (n, 3) largest first, ``size`` (n,) longest half.
    """

    corners: FloatArray
    child: IntArray
    leaf: IntArray
    centre: FloatArray
    axes: FloatArray
    half: FloatArray
    size: FloatArray


def build_rapid_tree(corners: FloatArray) -> tuple[RapidTree, int]:
    """The tree and its depth."""
    scale = float(np.abs(corners).max())
    scaled = corners / scale if scale > 0 else corners
    area, centroid, second = _moments(scaled)
    boxes: list[tuple[FloatArray, FloatArray, FloatArray]] = []

    def fit(faces: IntArray, node: IntArray, first: IntArray) -> FloatArray:
        mean, covariance = _statistics(area[faces], centroid[faces], second[faces], first)
        axes = np.ascontiguousarray(np.linalg.eigh(covariance)[1].transpose(0, 2, 1)[:, ::-1])
        boxes.append((axes, *extents(np.einsum("eci,eki->eck", scaled[faces], axes[node]), first)))
        return np.einsum("ei,ei->e", centroid[faces] - mean[node], axes[node, 0])

    shape = grow_tree(len(corners), 1, fit, balanced=False)
    axes, low, high = (np.concatenate(part) for part in zip(*boxes, strict=True))
    unit = scale if scale > 0 else 1.0
    centre = np.einsum("nki,nk->ni", axes, low / 2 + high / 2) * unit
    half = (high / 2 - low / 2) * unit
    tree = RapidTree(corners, shape.child, shape.order[shape.start], centre, axes, half, half.max(axis=1))
    return tree, shape.depth


def _moments(corners: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Area (f,), centroid (f, 3) and second moment about the origin per unit of area (f, 3, 3) of triangles."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1) / 2
    centroid = corners.mean(axis=1)
    outer = np.einsum("fci,fcj->fij", corners, corners)
    return area, centroid, (9 * centroid[:, :, None] * centroid[:, None, :] + outer) / 12


def _statistics(
    area: FloatArray, centroid: FloatArray, second: FloatArray, first: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Mean (n, 3) and covariance (n, 3, 3) of the surface of n nodes; faces without area count alike."""
    sizes = np.diff(first, append=len(area))
    flat = np.repeat(np.add.reduceat(area, first) <= 0.0, sizes)
    weight = np.where(flat, 1.0, area)
    total = np.add.reduceat(weight, first)
    mean = np.add.reduceat(weight[:, None] * centroid, first) / total[:, None]
    moment = np.add.reduceat(weight[:, None, None] * second, first) / total[:, None, None]
    return mean, moment - mean[:, :, None] * mean[:, None, :]


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
