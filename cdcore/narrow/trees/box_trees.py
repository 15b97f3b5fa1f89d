"""The box trees of four published searches: where boxes lie, how faces are cut in two, how many stand in a leaf."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cdcore.narrow.level_tree import Topology, extents, grow_tree
from cdcore.narrow.trees.descent import BoxNodes
from cdcore.numerics import FloatArray, IntArray

LEAF_FACES: Final = 4
"""Of an OBB tree: a box test costs about as much as three face tests that planes dismiss."""

Built = tuple[BoxNodes, int]
"""A tree and its depth, of corners (f, 3, 3)."""


def build_world_box_tree(corners: FloatArray) -> Built:
    """Boxes along the body's axes, cut at the median of the centroids along the longest side of their box."""
    centroids = corners[:, 0] / 3 + corners[:, 1] / 3 + corners[:, 2] / 3
    boxes: list[tuple[FloatArray, FloatArray]] = []

    def along_longest_side(faces: IntArray, node: IntArray, first: IntArray) -> FloatArray:
        boxes.append(extents(corners[faces], first))
        low, high = extents(centroids[faces, None], first)
        return centroids[faces, np.argmax(high / 2 - low / 2, axis=1)[node]]

    return _straight(corners, grow_tree(len(corners), 1, along_longest_side, balanced=True), boxes)


def build_solid_tree(corners: FloatArray) -> Built:
    """Boxes along the body's axes, cut at the middle of their longest side.

    A face lies where the middle of its own box lies. A node whose faces all lie on one side is cut into halves of their
    number.
    """
    middles = corners.min(axis=1) / 2 + corners.max(axis=1) / 2
    boxes: list[tuple[FloatArray, FloatArray]] = []

    def from_middle(faces: IntArray, node: IntArray, first: IntArray) -> FloatArray:
        low, high = extents(corners[faces], first)
        boxes.append((low, high))
        longest = np.argmax(high / 2 - low / 2, axis=1)
        return middles[faces, longest[node]] - (low / 2 + high / 2)[np.arange(len(first)), longest][node]

    return _straight(corners, grow_tree(len(corners), 1, from_middle, balanced=False), boxes)


def build_obb_tree(corners: FloatArray) -> Built:
    """Boxes along the principal axes of their faces or the body's axes, whichever box has the smaller surface.

    Cut at the median of the centroids along the longest side of the box.
    """
    scaled, unit = _scaled(corners)
    boxes: list[tuple[FloatArray, FloatArray, FloatArray]] = []

    def along_longest_side(faces: IntArray, node: IntArray, first: IntArray) -> FloatArray:
        axes, low, high = _tighter_boxes(scaled[faces], node, first)
        boxes.append((axes, low, high))
        longest = axes[np.arange(len(first)), np.argmax(high - low, axis=1)]
        return np.einsum("eci,ei->e", scaled[faces], longest[node])

    return _turned(corners, grow_tree(len(corners), LEAF_FACES, along_longest_side, balanced=True), boxes, unit)


def build_rapid_tree(corners: FloatArray) -> Built:
    """Boxes along the principal axes of the surface, the longest first, cut through its mean.

    Differs: the covariance is that of the triangles themselves, as in the library, not of their convex hull.
    """
    scaled, unit = _scaled(corners)
    area, centroid, second = _moments(scaled)
    boxes: list[tuple[FloatArray, FloatArray, FloatArray]] = []

    def from_mean(faces: IntArray, node: IntArray, first: IntArray) -> FloatArray:
        mean, covariance = _statistics(area[faces], centroid[faces], second[faces], first)
        axes = np.ascontiguousarray(np.linalg.eigh(covariance)[1].transpose(0, 2, 1)[:, ::-1])
        boxes.append((axes, *extents(np.einsum("eci,eki->eck", scaled[faces], axes[node]), first)))
        return np.einsum("ei,ei->e", centroid[faces] - mean[node], axes[node, 0])

    return _turned(corners, grow_tree(len(corners), 1, from_mean, balanced=False), boxes, unit)


def _straight(corners: FloatArray, shape: Topology, boxes: Sequence[tuple[FloatArray, FloatArray]]) -> Built:
    """A tree whose boxes, low and high of each level, lie along the body's axes."""
    low, high = (np.concatenate(part) for part in zip(*boxes, strict=True))
    return _tree(corners, shape, low / 2 + high / 2, np.tile(np.eye(3), (len(low), 1, 1)), high / 2 - low / 2)


def _turned(
    corners: FloatArray, shape: Topology, boxes: Sequence[tuple[FloatArray, FloatArray, FloatArray]], unit: float
) -> Built:
    """A tree of boxes along axes of their own; extents are in units."""
    axes, low, high = (np.concatenate(part) for part in zip(*boxes, strict=True))
    centre = np.einsum("nki,nk->ni", axes, low / 2 + high / 2) * unit
    return _tree(corners, shape, centre, axes, (high / 2 - low / 2) * unit)


def _tree(corners: FloatArray, shape: Topology, centre: FloatArray, axes: FloatArray, half: FloatArray) -> Built:
    faces = np.ascontiguousarray(corners[shape.order])
    nodes = shape.child, shape.start, shape.stop, centre, axes, half, half.max(axis=1)
    return BoxNodes(faces, shape.order, *nodes), shape.depth


def _scaled(corners: FloatArray) -> tuple[FloatArray, float]:
    """Corners over their size, so that the covariance of a mesh of 1e-200 m neither vanishes nor overflows."""
    size = float(np.abs(corners).max())
    return (corners / size, size) if size > 0 else (corners, 1.0)


def _tighter_boxes(corners: FloatArray, node: IntArray, first: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Axes (n, 3, 3) and extents along them (n, 3) of n nodes; ``corners`` (E, 3, 3) of their faces, node by node."""
    sizes = np.diff(first, append=len(node))[:, None]
    mean = np.add.reduceat(corners.mean(axis=1), first) / sizes
    spread = corners - mean[node][:, None]
    covariance = np.add.reduceat(np.einsum("eci,ecj->eij", spread, spread), first)
    principal = np.ascontiguousarray(np.linalg.eigh(covariance)[1].transpose(0, 2, 1))
    body = np.broadcast_to(np.eye(3), principal.shape)
    turned = extents(np.einsum("eci,eki->eck", corners, principal[node]), first)
    straight = extents(corners, first)
    tighter = _half_surface(*turned) < _half_surface(*straight)
    low, high = (np.where(tighter[:, None], one, other) for one, other in zip(turned, straight, strict=True))
    return np.where(tighter[:, None, None], principal, body), low, high


def _half_surface(low: FloatArray, high: FloatArray) -> FloatArray:
    x, y, z = (high - low).T
    return x * y + y * z + z * x


def _moments(corners: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Area (f,), centroid (f, 3) and second moment about the origin per unit of area (f, 3, 3) of triangles."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1) / 2
    centroid = corners.mean(axis=1)
    outer = np.einsum("fci,fcj->fij", corners, corners)
    return area, centroid, (9 * centroid[:, :, None] * centroid[:, None, :] + outer) / 12


def _statistics(
    area: FloatArray, centroid: FloatArray, second: FloatArray, first: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Mean (n, 3) and covariance (n, 3, 3) of the surface of n nodes; faces without area count alike."""
    sizes = np.diff(first, append=len(area))
    flat = np.repeat(np.add.reduceat(area, first) <= 0.0, sizes)
    weight = np.where(flat, 1.0, area)
    total = np.add.reduceat(weight, first)
    mean = np.add.reduceat(weight[:, None] * centroid, first) / total[:, None]
    moment = np.add.reduceat(weight[:, None, None] * second, first) / total[:, None, None]
    return mean, moment - mean[:, :, None] * mean[:, None, :]
