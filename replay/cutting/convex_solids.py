"""Convex solids that together stand for a mesh: limits of engines, the surface around them, how far they reach."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import TYPE_CHECKING, Final

import numpy as np

from cdcore.bounding.hull import hull_of
from cdcore.mesh import TriangleMesh, once_a_mesh
from cdcore.numerics import FloatArray
from cdcore.protocol import Solids

if TYPE_CHECKING:
    from manifold3d import Manifold

MOST_TRIANGLES: Final = 255
"""Of one convex collider: the limit of Unity and of PhysX."""

POINTS_AT_ONCE: Final = 256
"""Points whose heights over all planes are held together, in a cache: a seventh of the time of all at once, for which
pages of memory are fetched and threads wait (1,200 points, 250 faces, 2026-11-29)."""


def solids_of(pieces: Sequence[TriangleMesh]) -> Solids:
    """Solids with the surface around them."""
    return Solids(tuple(pieces), union_of(pieces))


def within_triangles(piece: TriangleMesh) -> TriangleMesh:
    """A convex solid with as few triangles as engines take: the hull of the corners that leave least outside."""
    if len(piece.faces) <= MOST_TRIANGLES:
        return piece
    return _with_fewer_corners(piece) or piece


@once_a_mesh
def _with_fewer_corners(piece: TriangleMesh) -> TriangleMesh | None:
    """The same, made once: levels of joined pieces share most of them; ``None``: a few corners span no solid."""
    corners = piece.vertices
    directions = np.array([step for step in np.ndindex(3, 3, 3) if step != (1, 1, 1)], dtype=np.float64) - 1.0
    hull_corners = np.unique((corners @ directions.T).argmax(axis=0))
    while (hull := hull_of(corners[hull_corners])) is not None:
        distances_beyond = beyond_planes(corners, hull)
        # A closed convex solid of V corners has 2 V - 4 triangles. One at a time: neighbours lie outside together.
        # Corners that lie in a face of the hull, as those of a box that is cut into a grid, are never left outside.
        farthest_corner = distances_beyond.argmax()
        if 2 * (len(hull_corners) + 1) - 4 > MOST_TRIANGLES or farthest_corner in hull_corners:
            return hull
        hull_corners = np.union1d(hull_corners, farthest_corner)
    return None


def beyond_planes(points: FloatArray, piece: TriangleMesh) -> FloatArray:
    """Metres by which points (n, 3) lie beyond the planes of the faces of a convex piece, at most 0 inside."""
    corners = piece.triangles
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    levels = (normals * corners[:, 0]).sum(axis=1)
    distances_beyond = np.empty(len(points))
    for start in range(0, len(points), POINTS_AT_ONCE):
        plane_heights = points[start : start + POINTS_AT_ONCE] @ normals.T
        plane_heights -= levels
        plane_heights.max(axis=1, out=distances_beyond[start : start + POINTS_AT_ONCE])
    return distances_beyond


def union_of(pieces: Sequence[TriangleMesh]) -> TriangleMesh:
    """One closed surface around convex solids that may overlap: only there does parity tell inside from outside.

    Where a solid is open, which no convex solid is, they are laid beside each other as they are.
    """
    if len(pieces) == 1:
        return pieces[0]
    if not all(piece.is_closed for piece in pieces):
        first_vertices = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
        faces = [piece.faces + start for piece, start in zip(pieces, first_vertices, strict=False)]
        return TriangleMesh(np.concatenate([piece.vertices for piece in pieces]), np.concatenate(faces))
    union_mesh = manifold_union(pieces).to_mesh64()
    return TriangleMesh(union_mesh.vert_properties[:, :3], np.asarray(union_mesh.tri_verts).astype(np.int64))


def manifold_union(pieces: Sequence[TriangleMesh]) -> Manifold:
    """The union of closed convex solids, for the library manifold."""
    from manifold3d import Manifold

    # Faces without area, which a thin hull may have, are no manifold: the hull is computed anew.
    solids = [manifold_of(piece) or Manifold.hull_points(piece.vertices) for piece in pieces]
    return reduce(lambda joined, solid: joined + solid, solids)


def manifold_of(mesh: TriangleMesh) -> Manifold | None:
    """A closed mesh for the library manifold; ``None``: it takes it for no solid."""
    from manifold3d import Error, Manifold, Mesh64

    solid = Manifold(Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64)))
    return solid if solid.status() == Error.NoError else None


def enclosed_solid(mesh: TriangleMesh) -> Manifold | None:
    """Solid within a closed mesh, for the library manifold, whichever way its faces look; ``None``: it is no solid."""
    solid = manifold_of(facing_outward(mesh)) if mesh.is_closed else None
    return None if solid is None or solid.volume() <= 0.0 else solid


def volume_of(mesh: TriangleMesh) -> float:
    """Cubic metres within a closed surface, each part counted alone; negative where faces look inwards."""
    a, b, c = np.moveaxis(mesh.triangles - mesh.vertices.mean(axis=0), 1, 0)
    return float(np.einsum("ij,ij->", a, _cross_products(b, c)) / 6)


def _cross_products(a: FloatArray, b: FloatArray) -> FloatArray:
    """The same as ``np.cross`` of vectors (n, 3): a ladder needs a thousand volumes, and it spends most in checks."""
    products = np.empty_like(a, order="C")
    for axis in range(3):
        second, third = (axis + 1) % 3, (axis + 2) % 3
        products[:, axis] = a[:, second] * b[:, third] - a[:, third] * b[:, second]
    return products


@once_a_mesh
def _with_flipped_faces(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh with its faces the other way round."""
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def facing_outward(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh; of one whose faces look inwards, as a mirrored one has them, the same with its faces turned."""
    return _with_flipped_faces(mesh) if mesh.is_closed and volume_of(mesh) < 0.0 else mesh


def area_of(mesh: TriangleMesh) -> float:
    """Square metres of the surface."""
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    return 0.5 * float(np.linalg.norm(_cross_products(b - a, c - a), axis=1).sum())


def outside_by(mesh: TriangleMesh, pieces: Sequence[TriangleMesh]) -> float:
    """Metres by which corners and middles of the faces of a mesh lie outside all of some convex pieces, at most."""
    from replay.cutting.surface_distance import Surface

    points = np.concatenate([mesh.referenced_vertices, mesh.triangles.mean(axis=1)])
    distances_beyond = np.stack([beyond_planes(points, piece) for piece in pieces])
    nearest_pieces = distances_beyond.argmin(axis=0)
    is_away = distances_beyond.min(axis=0) > 0.0
    largest_distance = 0.0
    for piece_number in np.unique(nearest_pieces[is_away]).tolist():
        # The point of a solid that is nearest to a point outside is on its surface.
        surface = Surface(pieces[piece_number].triangles)
        distances = surface.distances(points[is_away & (nearest_pieces == piece_number)])[0]
        largest_distance = max(largest_distance, float(distances.max()))
    return largest_distance
