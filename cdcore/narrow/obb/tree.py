"""A tree of oriented boxes: along a node's principal axes or the body's, whichever box has the smaller surface."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from cdcore.narrow.level_tree import extents, grow_tree
from cdcore.numerics import FloatArray, IntArray

LEAF_FACES: Final = 4
"""A box test costs about as much as three face tests that planes dismiss, so leaves of several faces pay."""


class ObbTree(NamedTuple):
    """Boxes of n nodes in the body's frame.

    ``corners`` (f, 3, 3) faces in the order of the leaves, ``number`` (f,) their numbers in the mesh; ``child`` (n,)
    first of two neighbouring children or -1; ``start``, ``stop`` (n,) a node's faces; ``centre`` (n, 3), ``axes``
    (n, 3, 3) one axis a row, ``half`` (n, 3).
    """

    corners: FloatArray
    number: IntArray
    child: IntArray
    start: IntArray
    stop: IntArray
    centre: FloatArray
    axes: FloatArray
    half: FloatArray


def build_obb_tree(corners: FloatArray) -> tuple[ObbTree, int]:
    """Cut at the median of the centroids along the longest side of the box; the tree and its depth."""
    size = float(np.abs(corners).max())
    # Divided by their size, so that the covariance of a mesh of 1e-200 m neither vanishes nor overflows.
    scaled = corners / size if size > 0 else corners
    boxes: list[tuple[FloatArray, FloatArray, FloatArray]] = []

    def fit(faces: IntArray, node: IntArray, first: IntArray) -> FloatArray:
        axes, low, high = _tighter_boxes(scaled[faces], node, first)
        boxes.append((axes, low, high))
        longest = axes[np.arange(len(first)), np.argmax(high - low, axis=1)]
        keys: FloatArray = np.einsum("eci,ei->e", scaled[faces], longest[node])
        return keys

    shape = grow_tree(len(corners), LEAF_FACES, fit, balanced=True)
    axes, low, high = (np.concatenate(part) for part in zip(*boxes, strict=True))
    unit = size if size > 0 else 1.0
    centre = np.einsum("nki,nk->ni", axes, low / 2 + high / 2) * unit
    ordered = np.ascontiguousarray(corners[shape.order])
    tree = ObbTree(
        ordered, shape.order, shape.child, shape.start, shape.stop, centre, axes, (high / 2 - low / 2) * unit
    )
    return tree, shape.depth


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
    area: FloatArray = x * y + y * z + z * x
    return area
