"""The trees of boxes, each a row of ``TREE_KINDS``: where boxes lie, how faces are cut in two, how two are searched.

Rules take a level of nodes at once, as ``Rule`` of the builder says.

Source: I. Wald, On fast construction of SAH-based bounding volume hierarchies (2007), for binned splits by surface
area; those of the others stand at their detectors.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cdcore.mesh import TriangleMesh
from cdcore.narrow.tree_builder import (
    Boxes,
    BoxNodes,
    Rule,
    body_axes,
    build_trees,
    coordinates_along,
    extents,
    half_surface,
    principal_axes,
    tighter_boxes,
)
from cdcore.numerics import BoolArray, FloatArray, IntArray

BINS: Final = 16
"""Places along an axis at which a split by surface area may cut."""
SHORTEST_SPLIT: Final = 0.25
"""Axes along which a box is shorter than this share of its longest side are not tried."""

WORLD_BOXES, SIX_AXES, FIFTEEN_AXES = range(3)
"""Box tests."""
LARGER_IN_WORLD, LARGER, BOTH = range(3)
"""What opens of two nodes that are no leaves."""


class Traversal(NamedTuple):
    """How two trees are searched.

    ``equal_opens_a``: of two boxes of one size A's opens; ``gjk``: faces are asked with GJK before exact arithmetic.
    """

    box_test: int
    opens: int
    equal_opens_a: bool = True
    gjk: bool = False


@dataclass(frozen=True)
class TreeKind:
    """A hierarchy: the rule by which its tree is cut, and how two trees are searched.

    ``search``: pose by pose, by ``published_trees``; ``None``: eight frames at once, by ``bvh``, whose box test is its
    own. ``undismissed``: the counter of face pairs that no volume kept apart by the pad.
    """

    rule: Rule
    search: Traversal | None = None
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


def by_surface_area(corners: FloatArray, node: IntArray, first: IntArray) -> tuple[Boxes, BoolArray]:
    """Tighter boxes, cut where the numbers of faces times the surfaces of both sides are least."""
    boxes, along = tighter_boxes(corners, node, first)
    side, centroids = boxes[2] - boxes[1], along.mean(axis=0)
    spans = np.concatenate([along.min(axis=0), -along.max(axis=0)])
    cost, position = cheapest_cuts(spans, centroids, node, first)
    cost[side < SHORTEST_SPLIT * side.max(axis=0)] = np.inf
    position[cost == np.inf] = np.inf
    best = cost.argmin(axis=0)[node]
    return boxes, centroids[best, np.arange(len(node))] >= position[best, node]


def cheapest_cuts(
    spans: FloatArray, along: FloatArray, node: IntArray, first: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Costs and places (3, n) of the cheapest cuts along three axes; an infinite cost where nothing can be cut.

    ``spans`` (6, E): least coordinates of a face and its largest, negative; ``along`` (3, E) its centroid's.
    """
    lower = np.minimum.reduceat(along, first, axis=1)
    width = (np.maximum.reduceat(along, first, axis=1) - lower) / BINS
    fraction = (along - lower[:, node]) / np.where(width > 0, width, 1.0)[:, node]
    # Bins are the slowest axis: the smallest up to each bin are then one call a bin.
    rows = node + len(first) * np.arange(3)[:, None]
    slot = (lower.size * np.minimum(BINS - 1, fraction.astype(np.int64)) + rows).ravel()
    counts = np.bincount(slot, minlength=BINS * lower.size).reshape(BINS, *lower.shape).cumsum(axis=0)
    boxes = np.full((6, BINS, *lower.shape), np.inf)
    for bound, coordinate in zip(boxes.reshape(6, -1), spans, strict=True):
        np.minimum.at(bound, slot, np.tile(coordinate, 3))
    after = half_surface(-box_sides(boxes[:, ::-1])[:, -2::-1])
    before = half_surface(-box_sides(boxes)[:, :-1])
    number, total = counts[:-1], counts[-1:]
    with np.errstate(invalid="ignore"):
        cost = number * before + (total - number) * after
    cost[(number == 0) | (number == total)] = np.inf
    return cost.min(axis=0), lower + (cost.argmin(axis=0) + 1) * width


def box_sides(bounds: FloatArray) -> FloatArray:
    """Sides (3, b, ...), negative, of the box around the contents of each bin and those before it.

    ``bounds`` (6, b, ...) of each bin: least coordinates, and the largest, negative.
    """
    sides = np.empty_like(bounds[:3])
    least = bounds[:, 0]
    for number in range(bounds.shape[1]):
        least = np.minimum(least, bounds[:, number])
        np.add(least[:3], least[3:], out=sides[:, number])
    return sides


TREE_KINDS: Final = {
    # Leaves of 4 faces were 1.1 times slower for face sets, no faster for booleans (2026-11-22).
    "exact": TreeKind(by_surface_area, leaf_faces=8),
    # A box test of fifteen axes costs about as much as three face tests that planes dismiss.
    "obb": TreeKind(oriented_boxes, Traversal(FIFTEEN_AXES, BOTH), leaf_faces=4),
    "aabb": TreeKind(along_body_axes, Traversal(WORLD_BOXES, LARGER_IN_WORLD)),
    "rapid-style": TreeKind(rapid_boxes, Traversal(FIFTEEN_AXES, LARGER, equal_opens_a=False)),
    "solid-style": TreeKind(
        solid_boxes,
        Traversal(SIX_AXES, LARGER, gjk=True),
        more_counters=("cache_hits", "gjk_steps", "exact_tests"),
        undismissed=4,
    ),
}
"""Detector -> its hierarchy."""


def _straight(corners: FloatArray, first: IntArray) -> Boxes:
    """Boxes along the body's axes; ``corners`` (3, 3, E) of the faces of n nodes, node by node."""
    return body_axes(len(first)), *extents(corners, first)


def _along_longest(points: FloatArray, side: FloatArray, node: IntArray) -> FloatArray:
    """Coordinates of points (3, E) along the longest side (3, n) of their node."""
    return np.take_along_axis(points, np.argmax(side, axis=0)[node][None], axis=0)[0]
