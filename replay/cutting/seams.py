"""Seams between the convex pieces of a mesh: where two overlap, and where two leave a slit in its material."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import combinations
from typing import Final

import numpy as np

from cdcore.mesh import TriangleMesh
from cdcore.numerics import FloatArray
from replay.cutting.convex_solids import beyond_planes
from replay.cutting.surface_distance import is_outside

NARROWEST_SEAM: Final = 1e-6
"""Metres; a seam that is narrower is the rounding of a file's numbers."""

WIDEST_SLIT: Final = 0.1
"""Fraction of the size of a mesh; pieces that are farther apart leave out a part of it, not a slit."""

FACING_FRACTION: Final = 0.5
"""Fraction of a slit's width by which corners of its walls may lie behind their foremost corner."""


class SeamKind(StrEnum):
    """How two pieces fail to meet."""

    OVERLAP = "overlap"
    SLIT = "slit"


@dataclass(frozen=True)
class Seam:
    """A place where two pieces overlap or leave a slit.

    Parameters
    ----------
    pieces : numbers of both, from 0.
    width : metres; of an overlap the shortest way that separates them, of a slit the shortest way that closes it.
    point : a point of it, (3,), in the axes of the body.
    """

    kind: SeamKind
    pieces: tuple[int, int]
    width: float
    point: tuple[float, float, float]


def seams_of(mesh: TriangleMesh, pieces: Sequence[TriangleMesh]) -> list[Seam]:
    """Seams between closed convex pieces of a mesh, the widest first.

    Pieces apart leave a slit where a closed mesh has material between them that no other piece fills. A wedge between
    pieces that touch along an edge is not found: its width is 0 there.
    """
    mesh_size = float(np.ptp(mesh.vertices, axis=0).max())
    lower = np.array([piece.vertices.min(axis=0) for piece in pieces])
    upper = np.array([piece.vertices.max(axis=0) for piece in pieces])
    seams = []
    for first, second in combinations(range(len(pieces)), 2):
        box_gap = np.maximum(lower[first] - upper[second], lower[second] - upper[first])
        if float(np.linalg.norm(np.maximum(box_gap, 0.0))) > WIDEST_SLIT * mesh_size:
            continue
        gap = signed_gap(pieces[first].vertices, pieces[second].vertices)
        pair_numbers = first, second
        if gap.metres < -NARROWEST_SEAM:
            point = _common_point(pieces[first].vertices, pieces[second].vertices)
            seams.append(Seam(SeamKind.OVERLAP, pair_numbers, -gap.metres, _float_triple(point)))
        elif NARROWEST_SEAM < gap.metres <= WIDEST_SLIT * mesh_size and mesh.is_closed:
            point = _point_between(pieces[first].vertices, pieces[second].vertices, gap)
            other_pieces = [piece for number, piece in enumerate(pieces) if number not in pair_numbers]
            if not is_outside(point[None], mesh.triangles)[0] and _is_free(point, other_pieces):
                seams.append(Seam(SeamKind.SLIT, pair_numbers, gap.metres, _float_triple(point)))
    return sorted(seams, key=lambda seam: -seam.width)


@dataclass(frozen=True, eq=False)
class Gap:
    """Signed distance of two convex solids: negative, the depth of their overlap; ``ends``: nearest points (2, 3)."""

    metres: float
    ends: FloatArray


def signed_gap(first: FloatArray, second: FloatArray) -> Gap:
    """Signed distance of the convex hulls of corners (n, 3) and (m, 3).

    It is that of the origin from the convex hull of all differences of their corners.
    """
    from scipy.optimize import nnls
    from scipy.spatial import ConvexHull

    differences = (first[:, None] - second[None]).reshape(-1, 3)
    hull = ConvexHull(differences)
    overlap_depth = float(hull.equations[:, 3].max())
    if overlap_depth <= 0.0:
        return Gap(overlap_depth, np.full((2, 3), np.nan))
    corners = differences[hull.vertices]
    corner_size = float(np.ptp(corners, axis=0).max())
    weights, _ = nnls(np.vstack([corners.T / corner_size, np.ones(len(corners))]), np.array([0.0, 0.0, 0.0, 1.0]))
    weights /= weights.sum()
    a, b = np.divmod(hull.vertices, len(second))
    ends = np.stack([weights @ first[a], weights @ second[b]])
    return Gap(float(np.linalg.norm(ends[1] - ends[0])), ends)


def _point_between(first: FloatArray, second: FloatArray, gap: Gap) -> FloatArray:
    """The middle of the slit where walls face each other, else the middle of the nearest points."""
    from manifold3d import Manifold

    gap_direction = (gap.ends[1] - gap.ends[0]) / gap.metres
    facing_hulls = []
    for corners, sign in ((first, 1.0), (second, -1.0)):
        heights_along_gap = sign * (corners @ gap_direction)
        facing_corners = corners[heights_along_gap >= heights_along_gap.max() - FACING_FRACTION * gap.metres]
        facing_hulls.append(
            Manifold.hull_points(np.concatenate([facing_corners, facing_corners + sign * gap.metres * gap_direction]))
        )
    common_hull = facing_hulls[0] ^ facing_hulls[1]
    if common_hull.is_empty():
        return np.asarray(gap.ends.mean(axis=0))
    return np.asarray(common_hull.to_mesh64().vert_properties[:, :3].mean(axis=0))


def _common_point(first: FloatArray, second: FloatArray) -> FloatArray:
    """The middle of what the convex hulls of corners (n, 3) and (m, 3) that overlap have in common."""
    from manifold3d import Manifold

    intersection = Manifold.hull_points(first) ^ Manifold.hull_points(second)
    return np.asarray(intersection.to_mesh64().vert_properties[:, :3].mean(axis=0))


def _is_free(point: FloatArray, pieces: Sequence[TriangleMesh]) -> bool:
    """Whether a point is in none of the pieces."""
    return all(beyond_planes(point[None], piece)[0] > 0.0 for piece in pieces)


def _float_triple(point: FloatArray) -> tuple[float, float, float]:
    x, y, z = point.tolist()
    return x, y, z
