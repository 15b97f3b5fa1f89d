"""Where rays first meet a mesh, in floats: balls around groups of neighbouring faces, then the faces themselves."""

from typing import Final

import numpy as np

from cdcore.narrow.level_tree import morton_codes
from cdcore.numerics import FloatArray, IntArray

GROUP: Final = 16
"""Faces in a ball: of 8, 16, 32 and 64 the quickest for 17,000 faces: 1.4 s for 54,000 rays (2026-11-22)."""

TOGETHER: Final = 1 << 20
"""Rays times balls, and rays times faces, that are held at a time: some 100 MB."""

WIDER: Final = 1e-12
"""By this share of a face its edges are moved out, so that no ray slips between two of them."""

ROUND: Final = 1.001


class FirstHits:
    """One mesh, ready to be asked many rays in its own frame."""

    def __init__(self, triangles: FloatArray) -> None:
        """``triangles``: (f, 3, 3)."""
        order = np.argsort(morton_codes(triangles.mean(axis=1)), kind="stable")
        rows = -(-len(order) // GROUP) * GROUP
        self._faces = triangles[np.resize(order, rows)].reshape(-1, GROUP, 3, 3)
        corners = self._faces.reshape(len(self._faces), -1, 3)
        self._balls = _balls_around(corners)
        self._whole = _balls_around(corners.reshape(1, -1, 3))

    def distances(self, origins: FloatArray, rays: FloatArray) -> FloatArray:
        """How far along each ray (n, 3) of length 1 from its origin (n, 3) a face comes first, (n,); inf: never."""
        nearest = np.full(len(rays), np.inf)
        near, _ = _meeting(*self._whole, origins, rays)
        step = max(1, TOGETHER // len(self._faces))
        for start in range(0, len(near), step):
            part = near[start : start + step]
            ray, ball = _meeting(*self._balls, origins[part], rays[part])
            for at in range(0, len(ray), TOGETHER // GROUP):
                some = slice(at, at + TOGETHER // GROUP)
                row = part[ray[some]]
                ahead = crossing(self._faces[ball[some]], origins[row, None], rays[row, None])
                np.minimum.at(nearest, row, ahead.min(axis=1))
        return nearest


def _balls_around(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centres (g, 3) and radii (g,) of balls around points (g, n, 3)."""
    centres = (corners.min(axis=1) + corners.max(axis=1)) / 2
    return centres, np.sqrt(((corners - centres[:, None]) ** 2).sum(axis=2).max(axis=1))


def _meeting(
    centres: FloatArray, radii: FloatArray, origins: FloatArray, rays: FloatArray
) -> tuple[IntArray, IntArray]:
    """Numbers of the rays and of the balls that meet; the share more of a radius covers all rounding."""
    to = centres - origins[:, None]
    along = np.einsum("ngk,nk->ng", to, rays)
    aside = np.einsum("ngk,ngk->ng", to, to) - along**2
    ray, ball = np.nonzero((aside <= radii**2 * ROUND + 1e-12) & (along >= -radii * ROUND))
    return ray, ball


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
