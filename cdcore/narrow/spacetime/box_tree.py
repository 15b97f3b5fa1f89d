"""A hierarchy of oriented boxes over a mesh, split by the surface-area heuristic, with its leaves prepared for eight
frames at once.

Built once for a mesh; nothing in it depends on poses. Siblings lie next to each other, faces of a leaf too.

Source: Gottschalk, Lin and Manocha (1996) for oriented boxes; Wald (2007) for binned surface-area splits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.compiling import hot_kernel, kernel
from cdcore.narrow.spacetime.box_fit import fit_box
from cdcore.narrow.spacetime.leaf_data import fill_leaves
from cdcore.numerics import FloatArray

BINS = 16
LEAF_FACES = 4
"""Most faces of a leaf; where no split separates their centroids a leaf may hold up to LEAF_LIMIT."""
LEAF_LIMIT = 8
BOX_WIDTH = 16
"""Doubles of a node: centre 3, axes 9 (rows), half extents 3, half diagonal 1."""


class BoxTree(NamedTuple):
    """The arrays of one tree; n nodes, f faces in leaf order, c distinct corners of leaves."""

    boxes: FloatArray
    """(n, 16)."""
    links: NDArray[np.int32]
    """(n, 2): first child (its sibling follows) or -1, leaf number or -1."""
    leaves: NDArray[np.int32]
    """(leaves, 4): first face, faces, first corner, corners."""
    faces: NDArray[np.int32]
    """(f,) number of the face in the mesh."""
    placed: FloatArray
    """(f, 12) corners in the body frame, as the mesh has them: x of corners 0, 1, 2, 0, then y, then z."""
    picks: NDArray[np.int32]
    """(f, 3) corners of the face, counted from its leaf's first corner."""
    corners: FloatArray
    """(c, 3) distinct corners of a leaf, body axes, from the leaf's centre."""
    boxed: FloatArray
    """(f, 9) corners in the leaf's box frame."""
    spans: FloatArray
    """(f, 6) least and largest coordinate of the face along each axis of the leaf's box."""
    planes: FloatArray
    """(f, 11): unit normal and its least and largest value on the face, in the box frame 5 and in body axes from the
    leaf's centre 5; longest edge 1."""
    reach: float
    """Largest distance of a corner from the body's origin, rounded up."""


@kernel
def best_split(  # noqa: C901 - loops over axes, faces and bins
    centroids: FloatArray, boxes: FloatArray, order: NDArray[np.int32], start: int, stop: int, extent: FloatArray,
) -> tuple[int, float]:  # fmt: skip
    """Axis and position of the cheapest of the binned splits; axis -1 when none separates the centroids."""
    longest = 0.0
    for k in range(3):
        longest = max(longest, extent[k, 1] - extent[k, 0])
    best_axis, best_at, best_cost = -1, 0.0, np.inf
    bounds, counts = np.empty((BINS, 3, 2)), np.empty(BINS, dtype=np.int64)
    left, right = np.empty(BINS), np.empty((3, 2))
    for axis in range(3):
        if extent[axis, 1] - extent[axis, 0] < 0.25 * longest:
            continue
        low, high = np.inf, -np.inf
        for row in range(start, stop):
            along = centroids[order[row], axis]
            low, high = min(low, along), max(high, along)
        if not high > low:
            continue
        width = (high - low) / BINS
        if not width > 0.0:
            continue
        for b in range(BINS):
            counts[b] = 0
            empty_box(bounds[b])
        for row in range(start, stop):
            face = order[row]
            b = min(BINS - 1, int((centroids[face, axis] - low) / width))
            counts[b] += 1
            for k in range(3):
                bounds[b, k, 0] = min(bounds[b, k, 0], boxes[face, k])
                bounds[b, k, 1] = max(bounds[b, k, 1], boxes[face, 3 + k])
        axis_cost, axis_bin = cheapest_bin(bounds, counts, left, right)
        if axis_cost < best_cost:
            best_axis, best_at, best_cost = axis, low + (axis_bin + 1) * width, axis_cost
    return best_axis, best_at


@hot_kernel
def cheapest_bin(
    bounds: FloatArray, counts: NDArray[np.int64], left: FloatArray, right: FloatArray
) -> tuple[float, int]:
    """Cost and last bin of the left side of the cheapest split: faces times surface, both sides."""
    empty_box(right)
    total = 0
    for b in range(BINS):
        total = grow(right, bounds, counts, b, total)
        left[b] = total * surface(right)
    empty_box(right)
    total, best, at = 0, np.inf, 0
    everything = 0
    for b in range(BINS):
        everything += counts[b]
    for b in range(BINS - 1, 0, -1):
        total = grow(right, bounds, counts, b, total)
        cost = left[b - 1] + total * surface(right)
        if cost < best and 0 < total < everything:
            best, at = cost, b - 1
    return best, at


@hot_kernel
def empty_box(box: FloatArray) -> None:
    """Make ``box`` (3, 2) contain nothing."""
    for k in range(3):
        box[k, 0], box[k, 1] = np.inf, -np.inf


@hot_kernel
def grow(box: FloatArray, bounds: FloatArray, counts: NDArray[np.int64], b: int, total: int) -> int:
    """Enlarge ``box`` by bin ``b``; returns the faces so far."""
    if counts[b] > 0:
        for k in range(3):
            box[k, 0] = min(box[k, 0], bounds[b, k, 0])
            box[k, 1] = max(box[k, 1], bounds[b, k, 1])
    return total + int(counts[b])


@hot_kernel
def surface(box: FloatArray) -> float:
    """Half the surface, 0 for the empty box."""
    if not box[0, 1] >= box[0, 0]:
        return 0.0
    x, y, z = box[0, 1] - box[0, 0], box[1, 1] - box[1, 0], box[2, 1] - box[2, 0]
    area: float = x * y + y * z + z * x
    return area


@kernel
def partition(
    triangles: FloatArray, centroids: FloatArray, boxes: FloatArray, order: NDArray[np.int32], start: int, stop: int,
    axes: FloatArray, extent: FloatArray,
) -> int:  # fmt: skip
    """Reorder ``order[start:stop]`` for the best split and return where the second part starts."""
    for row in range(start, stop):
        face = order[row]
        for k in range(3):
            low, high, sum_ = np.inf, -np.inf, 0.0
            for c in range(3):
                along = (
                    axes[k, 0] * triangles[face, c, 0]
                    + axes[k, 1] * triangles[face, c, 1]
                    + axes[k, 2] * triangles[face, c, 2]
                )
                low, high, sum_ = min(low, along), max(high, along), sum_ + along / 3.0
            boxes[face, k], boxes[face, 3 + k], centroids[face, k] = low, high, sum_
    axis, at = best_split(centroids, boxes, order, start, stop, extent)
    if axis < 0:
        return (start + stop) // 2
    i, j = start, stop - 1
    while i <= j:
        if centroids[order[i], axis] < at:
            i += 1
        else:
            order[i], order[j] = order[j], order[i]
            j -= 1
    if i in (start, stop):
        return (start + stop) // 2
    return i


@kernel
def split_all(
    triangles: FloatArray, boxes: FloatArray, links: NDArray[np.int32], order: NDArray[np.int32],
    leaves: NDArray[np.int32],
) -> tuple[int, int]:  # fmt: skip
    """Fill boxes, links and leaves from the root down; returns how many nodes and leaves there are."""
    count = len(triangles)
    centroids, bounds = np.empty((count, 3)), np.empty((count, 6))
    axes, extent = np.empty((3, 3)), np.empty((3, 2))
    todo = np.empty((count + 2, 3), dtype=np.int64)
    todo[0, 0], todo[0, 1], todo[0, 2] = 0, 0, count
    depth, nodes, leaf = 1, 1, 0
    while depth > 0:
        depth -= 1
        node, start, stop = todo[depth, 0], todo[depth, 1], todo[depth, 2]
        fit_box(triangles, order, start, stop, axes, extent)
        for k in range(3):
            boxes[node, k] = 0.0
        diagonal = 0.0
        for k in range(3):
            middle, half = 0.5 * extent[k, 0] + 0.5 * extent[k, 1], 0.5 * extent[k, 1] - 0.5 * extent[k, 0]
            for i in range(3):
                boxes[node, i] += middle * axes[k, i]
                boxes[node, 3 + 3 * k + i] = axes[k, i]
            boxes[node, 12 + k] = half
            diagonal += half * half
        boxes[node, 15] = np.sqrt(diagonal)
        if stop - start <= LEAF_FACES:
            links[node, 0], links[node, 1] = -1, leaf
            leaves[leaf, 0], leaves[leaf, 1] = start, stop - start
            leaf += 1
            continue
        middle_row = partition(triangles, centroids, bounds, order, start, stop, axes, extent)
        links[node, 0], links[node, 1] = nodes, -1
        todo[depth, 0], todo[depth, 1], todo[depth, 2] = nodes + 1, middle_row, stop
        todo[depth + 1, 0], todo[depth + 1, 1], todo[depth + 1, 2] = nodes, start, middle_row
        depth += 2
        nodes += 2
    return nodes, leaf


def build_box_tree(triangles: FloatArray) -> BoxTree:
    """The tree of a mesh from its corners (f, 3, 3), body frame."""
    count = len(triangles)
    boxes, links = np.empty((2 * count, BOX_WIDTH)), np.empty((2 * count, 2), dtype=np.int32)
    order, leaves = np.arange(count, dtype=np.int32), np.zeros((count, 4), dtype=np.int32)
    nodes, leaf_count = split_all(triangles, boxes, links, order, leaves)
    boxes, links, leaves = boxes[:nodes].copy(), links[:nodes].copy(), leaves[:leaf_count].copy()
    leaf_nodes = np.flatnonzero(links[:, 1] >= 0)[np.argsort(links[links[:, 1] >= 0, 1])].astype(np.int64)
    placed = np.ascontiguousarray(triangles[order][:, [0, 1, 2, 0]].transpose(0, 2, 1).reshape(count, 12))
    picks, corners = np.zeros((count, 3), dtype=np.int32), np.empty((3 * count, 3))
    boxed, planes = np.empty((count, 9)), np.empty((count, 11))
    corner_count = fill_leaves(boxes, leaf_nodes, leaves, placed, picks, corners, boxed, planes)
    reach = float(np.sqrt((triangles**2).sum(axis=2).max())) * (1 + 2.0**-50)
    corners = corners[:corner_count].copy()
    spans = np.ascontiguousarray(
        np.stack([boxed.reshape(-1, 3, 3).min(axis=1), boxed.reshape(-1, 3, 3).max(axis=1)], axis=2).reshape(-1, 6)
    )
    return BoxTree(boxes, links, leaves, order, placed, picks, corners, boxed, spans, planes, reach)
