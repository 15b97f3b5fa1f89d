"""Rods, boxes, rings and tubes along bent paths, the things that rows of `united.toml` join of them, and the search
for a face count."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.geometry.rings import Ring, area_factor, even_angles, revolved_rings, sewn
from sessions.geometry.solids import box
from sessions.glassware.instrument import Instrument, metres, rows, weighed_instrument
from sessions.mesh_data import MeshData
from sessions.meshes.mesh_files import refined_mesh, subtracted_mesh, united_mesh

FACE_COUNT_TOLERANCE = 0.08
SEARCH_STEPS = 9


def from_row(faces: int, *, name: str) -> Instrument:
    """Return the instrument that a row of `united.toml` describes."""
    row = rows("united.toml")[name]

    def build(spacing: float) -> MeshData:
        solids = [_solid(solid, spacing) for solid in row["parts"]]
        if len(solids) == 1:
            return solids[0]
        whole = united_mesh(solids)
        if "holes" in row:
            whole = subtracted_mesh(whole, [_solid(hole, spacing) for hole in row["holes"]])
        return refined_mesh(whole, spacing * row.get("coarser", 1.0))

    mesh = fitted_mesh(build, faces, metres(row["spacing"]))[0]
    if row.get("grounded"):
        mesh = MeshData(mesh.vertices - np.array([0.0, mesh.bounds[0, 1], 0.0]), mesh.faces)
    return weighed_instrument(name, mesh, row["tags"], row["material"])


def _solid(solid: dict[str, Any], spacing: float) -> MeshData:
    if "box" in solid:
        return box(metres(solid["box"]), metres(solid["at"]))
    around = sections_for(metres(solid.get("round", solid.get("radius"))), spacing, solid.get("least", 8))
    if "ring" in solid:
        outline = np.array(metres(solid["ring"]))
        if solid.get("divided"):
            outline = divided_path(outline, spacing)
        return sewn(revolved_rings(outline[:-1], even_angles(around)), around=True)
    radius = metres(solid["radius"])
    if "path" in solid:
        pose = _pose(solid)
        path = bent(
            metres(solid["path"]) @ pose[:3, :3].T + pose[:3, 3],
            metres(solid["bend"]),
            spacing,
            least=solid.get("bends", 3),
        )
        return rod(path, radius, around)
    if "loop" in solid:
        reach = metres(solid["loop"])
        angles = np.linspace(0.0, 2.0 * np.pi, max(8, round(2.0 * np.pi * reach / spacing)), endpoint=False)
        circle = reach * np.column_stack([np.cos(angles), np.zeros_like(angles), np.sin(angles)])
        loop = metres(solid["about"]) + circle
        rings = swept(np.concatenate([loop[-1:], loop, loop[:1]]), [radius] * (len(loop) + 2), around)[1:-1]
        return sewn(rings, around=True).transformed(_pose(solid))
    if "arc" in solid:
        reach, (x, y, z) = metres(solid["arc"]), metres(solid["at"])
        count = max(9, round(4.9 * reach / spacing))
        angles = np.radians(np.linspace(solid["from_deg"], solid["to_deg"], count))
        path = np.column_stack([x + reach * np.cos(angles), np.full_like(angles, y), z - reach * np.sin(angles)])
        return rod(path, radius, around)
    if solid.get("across") == "corners":
        radius = across_corners(radius, around)
    end_radius = metres(solid["end_radius"]) if "end_radius" in solid else radius
    return cylinder(metres(solid["from"]), metres(solid["to"]), (radius, end_radius), around)


def _pose(solid: dict[str, Any]) -> NDArray[np.float64]:
    """Matrix (4, 4) that turns a part about Y, mirrors it in X if it says so, and moves it to where it is."""
    angle, mirror = np.radians(solid["turned_deg"]), -1.0 if solid.get("mirrored") else 1.0
    pose = np.eye(4)
    pose[[0, 0, 2, 2], [0, 2, 0, 2]] = mirror * np.cos(angle), mirror * np.sin(angle), -np.sin(angle), np.cos(angle)
    pose[:3, 3] = metres(solid.get("at", [0, 0, 0]))
    return pose


def fitted_mesh(build: Callable[[float], MeshData], faces: int, start: float) -> tuple[MeshData, float]:
    """Return ``build(spacing)``, and the spacing in metres, whose mesh comes nearest to ``faces`` faces.

    Cost: up to nine meshes. ``start`` is the first spacing tried; the count is taken to fall with the square of the
    spacing.
    """
    spacing = start
    lower, upper = 0.0, np.inf  # spacings known to give too many faces, too few
    tried: list[tuple[MeshData, float]] = []
    for _ in range(SEARCH_STEPS):
        tried.append((build(spacing), spacing))
        ratio = len(tried[-1][0].faces) / faces
        if abs(ratio - 1.0) < FACE_COUNT_TOLERANCE:
            break
        lower, upper = (max(lower, spacing), upper) if ratio > 1.0 else (lower, min(upper, spacing))
        spacing *= float(np.sqrt(ratio))
        if not lower < spacing < upper:
            spacing = float(np.sqrt(lower * upper))
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
    start_cap = points[:1] + radius * first / np.linalg.norm(first)
    end_cap = points[-1:] + radius * last / np.linalg.norm(last)
    return sewn([start_cap, *rings, end_cap])


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


def divided_path(path: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Return the points (n, 3) or (n, 2) of a path, and as many between them that all are about ``spacing`` apart."""
    pieces = [
        np.linspace(start, end, max(1, round(float(np.linalg.norm(end - start)) / spacing)), endpoint=False)
        for start, end in pairwise(path)
    ]
    return np.concatenate([*pieces, path[-1:]])
