"""How far along a ray a triangle is crossed, in floats."""

from typing import Final

import numpy as np

from cdcore.numerics import FloatArray

WIDER: Final = 1e-12
"""By this share of a face its edges are moved out, so that no ray slips between two of them."""


def crossing(triangles: FloatArray, origins: FloatArray, rays: FloatArray) -> FloatArray:
    """How far along its ray (..., 3) each triangle (..., 3, 3) is crossed, (...); inf: not, or the ray lies in it.

    Source: Moeller and Trumbore, "Fast, minimum storage ray-triangle intersection", 1997.
    """
    a = triangles[..., 0, :]
    edge_b, edge_c = triangles[..., 1, :] - a, triangles[..., 2, :] - a
    p = np.cross(rays, edge_c)
    determinant = (edge_b * p).sum(axis=-1)
    flat = determinant == 0
    inverse = 1.0 / np.where(flat, 1.0, determinant)
    from_a = origins - a
    u = (from_a * p).sum(axis=-1) * inverse
    q = np.cross(from_a, edge_b)
    v = (rays * q).sum(axis=-1) * inverse
    t = (edge_c * q).sum(axis=-1) * inverse
    inside = ~flat & (u >= -WIDER) & (v >= -WIDER) & (u + v <= 1 + WIDER) & (t >= 0)
    return np.where(inside, t, np.inf)
