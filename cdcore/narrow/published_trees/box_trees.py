"""One builder for the box trees of four published searches: rows say where boxes lie and how faces are cut in two."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.narrow.published_trees.tree_descent import OBB, RAPID, SOLID, WORLD, BoxNodes
from cdcore.numerics import FloatArray, IntArray

Boxes = tuple[FloatArray, FloatArray, FloatArray]
"""Of the n nodes of a level: axes (n, 3, 3), one a row, and the least and largest coordinates along them (n, 3)."""

Level = Callable[[IntArray, IntArray, IntArray], tuple[Boxes, FloatArray]]
"""``(faces, node, first) -> boxes, key``: called once a level with the faces of all its nodes (E,), the node within the
level each belongs to (E,), and where each node's faces start (n,); the key is the place of each face along the cut."""


@dataclass(frozen=True)
class TreeKind:
    """A hierarchy: how a level of its tree is cut, of corners (f, 3, 3), and how two trees are searched.

    ``balanced``: cut at the median of the keys; else between keys up to 0 and keys above, and in the middle where that
    leaves one side empty. ``scaled``: corners come divided by their size, so that the covariance of a mesh of 1e-200 m
    neither vanishes nor overflows. ``undismissed``: the counter of face pairs that no volume kept apart by the pad.
    """

    level: Callable[[FloatArray], Level]
    search: int
    balanced: bool
    scaled: bool
    leaf_faces: int = 1
    more_counters: tuple[str, ...] = ()
    undismissed: int = 1


def build_tree(corners: FloatArray, kind: TreeKind) -> tuple[BoxNodes, int]:
    """A tree over faces (f, 3, 3), and its depth: level by level with whole arrays, nothing to compile, no recursion.

    Nodes stand in order of their level, so children come after their parent and siblings are neighbours.
    """
    unit = float(np.abs(corners).max()) if kind.scaled else 1.0
    unit = unit if unit > 0 else 1.0
    level, order = kind.level(corners / unit), np.arange(len(corners))
    start, stop = np.array([0]), np.array([len(corners)])
    levels: list[tuple[FloatArray | IntArray, ...]] = []
    count = 0
    while len(start):
        sizes = stop - start
        first = np.cumsum(sizes) - sizes
        node = np.repeat(np.arange(len(start)), sizes)
        place = np.arange(len(node)) + np.repeat(start - first, sizes)
        faces = order[place]
        boxes, key = level(faces, node, first)
        rank = key if kind.balanced else key > 0
        order[place] = faces[np.lexsort((faces, rank, node))]
        opened, cut = sizes > kind.leaf_faces, sizes // 2
        if not kind.balanced:
            below = sizes - np.add.reduceat(rank.astype(np.int64), first)
            cut = np.where((below > 0) & (below < sizes), below, cut)
        count += len(start)
        child = np.full(len(start), -1, dtype=np.int64)
        child[opened] = count + 2 * np.arange(opened.sum())
        levels.append((child, start, stop, *boxes))
        low, middle, high = start[opened], start[opened] + cut[opened], stop[opened]
        start, stop = np.column_stack([low, middle]).ravel(), np.column_stack([middle, high]).ravel()
    child, start, stop, axes, low, high = (np.concatenate(part) for part in zip(*levels, strict=True))
    centre, half = np.einsum("nki,nk->ni", axes, low / 2 + high / 2) * unit, (high / 2 - low / 2) * unit
    faces = np.ascontiguousarray(corners[order])
    return BoxNodes(faces, order, child, start, stop, centre, axes, half, half.max(axis=1)), len(levels)


def along_body_axes(corners: FloatArray) -> Level:
    """Boxes along the body's axes, cut at the median of the centroids along the longest side of their box."""
    centroids = corners[:, 0] / 3 + corners[:, 1] / 3 + corners[:, 2] / 3

    def level(faces: IntArray, node: IntArray, first: IntArray) -> tuple[Boxes, FloatArray]:
        low, high = _extents(centroids[faces, None], first)
        return _straight(corners[faces], first), centroids[faces, np.argmax(high / 2 - low / 2, axis=1)[node]]

    return level


def solid_boxes(corners: FloatArray) -> Level:
    """Boxes along the body's axes, cut at the middle of their longest side.

    A face lies where the middle of its own box lies. A node whose faces all lie on one side is cut into halves of their
    number.
    """
    middles = corners.min(axis=1) / 2 + corners.max(axis=1) / 2

    def level(faces: IntArray, node: IntArray, first: IntArray) -> tuple[Boxes, FloatArray]:
        boxes = _straight(corners[faces], first)
        longest, middle = np.argmax(boxes[2] / 2 - boxes[1] / 2, axis=1), boxes[1] / 2 + boxes[2] / 2
        return boxes, middles[faces, longest[node]] - middle[np.arange(len(first)), longest][node]

    return level


def oriented_boxes(corners: FloatArray) -> Level:
    """Boxes along the principal axes of their faces or the body's axes, whichever box has the smaller surface.

    Cut at the median of the centroids along the longest side of the box.
    """

    def level(faces: IntArray, node: IntArray, first: IntArray) -> tuple[Boxes, FloatArray]:
        axes, low, high = _tighter_boxes(corners[faces], node, first)
        longest = axes[np.arange(len(first)), np.argmax(high - low, axis=1)]
        return (axes, low, high), np.einsum("eci,ei->e", corners[faces], longest[node])

    return level


def rapid_boxes(corners: FloatArray) -> Level:
    """Boxes along the principal axes of the surface, the longest first, cut through its mean.

    Differs: the covariance is that of the triangles themselves, as in the library, not of their convex hull.
    """
    area, centroid, second = _moments(corners)

    def level(faces: IntArray, node: IntArray, first: IntArray) -> tuple[Boxes, FloatArray]:
        mean, covariance = _statistics(area[faces], centroid[faces], second[faces], first)
        axes = np.ascontiguousarray(np.linalg.eigh(covariance)[1].transpose(0, 2, 1)[:, ::-1])
        low, high = _extents(np.einsum("eci,eki->eck", corners[faces], axes[node]), first)
        return (axes, low, high), np.einsum("ei,ei->e", centroid[faces] - mean[node], axes[node, 0])

    return level


TREE_KINDS: Final = {
    "rapid-style": TreeKind(rapid_boxes, RAPID, balanced=False, scaled=True),
    "solid-style": TreeKind(
        solid_boxes, SOLID, balanced=False, scaled=False, more_counters=("cache_hits", "gjk_steps", "exact_tests"),
        undismissed=4,
    ),
    "aabb": TreeKind(along_body_axes, WORLD, balanced=True, scaled=False),
    # A box test of fifteen axes costs about as much as three face tests that planes dismiss.
    "obb": TreeKind(oriented_boxes, OBB, balanced=True, scaled=True, leaf_faces=4),
}  # fmt: skip
"""Detector -> its hierarchy."""


def _extents(along: FloatArray, first: IntArray) -> tuple[FloatArray, FloatArray]:
    """Least and largest coordinates (n, 3) of n nodes; ``along`` (E, c, 3): corners of their faces, node after node."""
    return np.minimum.reduceat(along.min(axis=1), first), np.maximum.reduceat(along.max(axis=1), first)


def _straight(corners: FloatArray, first: IntArray) -> Boxes:
    """Boxes along the body's axes; ``corners`` (E, 3, 3) of the faces of n nodes, node by node."""
    return np.tile(np.eye(3), (len(first), 1, 1)), *_extents(corners, first)


def _tighter_boxes(corners: FloatArray, node: IntArray, first: IntArray) -> Boxes:
    """Axes (n, 3, 3) and extents along them (n, 3) of n nodes; ``corners`` (E, 3, 3) of their faces, node by node."""
    sizes = np.diff(first, append=len(node))[:, None]
    mean = np.add.reduceat(corners.mean(axis=1), first) / sizes
    spread = corners - mean[node][:, None]
    covariance = np.add.reduceat(np.einsum("eci,ecj->eij", spread, spread), first)
    principal = np.ascontiguousarray(np.linalg.eigh(covariance)[1].transpose(0, 2, 1))
    body = np.broadcast_to(np.eye(3), principal.shape)
    turned = _extents(np.einsum("eci,eki->eck", corners, principal[node]), first)
    straight = _extents(corners, first)
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
