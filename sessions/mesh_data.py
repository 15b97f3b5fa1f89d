"""A triangle mesh as two read-only arrays, kept bit for bit on the way to a file and back; imports only numpy."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.errors import MeshFileError


@dataclass(frozen=True, eq=False)
class MeshData:
    """Vertices (v, 3) float64 in metres and faces (f, 3) int64; both are read-only copies.

    Every bit is kept, so a glass that rests exactly on a table still does after the session was written and read.
    Only negative zeros become zeros. Face ``i`` stays face ``i``: nothing in `sessions` merges or reorders.

    Raises ``MeshFileError``: the arrays are no mesh: a wrong shape, no row, an index out of range, a coordinate that is
    not finite or beyond float32 (no viewer could draw it).

    Examples
    --------
    >>> MeshData([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], [[0, 1, 2]]).faces.shape
    (1, 3)
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        points, triangles = checked_vertices(vertices), _checked_faces(faces)
        outside = (triangles < 0) | (triangles >= len(points))
        if outside.any():
            face = int(np.flatnonzero(outside.any(axis=1))[0])
            raise MeshFileError(
                f"face {face} names vertices {triangles[face].tolist()} of a mesh with {len(points)} vertices; "
                "indices run from 0"
            )
        points.flags.writeable = False
        triangles.flags.writeable = False
        object.__setattr__(self, "vertices", points)
        object.__setattr__(self, "faces", triangles)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Least and greatest corner of the faces, (2, 3) in metres: a vertex that no face uses is no surface."""
        x, y, z = np.moveaxis(self.triangles, -1, 0)  # a twentieth of the time of ``min(axis=(0, 1))``
        return np.array([[x.min(), y.min(), z.min()], [x.max(), y.max(), z.max()]])

    @property
    def triangles(self) -> NDArray[np.float64]:
        """Corners of every face, (f, 3, 3) in metres."""
        return np.take(self.vertices, self.faces, axis=0)  # a quarter of the time of ``vertices[faces]``

    @property
    def volume(self) -> float:
        """Signed volume in m3: positive when the faces of a closed mesh wind outwards."""
        corners = self.triangles - self.bounds.mean(axis=0)
        return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0)

    def transformed(self, matrix: ArrayLike) -> "MeshData":
        """Return this mesh posed by a 4x4 matrix (column convention); a mirroring matrix also turns the faces round."""
        pose = np.asarray(matrix, dtype=np.float64)
        faces = self.faces if np.linalg.det(pose[:3, :3]) > 0 else self.faces[:, ::-1]
        return MeshData(self.vertices @ pose[:3, :3].T + pose[:3, 3], faces)


def concatenated_meshes(meshes: list[MeshData]) -> MeshData:
    """Return one mesh that holds the faces of all, in order; vertices are not shared across them."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])[:-1]
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]
    return MeshData(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def has_consistent_winding(mesh: MeshData) -> bool:
    """Whether every directed edge occurs once and so does its reverse: watertight with consistent winding."""
    start, end = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    forward = np.sort(start * len(mesh.vertices) + end)
    backward = np.sort(end * len(mesh.vertices) + start)
    return bool((np.diff(forward) > 0).all() and np.array_equal(forward, backward))


def least_area(mesh: MeshData) -> float:
    """Return the area of the smallest face in m2; 0 when a face is degenerate."""
    corners = mesh.triangles
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(0.5 * np.linalg.norm(normals, axis=1).min())


def checked_vertices(vertices: ArrayLike) -> NDArray[np.float64]:
    """Return the points (v, 3) as a mesh holds them: a float64 copy without negative zeros.

    Raises ``MeshFileError``: a wrong shape, no row, a coordinate that is not finite or beyond float32.
    """
    given = np.asarray(vertices, dtype=np.float64)
    _check_rows(given, "vertices", "v")
    points = given + 0.0  # a copy, and negative zeros become zeros
    with np.errstate(over="ignore", invalid="ignore"):
        bad = ~np.isfinite(points.astype(np.float32)).all(axis=1)
    if bad.any():
        row = int(np.flatnonzero(bad)[0])
        raise MeshFileError(f"vertex {row} is {given[row].tolist()}; coordinates must be finite and within float32")
    return points


def _checked_faces(faces: ArrayLike) -> NDArray[np.int64]:
    given = np.asarray(faces)
    _check_rows(given, "faces", "f")
    if given.dtype.kind not in "iu":
        raise MeshFileError(f"faces must be whole numbers, not {given.dtype}; give vertex indices")
    return given.astype(np.int64)


def _check_rows(given: NDArray[Any], what: str, letter: str) -> None:
    if given.ndim != 2 or given.shape[1:] != (3,) or not len(given):
        raise MeshFileError(f"{what} must be an array of shape ({letter}, 3) with at least one row, not {given.shape}")
