"""One builder for every tree of boxes: a rule says where the boxes of a level lie and where each node is cut in two.

It takes level by level with whole arrays: nothing to compile, no recursion. Axes come from Jacobi rotations instead of
LAPACK, so that every machine builds the same tree.

Source: S. Gottschalk, M. C. Lin, D. Manocha, OBBTree (1996), for oriented boxes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from typing import Final, NamedTuple

import numpy as np

from cdcore.numerics import BoolArray, FloatArray, IntArray

SWEEPS: Final = 5
"""Jacobi rotations converge quadratically: 3 x 3 matrices are diagonal to rounding after five sweeps."""
FACES_TOGETHER: Final = 16384
"""So many faces of small bodies go through the builder together: a step of all takes as many calls as of one."""

Boxes = tuple[FloatArray, FloatArray, FloatArray]
"""Of the n nodes of a level: axes (3, 3, n), one a row, and the least and largest coordinates along them (3, n)."""

Rule = Callable[[FloatArray, IntArray, IntArray], tuple[Boxes, FloatArray | BoolArray]]
"""``(corners, node, first) -> boxes, key``: called once a level with the faces of all its nodes, (3, 3, E) corners and
coordinates, the node within the level each belongs to (E,), and where each node's faces start (n,). The key of a
face is its coordinate along the cut (``cut_at_median``), or whether it comes second (``cut_by_side``)."""


class BoxNodes(NamedTuple):
    """Boxes of n nodes in the body's frame, in order of their level: children after their parent, siblings neighbours.

    ``corners`` (f, 3, 3) faces in the order of the leaves, ``number`` (f,) their numbers in the mesh; ``child`` (n,)
    first of two neighbouring children or -1; ``start``, ``stop`` (n,) a node's faces; ``centre`` (n, 3), ``axes``
    (n, 3, 3) one axis a row, ``half`` (n, 3), ``size`` (n,) longest half.
    """

    corners: FloatArray
    number: IntArray
    child: IntArray
    start: IntArray
    stop: IntArray
    centre: FloatArray
    axes: FloatArray
    half: FloatArray
    size: FloatArray


def build_trees(bodies: Sequence[FloatArray], rule: Rule, leaf_faces: int) -> list[tuple[BoxNodes, int]]:
    """Over the faces (f, 3, 3) of each body a tree with at most ``leaf_faces`` a leaf, and its depth."""
    position = np.cumsum([len(corners) for corners in bodies]) // FACES_TOGETHER
    groups = groupby(range(len(bodies)), lambda k: position[k])
    return [tree for _, some in groups for tree in _build_group([bodies[k] for k in some], rule, leaf_faces)]


def _build_group(bodies: list[FloatArray], rule: Rule, leaf_faces: int) -> Iterator[tuple[BoxNodes, int]]:
    """Trees that grow by the same steps: a step of all takes as many calls as of one, and no tree changes another."""
    corners, faces = np.concatenate(bodies), np.array([len(corners) for corners in bodies])
    begin = np.cumsum(faces) - faces
    # Scaled by a power of two, so that no product over- or underflows and no coordinate rounds.
    exponent = np.frexp([np.abs(corners).max() for corners in bodies])[1]
    scaled = np.ldexp(corners, -np.repeat(exponent, faces)[:, None, None])
    # Faces stand side by side, so that a step is one pass over all of them.
    scaled, order = np.ascontiguousarray(scaled.transpose(1, 2, 0)), np.arange(len(corners))
    tree, start, stop = np.arange(len(bodies)), begin, begin + faces
    levels: list[tuple[FloatArray | IntArray, ...]] = []
    count = 0
    while len(start):
        sizes = stop - start
        first = np.cumsum(sizes) - sizes
        node = np.repeat(np.arange(len(start)), sizes)
        position = np.arange(len(node)) + np.repeat(start - first, sizes)
        taken = order[position]
        boxes, key = rule(scaled.take(taken, axis=2), node, first)
        order[position] = taken[np.lexsort((taken, key, node))]
        opened = sizes > leaf_faces
        cut = cut_by_side(key == 1, sizes, first) if key.dtype == np.bool_ else cut_at_median(sizes)
        count += len(start)
        child = np.full(len(start), -1, dtype=np.int64)
        child[opened] = count + 2 * np.arange(opened.sum())
        levels.append((np.full(len(start), len(levels) + 1), tree, child, start, stop, *boxes))
        lower, middle, upper = start[opened], start[opened] + cut[opened], stop[opened]
        start, stop = np.column_stack([lower, middle]).ravel(), np.column_stack([middle, upper]).ravel()
        tree = tree[opened].repeat(2)
    depth, tree, child, start, stop, axes, lower, upper = (
        np.concatenate(columns, axis=-1) for columns in zip(*levels, strict=True)
    )
    centre = np.ldexp((axes * (lower / 2 + upper / 2)[:, None]).sum(axis=0), exponent[tree])
    half = np.ldexp(upper / 2 - lower / 2, exponent[tree])
    number = np.empty_like(tree)  # of a node within its tree
    for k, nodes in enumerate(np.split(np.argsort(tree, kind="stable"), np.bincount(tree).cumsum()[:-1])):
        number[nodes] = np.arange(len(nodes))
        members, sides = order[begin[k] : begin[k] + faces[k]], half.T[nodes]
        grown = BoxNodes(
            corners=corners[members],
            number=members - begin[k],
            child=np.where(child[nodes] < 0, -1, number[child[nodes]]),
            start=start[nodes] - begin[k],
            stop=stop[nodes] - begin[k],
            centre=centre.T[nodes],
            axes=axes.transpose(2, 0, 1)[nodes],
            half=sides,
            size=sides.max(axis=1),
        )
        yield grown, int(depth[nodes[-1]])


def cut_at_median(sizes: IntArray) -> IntArray:
    """Number of faces in the first child of each node: half of its faces, sorted along the cut."""
    return sizes // 2


def cut_by_side(second: BoolArray, sizes: IntArray, first: IntArray) -> IntArray:
    """Number of faces in the first child of each node: those not marked ``second``; half if all or none are."""
    before = sizes - np.add.reduceat(second.astype(np.int64), first)
    return np.where((before > 0) & (before < sizes), before, cut_at_median(sizes))


def extents(along: FloatArray, first: IntArray) -> tuple[FloatArray, FloatArray]:
    """Least and largest coordinates (3, n) of n nodes; ``along`` (c, 3, E): corners of their faces, node after node."""
    return np.minimum.reduceat(along.min(axis=0), first, axis=1), np.maximum.reduceat(along.max(axis=0), first, axis=1)


def body_axes(count: int) -> FloatArray:
    """The axes of boxes that stand along the body's, (3, 3, n)."""
    return np.broadcast_to(np.eye(3)[:, :, None], (3, 3, count))


def coordinates_along(axes: FloatArray, points: FloatArray) -> FloatArray:
    """Coordinates (c, 3, E) of points (c, 3, E) along axes (3, 3, E), one a row; sums have a fixed order."""
    # Corner by corner, in memory that the cache still holds: a half of the time of one product and one sum.
    along = np.empty_like(points)
    for corner, (x, y, z) in enumerate(points):
        along[corner] = axes[:, 0] * x + axes[:, 1] * y + axes[:, 2] * z
    return along


def tighter_boxes(corners: FloatArray, node: IntArray, first: IntArray) -> tuple[Boxes, FloatArray]:
    """Boxes along the principal axes of the corners or the body's axes, whichever box has the smaller surface.

    Also the coordinates of the corners (3, 3, E) along the axes of their box.
    """
    mean = np.add.reduceat(corners.mean(axis=0), first, axis=1) / np.diff(first, append=len(node))
    spread = corners - mean.take(node, axis=1)
    principal = principal_axes(np.add.reduceat((spread[:, :, None] * spread[:, None]).sum(axis=0), first, axis=2))
    rotated = coordinates_along(principal.take(node, axis=2), corners)
    (lower, upper), (least, most) = extents(rotated, first), extents(corners, first)
    keep = half_surface(upper - lower) < half_surface(most - least)
    axes = np.where(keep, principal, body_axes(len(first)))
    return (axes, np.where(keep, lower, least), np.where(keep, upper, most)), np.where(keep[node], rotated, corners)


def principal_axes(matrices: FloatArray) -> FloatArray:
    """Orthonormal eigenvectors, one a row, of symmetric matrices (3, 3, n); that of the largest eigenvalue first."""
    count = matrices.shape[2]
    # Rows of the matrices go on in rows of the axes: both turn in one step.
    both = np.concatenate([matrices, body_axes(count)], axis=1)
    m, sines = both[:, :3], np.empty((2, 1, count))
    for sweep in range(3 * SWEEPS):
        p, q = ((0, 1), (0, 2), (1, 2))[sweep % 3]
        # The smaller of the angles that make the entry 0.
        off, difference = 2.0 * m[p, q], m[q, q] - m[p, p]
        length = np.sqrt(off * off + difference * difference)
        tangent = off / np.where(length > 0, difference + np.copysign(length, difference), np.inf)
        cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
        np.multiply(tangent, cosine, out=sines[1, 0])
        np.negative(sines[1], out=sines[0])
        for rows in (both, m.swapaxes(0, 1)):
            pair = rows[p : q + 1 : q - p]
            crossed = sines * pair[::-1]
            pair *= cosine
            pair += crossed
    order = np.argsort(-np.einsum("iin->in", m), axis=0, kind="stable")
    axes = both[:, 3:][order, :, np.arange(count)].transpose(0, 2, 1)
    x = axes[0] / np.sqrt((axes[0] * axes[0]).sum(axis=0))
    y = axes[1] - (x * axes[1]).sum(axis=0) * x
    y = y / np.sqrt((y * y).sum(axis=0))
    return np.stack([x, y, x[[1, 2, 0]] * y[[2, 0, 1]] - x[[2, 0, 1]] * y[[1, 2, 0]]])


def half_surface(size: FloatArray) -> FloatArray:
    """Half the surface of boxes with sides (3, ...)."""
    x, y, z = size
    return x * y + y * z + z * x
