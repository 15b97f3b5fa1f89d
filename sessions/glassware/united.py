"""Rods, boxes, rings and tubes along bent paths, the things that rows of `united.toml` join of them, and the search
for a face count."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.geometry.rings import Ring, area_factor, even_angles, sewn, turned
from sessions.geometry.solids import box
from sessions.glassware.instrument import Instrument, metres, rows, weighed
from sessions.mesh_data import MeshData
from sessions.meshes.mesh_files import refined, subtracted, united

FACE_COUNT_TOLERANCE = 0.08
SEARCH_STEPS = 9


def from_row(faces: int, *, name: str) -> Instrument:
    """Return the instrument that a row of `united.toml` describes."""
    row = rows("united.toml")[name]

    def build(spacing: float) -> MeshData:
        solids = [_solid(part, spacing) for part in row["parts"]]
        if len(solids) == 1:
            return solids[0]
        whole = united(solids)
        if "holes" in row:
            whole = subtracted(whole, [_solid(hole, spacing) for hole in row["holes"]])
        return refined(whole, spacing * row.get("coarser", 1.0))

    mesh = fitted(build, faces, metres(row["spacing"]))[0]
    if row.get("grounded"):
        mesh = MeshData(mesh.vertices - np.array([0.0, mesh.bounds[0, 1], 0.0]), mesh.faces)
    return weighed(name, mesh, row["tags"], row["material"])


def _solid(part: dict[str, Any], spacing: float) -> MeshData:
    if "box" in part:
        return box(metres(part["box"]), metres(part["at"]))
    around = sections_for(metres(part.get("round", part.get("radius"))), spacing, part.get("least", 8))
    if "ring" in part:
        outline = np.array(metres(part["ring"]))
        if part.get("divided"):
            outline = divided(outline, spacing)
        return sewn(turned(outline[:-1], even_angles(around)), around=True)
    radius = metres(part["radius"])
    if "path" in part:
        pose = _pose(part)
        path = bent(
            metres(part["path"]) @ pose[:3, :3].T + pose[:3, 3],
            metres(part["bend"]),
            spacing,
            least=part.get("bends", 3),
        )
        return rod(path, radius, around)
    if "loop" in part:
        reach = metres(part["loop"])
        angles = np.linspace(0.0, 2.0 * np.pi, max(8, round(2.0 * np.pi * reach / spacing)), endpoint=False)
        circle = reach * np.column_stack([np.cos(angles), np.zeros_like(angles), np.sin(angles)])
        loop = metres(part["about"]) + circle
        rings = swept(np.concatenate([loop[-1:], loop, loop[:1]]), [radius] * (len(loop) + 2), around)[1:-1]
        return sewn(rings, around=True).transformed(_pose(part))
    if "arc" in part:
        reach, (x, y, z) = metres(part["arc"]), metres(part["at"])
        count = max(9, round(4.9 * reach / spacing))
        angles = np.radians(np.linspace(part["from_deg"], part["to_deg"], count))
        path = np.column_stack([x + reach * np.cos(angles), np.full_like(angles, y), z - reach * np.sin(angles)])
        return rod(path, radius, around)
    if part.get("across") == "corners":
        radius = across_corners(radius, around)
    end_radius = metres(part["end_radius"]) if "end_radius" in part else radius
    return cylinder(metres(part["from"]), metres(part["to"]), (radius, end_radius), around)


def _pose(part: dict[str, Any]) -> NDArray[np.float64]:
    """Matrix (4, 4) that turns a part about Y, mirrors it in X if it says so, and moves it to where it is."""
    angle, mirror = np.radians(part["turned_deg"]), -1.0 if part.get("mirrored") else 1.0
    pose = np.eye(4)
    pose[[0, 0, 2, 2], [0, 2, 0, 2]] = mirror * np.cos(angle), mirror * np.sin(angle), -np.sin(angle), np.cos(angle)
    pose[:3, 3] = metres(part.get("at", [0, 0, 0]))
    return pose


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
            spacing = float(np.sqrt(low * high))
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


def cylinder(start: ArrayLike, end: ArrayLike, radii: Sequence[float], sections: int) -> MeshData:
    """Return a cone stump with flat ends, as large in section as the round one, of these radii at its two ends."""
    rings = swept(np.array([start, end], dtype=np.float64), radii, sections)
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


def divided(path: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Return the points (n, 3) or (n, 2) of a path, and as many between them that all are about ``spacing`` apart."""
    pieces = [
        np.linspace(start, end, max(1, round(float(np.linalg.norm(end - start)) / spacing)), endpoint=False)
        for start, end in pairwise(path)
    ]
    return np.concatenate([*pieces, path[-1:]])
