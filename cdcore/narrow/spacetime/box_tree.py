"""A hierarchy of oriented boxes over a mesh, split by the surface-area heuristic, its leaves ready for eight frames.

Built once for a mesh; nothing in it depends on poses. Siblings lie next to each other, faces of a leaf too.

Source: Gottschalk, Lin and Manocha (1996) for oriented boxes; Wald (2007) for binned surface-area splits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, doubles_at, integers_at, row_of, words_at
from cdcore.narrow.spacetime.box_fit import FitMemory, fit_box
from cdcore.narrow.spacetime.leaf_data import fill_leaves
from cdcore.numerics import FloatArray, IntArray

BINS = 16
LEAF_FACES = 8
"""Most faces of a leaf; 4 were 1.1 times slower for face sets, no faster for booleans (2026-11-22)."""
BOX_WIDTH = 16
"""Doubles of a node: centre 3, axes 9 (x of all three, then y, z, so that one vector loads it), half extents 3, half
diagonal 1."""
COSTS = 24 + 6 * BINS
"""Where the cost of bins lies in the scratch of a split."""
ROOM_DOUBLES = COSTS + BINS + 1 + 6 + 2
"""Scratch of a split: axes 9, extent 6, covariance 9, the bins' boxes and costs, one box, the choice."""
SMALLEST_SCALED = 1e-300
"""A mesh whose coordinates are all smaller counts as one point: its covariance is taken as it is, not scaled up."""


class BoxTree(NamedTuple):
    """The arrays of one tree; n nodes, f faces in leaf order, c distinct corners of leaves.

    ``boxes`` (n, 16). ``links`` (n, 2): first child (its sibling follows) or -1, leaf number or -1. ``leaves`` (l, 4):
    first face, faces, first corner, corners. ``faces`` (f,): numbers in the mesh. ``placed`` (f, 12): corners in the
    body frame, as the mesh has them, x of corners 0, 1, 2, 0, then y, then z. ``picks`` (f, 3): corners of the face,
    counted from its leaf's first corner. ``corners`` (c, 3): distinct corners of a leaf, body axes, from the leaf's
    centre. ``boxed`` (f, 9): corners in the leaf's box frame. ``spans`` (f, 6): least and largest coordinate of the
    face along each axis of the leaf's box. ``planes`` (f, 11): unit normal and its least and largest value on the face,
    in the box frame 5 and in body axes from the leaf's centre 5; longest edge 1. ``reach``: largest distance of a
    corner from the body's origin, rounded up. ``row`` (10,): addresses of the arrays, as the kernels take them.
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
    planes: FloatArray
    reach: float
    row: IntArray


class SplitMemory(NamedTuple):
    """What one split reads and writes.

    ``bounds`` (BINS, 6): least and largest coordinates of the faces of a bin; ``counts`` (BINS,) its faces; ``left``
    (BINS + 1,): cost of the bins up to this one; ``right`` (6,): the box of several bins; ``choice`` (2,): cost and
    position of the best split so far.
    """

    bounds: Memory
    counts: Memory
    left: Memory
    right: Memory
    choice: Memory


@hot_kernel
def best_split(fit: FitMemory, split: SplitMemory, start: int, stop: int) -> int:
    """Axis of the cheapest of the binned splits, -1 when none separates the centroids; its place in ``choice``."""
    stay_one_function()
    extent, spans, choice = fit.extent, fit.spans, split.choice
    longest = max(max(extent[1] - extent[0], extent[3] - extent[2]), extent[5] - extent[4])
    best = runtime_int(-1)
    choice[0], choice[1] = np.inf, 0.0
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
        fill_bins(fit, split, start, stop, axis, low, width)
        at = cheapest_bin(split)
        if split.left[BINS] < choice[0]:
            best, choice[0], choice[1] = axis, split.left[BINS], low + (at + 1) * width
    return best


@hot_kernel
def fill_bins(fit: FitMemory, split: SplitMemory, start: int, stop: int, axis: int, low: float, width: float) -> None:
    """Sort the faces into bins along an axis by their centroids."""
    stay_one_function()
    for b in range(BINS):
        split.counts[b] = 0
        empty_box(split.bounds, 6 * b)
    for row in range(start, stop):
        face = 9 * fit.order[row]
        b = min(runtime_int(BINS - 1), int((fit.spans[face + 6 + axis] - low) / width))
        split.counts[b] += 1
        grow(split.bounds, 6 * b, fit.spans, face)


@hot_kernel
def cheapest_bin(split: SplitMemory) -> int:
    """Last bin left of the cheapest split; its cost, faces times surface of both sides, goes to ``left[BINS]``."""
    stay_one_function()
    left, right, counts = split.left, split.right, split.counts
    empty_box(right, runtime_int(0))
    total = runtime_int(0)
    for b in range(BINS):
        total += counts[b]
        grow(right, runtime_int(0), split.bounds, 6 * b)
        left[b] = total * surface(right)
    empty_box(right, runtime_int(0))
    everything, total, at = total, runtime_int(0), runtime_int(0)
    left[BINS] = np.inf
    for b in range(BINS - 1, 0, -1):
        total += counts[b]
        grow(right, runtime_int(0), split.bounds, 6 * b)
        cost = left[b - 1] + total * surface(right)
        if cost < left[BINS] and 0 < total < everything:
            left[BINS], at = cost, b - 1
    return at


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
def partition(fit: FitMemory, split: SplitMemory, start: int, stop: int) -> int:
    """Reorder ``order[start:stop]`` for the best split and return where the second part starts."""
    stay_one_function()
    order, axis = fit.order, best_split(fit, split, start, stop)
    i, j = start, stop - 1
    while axis >= 0 and i <= j:
        if fit.spans[9 * order[i] + 6 + axis] < split.choice[1]:
            i += 1
        else:
            order[i], order[j] = order[j], order[i]
            j -= 1
    return i if start < i < stop else (start + stop) // 2


@hot_kernel
def write_box(fit: FitMemory, box: Memory, at: int) -> None:
    """Centre, axes, half extents and half diagonal of the fitted box to ``box[at : at + 16]``."""
    stay_one_function()
    axes, extent = fit.axes, fit.extent
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
    """Fill boxes, links and leaves from the root down; returns how many nodes there are.

    ``row`` holds addresses: of the corners (f, 9), order, boxes, links, leaves, room for doubles (9 f + ROOM_DOUBLES)
    and for words (3 f + 6 + BINS).
    """
    boxes, links, leaves = doubles_at(row[2]), integers_at(row[3]), integers_at(row[4])
    room, todo = row[5], words_at(row[6])
    order = integers_at(row[1])
    fit = FitMemory(
        doubles_at(row[0]), order, doubles_at(room + 8 * ROOM_DOUBLES), doubles_at(room), doubles_at(room + 72),
        doubles_at(room + 120),
    )  # fmt: skip
    split = SplitMemory(
        doubles_at(room + 8 * 24), words_at(row[6] + 24 * (count + 2)), doubles_at(room + 8 * COSTS),
        doubles_at(room + 8 * (COSTS + BINS + 1)), doubles_at(room + 8 * (COSTS + BINS + 7)),
    )  # fmt: skip
    todo[0], todo[1], todo[2] = 0, 0, count
    depth, nodes, leaf = runtime_int(3), runtime_int(1), runtime_int(0)
    while depth > 0:
        depth -= 3
        node, start, stop = todo[depth], todo[depth + 1], todo[depth + 2]
        fit_box(fit, start, stop, scale)
        write_box(fit, boxes, BOX_WIDTH * node)
        if stop - start <= LEAF_FACES:
            links[2 * node], links[2 * node + 1] = -1, leaf
            leaves[4 * leaf], leaves[4 * leaf + 1] = start, stop - start
            leaf += 1
            continue
        middle = partition(fit, split, start, stop)
        links[2 * node], links[2 * node + 1] = nodes, -1
        todo[depth], todo[depth + 1], todo[depth + 2] = nodes + 1, middle, stop
        todo[depth + 3], todo[depth + 4], todo[depth + 5] = nodes, start, middle
        depth += 6
        nodes += 2
    return nodes


def build_box_tree(triangles: FloatArray) -> BoxTree:
    """The tree of a mesh from its corners (f, 3, 3), body frame."""
    count = len(triangles)
    boxes, links = np.empty((2 * count, BOX_WIDTH)), np.empty((2 * count, 2), dtype=np.int32)
    order, leaves = np.arange(count, dtype=np.int32), np.zeros((count, 4), dtype=np.int32)
    room, words = np.empty(9 * count + ROOM_DOUBLES), np.empty(3 * count + 6 + BINS, dtype=np.int64)
    largest = float(np.abs(triangles).max())
    scale = 1.0 / largest if largest > SMALLEST_SCALED else 1.0
    flat = np.ascontiguousarray(triangles)
    nodes = split_all(row_of([flat, order, boxes, links, leaves, room, words]), count, scale)
    leaf_count = (nodes + 1) // 2
    boxes, links, leaves = boxes[:nodes].copy(), links[:nodes].copy(), leaves[:leaf_count].copy()
    leaf_nodes = np.flatnonzero(links[:, 1] >= 0)[np.argsort(links[links[:, 1] >= 0, 1])].astype(np.int64)
    placed = np.ascontiguousarray(triangles[order][:, [0, 1, 2, 0]].transpose(0, 2, 1).reshape(count, 12))
    picks, corners = np.zeros((count, 3), dtype=np.int32), np.empty((3 * count, 3))
    boxed, planes = np.empty((count, 9)), np.empty((count, 11))
    row = row_of([boxes, leaf_nodes, leaves, placed, picks, corners, boxed, planes, room])
    corner_count = fill_leaves(row, leaf_count)
    reach = float(np.sqrt((triangles**2).sum(axis=2).max())) * (1 + 2.0**-50)
    corners = corners[:corner_count].copy()
    along = boxed.reshape(-1, 3, 3)
    spans = np.ascontiguousarray(np.stack([along.min(axis=1), along.max(axis=1)], axis=2).reshape(-1, 6))
    arrays = (boxes, links, leaves, order, placed, picks, corners, boxed, spans, planes)
    return BoxTree(*arrays, reach, row_of([*arrays]))
