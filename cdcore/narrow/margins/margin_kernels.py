"""Float bounds of clearance and penetration that are always on the safe side; integers decide what they leave open.

``overlap_bounds`` looks along the eleven axes of two triangles, ``certainly_apart`` at two trees over many poses.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdcore.kernels.box_axes import apart_on_face_axes, box_seen_from
from cdcore.kernels.compiling import hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, doubles_of
from cdcore.numerics import EPS, BoolArray, FloatArray

if TYPE_CHECKING:
    from cdcore.narrow.bvh.box_tree import BoxTree

PROJECTION_ULPS = 16.0
"""Rounding of a difference, a dot product and a division, in eps of the triangles' extent."""
DIRECTION_ULPS = 64.0
"""Rounding of a cross product turns an axis: by this many eps of the edges' lengths over the product's."""
PARALLEL = 1e-9
"""Edges whose cross product is shorter than this share of their lengths count as parallel. Their axis, if they have
one, is across both; and across a common edge the least overlap is along a face's normal, so it adds nothing."""
PARALLEL_PAD = 1e-8
"""Of the extent: covers the angle below which edges count as parallel."""
POSE_ULPS = 256.0
"""Rounding of a relative pose beside the reference vertices, in eps of the bodies' coordinates in the world."""


@kernel
def overlap_bounds(pairs: FloatArray, low: FloatArray, high: FloatArray, apart: FloatArray) -> None:
    """Fill for each pair (n, 6, 3): bounds of its least overlap along the axes, and a distance it certainly keeps."""
    axes, points = np.empty((11, 4)), np.empty((6, 3))
    for pair in range(len(pairs)):
        low[pair], high[pair], apart[pair] = _bounds(pairs[pair], axes, points)


@hot_kernel
def _bounds(corners: FloatArray, axes: FloatArray, points: FloatArray) -> tuple[float, float, float]:
    """Lower and upper bound of the least overlap, and a lower bound of the distance."""
    stay_one_function()
    extent = 0.0
    for corner in range(6):
        for k in range(3):
            points[corner, k] = corners[corner, k] - corners[0, k]
            extent = max(extent, abs(points[corner, k]))
    extent *= 2.0
    _fill_axes(points, axes)
    low, high, apart, pad = np.inf, np.inf, -np.inf, 0.0
    for axis in range(11):
        x, y, z, lengths = axes[axis, 0], axes[axis, 1], axes[axis, 2], axes[axis, 3]
        length = np.sqrt(x * x + y * y + z * z)
        if not length > PARALLEL * lengths:
            if axis < 2:
                low = -np.inf
            pad = PARALLEL_PAD * extent
            continue
        overlap = _overlap_along(points, x, y, z) / length
        rounding = PROJECTION_ULPS * EPS * extent
        turning = DIRECTION_ULPS * EPS * extent * lengths / length
        low = min(low, overlap - rounding - turning)
        high = min(high, overlap + rounding + turning)
        apart = max(apart, -overlap - rounding)
    return low - pad, high, apart


@hot_kernel
def _fill_axes(points: FloatArray, axes: FloatArray) -> None:
    """Two normals and nine cross products of edges; beside each the product of the edges' lengths."""
    stay_one_function()
    _cross_of(points, 1, 0, 2, 0, axes[0])
    _cross_of(points, 4, 3, 5, 3, axes[1])
    for i in range(3):
        for j in range(3):
            _cross_of(points, (i + 1) % 3, i, 3 + (j + 1) % 3, 3 + j, axes[2 + 3 * i + j])


@hot_kernel
def _cross_of(points: FloatArray, a: int, b: int, c: int, d: int, axis: FloatArray) -> None:
    stay_one_function()
    ux, uy, uz = points[a, 0] - points[b, 0], points[a, 1] - points[b, 1], points[a, 2] - points[b, 2]
    vx, vy, vz = points[c, 0] - points[d, 0], points[c, 1] - points[d, 1], points[c, 2] - points[d, 2]
    axis[0], axis[1], axis[2] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    axis[3] = np.sqrt((ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz))


@hot_kernel
def _overlap_along(points: FloatArray, x: float, y: float, z: float) -> float:
    stay_one_function()
    low_a, high_a, low_b, high_b = np.inf, -np.inf, np.inf, -np.inf
    for corner in range(3):
        along = points[corner, 0] * x + points[corner, 1] * y + points[corner, 2] * z
        low_a, high_a = min(low_a, along), max(high_a, along)
        along = points[3 + corner, 0] * x + points[3 + corner, 1] * y + points[3 + corner, 2] * z
        low_b, high_b = min(low_b, along), max(high_b, along)
    return min(high_a - low_b, high_b - low_a)


class Boxes(NamedTuple):
    """Boxes of n nodes as the axes tests read them: centre (n, 3), axes (n, 3, 3) one a row, half (n, 3), size (n,)."""

    centre: FloatArray
    axes: FloatArray
    half: FloatArray
    size: FloatArray


def boxes_of(tree: BoxTree) -> Boxes:
    """The boxes of a tree."""
    boxes = tree.boxes
    parts = boxes[:, :3], boxes[:, 3:12].reshape(-1, 3, 3).swapaxes(1, 2), boxes[:, 12:15], boxes[:, 15]
    return Boxes(*(np.ascontiguousarray(part) for part in parts))


@kernel
def certainly_apart(
    boxes_a: Boxes, tree_a: BoxTree, boxes_b: Boxes, tree_b: BoxTree, turns: FloatArray, moves: FloatArray,
    reach: FloatArray, measured: bool, apart: BoolArray,
) -> None:  # fmt: skip
    """Fill for each relative pose, of body a in the axes of b, whether the surfaces keep more than ``reach`` there.

    ``turns`` (K, 3, 3), ``moves`` (K, 3), ``reach`` (K,), ``apart`` (K,). Where it is not certain the answer is False,
    or with ``measured`` what the distance says, computed in floats, of surfaces that do not meet.
    """
    links_a, leaves_a, links_b, leaves_b = tree_a.links, tree_a.leaves, tree_b.links, tree_b.leaves
    stack = np.empty((len(links_a) + len(links_b) + 2, 2), dtype=np.int64)
    room, m, d = (np.empty((11, 4)), np.empty((6, 3)), np.empty((6, 3))), np.empty((3, 3)), np.empty(3)
    for row in range(len(turns)):
        turn, move, far = turns[row], moves[row], reach[row]
        stack[0, 0], stack[0, 1] = 0, 0
        depth = 1
        apart[row] = True
        while depth > 0 and apart[row]:
            depth -= 1
            a, b = stack[depth, 0], stack[depth, 1]
            box_seen_from(boxes_b.centre[b], boxes_b.axes[b], boxes_a.centre[a], boxes_a.axes[a], turn, move, m, d)
            if apart_on_face_axes(m, d, boxes_b.half[b], boxes_a.half[a], far):
                continue
            if links_a[a, 0] < 0 and links_b[b, 0] < 0:
                leaf_a, leaf_b = leaves_a[links_a[a, 1]], leaves_b[links_b[b, 1]]
                apart[row] = _faces_apart(tree_a.placed, leaf_a, tree_b.placed, leaf_b, turn, move, far, measured, room)
                continue
            split_a = links_b[b, 0] < 0 or (links_a[a, 0] >= 0 and boxes_a.size[a] >= boxes_b.size[b])
            for child in range(2):
                stack[depth, 0] = links_a[a, 0] + child if split_a else a
                stack[depth, 1] = b if split_a else links_b[b, 0] + child
                depth += 1


@hot_kernel
def _faces_apart(
    placed_a: FloatArray, leaf_a: NDArray[np.int32], placed_b: FloatArray, leaf_b: NDArray[np.int32],
    turn: FloatArray, move: FloatArray, far: float, measured: bool, room: tuple[FloatArray, FloatArray, FloatArray],
) -> bool:  # fmt: skip
    """Whether every face of one leaf keeps more than ``far`` from every face of the other, as ``certainly_apart``.

    ``room``: axes (11, 4), points (6, 3) and a pair of faces (6, 3) to compute with.
    """
    stay_one_function()
    axes, points, pair = room
    for i in range(leaf_a[0], leaf_a[0] + leaf_a[1]):
        _place_face(placed_a[i], turn, move, pair)
        for m in range(leaf_b[0], leaf_b[0] + leaf_b[1]):
            for corner in range(3):
                for k in range(3):
                    pair[3 + corner, k] = placed_b[m, 4 * k + corner]
            if _bounds(pair, axes, points)[2] > far:
                continue
            if not measured or not _square_distance(points, axes[0]) > far * far:
                return False
    return True


@hot_kernel
def _square_distance(points: FloatArray, way: FloatArray) -> float:
    """Of two triangles (6, 3) that do not meet: between two edges, or a corner and a face; ``way`` (3,) is scratch.

    Source: C. Ericson, Real-Time Collision Detection, 2005, section 5.1.
    """
    stay_one_function()
    corners, o = doubles_of(points), runtime_int(0)
    least = nearest_between_edges(corners, o, corners, o + 9, way)
    for corner in range(6):
        least = min(least, _above_face(points, corner, 3 if corner < 3 else 0))
    return least


@hot_kernel
def nearest_between_edges(p: Memory, a: int, q: Memory, b: int, way: FloatArray) -> float:
    """Between the nearest points of the edges of two faces, corners ``p[a:a + 9]`` and ``q[b:b + 9]``: ``way`` (3,) to
    the first, and its squared length. An edge may be a point.
    """
    stay_one_function()
    best = np.inf
    for i in range(3):
        i0, i1 = a + 3 * i, a + 3 * ((i + 1) % 3)
        ux, uy, uz = p[i1] - p[i0], p[i1 + 1] - p[i0 + 1], p[i1 + 2] - p[i0 + 2]
        uu = ux * ux + uy * uy + uz * uz
        for j in range(3):
            j0, j1 = b + 3 * j, b + 3 * ((j + 1) % 3)
            vx, vy, vz = q[j1] - q[j0], q[j1 + 1] - q[j0 + 1], q[j1 + 2] - q[j0 + 2]
            wx, wy, wz = p[i0] - q[j0], p[i0 + 1] - q[j0 + 1], p[i0 + 2] - q[j0 + 2]
            vv, uv = vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz
            uw, vw = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
            spread = uu * vv - uv * uv
            s = min(1.0, max(0.0, (uv * vw - vv * uw) / spread)) if spread > 0.0 else 0.0
            t = (uv * s + vw) / vv if vv > 0.0 else 0.0
            if t < 0.0 or t > 1.0 or vv == 0.0:
                t = min(1.0, max(0.0, t))
                s = min(1.0, max(0.0, (uv * t - uw) / uu)) if uu > 0.0 else 0.0
            dx, dy, dz = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
            distance = dx * dx + dy * dy + dz * dz
            if distance < best:
                best = distance
                way[0], way[1], way[2] = dx, dy, dz
    return best


@hot_kernel
def _above_face(points: FloatArray, corner: int, face: int) -> float:
    """Squared, from a corner to the plane of a face of three corners from ``face`` on; infinity beside the face."""
    stay_one_function()
    length, height = 0.0, 0.0
    for k in range(3):
        normal = _normal(points, face, face + 1, face + 2, k)
        length += normal * normal
        height += normal * (points[corner, k] - points[face, k])
    if not length > 0.0:
        return np.inf
    for k in range(3):
        side = 0.0
        for m in range(3):
            side += _normal(points, face, face + 1, face + 2, m) * _normal(
                points, face + k, face + (k + 1) % 3, corner, m
            )
        if side < 0.0:
            return np.inf
    return height * height / length


@hot_kernel
def _normal(points: FloatArray, a: int, b: int, c: int, k: int) -> float:
    """One coordinate of the normal of corners a, b, c."""
    i, j = (k + 1) % 3, (k + 2) % 3
    u, v = points[b, i] - points[a, i], points[b, j] - points[a, j]
    normal: float = u * (points[c, j] - points[a, j]) - v * (points[c, i] - points[a, i])
    return normal


@hot_kernel
def _place_face(face: FloatArray, turn: FloatArray, move: FloatArray, pair: FloatArray) -> None:
    stay_one_function()
    for corner in range(3):
        for k in range(3):
            pair[corner, k] = move[k]
            for j in range(3):
                pair[corner, k] += turn[k, j] * face[4 * j + corner]
