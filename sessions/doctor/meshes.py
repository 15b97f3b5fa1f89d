"""Faults of a surface, before any collision detection; and its repair, as a mesh editor would do it."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.doctor.finding import Finding, Severity
from sessions.errors import SessionError
from sessions.mesh_data import MeshData, has_consistent_winding
from sessions.meshes.mesh_files import outward
from sessions.meshes.separate_surfaces import separate_surfaces, separation_text
from sessions.quantities import length, number

LARGE_M: Final = 30.0  # A mesh larger than this was drawn in centimetres or millimetres; a laboratory fits into it
SMALL_M: Final = 0.0005  # A mesh smaller than half a millimetre was drawn in other units; a needle is longer

FAR_APART: Final = 0.5
"""Surfaces of which an empty slab takes more than two thirds of the mesh's length are no two walls of one thing."""

WELD_DISTANCE_M: Final = 1e-8
"""Vertices this near are one: float32 leaves 2e-9 m between the two sides of a seam 10 cm from the origin."""

FLAT: Final = 1e-12
"""A face whose height is below this part of its longest edge has no area that float64 could tell from rounding."""


Faces = NDArray[np.int64]
Row = tuple[str, int, str]
"""Code, how many faces or edges (0: nothing is found), message."""


def mesh_findings(name: str, mesh: MeshData) -> Iterator[Finding]:
    """Everything about one mesh; ``count`` is in faces or edges."""
    welded = _welded_faces(mesh)
    faces, flat = len(mesh.faces), int(degenerate_faces(mesh).sum())
    doubles = faces - int(row_numbers(np.sort(welded, axis=1)).max(initial=-1)) - 1
    size = float((mesh.bounds[1] - mesh.bounds[0]).max())
    is_odd = not SMALL_M <= size <= LARGE_M
    rows: list[Row] = [
        ("mesh-degenerate", flat, f"{flat} of {faces} faces have no area"),
        ("mesh-duplicate", doubles, f"{doubles} of {faces} faces repeat another"),
        *_edges(mesh, welded),
        ("mesh-units", is_odd, f"it is {length(size)} long: drawn in other units?"),
    ]
    for code, count, message in rows:
        if count:
            yield Finding(code, message, name, count=int(count))
    surfaces, gap = separate_surfaces(mesh)
    if surfaces > 1:
        severity = None if gap > size / (1.0 + FAR_APART) else Severity.NOTE
        yield Finding("mesh-apart", separation_text(surfaces, gap), name, count=surfaces, own_severity=severity)


def degenerate_faces(mesh: MeshData) -> NDArray[np.bool_]:
    """Mask (f,) of the faces that are points or segments."""
    corners = mesh.triangles
    edges = corners - np.roll(corners, 1, axis=1)
    longest = np.sqrt((edges * edges).sum(axis=2).max(axis=1))
    normal = np.cross(edges[:, 0], edges[:, 1])
    return np.sqrt((normal * normal).sum(axis=1)) <= FLAT * longest * longest


def _edge_uses(faces: Faces) -> tuple[Faces, Faces, Faces, Faces]:
    """Start and end of the edges along all faces, (3f,); the number of each edge, and how often each number is used."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    keys = np.minimum(start, end) * (faces.max(initial=0) + 1) + np.maximum(start, end)
    _, edge, uses = np.unique(keys, return_inverse=True, return_counts=True)
    return start, end, edge, uses


def _edges(mesh: MeshData, faces: Faces) -> list[Row]:
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    start, end, edge, uses = _edge_uses(faces)
    many, boundary = int((uses > 2).sum()), int((uses == 1).sum())
    winding = np.bincount(edge, weights=np.where(start < end, 1.0, -1.0))
    unlike = int((uses[winding != 0] == 2).sum())
    is_mirrored = len(faces) > 0 and not (many or boundary or unlike) and mesh.volume < 0
    inward = len(mesh.faces) if is_mirrored else 0
    return [
        ("mesh-non-manifold", many, f"{many} edges belong to more than two faces"),
        ("mesh-open", boundary, f"{boundary} edges belong to one face only"),
        ("mesh-winding", unlike, f"{unlike} edges join faces that wind against each other"),
        ("mesh-mirrored", inward, f"its signed volume is {number(1e6 * mesh.volume)} mL"),
    ]


def _welded_faces(mesh: MeshData) -> NDArray[np.int64]:
    """Faces over vertices that are different places: exporters split vertices at seams of textures and normals."""
    return row_numbers(np.round(mesh.vertices / WELD_DISTANCE_M))[mesh.faces]


def row_numbers(rows: NDArray[Any]) -> NDArray[np.int64]:
    """Returns a number for each row (n, k), (n,): equal ones for equal rows; a third of the time of `numpy.unique`."""
    order = np.lexsort(rows.T)
    is_first = np.ones(len(rows), dtype=np.bool_)
    is_first[1:] = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    numbers = np.empty(len(rows), dtype=np.int64)
    numbers[order] = np.cumsum(is_first) - 1
    return numbers


def all_mesh_findings(meshes: Mapping[str, MeshData], names: Iterable[str] | None = None) -> Iterator[Finding]:
    """Findings of every mesh, or those of some names; one that cannot be loaded is a finding too."""
    for name in meshes if names is None else names:
        try:
            mesh = meshes[name]
        except SessionError as error:
            yield Finding("mesh-unreadable", str(error), name)
        else:
            yield from mesh_findings(name, mesh)


def repaired_mesh(mesh: MeshData) -> tuple[MeshData, list[str]]:
    """The mesh without doubled vertices, flat and repeated faces, holes and faces that wind inwards; what was done.

    A hole gets a fan of faces about the mean of its rim: right for a flat hole, a guess for any other, and a lid where
    it was the mouth of a thin vessel. Edges of three or more faces stay as they are, and so does a face by itself.
    """
    repairs, points, faces = [], mesh.vertices, mesh.faces
    if not has_consistent_winding(mesh):  # of two closed parts that touch, joining makes one with edges of four faces
        rounded = np.round(points / WELD_DISTANCE_M)
        _, first, merged = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
        points, faces = points[first], merged.reshape(-1)[faces]
        repairs += _repair_text(len(rounded) - len(first), "vertex", "vertices", "at the place of another joined")
    flat = degenerate_faces(MeshData(points, faces))
    faces = faces[~flat]
    repairs += _repair_text(int(flat.sum()), "face", "faces", "without area removed")
    _, kept = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    repairs += _repair_text(len(faces) - len(kept), "repeated face", "repeated faces", "removed")
    faces = faces[np.sort(kept)]
    if not len(faces):
        return mesh, ["nothing is left of it without its flat faces; it stays as it was"]
    alone = {tuple(face) for face in np.sort(faces, axis=1).tolist()}
    holes = [rim for rim in _holes(faces) if tuple(sorted(rim)) not in alone]
    for rim in holes:
        middle = len(points)
        points = np.concatenate([points, points[rim].mean(axis=0, keepdims=True)])
        faces = np.concatenate([faces, [(b, a, middle) for a, b in zip(rim, np.roll(rim, -1), strict=True)]])
    repairs += _repair_text(len(holes), "hole", "holes", "closed")
    oriented = outward(MeshData(points, faces))
    inward = int((oriented.faces != faces).any(axis=1).sum())
    repairs += _repair_text(inward, "face", "faces", "turned to wind outwards")
    used, number = np.unique(oriented.faces, return_inverse=True)
    return MeshData(oriented.vertices[used], number.reshape(-1, 3)), repairs


def _repair_text(count: int, singular: str, plural: str, done: str) -> list[str]:
    return [f"{count:,} {singular if count == 1 else plural} {done}"] if count else []


def _holes(faces: Faces) -> Iterator[list[int]]:
    """Rims of holes, each as the vertices along it in the sense of the faces that it belongs to."""
    start, end, edge, uses = _edge_uses(faces)
    rim = uses[edge] == 1
    after: dict[int, list[int]] = {}
    for a, b in zip(start[rim].tolist(), end[rim].tolist(), strict=True):
        after.setdefault(a, []).append(b)
    while after:
        chain = [next(iter(after))]
        while chain[-1] in after:
            onward = after[chain[-1]].pop()
            if not after[chain[-1]]:
                del after[chain[-1]]
            if onward in chain:  # a rim that touches itself is cut into loops
                loop = chain[chain.index(onward) :]
                yield loop
                chain = chain[: chain.index(onward) + 1]
            else:
                chain.append(onward)
