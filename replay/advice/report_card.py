"""The report card of a collider: what its pieces add to a mesh and leave out, and what they get wrong in motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from cdcore.mesh import TriangleMesh
from cdcore.numerics import FloatArray
from cdcore.protocol import Solids
from replay.auditing.outcome import Outcome
from replay.auditing.tolerance import Reference
from replay.cutting.convex_solids import area_of, enclosed_solid, manifold_union, outside_by, solids_of
from replay.cutting.seams import SeamKind, seams_of
from replay.cutting.surface_distance import Surface, farthest_on, farthest_triangles
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import make_detector
from replay.prepare.assembly import Assembly

if TYPE_CHECKING:
    from manifold3d import Manifold

VOLUME_ROUNDING: Final = 1e-9
"""Fraction of a volume that is none: common volumes of equal boxes differ by 1e-16 of it, of curved solids by 1e-10."""

FILE_ROUNDING: Final = 2.0**-24
"""Fraction of a coordinate by which a file of colliders may move it: half a step of its float32."""


def shape_figures(mesh: TriangleMesh, pieces: Sequence[TriangleMesh]) -> dict[str, Any]:
    """Pieces, triangles, volumes beyond and missing as fractions of the mesh, and reaches in millimetres, plain data.

    ``reach_mm`` is how far a piece stands beyond the surface at most, ``outside_mm`` how far the mesh lies outside its
    pieces. Volumes are ``None`` of a mesh that is no solid. ``seams`` are those of ``replay.cutting.seams``.
    """
    volume_beyond = missing_volume = None
    solids = _solids(mesh, pieces)
    if solids is not None:
        solid, pieces_union = solids
        volume = solid.volume()
        common_volume = (pieces_union ^ solid).volume()
        volume_tolerance = volume_rounding(mesh, volume)
        volume_differences = pieces_union.volume() - common_volume, volume - common_volume
        volume_beyond, missing_volume = (
            volume_difference / volume if volume_difference > volume_tolerance else 0.0
            for volume_difference in volume_differences
        )
    return {
        "pieces": len(pieces),
        "triangles": sum(len(piece.faces) for piece in pieces),
        "most_triangles": max(len(piece.faces) for piece in pieces),
        "beyond": volume_beyond,
        "missing": missing_volume,
        "reach_mm": 1e3 * _reach(mesh, pieces, solids),
        "outside_mm": 1e3 * _beyond_rounding(outside_by(mesh, pieces), mesh),
        **seam_figures(mesh, pieces),
    }


def seam_figures(mesh: TriangleMesh, pieces: Sequence[TriangleMesh]) -> dict[str, Any]:
    """Widest overlap and slit between two pieces in millimetres, and every seam with its place, plain data."""
    seams = seams_of(mesh, pieces)
    widest_of_kind = {kind: max((seam.width for seam in seams if seam.kind is kind), default=0.0) for kind in SeamKind}
    seam_rows = [
        {
            "kind": seam.kind.value,
            "pieces": list(seam.pieces),
            "width_mm": 1e3 * seam.width,
            "at_mm": [1e3 * coordinate for coordinate in seam.point],
        }
        for seam in seams
    ]
    return {
        "overlap_mm": 1e3 * widest_of_kind[SeamKind.OVERLAP],
        "slit_mm": 1e3 * widest_of_kind[SeamKind.SLIT],
        "seams": seam_rows,
    }


def volume_rounding(mesh: TriangleMesh, volume: float) -> float:
    """Cubic metres of a closed mesh of this volume that are none: what booleans and the written file round away.

    A file moves the surface by at most its rounding, so that the volume changes by at most that times the area.
    """
    return max(VOLUME_ROUNDING * abs(volume), area_of(mesh) * _file_rounding(mesh))


def _file_rounding(mesh: TriangleMesh) -> float:
    """Metres by which a file of colliders may move a corner, at most: the diagonal of the roundings of coordinates."""
    return 3.0**0.5 * FILE_ROUNDING * float(np.abs(mesh.referenced_vertices).max())


def _beyond_rounding(metres: float, mesh: TriangleMesh) -> float:
    """The length, and 0 where it is what the written file rounds away."""
    return metres if metres > _file_rounding(mesh) else 0.0


def _solids(mesh: TriangleMesh, pieces: Sequence[TriangleMesh]) -> tuple[Manifold, Manifold] | None:
    """The mesh and the union of its pieces, for the library manifold; ``None``: one of them is no solid."""
    solid = enclosed_solid(mesh)
    if solid is None or not all(piece.is_closed for piece in pieces):
        return None
    return solid, manifold_union(pieces)


def reach(mesh: TriangleMesh, pieces: Sequence[TriangleMesh]) -> float:
    """Metres from the surface of a mesh to the point of the pieces' surfaces outside it that is farthest from it.

    Of a mesh that is no solid, all of the pieces' surfaces counts: it has no inside.
    """
    return _reach(mesh, pieces, _solids(mesh, pieces))


def _reach(mesh: TriangleMesh, pieces: Sequence[TriangleMesh], solids: tuple[Manifold, Manifold] | None) -> float:
    """The same; ``solids``: the mesh and the union of the pieces, ``None`` where they are no solids."""
    if solids is None:
        return _farthest(np.concatenate([piece.triangles for piece in pieces]), mesh)
    solid, pieces_union = solids
    overhang = pieces_union - solid
    # A sliver between equal surfaces is what booleans of solids round away.
    if overhang.volume() <= volume_rounding(mesh, solid.volume()):
        return 0.0
    outside_mesh = overhang.to_mesh64()
    corners = outside_mesh.vert_properties[:, :3][np.asarray(outside_mesh.tri_verts).astype(np.int64)]
    return _farthest(corners, mesh)


def _farthest(region: FloatArray, mesh: TriangleMesh) -> float:
    """Metres from the surface of a mesh to the farthest point of triangles (n, 3, 3)."""
    return farthest_on(farthest_triangles(region, mesh.triangles), Surface(mesh.triangles), thorough=True)


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
    pair_assembly = replace(assembly, bodies=bodies, pairs=assembly.pairs[columns])
    detector = make_detector(DetectorSpec("card", "collider", {"shape": "shipped"}), pair_assembly, 0)
    detection = detector.detect(assembly.motion)
    verdict = reference.detection.verdict.copy()
    verdict[:, columns] = detection.verdict
    comparison = reference.compare(replace(reference.detection, verdict=verdict))
    right_frames, missed_frames, false_frames = comparison.by_pair[columns][
        :, [Outcome.BOTH, Outcome.MISSED, Outcome.FALSE_CONTACT]
    ].sum(axis=0)
    seconds = sum(float(np.sum(stage)) for stage in detection.seconds.values())
    return {
        "false": float(false_frames / (right_frames + false_frames)) if right_frames + false_frames else None,
        "missed": float(missed_frames / (right_frames + missed_frames)) if right_frames + missed_frames else None,
        "ms": 1e3 * seconds / max(1, len(assembly.motion)),
    }
