"""Solids that engines receive for a mesh: the corners of its hull, or its triangles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from cdcore.bounding.hull import hull_of
from cdcore.errors import InvalidMeshError
from cdcore.mesh import TriangleMesh
from cdcore.numerics import FloatArray, Int32Array
from cdcore.protocol import Body

LARGEST: Final = 1e5
"""Metres: the corners are kept in float32, in which a body of this size is known to a centimetre."""

CONVEX_FRACTION: Final = 1e-6
"""A mesh whose volume is less than its hull's by no more than this share is convex; files keep seven digits."""


@dataclass(frozen=True, eq=False)
class EngineSolid:
    """One body as an engine has it, about its own middle.

    ``corners`` (n, 3) metres from ``middle`` (3,); ``faces`` (m, 3) of a triangle mesh, ``None``: the hull of the
    corners stands in its place.
    """

    name: str
    corners: FloatArray
    middle: FloatArray
    faces: Int32Array | None = None


def engine_solid(body: Body, shape: str, engine: str, least_thickness: float) -> EngineSolid:
    """The hull of a body (``shape`` "hull"), or its triangles if it is not convex ("mesh").

    A hull thinner than ``least_thickness``, metres, gets that thickness.

    InvalidMeshError for a body so large that an engine of float32 does not know its corners.
    """
    lower, upper = body.mesh.bounds
    size = float((upper - lower).max())
    if size > LARGEST:
        raise InvalidMeshError(
            f"{engine} keeps float32, too coarse for {body.name}, which is {size:g} m large; "
            f"give it in metres, at most {LARGEST:g} m"
        )
    middle = (lower + upper) / 2
    if shape == "mesh" and not is_convex(body.mesh):
        return EngineSolid(body.name, body.mesh.vertices - middle, middle, body.mesh.faces)
    solid = thickened_points(body.mesh.referenced_vertices - middle, least_thickness)
    hull = hull_of(solid)
    return EngineSolid(body.name, solid if hull is None else hull.vertices, middle)


def is_convex(mesh: TriangleMesh) -> bool:
    """Whether a closed mesh fills its hull."""
    if not mesh.is_closed:
        return False
    hull = hull_of(mesh.referenced_vertices)
    if hull is None:
        return False
    full = _volume(hull)
    return abs(full - abs(_volume(mesh))) <= CONVEX_FRACTION * full


def thickened_points(points: FloatArray, least: float) -> FloatArray:
    """The points (n, 3); those of a sheet or a needle, thinner than ``least``, on both sides of it, so far apart."""
    about = points - points.mean(axis=0)
    for axis in np.linalg.eigh(about.T @ about)[1].T:
        if np.ptp(points @ axis) < least:
            points = np.concatenate([points - least / 2 * axis, points + least / 2 * axis])
    return points


def engine_poses(
    solids: list[EngineSolid], rotations: FloatArray, translations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns the world positions (N, 3) of the middles, metres, and quaternions (N, 4) as x, y, z, w."""
    middles = np.array([solid.middle for solid in solids]).reshape(-1, 3)
    positions = translations + np.einsum("nij,nj->ni", rotations, middles)
    return positions, Rotation.from_matrix(rotations).as_quat()


def spread_positions(solids: list[EngineSolid]) -> tuple[FloatArray, FloatArray]:
    """Places (N, 3) along one axis at which no two solids are near each other, and quaternions (N, 4) of no turn."""
    widths = np.array([2.0 * float(np.linalg.norm(solid.corners, axis=1).max()) + 1.0 for solid in solids])
    along = np.cumsum(widths) - widths / 2.0
    return np.column_stack([along, np.zeros((len(solids), 2))]), np.tile([0.0, 0.0, 0.0, 1.0], (len(solids), 1))


def _volume(mesh: TriangleMesh) -> float:
    a, b, c = np.moveaxis(mesh.triangles - mesh.vertices[0], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
