"""The box trees of four published searches: rows say where boxes lie and how faces are cut in two."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.mesh import TriangleMesh, once_for_meshes
from cdcore.narrow.published_trees.tree_search import (
    BOTH,
    FIFTEEN_AXES,
    LARGER,
    LARGER_IN_WORLD,
    SIX_AXES,
    WORLD_BOXES,
    Traversal,
)
from cdcore.narrow.tree_builder import (
    Boxes,
    BoxNodes,
    Rule,
    body_axes,
    build_trees,
    coordinates_along,
    extents,
    principal_axes,
    tighter_boxes,
)
from cdcore.numerics import BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class TreeKind:
    """A hierarchy: the rule by which its tree is cut, and how two trees are searched.

    ``undismissed``: the counter of face pairs that no volume kept apart by the pad.
    """

    rule: Rule
    search: Traversal
    leaf_faces: int = 1
    more_counters: tuple[str, ...] = ()
    undismissed: int = 1

    def trees(self, meshes: Sequence[TriangleMesh]) -> list[tuple[BoxNodes, int]]:
        """The trees of meshes, and their depths."""
        return build_trees([mesh.triangles for mesh in meshes], self.rule, self.leaf_faces)


def along_body_axes(corners: FloatArray, node: IntArray, first: IntArray) -> tuple[Boxes, FloatArray]:
    """Boxes along the body's axes, cut at the median of the centroids along the longest side of their box."""
    centroids = corners[0] / 3 + corners[1] / 3 + corners[2] / 3
    lower, upper = extents(centroids[None], first)
    return _straight(corners, first), _along_longest(centroids, upper / 2 - lower / 2, node)


def solid_boxes(corners: FloatArray, node: IntArray, first: IntArray) -> tuple[Boxes, BoolArray]:
    """Boxes along the body's axes, cut at the middle of their longest side.

    A face lies where the middle of its own box lies. A node whose faces all lie on one side is cut into halves of their
    number.
    """
    middles, boxes = corners.min(axis=0) / 2 + corners.max(axis=0) / 2, _straight(corners, first)
    _, lower, upper = boxes
    return boxes, _along_longest(middles - (lower / 2 + upper / 2)[:, node], upper / 2 - lower / 2, node) > 0


def oriented_boxes(corners: FloatArray, node: IntArray, first: IntArray) -> tuple[Boxes, FloatArray]:
    """Boxes along the principal axes of their faces or the body's axes, whichever box has the smaller surface.

    Cut at the median of the centroids along the longest side of the box.
    """
    boxes, along = tighter_boxes(corners, node, first)
    return boxes, _along_longest(along.sum(axis=0), boxes[2] - boxes[1], node)


def rapid_boxes(corners: FloatArray, node: IntArray, first: IntArray) -> tuple[Boxes, BoolArray]:
    """Boxes along the principal axes of the surface, the longest first, cut through its mean.

    Differs: the covariance is that of the triangles themselves, as in the library, not of their convex hull.
    """
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0], axis=0)
    area, centroids = np.sqrt((normal * normal).sum(axis=0)), corners.mean(axis=0)
    # Faces without area count alike where all of a node have none.
    area[(np.add.reduceat(area, first) == 0)[node]] = 1.0
    total = np.add.reduceat(area, first)
    mean = np.add.reduceat(area * centroids, first, axis=1) / total
    squares = 9 * centroids[:, None] * centroids + (corners[:, :, None] * corners[:, None]).sum(axis=0)
    covariance = np.add.reduceat(area * squares, first, axis=2) / (12 * total) - mean[:, None] * mean
    axes = principal_axes(covariance)
    lower, upper = extents(coordinates_along(axes[..., node], corners), first)
    return (axes, lower, upper), ((centroids - mean[:, node]) * axes[0][:, node]).sum(axis=0) > 0


TREE_KINDS: Final = {
    "rapid-style": TreeKind(rapid_boxes, Traversal(FIFTEEN_AXES, LARGER, equal_opens_a=False)),
    "solid-style": TreeKind(
        solid_boxes,
        Traversal(SIX_AXES, LARGER, gjk=True),
        more_counters=("cache_hits", "gjk_steps", "exact_tests"),
        undismissed=4,
    ),
    "aabb": TreeKind(along_body_axes, Traversal(WORLD_BOXES, LARGER_IN_WORLD)),
    # A box test of fifteen axes costs about as much as three face tests that planes dismiss.
    "obb": TreeKind(oriented_boxes, Traversal(FIFTEEN_AXES, BOTH), leaf_faces=4),
}
"""Detector -> its hierarchy."""

TREES_OF: Final = {name: once_for_meshes(kind.trees) for name, kind in TREE_KINDS.items()}
"""Detector -> the trees of meshes, and their depths; kept as long as the meshes, for all settings of a detector."""


def _straight(corners: FloatArray, first: IntArray) -> Boxes:
    """Boxes along the body's axes; ``corners`` (3, 3, E) of the faces of n nodes, node by node."""
    return body_axes(len(first)), *extents(corners, first)


def _along_longest(points: FloatArray, side: FloatArray, node: IntArray) -> FloatArray:
    """Coordinates of points (3, E) along the longest side (3, n) of their node."""
    return np.take_along_axis(points, np.argmax(side, axis=0)[node][None], axis=0)[0]
