"""The report card of a collider: what its pieces add to a mesh and leave out, and what they get wrong in motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from cdcore.mesh import TriangleMesh
from cdcore.numerics import BoolArray, FloatArray
from cdcore.protocol import Solids
from replay.auditing.outcome import Outcome
from replay.auditing.tolerance import Reference
from replay.cutting.convex_solids import manifold_of, manifold_union, outside_by, solids_of
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import make_detector
from replay.prepare.assembly import Assembly

SAMPLES: Final = 48
"""Points of a piece's surface along the size of a body, between which its reach is not looked at."""

ROUNDING: Final = 1e-9
"""Fraction of a volume that is none: common volumes of equal boxes differ by 1e-16 of it, of curved solids by 1e-10."""

POINTS_AT_ONCE: Final = 32
"""Of the points that are farthest from samples of the surface, so many are measured."""


def shape_figures(mesh: TriangleMesh, pieces: Sequence[TriangleMesh]) -> dict[str, Any]:
    """Pieces, triangles, volumes beyond and missing as fractions of the mesh, and reaches in millimetres, plain data.

    ``reach_mm`` is how far a piece stands beyond the surface at most, ``outside_mm`` how far the mesh lies outside its
    pieces. Volumes are ``None`` of a mesh that is no solid.
    """
    solid = manifold_of(mesh) if mesh.is_closed else None
    volume = 0.0 if solid is None else solid.volume()
    beyond = missing = None
    if solid is not None and volume > 0.0 and all(piece.is_closed for piece in pieces):
        filled = manifold_union(pieces)
        common = (filled ^ solid).volume()
        beyond, missing = (_beyond_rounding((part - common) / volume) for part in (filled.volume(), volume))
    return {
        "pieces": len(pieces),
        "triangles": sum(len(piece.faces) for piece in pieces),
        "most_triangles": max(len(piece.faces) for piece in pieces),
        "beyond": beyond,
        "missing": missing,
        "reach_mm": 1e3 * reach(mesh, pieces),
        "outside_mm": 1e3 * outside_by(mesh, pieces),
    }


def _beyond_rounding(fraction: float) -> float:
    """The fraction, and 0 where it is what booleans of solids round away."""
    return fraction if fraction > ROUNDING else 0.0


def reach(mesh: TriangleMesh, pieces: Sequence[TriangleMesh]) -> float:
    """Metres by which points of the pieces' surfaces, outside a mesh, are away from its surface at most.

    Points lie a forty-eighth of the size of the body from each other, so that it is right to about a hundredth of it.
    """
    from scipy.spatial import cKDTree

    size = float(np.ptp(mesh.referenced_vertices, axis=0).max())
    points = surface_points(pieces, size / SAMPLES)
    distance, _ = cKDTree(surface_points([mesh], size / SAMPLES)).query(points)
    order = np.argsort(-distance, kind="stable")
    for start in range(0, len(order), POINTS_AT_ONCE):
        rows = order[start : start + POINTS_AT_ONCE]
        outside = rows[is_outside(points[rows], mesh)]
        if len(outside):
            return float(distance_to(points[outside], mesh).max())
    return 0.0


def surface_points(pieces: Sequence[TriangleMesh], spacing: float) -> FloatArray:
    """Points (n, 3) of the surfaces of pieces, no farther from each other than the spacing."""
    points = []
    for piece in pieces:
        corners = piece.triangles
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        counts = np.maximum(1, np.ceil(longest / spacing)).astype(np.int64)
        for count in np.unique(counts).tolist():
            weights = np.array([(i, j, count - i - j) for i in range(count + 1) for j in range(count + 1 - i)]) / count
            points.append(np.einsum("ka,nad->nkd", weights, corners[counts == count]).reshape(-1, 3))
    return np.unique(np.concatenate(points), axis=0)


def distance_to(points: FloatArray, mesh: TriangleMesh) -> FloatArray:
    """Metres from points (n, 3) to the surface of a mesh, (n,)."""
    triangles = mesh.triangles
    distance = np.empty(len(points))
    for number, point in enumerate(points):
        distance[number] = _point_triangle(np.broadcast_to(point, (len(triangles), 3)), triangles).min()
    return distance


def _point_triangle(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """Metres from each point (n, 3) to its triangle (n, 3, 3), (n,)."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    unit = normal / np.maximum(length, 1e-300)[:, None]
    height = ((points - a) * unit).sum(axis=1)
    foot = points - height[:, None] * unit
    inside = length > 0.0
    nearest = np.full(len(points), np.inf)
    for first, second in ((a, b), (b, c), (c, a)):
        edge = second - first
        inside &= (np.cross(edge, foot - first) * unit).sum(axis=1) >= 0.0
        squared = np.maximum((edge * edge).sum(axis=1), 1e-300)
        along = np.clip(((points - first) * edge).sum(axis=1) / squared, 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(points - first - along[:, None] * edge, axis=1))
    return np.where(inside, np.abs(height), nearest)


def is_outside(points: FloatArray, mesh: TriangleMesh) -> BoolArray:
    """Whether points (n, 3) are outside a closed mesh, (n,): its winding number there is less than a half.

    Source: van Oosterom and Strackee 1983 (solid angle of a triangle).
    """
    a, b, c = (mesh.triangles[:, k][None] - points[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(corner, axis=2) for corner in (a, b, c))
    above = (a * np.cross(b, c)).sum(axis=2)
    below = la * lb * lc + (a * b).sum(axis=2) * lc + (b * c).sum(axis=2) * la + (c * a).sum(axis=2) * lb
    winding = 2.0 * np.arctan2(above, below).sum(axis=1) / (4.0 * np.pi)
    return np.asarray(np.abs(winding) < 0.5)


def contact_figures(
    assembly: Assembly, reference: Reference, name: str, pieces: Sequence[TriangleMesh]
) -> dict[str, Any]:
    """Errors of the pieces of one body while every other body keeps its mesh, at every frame, plain data.

    ``false`` is a fraction of the contact time reported of its pairs, ``missed`` of their true contact time, ``None``
    where there is none; ``ms`` is the time a frame of its pairs, asked about all frames at once.
    """
    columns = np.flatnonzero((assembly.pairs == assembly.names.index(name)).any(axis=1))
    if not len(columns):
        return {"false": None, "missed": None, "ms": None}
    bodies = tuple(
        replace(body, colliders=solids_of(pieces) if body.name == name else Solids((body.mesh,), body.mesh))
        for body in assembly.bodies
    )
    seen = replace(assembly, bodies=bodies, pairs=assembly.pairs[columns])
    detector = make_detector(DetectorSpec("card", "collider", {"shape": "shipped"}), seen, 0)
    detection = detector.detect(assembly.motion)
    verdict = reference.truth.verdict.copy()
    verdict[:, columns] = detection.verdict
    comparison = reference.compare(replace(reference.truth, verdict=verdict))
    both, missed, false = comparison.by_pair[columns][:, [Outcome.BOTH, Outcome.MISSED, Outcome.FALSE_CONTACT]].sum(
        axis=0
    )
    seconds = sum(float(np.sum(stage)) for stage in detection.seconds.values())
    return {
        "false": float(false / (both + false)) if both + false else None,
        "missed": float(missed / (both + missed)) if both + missed else None,
        "ms": 1e3 * seconds / max(1, len(assembly.motion)),
    }
