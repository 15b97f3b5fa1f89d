"""Float bounds of clearance and penetration that are always on the safe side; integers decide what they leave open."""

from __future__ import annotations

import numpy as np

from cdcore.numerics import EPS, FloatArray

PROJECTION_ULPS = 16.0
"""Rounding of a difference, a dot product and a division, in eps of the triangles' extent."""
DIRECTION_ULPS = 64.0
"""Rounding of a cross product turns an axis: by this many eps of the edges' lengths over the product's."""
PARALLEL = 1e-9
"""Edges whose cross product is shorter than this share of their lengths count as parallel. Their axis, if they have
one, is across both; and across a common edge the least overlap is along a face's normal, so it adds nothing."""
PARALLEL_PAD = 1e-8
"""Of the extent: covers the angle below which edges count as parallel."""


def overlap_bounds(pairs: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bounds, lower and upper, of the least overlap of triangle pairs (n, 2, 3, 3) along the eleven axes of a pair,
    two normals and nine cross products of edges, and a distance that the triangles certainly keep; (n,) each.
    """
    points = pairs - pairs[:, :1, :1]
    extent = 2.0 * np.abs(points).max(axis=(1, 2, 3))[:, None]
    edges = np.roll(points, -1, axis=2) - points
    first = np.concatenate([edges[:, :, 0], np.repeat(edges[:, 0], 3, axis=1)], axis=1)
    second = np.concatenate([edges[:, :, 1], np.tile(edges[:, 1], (1, 3, 1))], axis=1)
    axes = np.cross(first, second)
    lengths = np.linalg.norm(first, axis=2) * np.linalg.norm(second, axis=2)
    length = np.linalg.norm(axes, axis=2)
    known = length > PARALLEL * lengths
    length[~known] = 1.0
    along = np.einsum("nbck,nak->nbac", points, axes) / length[:, None, :, None]
    lower, upper = along.min(axis=3), along.max(axis=3)
    overlap = np.minimum(upper[:, 0] - lower[:, 1], upper[:, 1] - lower[:, 0])
    rounding = PROJECTION_ULPS * EPS * extent
    turning = DIRECTION_ULPS * EPS * extent * lengths / length
    # along the normal of a triangle that has none anything may be less, across edges that are nearly parallel little
    unknown = np.where(np.arange(known.shape[1]) < 2, -np.inf, np.inf)
    least = np.where(known, overlap - rounding - turning, unknown).min(axis=1)
    least -= np.where(known.all(axis=1), 0.0, PARALLEL_PAD * extent[:, 0])
    most = np.where(known, overlap + rounding + turning, np.inf).min(axis=1)
    return least, most, np.where(known, -overlap - rounding, -np.inf).max(axis=1)
