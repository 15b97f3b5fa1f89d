"""A hierarchy of oriented boxes over a mesh, split by the surface-area heuristic, its leaves ready for eight frames.

Built once for a mesh; nothing in it depends on poses. Siblings lie next to each other, faces of a leaf too.

Source: Gottschalk, Lin and Manocha (1996) for oriented boxes; Wald (2007) for binned surface-area splits.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, words_of
from cdcore.narrow.bvh.box_fit import BuildMemory, build_at, fit_box
from cdcore.narrow.bvh.tree_memory import TreeMemory, row_of, words_of_rows
from cdcore.numerics import FloatArray, IntArray

BINS = 16
LEAF_FACES = 8
"""Most faces of a leaf; 4 were 1.1 times slower for face sets, no faster for booleans (2026-11-22)."""
BOX_WIDTH = 16
"""Doubles of a node: centre 3, axes 9 (x of all three, then y, z, so that one vector loads it), half extents 3, half
diagonal 1."""
SMALLEST_SCALED = 1e-300
"""A mesh whose coordinates are all smaller counts as one point: its covariance is taken as it is, not scaled up."""


class BoxTree(NamedTuple):
    """The arrays of one tree; n nodes, f faces in leaf order, c distinct corners of leaves.

    ``boxes`` (n, 16). ``links`` (n, 2): first child (its sibling follows) or -1, leaf number or -1. ``leaves`` (l, 4):
    first face, faces, first corner, corners. ``faces`` (f,): numbers in the mesh. ``placed`` (f, 12): corners in the
    body frame, as the mesh has them, x of corners 0, 1, 2, 0, then y, then z. ``picks`` (f, 3): corners of the face,
    counted from its leaf's first corner. ``corners`` (c, 3): distinct corners of a leaf, body axes, from the leaf's
    centre. ``boxed`` (f, 9): corners in the leaf's box frame. ``spans`` (f, 6): least and largest coordinate of the
    face along each axis of the leaf's box. ``reach``: largest distance of a corner from the body's origin, rounded up.
    ``words`` (9,): where the kernels find them, the row of a ``TreeMemory``.
    """

    boxes: FloatArray
    links: NDArray[np.int32]
    leaves: NDArray[np.int32]
    faces: NDArray[np.int32]
    placed: FloatArray
    picks: NDArray[np.int32]
    corners: FloatArray
    boxed: FloatArray
    spans: FloatArray
    reach: float
    words: IntArray


@hot_kernel
def best_split(fit: BuildMemory, start: int, stop: int) -> tuple[int, float]:
    """Axis of the cheapest of the binned splits, -1 when none separates the centroids, and where it cuts."""
    stay_one_function()
    extent, spans = fit.extent, fit.spans
    longest = max(max(extent[1] - extent[0], extent[3] - extent[2]), extent[5] - extent[4])
    best, least, position = runtime_int(-1), np.inf, 0.0
    for axis in range(3):
        if extent[2 * axis + 1] - extent[2 * axis] < 0.25 * longest:
            continue
        low, high = np.inf, -np.inf
        for row in range(start, stop):
            along = spans[9 * fit.order[row] + 6 + axis]
            low, high = min(low, along), max(high, along)
        width = (high - low) / BINS
        if not width > 0.0:
            continue
        fill_bins(fit, start, stop, axis, low, width)
        at, cost = cheapest_bin(fit)
        if cost < least:
            best, least, position = axis, cost, low + (at + 1) * width
    return best, position


@hot_kernel
def fill_bins(fit: BuildMemory, start: int, stop: int, axis: int, low: float, width: float) -> None:
    """Sort the faces into bins along an axis by their centroids."""
    stay_one_function()
    for b in range(BINS):
        fit.counts[b] = 0
        empty_box(fit.bounds, 6 * b)
    for row in range(start, stop):
        face = 9 * fit.order[row]
        b = min(runtime_int(BINS - 1), int((fit.spans[face + 6 + axis] - low) / width))
        fit.counts[b] += 1
        grow(fit.bounds, 6 * b, fit.spans, face)


@hot_kernel
def cheapest_bin(fit: BuildMemory) -> tuple[int, float]:
    """Last bin left of the cheapest split, and its cost: faces times surface of both sides."""
    stay_one_function()
    left, right, counts = fit.left, fit.right, fit.counts
    empty_box(right, runtime_int(0))
    total = runtime_int(0)
    for b in range(BINS):
        total += counts[b]
        grow(right, runtime_int(0), fit.bounds, 6 * b)
        left[b] = total * surface(right)
    empty_box(right, runtime_int(0))
    everything, total, at, least = total, runtime_int(0), runtime_int(0), np.inf
    for b in range(BINS - 1, 0, -1):
        total += counts[b]
        grow(right, runtime_int(0), fit.bounds, 6 * b)
        cost = left[b - 1] + total * surface(right)
        if cost < least and 0 < total < everything:
            least, at = cost, b - 1
    return at, least


@hot_kernel
def empty_box(box: Memory, at: int) -> None:
    """Make the box (6,) at ``box[at]`` contain nothing."""
    become_part_of_caller()
    for k in range(at, at + 3):
        box[k], box[k + 3] = np.inf, -np.inf


@hot_kernel
def grow(box: Memory, at: int, other: Memory, row: int) -> None:
    """Enlarge the box at ``box[at]`` by the one at ``other[row]``."""
    become_part_of_caller()
    for k in range(3):
        box[at + k] = min(box[at + k], other[row + k])
        box[at + 3 + k] = max(box[at + 3 + k], other[row + 3 + k])


@hot_kernel
def surface(box: Memory) -> float:
    """Half the surface, 0 for the empty box."""
    become_part_of_caller()
    if not box[3] >= box[0]:
        return 0.0
    x, y, z = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    area: float = x * y + y * z + z * x
    return area


@hot_kernel
def partition(fit: BuildMemory, start: int, stop: int) -> int:
    """Reorder ``order[start:stop]`` for the best split and return where the second part starts."""
    stay_one_function()
    order, (axis, position) = fit.order, best_split(fit, start, stop)
    i, j = start, stop - 1
    while axis >= 0 and i <= j:
        if fit.spans[9 * order[i] + 6 + axis] < position:
            i += 1
        else:
            order[i], order[j] = order[j], order[i]
            j -= 1
    return i if start < i < stop else (start + stop) // 2


@hot_kernel
def write_box(fit: BuildMemory, at: int) -> None:
    """Centre, axes, half extents and half diagonal of the fitted box to ``boxes[at : at + 16]``."""
    stay_one_function()
    axes, extent, box = fit.axes, fit.extent, fit.boxes
    for i in range(3):
        box[at + i] = 0.0
    diagonal = 0.0
    for k in range(3):
        low, high = 0.5 * extent[2 * k], 0.5 * extent[2 * k + 1]
        for i in range(3):
            box[at + i] += (low + high) * axes[3 * k + i]
            box[at + 3 + 3 * i + k] = axes[3 * k + i]
        box[at + 12 + k] = high - low
        diagonal += (high - low) * (high - low)
    box[at + 15] = np.sqrt(diagonal)


@kernel
def split_all(row: IntArray, count: int, scale: float) -> int:
    """Fill boxes, links and leaves of a ``BuildMemory`` from the root down; returns how many nodes there are."""
    fit = build_at(words_of(row))
    links, leaves, todo = fit.links, fit.leaves, fit.stack
    todo[0], todo[1], todo[2] = 0, 0, count
    depth, nodes, leaf = runtime_int(3), runtime_int(1), runtime_int(0)
    while depth > 0:
        depth -= 3
        node, start, stop = todo[depth], todo[depth + 1], todo[depth + 2]
        fit_box(fit, start, stop, scale)
        write_box(fit, BOX_WIDTH * node)
        if stop - start <= LEAF_FACES:
            links[2 * node], links[2 * node + 1] = -1, leaf
            leaves[4 * leaf], leaves[4 * leaf + 1] = start, stop - start
            leaf += 1
            continue
        middle = partition(fit, start, stop)
        links[2 * node], links[2 * node + 1] = nodes, -1
        todo[depth], todo[depth + 1], todo[depth + 2] = nodes + 1, middle, stop
        todo[depth + 3], todo[depth + 4], todo[depth + 5] = nodes, start, middle
        depth += 6
        nodes += 2
    return nodes


def distinct_corners(local: FloatArray, leaf: IntArray) -> tuple[FloatArray, NDArray[np.int32], IntArray]:
    """Corners (c, 3) without those that a leaf has twice, leaf by leaf; which a face has, (f, 3), counted from its
    leaf's first; and how many each leaf has.

    ``local`` (f, 3, 3) corners of faces, ``leaf`` (f,) which each belongs to, ascending.
    """
    points, owner = local.reshape(-1, 3), np.repeat(leaf, 3)
    order = np.lexsort((*points.T, owner))
    points, owner = points[order], owner[order]
    fresh = np.ones(len(order), dtype=np.bool_)
    fresh[1:] = (points[1:] != points[:-1]).any(axis=1) | (owner[1:] != owner[:-1])
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.cumsum(fresh) - 1
    counts = np.bincount(owner[fresh])
    picks = number.reshape(-1, 3) - (np.cumsum(counts) - counts)[leaf][:, None]
    return points[fresh], picks.astype(np.int32), counts


def build_box_tree(triangles: FloatArray) -> BoxTree:
    """The tree of a mesh from its corners (f, 3, 3), body frame."""
    count = len(triangles)
    boxes, links = np.empty((2 * count, BOX_WIDTH)), np.empty((2 * count, 2), dtype=np.int32)
    order, leaves = np.arange(count, dtype=np.int32), np.zeros((count, 4), dtype=np.int32)
    lengths = {"spans": 9 * count, "axes": 9, "extent": 6, "matrix": 9, "bounds": 6 * BINS, "left": BINS, "right": 6}
    scratch: dict[str, NDArray[Any]] = {name: np.empty(length) for name, length in lengths.items()}
    scratch |= {"counts": np.empty(BINS, dtype=np.int64), "stack": np.empty(3 * count + 6, dtype=np.int64)}
    largest = float(np.abs(triangles).max())
    scale = 1.0 / largest if largest > SMALLEST_SCALED else 1.0
    corners = np.ascontiguousarray(triangles)
    row = row_of(BuildMemory, **scratch, corners=corners, boxes=boxes, order=order, links=links, leaves=leaves)
    nodes = split_all(words_of_rows(row[None])[0], count, scale)
    boxes, links, leaves = boxes[:nodes].copy(), links[:nodes].copy(), leaves[: (nodes + 1) // 2].copy()
    sorted_faces, leaf = triangles[order], np.repeat(np.arange(len(leaves)), leaves[:, 1])
    leaf_boxes = boxes[links[:, 1] >= 0][np.argsort(links[links[:, 1] >= 0, 1])][leaf]
    local = sorted_faces - leaf_boxes[:, None, :3]
    boxed = np.einsum("fci,fik->fck", local, leaf_boxes[:, 3:12].reshape(-1, 3, 3))
    corners, picks, leaves[:, 3] = distinct_corners(local, leaf)
    leaves[:, 2] = np.cumsum(leaves[:, 3]) - leaves[:, 3]
    arrays = [
        boxes, links, leaves, order, sorted_faces[:, [0, 1, 2, 0]].transpose(0, 2, 1).reshape(count, 12), picks,
        corners, boxed.reshape(count, 9), np.stack([boxed.min(axis=1), boxed.max(axis=1)], axis=2).reshape(count, 6),
    ]  # fmt: skip
    arrays = [np.ascontiguousarray(array) for array in arrays]
    reach = float(np.sqrt((triangles**2).sum(axis=2).max())) * (1 + 2.0**-50)
    row = row_of(TreeMemory, **dict(zip(TreeMemory._fields, arrays, strict=True)))
    return BoxTree._make([*arrays, reach, words_of_rows(row[None])[0]])
