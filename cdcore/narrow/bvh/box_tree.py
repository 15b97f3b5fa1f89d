"""A hierarchy of oriented boxes over a mesh, split by the surface-area heuristic, its leaves ready for eight frames.

Built once for a mesh; nothing in it depends on poses. Siblings lie next to each other, faces of a leaf too.

Source: Gottschalk, Lin and Manocha (1996) for oriented boxes; Wald (2007) for binned surface-area splits.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from cdcore.kernels.memory import integers_of_rows, row_of
from cdcore.mesh import TriangleMesh, once_for_meshes
from cdcore.narrow.bvh.tree_memory import TreeMemory
from cdcore.narrow.tree_builder import BoxNodes, build_trees, coordinates_along
from cdcore.narrow.tree_kinds import TREE_KINDS
from cdcore.numerics import FloatArray, Int32Array, IntArray


class BoxTree(NamedTuple):
    """The arrays of one tree; n nodes, f faces in leaf order.

    ``boxes`` (n, 16): centre 3, axes 9 (x of all three, then y, z, so that one vector loads it), half extents 3, half
    diagonal 1. ``child`` (n,): first child (its sibling follows), -1 of a leaf. ``start``, ``stop`` (n,): a node's
    faces. ``faces`` (f,): numbers in the mesh. ``placed`` (f, 12): corners in the body frame, as the mesh has
    them, x of corners 0, 1, 2, 0, then y, then z. ``corners`` (f, 9): the same, body axes, from the leaf's centre.
    ``boxed`` (f, 9): corners in the leaf's box frame. ``spans`` (f, 6): least and largest coordinate of the face along
    each axis of the leaf's box. ``reach``: largest distance of a corner from the body's origin, rounded up.
    ``memory_row`` (9,): where the kernels find them, the row of a ``TreeMemory``.
    """

    boxes: FloatArray
    child: Int32Array
    start: Int32Array
    stop: Int32Array
    faces: Int32Array
    placed: FloatArray
    corners: FloatArray
    boxed: FloatArray
    spans: FloatArray
    reach: float
    memory_row: IntArray

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy has arrays of its own, so its row names these."""
        return _tree_of_arrays, tuple(self[:-1])


@once_for_meshes
def box_trees_of(meshes: Sequence[TriangleMesh]) -> list[BoxTree]:
    """The trees of meshes; to build one of 3,000 faces takes 40 ms."""
    return build_box_trees([mesh.triangles for mesh in meshes])


def build_box_trees(bodies: Sequence[FloatArray]) -> list[BoxTree]:
    """The trees of meshes from their corners (f, 3, 3), body frame."""
    kind = TREE_KINDS["exact"]
    built = build_trees(bodies, kind.rule, kind.leaf_faces)
    return [_box_tree(nodes, triangles) for (nodes, _), triangles in zip(built, bodies, strict=True)]


def _box_tree(nodes: BoxNodes, triangles: FloatArray) -> BoxTree:
    """Builds the arrays that kernels read of the nodes over triangles (f, 3, 3)."""
    leaf_nodes = np.flatnonzero(nodes.child < 0)
    leaf_nodes = leaf_nodes[np.argsort(nodes.start[leaf_nodes])]
    leaf = np.repeat(leaf_nodes, nodes.stop[leaf_nodes] - nodes.start[leaf_nodes])
    diagonal = np.sqrt((nodes.half**2).sum(axis=1, keepdims=True))
    axes = nodes.axes.transpose(0, 2, 1)
    boxes = np.concatenate([nodes.centre, axes.reshape(-1, 9), nodes.half, diagonal], axis=1)
    local = nodes.corners - nodes.centre[leaf][:, None]
    leaf_axes = nodes.axes[leaf].transpose(1, 2, 0)
    boxed = coordinates_along(leaf_axes, local.transpose(1, 2, 0)).transpose(2, 0, 1)
    placed = nodes.corners[:, [0, 1, 2, 0]].transpose(0, 2, 1)
    spans = np.stack([boxed.min(axis=1), boxed.max(axis=1)], axis=2)
    integers = [array.astype(np.int32) for array in (nodes.child, nodes.start, nodes.stop, nodes.number)]
    doubles = [np.ascontiguousarray(array.reshape(len(array), -1)) for array in (placed, local, boxed, spans)]
    arrays = [boxes, *integers, *doubles]
    reach = float(np.sqrt((triangles**2).sum(axis=2).max())) * (1 + 2.0**-50)
    return _tree_of_arrays(*arrays, reach)


def _tree_of_arrays(*arrays_and_reach: Any) -> BoxTree:
    """A tree of the fields of a ``BoxTree`` but the last, the row that names its arrays by address."""
    arrays = arrays_and_reach[:-1]
    row = row_of(TreeMemory, **dict(zip(TreeMemory._fields, arrays, strict=True)))
    return BoxTree._make([*arrays_and_reach, integers_of_rows(row)[0]])
