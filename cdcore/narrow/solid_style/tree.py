"""SOLID's tree: boxes along the body's own axes, cut at the middle of their longest side.

Source: G. van den Bergen, Efficient collision detection of complex deformable models using AABB trees (1997).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdcore.narrow.level_tree import extents, grow_tree
from cdcore.numerics import FloatArray, IntArray


class SolidTree(NamedTuple):
    """Boxes of n nodes in the body's frame, one face a leaf.

    ``corners`` (f, 3, 3); ``child`` (n,) first of two neighbouring children or -1; ``leaf`` (n,) face of a leaf;
    ``centre`` (n, 3), ``half`` (n, 3), ``size`` (n,) longest half.
    """

    corners: FloatArray
    child: IntArray
    leaf: IntArray
    centre: FloatArray
    half: FloatArray
    size: FloatArray


def build_solid_tree(corners: FloatArray) -> tuple[SolidTree, int]:
    """The tree and its depth; a node whose faces all lie on one side of the middle is cut into halves of their number.

    A face lies where the middle of its own box lies.
    """
    middles = corners.min(axis=1) / 2 + corners.max(axis=1) / 2
    boxes: list[tuple[FloatArray, FloatArray]] = []

    def fit(faces: IntArray, node: IntArray, first: IntArray) -> FloatArray:
        low, high = extents(corners[faces], first)
        centre, half = low / 2 + high / 2, high / 2 - low / 2
        boxes.append((centre, half))
        longest = np.argmax(half, axis=1)
        keys: FloatArray = middles[faces, longest[node]] - centre[np.arange(len(first)), longest][node]
        return keys

    shape = grow_tree(len(corners), 1, fit, balanced=False)
    centre, half = (np.concatenate(part) for part in zip(*boxes, strict=True))
    return SolidTree(corners, shape.child, shape.order[shape.start], centre, half, half.max(axis=1)), shape.depth
