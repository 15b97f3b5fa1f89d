"""RAPID's tree: boxes along the principal axes of the surface, cut through its mean across the longest axis.

Source: S. Gottschalk, M. C. Lin, D. Manocha, OBBTree: a hierarchical structure for rapid interference detection (1996),
section 4. Differs: the covariance is that of the triangles themselves, as in the library, not of their convex hull.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdcore.narrow.level_tree import extents, grow_tree
from cdcore.numerics import FloatArray, IntArray


class RapidTree(NamedTuple):
    """Boxes of n nodes in the body's frame, one face a leaf.

    ``corners`` (f, 3, 3); ``child`` (n,) first of two neighbouring children or -1; ``leaf`` (n,) face of a leaf;
    ``centre`` (n, 3), ``axes`` (n, 3, 3) one axis a row, ``half`` (n, 3) largest first, ``size`` (n,) longest half.
    """

    corners: FloatArray
    child: IntArray
    leaf: IntArray
    centre: FloatArray
    axes: FloatArray
    half: FloatArray
    size: FloatArray


def build_rapid_tree(corners: FloatArray) -> tuple[RapidTree, int]:
    """The tree and its depth."""
    scale = float(np.abs(corners).max())
    scaled = corners / scale if scale > 0 else corners
    area, centroid, second = _moments(scaled)
    boxes: list[tuple[FloatArray, FloatArray, FloatArray]] = []

    def fit(faces: IntArray, node: IntArray, first: IntArray) -> FloatArray:
        mean, covariance = _statistics(area[faces], centroid[faces], second[faces], first)
        axes = np.ascontiguousarray(np.linalg.eigh(covariance)[1].transpose(0, 2, 1)[:, ::-1])
        boxes.append((axes, *extents(np.einsum("eci,eki->eck", scaled[faces], axes[node]), first)))
        keys: FloatArray = np.einsum("ei,ei->e", centroid[faces] - mean[node], axes[node, 0])
        return keys

    shape = grow_tree(len(corners), 1, fit, balanced=False)
    axes, low, high = (np.concatenate(part) for part in zip(*boxes, strict=True))
    unit = scale if scale > 0 else 1.0
    centre = np.einsum("nki,nk->ni", axes, low / 2 + high / 2) * unit
    half = (high / 2 - low / 2) * unit
    tree = RapidTree(corners, shape.child, shape.order[shape.start], centre, axes, half, half.max(axis=1))
    return tree, shape.depth


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
