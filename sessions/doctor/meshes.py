"""Findings about meshes: what is wrong with a surface, before any collision detection."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.doctor.finding import Finding, Severity
from sessions.errors import SessionError
from sessions.mesh_data import MeshData

LARGE_M: Final = 30.0  # A mesh larger than this was drawn in centimetres or millimetres; a laboratory fits into it
SMALL_M: Final = 0.0005  # A mesh smaller than half a millimetre was drawn in other units; a needle is longer

SAME_PLACE_M: Final = 1e-8
"""Vertices this near are one: float32 leaves 2e-9 m between the two sides of a seam 10 cm from the origin."""

FLAT: Final = 1e-12
"""A face whose height is below this part of its longest edge has no area that float64 could tell from rounding."""


def mesh_findings(name: str, mesh: MeshData) -> Iterator[Finding]:
    """Everything about one mesh; ``count`` is in faces or edges."""
    faces, flat, doubles = len(mesh.faces), int(degenerate_faces(mesh).sum()), duplicate_faces(mesh)
    if flat:
        message = f"{flat} of {faces} faces have no area"
        yield Finding("mesh-degenerate", Severity.WARNING, message, name, count=flat)
    if doubles:
        message = f"{doubles} of {faces} faces repeat another"
        yield Finding("mesh-duplicate", Severity.WARNING, message, name, count=doubles)
    yield from _edges(name, mesh)
    size = float((mesh.bounds[1] - mesh.bounds[0]).max())
    if not SMALL_M <= size <= LARGE_M:
        yield Finding("mesh-units", Severity.WARNING, f"it is {size:.3g} m long: drawn in other units?", name)


def degenerate_faces(mesh: MeshData) -> NDArray[np.bool_]:
    """Which faces are points or segments, (f,)."""
    corners = mesh.triangles
    edges = corners - np.roll(corners, 1, axis=1)
    longest = np.sqrt((edges * edges).sum(axis=2).max(axis=1))
    normal = np.cross(edges[:, 0], edges[:, 1])
    return np.sqrt((normal * normal).sum(axis=1)) <= FLAT * longest * longest


def duplicate_faces(mesh: MeshData) -> int:
    """How many faces join the same three places as an earlier one, in any order."""
    return len(mesh.faces) - len(np.unique(np.sort(_welded(mesh), axis=1), axis=0))


def _edges(name: str, mesh: MeshData) -> Iterator[Finding]:
    faces = _welded(mesh)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    low, high = np.minimum(start, end), np.maximum(start, end)
    _, edge, uses = np.unique(low * len(mesh.vertices) + high, return_inverse=True, return_counts=True)
    many, one = int((uses > 2).sum()), int((uses == 1).sum())
    if many:
        message = f"{many} edges belong to more than two faces"
        yield Finding("mesh-non-manifold", Severity.NOTE, message, name, count=many)
    if one:
        message = f"{one} edges belong to one face only"
        yield Finding("mesh-open", Severity.NOTE, message, name, count=one)
    way = np.bincount(edge, weights=np.where(start < end, 1.0, -1.0))
    unlike = int((uses[way != 0] == 2).sum())
    if unlike:
        message = f"{unlike} edges join faces that wind against each other"
        yield Finding("mesh-winding", Severity.WARNING, message, name, count=unlike)
    elif len(faces) and not one and not many and mesh.volume < 0:
        message = f"its signed volume is {1e6 * mesh.volume:.4g} ml"
        yield Finding("mesh-mirrored", Severity.ERROR, message, name, count=len(mesh.faces))


def _welded(mesh: MeshData) -> NDArray[np.int64]:
    """Faces over vertices that are different places: exporters split vertices at seams of textures and normals."""
    _, inverse = np.unique(np.round(mesh.vertices / SAME_PLACE_M), axis=0, return_inverse=True)
    return inverse.reshape(-1)[mesh.faces]


def all_mesh_findings(meshes: Mapping[str, MeshData], names: Iterable[str] | None = None) -> Iterator[Finding]:
    """Findings of every mesh, or those of some names; one that cannot be loaded is a finding too."""
    for name in meshes if names is None else names:
        try:
            mesh = meshes[name]
        except SessionError as error:
            yield Finding("mesh-unreadable", Severity.ERROR, str(error), name)
        else:
            yield from mesh_findings(name, mesh)
