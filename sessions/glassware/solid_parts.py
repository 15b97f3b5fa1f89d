"""Rods, boxes, rings and tubes along bent paths: the closed solids of unions, and the search for a face count."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.geometry.rings import Ring, area_factor, even_angles, sewn, turned
from sessions.mesh_data import MeshData

FACE_COUNT_TOLERANCE = 0.08
SEARCH_STEPS = 9


def fitted(build: Callable[[float], MeshData], faces: int, start: float) -> tuple[MeshData, float]:
    """Return ``build(spacing)``, and the spacing in metres, whose mesh comes nearest to ``faces`` faces.

    Cost: up to nine meshes. ``start`` is the first spacing tried; the count is taken to fall with the square of the
    spacing.
    """
    spacing = start
    low, high = 0.0, np.inf  # spacings known to give too many faces, too few
    tried: list[tuple[MeshData, float]] = []
    for _ in range(SEARCH_STEPS):
        tried.append((build(spacing), spacing))
        ratio = len(tried[-1][0].faces) / faces
        if abs(ratio - 1.0) < FACE_COUNT_TOLERANCE:
            break
        low, high = (max(low, spacing), high) if ratio > 1.0 else (low, min(high, spacing))
        spacing *= float(np.sqrt(ratio))
        if not low < spacing < high:
            spacing = float(np.sqrt(low * high)) if low > 0.0 and high < np.inf else spacing
    return min(tried, key=lambda trial: abs(np.log(len(trial[0].faces) / faces)))


def sections_for(radius: float, spacing: float, least: int = 8) -> int:
    """Return how many sides a circle gets so that they are about ``spacing`` long."""
    return int(np.clip(2 * round(np.pi * radius / spacing), least, 128))


def across_corners(radius: float, sections: int) -> float:
    """Return the radius to ask of `cylinder` so that its corners lie at ``radius``: nothing reaches further out."""
    return radius / area_factor(even_angles(sections))


def across_flats(radius: float, sections: int) -> float:
    """Return the radius to ask of `cylinder` so that its sides lie at ``radius``: nothing reaches further in."""
    return across_corners(radius / float(np.cos(np.pi / sections)), sections)


def cylinder(
    start: ArrayLike, end: ArrayLike, radius: float, sections: int, end_radius: float | None = None
) -> MeshData:
    """Return a cylinder (or cone stump) between two points with flat ends and the round one's cross-section area."""
    path = np.array([start, end], dtype=np.float64)
    rings = swept(path, [radius, radius if end_radius is None else end_radius], sections)
    return sewn([rings[0].mean(axis=0, keepdims=True), *rings, rings[-1].mean(axis=0, keepdims=True)])


def rod(path: ArrayLike, radius: float, sections: int) -> MeshData:
    """Return a round rod along a path (n, 3) that ends in half balls about the path's ends."""
    points = np.asarray(path, dtype=np.float64)
    first, last = points[0] - points[1], points[-1] - points[-2]
    steps = max(2, sections // 4)
    angles = np.linspace(np.pi / 2.0, 0.0, steps, endpoint=False)[1:]
    sines, cosines = np.sin(angles) * radius, np.cos(angles) * radius
    before = points[0] + np.outer(sines, first / np.linalg.norm(first))
    after = points[-1] + np.outer(sines[::-1], last / np.linalg.norm(last))
    rings = swept(
        np.concatenate([before, points, after]), [*cosines, *([radius] * len(points)), *cosines[::-1]], sections
    )
    low = points[:1] + radius * first / np.linalg.norm(first)
    high = points[-1:] + radius * last / np.linalg.norm(last)
    return sewn([low, *rings, high])


def ring(outline: ArrayLike, sections: int) -> MeshData:
    """Return the solid that a closed outline (n, 2) of points (r, y) off the axis sweeps around it."""
    return sewn(turned(np.asarray(outline, dtype=np.float64), even_angles(sections)), around=True)


def swept(path: NDArray[np.float64], radii: Sequence[float], sections: int) -> list[Ring]:
    """Return circles along a path, one per point, in planes that halve the bend and without twist."""
    step = np.diff(path, axis=0)
    step /= np.linalg.norm(step, axis=1, keepdims=True)
    tangents = np.concatenate([step[:1], step[:-1] + step[1:], step[-1:]])
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    side = np.cross(tangents[0], np.eye(3)[int(np.argmin(np.abs(tangents[0])))])
    angles = even_angles(sections)
    factor = area_factor(angles)
    rings = []
    for point, tangent, radius in zip(path, tangents, radii, strict=True):
        side = side - (side @ tangent) * tangent
        side /= np.linalg.norm(side)
        other = np.cross(tangent, side)
        rings.append(point + factor * radius * (np.outer(np.cos(angles), side) + np.outer(np.sin(angles), other)))
    return rings


def bent(corners: ArrayLike, radius: float, spacing: float, *, least: int = 3) -> NDArray[np.float64]:
    """Return a path along ``corners`` (n, 3) whose bends are arcs of ``radius``, points about ``spacing`` apart."""
    points = np.asarray(corners, dtype=np.float64)
    path = [points[:1]]
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        into = (corner - before) / np.linalg.norm(corner - before)
        out = (after - corner) / np.linalg.norm(after - corner)
        half = float(np.arccos(np.clip(into @ out, -1.0, 1.0))) / 2.0
        inward = (out - into) / np.linalg.norm(out - into)
        centre = corner + inward * radius / np.cos(half)
        count = max(least, round(2.0 * half * radius / spacing))
        angles = np.linspace(-half, half, count + 1)
        along = (into + out) / np.linalg.norm(into + out)
        path.append(centre + radius * (np.outer(np.sin(angles), along) - np.outer(np.cos(angles), inward)))
    return np.concatenate([*path, points[-1:]])


def grounded(mesh: MeshData) -> MeshData:
    """Return the mesh moved along y so that its lowest vertex stands at y = 0."""
    return MeshData(mesh.vertices - np.array([0.0, mesh.bounds[0, 1], 0.0]), mesh.faces)
