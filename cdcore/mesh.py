"""A triangle mesh that is valid by construction: finite vertices, faces that exist, nothing that can be changed."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, wraps
from typing import TypeVar
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdcore.errors import InvalidMeshError
from cdcore.numerics import FloatArray, Int32Array, IntArray, readonly


@dataclass(frozen=True, eq=False, init=False)
class TriangleMesh:
    """The surface of a body, as triangles in the body's own frame.

    Face order and face numbers are kept: they name the faces in every result. Duplicate, degenerate and unreferenced
    parts are allowed, because real meshes have them.

    Parameters
    ----------
    vertices : (v, 3) finite numbers, metres.
    faces : (f, 3) integers in ``0..v-1``, f >= 1.

    Raises
    ------
    InvalidMeshError
        Says what is wrong and at which vertex or face.

    Examples
    --------
    >>> TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).is_closed
    False
    """

    vertices: FloatArray
    faces: Int32Array

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        object.__setattr__(self, "vertices", _vertices(vertices))
        object.__setattr__(self, "faces", _faces(faces, len(self.vertices)))

    def __repr__(self) -> str:
        return f"TriangleMesh({len(self.vertices)} vertices, {len(self.faces)} faces)"

    @cached_property
    def triangles(self) -> FloatArray:
        """Corners of every face, (f, 3, 3), body frame."""
        return readonly(np.ascontiguousarray(self.vertices[self.faces]))

    @cached_property
    def referenced_vertices(self) -> FloatArray:
        """Vertices that a face uses, (r, 3): an unreferenced far vertex must not inflate a bounding volume."""
        return readonly(self.vertices[np.unique(self.faces)])

    @cached_property
    def bounds(self) -> FloatArray:
        """Lowest and highest coordinates of the referenced vertices, (2, 3)."""
        return readonly(np.array([self.referenced_vertices.min(axis=0), self.referenced_vertices.max(axis=0)]))

    @cached_property
    def is_closed(self) -> bool:
        """Whether every edge belongs to an even number of faces, so that *inside* is well defined by parity.

        Vertices count as one only when their coordinates are bitwise equal; faces with two equal corners have no
        interior and are left out.
        """
        edges = np.sort(self._proper_faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        # One number an edge: rows are sorted ten times as slowly.
        _, counts = np.unique(edges[:, 0] * len(self.vertices) + edges[:, 1], return_counts=True)
        return bool(len(counts) > 0 and (counts % 2 == 0).all())

    @cached_property
    def has_doubled_faces(self) -> bool:
        """Whether two faces have the same three corners, in any order: parity then calls the inside outside."""
        distinct, _ = distinct_rows(np.sort(self._proper_faces, axis=1))
        return len(distinct) < len(self._proper_faces)

    @cached_property
    def _proper_faces(self) -> IntArray:
        """Merged faces with three different corners, (p, 3)."""
        a, b, c = self.merged_faces.T
        return self.merged_faces[(a != b) & (b != c) & (c != a)]

    @cached_property
    def merged_faces(self) -> IntArray:
        """Faces over vertices merged where bitwise equal, (f, 3); -0.0 and 0.0 are one."""
        _, numbers = distinct_rows(self.vertices)
        return numbers[self.faces]

    @cached_property
    def components(self) -> IntArray:
        """Lowest face number of the connected component each face belongs to, (f,)."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        # Faces and vertices as one bipartite graph: linear in the faces even where thousands of them share one vertex.
        merged, count = self.merged_faces, len(self.faces)
        face = np.repeat(np.arange(count), 3)
        size = count + int(merged.max()) + 1
        graph = coo_array((np.ones(3 * count, dtype=np.int8), (face, count + merged.ravel())), shape=(size, size))
        label = connected_components(graph, directed=False)[1][:count]
        first = np.full(label.max() + 1, count, dtype=np.int64)
        np.minimum.at(first, label, np.arange(count))
        return first[label]

    @cached_property
    def content_hash(self) -> str:
        """SHA-256 of vertices and faces, the name under which trees are cached."""
        digest = hashlib.sha256(np.int64(self.vertices.shape[0]).tobytes())
        digest.update(self.vertices.astype("<f8").tobytes())
        digest.update(self.faces.astype("<i4").tobytes())
        return digest.hexdigest()


def winding(triangles: FloatArray) -> int:
    """1 where the normals of a closed surface (f, 3, 3) point out, -1 where they point in, 0 where it has no volume."""
    # By a power of two, which rounds nothing: volumes of bodies of 1e103 m overflow, of 1e-110 m they vanish.
    scaled = np.ldexp(triangles, -int(np.frexp(np.abs(triangles).max())[1]))
    a, b, c = np.moveaxis(scaled - scaled[0, 0], 1, 0)
    return int(np.sign(np.einsum("fk,fk->", a, np.cross(b, c))))


def _vertices(vertices: ArrayLike) -> FloatArray:
    try:
        array = np.array(vertices, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InvalidMeshError(
            f"vertices are not an array of numbers ({error}); give an array of shape (v, 3)"
        ) from None
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidMeshError(f"vertices have shape {array.shape}; give (v, 3)")
    finite = np.isfinite(array).all(axis=1)
    if not finite.all():
        where = int(np.flatnonzero(~finite)[0])
        raise InvalidMeshError(f"vertex {where} is not finite: {array[where].tolist()}; repair or remove it")
    return readonly(array)


def _faces(faces: ArrayLike, vertex_count: int) -> Int32Array:
    try:
        given = np.asarray(faces)
    except ValueError as error:
        raise InvalidMeshError(f"faces are not an array ({error}); give integers of shape (f, 3)") from None
    if given.size == 0:
        raise InvalidMeshError("the mesh is empty: it has no faces; give at least one triangle")
    if given.dtype.kind not in "iu":
        raise InvalidMeshError(f"faces are {given.dtype}, not integers; give vertex numbers of shape (f, 3)")
    if given.ndim != 2 or given.shape[1] != 3:
        raise InvalidMeshError(f"faces have shape {given.shape}; give (f, 3): triangles only")
    outside = ((given < 0) | (given >= vertex_count)).any(axis=1)
    if outside.any():
        where = int(np.flatnonzero(outside)[0])
        raise InvalidMeshError(
            f"face {where} names vertices {given[where].tolist()}, but there are only vertices 0 to {vertex_count - 1}"
        )
    array = np.ascontiguousarray(given, dtype=np.int32)
    if array is given or array.base is not None:
        array = array.copy()
    return readonly(array)


Number = TypeVar("Number", bound=np.generic)


def distinct_rows(rows: NDArray[Number]) -> tuple[NDArray[Number], IntArray]:
    """The different rows of numbers (n, k) in ascending order, and the number (n,) of each row among them.

    Cost: a fifth of ``np.unique`` of rows.
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    is_new = np.ones(len(rows), dtype=np.bool_)
    is_new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    numbers = np.empty(len(rows), dtype=np.int64)
    numbers[order] = np.cumsum(is_new) - 1
    return ordered[is_new], numbers


Mesh = TypeVar("Mesh")
Made = TypeVar("Made")


def once_a_mesh(make: Callable[[Mesh], Made]) -> Callable[[Mesh], Made]:
    """Keep what a function makes of a mesh as long as the mesh, which nothing made of it may hold.

    Several detectors of a run ask the same meshes, and a worker replays one session after another.
    """
    of_each: Callable[[Sequence[Mesh]], list[Made]] = once_for_meshes(lambda meshes: [make(mesh) for mesh in meshes])
    return wraps(make)(lambda mesh: of_each([mesh])[0])


def once_for_meshes(
    make: Callable[[Sequence[Mesh]], Sequence[Made]],
) -> Callable[[Sequence[Mesh]], list[Made]]:
    """``once_a_mesh`` for a function that makes things of several meshes together."""
    kept: WeakKeyDictionary[Mesh, Made] = WeakKeyDictionary()

    @wraps(make)
    def of(meshes: Sequence[Mesh]) -> list[Made]:
        if new := list(dict.fromkeys(mesh for mesh in meshes if mesh not in kept)):
            kept.update(zip(new, make(new), strict=True))
        return [kept[mesh] for mesh in meshes]

    return of
