"""A hierarchy of oriented boxes over a mesh, split by the surface-area heuristic, its leaves ready for eight frames.

Built once for a mesh; nothing in it depends on poses. Siblings lie next to each other, faces of a leaf too.

Source: Gottschalk, Lin and Manocha (1996) for oriented boxes; Wald (2007) for binned surface-area splits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.bvh.tree_memory import TreeMemory, row_of, words_of_rows
from cdcore.narrow.tree_builder import build_tree, by_surface_area, coordinates_along
from cdcore.numerics import FloatArray, IntArray

LEAF_FACES = 8
"""Most faces of a leaf; 4 were 1.1 times slower for face sets, no faster for booleans (2026-11-22)."""


class BoxTree(NamedTuple):
    """The arrays of one tree; n nodes, f faces in leaf order, c distinct corners of leaves.

    ``boxes`` (n, 16): centre 3, axes 9 (x of all three, then y, z, so that one vector loads it), half extents 3, half
    diagonal 1. ``links`` (n, 2): first child (its sibling follows) or -1, leaf number or -1. ``leaves`` (l, 4):
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
    nodes, _ = build_tree(triangles, by_surface_area, LEAF_FACES)
    leaf_nodes = np.flatnonzero(nodes.child < 0)
    leaf_nodes = leaf_nodes[np.argsort(nodes.start[leaf_nodes])]
    counts = nodes.stop[leaf_nodes] - nodes.start[leaf_nodes]
    links = np.stack([nodes.child, np.full(len(nodes.child), -1)], axis=1)
    links[leaf_nodes, 1] = np.arange(len(leaf_nodes))
    diagonal = np.sqrt((nodes.half**2).sum(axis=1, keepdims=True))
    axes = nodes.axes.transpose(0, 2, 1)
    boxes = np.concatenate([nodes.centre, axes.reshape(-1, 9), nodes.half, diagonal], axis=1)
    leaf = np.repeat(np.arange(len(leaf_nodes)), counts)
    local = nodes.corners - nodes.centre[leaf_nodes][leaf][:, None]
    leaf_axes = nodes.axes[leaf_nodes][leaf].transpose(1, 2, 0)
    boxed = coordinates_along(leaf_axes, local.transpose(1, 2, 0)).transpose(2, 0, 1)
    corners, picks, corner_counts = distinct_corners(local, leaf)
    first_corner = np.cumsum(corner_counts) - corner_counts
    leaves = np.stack([nodes.start[leaf_nodes], counts, first_corner, corner_counts], axis=1)
    placed = nodes.corners[:, [0, 1, 2, 0]].transpose(0, 2, 1)
    spans = np.stack([boxed.min(axis=1), boxed.max(axis=1)], axis=2)
    integers = [np.ascontiguousarray(part, dtype=np.int32) for part in (links, leaves, nodes.number)]
    doubles = [np.ascontiguousarray(part.reshape(len(part), -1)) for part in (placed, corners, boxed, spans)]
    arrays = [boxes, *integers, doubles[0], picks, *doubles[1:]]
    reach = float(np.sqrt((triangles**2).sum(axis=2).max())) * (1 + 2.0**-50)
    row = row_of(TreeMemory, **dict(zip(TreeMemory._fields, arrays, strict=True)))
    return BoxTree._make([*arrays, reach, words_of_rows(row[None])[0]])
