"""Meshes of polygons, as OBJ, PLY and OFF hold them, cut into triangles without moving or adding a vertex."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import EmptyMeshError, MeshFileError
from sessions.mesh_data import checked_vertices
from sessions.meshes.ear_clipping import FEW_CORNERS, FLAT, clip_ears

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

FAN_CORNERS: Final = 4
"""From so many corners a fan is tried, of all polygons of a size at once, before each is cut by itself."""

BLOCK_CORNERS: Final = 1 << 18
"""Corners of polygons that are tried at once: 50 MB of work space."""

MOST_CORNER_PAIRS: Final = 100_000_000
"""Pairs of corners that are compared within concave polygons of more than 64 corners: one of 10,000, for seconds."""

NO_TRIANGLE: Final = "the file holds no triangle; export the surface as triangles"


@dataclass(frozen=True, eq=False)
class PolygonMesh:
    """Polygons over shared vertices, in the order of a file.

    Parameters
    ----------
    vertices : (v, 3) float64, in the units of the file.
    corners : (c,) int64, the vertices along all polygons, one after the other, from 0.
    sizes : (p,) int64, corners of each polygon; those of one or two corners have no surface and give no triangle.
    """

    vertices: Array
    corners: Indices
    sizes: Indices

    def triangulated(self) -> tuple[Array, Indices]:
        """Return the vertices and the triangles (t, 3): of a polygon of n corners n - 2, polygon after polygon.

        A polygon is cut in its own sense, seen along the axis that its normal is nearest to. It becomes a fan of its
        first corner where that is right, a fan of its second to fourth, or it is cut by `ear_clipping`. A polygon that
        crosses itself even so has as many triangles, of which some wind the other way.

        Raises ``MeshFileError``: no polygon of three corners, a corner that is no vertex, a coordinate that no mesh can
        have, concave polygons of so many corners that cutting them would take minutes.
        """
        if not len(self.sizes) or self.sizes.max() < 3:
            raise EmptyMeshError(NO_TRIANGLE)
        if not len(self.vertices):
            raise MeshFileError("it has faces and no vertex; export it again")
        vertices = checked_vertices(self.vertices)
        self._check_corners()
        starts = np.cumsum(self.sizes) - self.sizes
        counts = np.maximum(self.sizes - 2, 0)
        first_faces = np.cumsum(counts) - counts
        faces = np.empty((int(counts.sum()), 3), dtype=np.int64)
        pairs = 0
        for size in sorted(set(self.sizes[self.sizes >= 3].tolist())):
            rows = np.flatnonzero(self.sizes == size)
            for block in np.array_split(rows, -(-len(rows) * size // BLOCK_CORNERS)):
                polygons = self.corners[starts[block][:, None] + np.arange(size)]
                triangles, is_fan = _fans(vertices, polygons)
                concave = np.flatnonzero(~is_fan)
                pairs += len(concave) * size * size if size > FEW_CORNERS else 0
                if pairs > MOST_CORNER_PAIRS:
                    raise MeshFileError(f"it has concave faces of {size:,} corners; export the surface as triangles")
                for row in concave.tolist():
                    triangles[row] = polygons[row][_ear_clipped_triangles(vertices[polygons[row]])]
                faces[first_faces[block][:, None] + np.arange(size - 2)] = triangles
        return vertices, faces

    def _check_corners(self) -> None:
        wrong = (self.corners < 0) | (self.corners >= len(self.vertices))
        if wrong.any():
            corner = int(np.flatnonzero(wrong)[0])
            face = int(np.searchsorted(np.cumsum(self.sizes), corner, side="right"))
            raise MeshFileError(
                f"face {face} of the file, counted from 0, names vertex {self.corners[corner]} of a mesh with "
                f"{len(self.vertices)} vertices; export it again"
            )


def _fans(vertices: Array, polygons: Indices) -> tuple[Indices, NDArray[np.bool_]]:
    """Return triangles (p, n - 2, 3) of polygons (p, n), and which of them are cut right; the others are fans too."""
    size = polygons.shape[1]
    triangles = np.empty((len(polygons), size - 2, 3), dtype=np.int64)
    triangles[:] = _fan(polygons)
    if size == 3:
        return triangles, np.ones(len(polygons), dtype=bool)
    is_right = _winds_alike(vertices[polygons])
    for first in range(1, min(size, FAN_CORNERS)):
        rows = np.flatnonzero(~is_right)
        if not len(rows):
            break
        rotated = np.roll(polygons[rows], -first, axis=1)
        fits = _winds_alike(vertices[rotated])
        triangles[rows[fits]] = _fan(rotated[fits])
        is_right[rows[fits]] = True
    return triangles, is_right


def _fan(polygons: Indices) -> Indices:
    """Triangles (p, n - 2, 3) of the first corner and each edge that is not at it."""
    first = np.broadcast_to(polygons[:, :1], polygons[:, 1:-1].shape)
    return np.stack([first, polygons[:, 1:-1], polygons[:, 2:]], axis=2)


def _winds_alike(points: Array) -> NDArray[np.bool_]:
    """Whether all triangles of the fan of the first corner wind alike and none is flat, of polygons (p, n, 3).

    Then they are the polygon: they cover each point as often as the outline winds about it. A triangle of two
    neighbouring corners at one point is flat in any cut; exporters write triangles as such quads.
    """
    spokes = points[:, 1:] - points[:, :1]
    normals = np.cross(spokes[:, :-1], spokes[:, 1:])
    total = normals.sum(axis=1)
    axis = np.abs(total).argmax(axis=1)
    rows = np.arange(len(points))
    areas = normals[rows, :, axis] * np.sign(total[rows, axis])[:, None]
    extent = np.ptp(points, axis=1)
    extent[rows, axis] = 0.0
    size = extent.max(axis=1)
    is_repeated = (points[:, 1:-1] == points[:, 2:]).all(axis=2)
    is_repeated[:, 0] |= (points[:, 0] == points[:, 1]).all(axis=1)
    is_repeated[:, -1] |= (points[:, 0] == points[:, -1]).all(axis=1)
    is_upright = areas > (FLAT * size * size)[:, None]
    return (is_upright | is_repeated).all(axis=1)


def _ear_clipped_triangles(points: Array) -> Indices:
    """Triangles (n - 2, 3) of the corners of one polygon (n, 3), by the first projection in which it can be cut.

    Where it crosses itself in each, the first that has an area; without any area it becomes a fan.
    """
    spokes = points[1:] - points[0]
    normal = np.abs(np.cross(spokes[:-1], spokes[1:]).sum(axis=0))
    axes = np.argsort(-normal, kind="stable")
    cuts = []
    for axis in axes[normal[axes] > 0]:
        cuts.append(clip_ears(np.delete(points, axis, axis=1)))
        if cuts[-1].covers:
            return np.array(cuts[-1].triangles, dtype=np.int64)
    if not cuts:
        return _fan(np.arange(len(points))[None])[0]
    return np.array(cuts[0].triangles, dtype=np.int64)
