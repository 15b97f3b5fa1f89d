"""Binary trees over faces, grown level by level with whole-array operations: nothing to compile, no recursion.

Nodes stand in order of their level, so children come after their parent and the two children of a node are neighbours.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray

MORTON_BITS: Final = 10

Keys = Callable[[IntArray, IntArray, IntArray], FloatArray]
"""``(faces, node, first) -> key``: called once a level with the faces of all its nodes (E,), the node within the
level each belongs to (E,), and where each node's faces start (n,); gives each face its place along the cut, (E,)."""


@dataclass(frozen=True, eq=False)
class Topology:
    """Which faces each of n nodes holds: ``order[start:stop]``, of face numbers ``order`` (f,).

    ``child`` (n,): number of the first child, the second follows it; -1 for a leaf. ``depth``: levels.
    """

    child: IntArray
    start: IntArray
    stop: IntArray
    order: IntArray
    depth: int


def grow_tree(count: int, leaf_faces: int, keys: Keys, *, balanced: bool) -> Topology:
    """Cut ``count`` faces in two, level by level, until no node has more than ``leaf_faces``.

    ``balanced``: cut at the median of the keys; else between keys up to 0 and keys above, and in the middle where that
    leaves one side empty.
    """
    order = np.arange(count, dtype=np.int64)
    start, stop = np.array([0], dtype=np.int64), np.array([count], dtype=np.int64)
    levels: list[tuple[IntArray, IntArray, IntArray]] = []
    nodes = 0
    while len(start):
        sizes = stop - start
        first = np.cumsum(sizes) - sizes
        node = np.repeat(np.arange(len(start)), sizes)
        place = np.arange(len(node)) + np.repeat(start - first, sizes)
        faces = order[place]
        key = keys(faces, node, first)
        rank = key if balanced else key > 0
        order[place] = faces[np.lexsort((faces, rank, node))]
        opened = sizes > leaf_faces
        cut = sizes // 2
        if not balanced:
            below = sizes - np.add.reduceat(rank.astype(np.int64), first)
            cut = np.where((below > 0) & (below < sizes), below, cut)
        cut = cut[opened]
        nodes += len(start)
        child = np.full(len(start), -1, dtype=np.int64)
        child[opened] = nodes + 2 * np.arange(len(cut))
        levels.append((child, start, stop))
        low, high = start[opened], stop[opened]
        start, stop = np.column_stack([low, low + cut]).ravel(), np.column_stack([low + cut, high]).ravel()
    child, start, stop = (np.concatenate(part) for part in zip(*levels, strict=True))
    return Topology(child, start, stop, order, len(levels))


def extents(along: FloatArray, first: IntArray) -> tuple[FloatArray, FloatArray]:
    """Least and largest coordinates (n, 3) of n nodes; ``along`` (E, c, 3): corners of their faces, node after node."""
    return np.minimum.reduceat(along.min(axis=1), first), np.maximum.reduceat(along.max(axis=1), first)


def morton_codes(points: FloatArray) -> IntArray:
    """Place of each point (n, 3) along a Morton curve: 10 bits per axis, scaled by the longest side of their box."""
    low, high = points.min(axis=0), points.max(axis=0)
    half_side = float((high / 2.0 - low / 2.0).max())
    code = np.zeros(len(points), dtype=np.int64)
    if half_side == 0.0:
        return code
    share = (points / 2.0 - low / 2.0) / half_side
    cell = np.minimum((share * 2.0**MORTON_BITS).astype(np.int64), 2**MORTON_BITS - 1)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code
