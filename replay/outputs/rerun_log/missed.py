"""The faces that met and were missed, in red."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore import Detection, TriangleMesh
from cdcore.numerics import FloatArray
from replay.comparison.misses import by_depth
from replay.comparison.outcome import Miss
from replay.outputs.palette import MISSED_FACES
from replay.outputs.rerun_log.columns import RecordingWriter
from replay.outputs.rerun_log.world import body_path, face_normals
from replay.prepare.assembly import Assembly

PUSHED_OUT: Final = 0.00015
"""Metres that red faces stand off their body, so that the two do not flicker through each other."""

DRAWN_MISSED_FACES: Final = 200_000
"""Red faces per body at most, 7 MB: beyond it the shallowest misses stay without faces; pins and lanes show them."""

LARGE_FACE: Final = 0.002
"""Square metres, a triangle 6 cm wide and high: larger faces are not painted where smaller ones show the place. Two
triangles of a bench top are two hands wide: painted, they drown the contact, and the curve says where on them it is."""


def log_missed_faces(writer: RecordingWriter, assembly: Assembly, oracle: Detection, misses: Sequence[Miss]) -> None:
    """Send below each body, in its own frame, per frame its faces that met and were missed.

    Where the oracle lists no faces, those of each miss's deepest moment, which may lie between frames.
    """
    per_body: dict[int, dict[Moment, list[NDArray[np.int64]]]] = {}
    room = dict.fromkeys(range(len(assembly.bodies)), DRAWN_MISSED_FACES)
    for miss in by_depth(misses):
        for moment, faces in _moments_with_faces(oracle, miss):
            for body, mine in _red_faces(assembly, miss.pair, faces):
                if 0 < len(mine) <= room[body]:
                    room[body] -= len(mine)
                    per_body.setdefault(body, {}).setdefault(moment, []).append(mine)
    for body in sorted({int(k) for miss in misses for k in assembly.pairs[miss.pair]}):
        _log_faces_of(writer, assembly, body, per_body.get(body, {}))


Moment = tuple[int, int]
"""A frame, and nanoseconds after it."""


def _moments_with_faces(oracle: Detection, miss: Miss) -> Iterator[tuple[Moment, NDArray[np.int64]]]:
    if oracle.face_sets is not None:
        yield from (((frame, 0), oracle.faces(frame, miss.pair)) for frame in range(miss.first, miss.last + 1))
    elif miss.faces is not None:
        yield miss.shown, miss.faces


def _red_faces(assembly: Assembly, pair: int, faces: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Both bodies and their faces to paint: large ones only where nothing smaller shows the place."""
    bodies = assembly.pairs[pair].tolist()
    mine = [np.unique(faces[:, side]) for side in range(2)]
    areas = [face_areas(assembly.bodies[body].mesh, one) for body, one in zip(bodies, mine, strict=True)]
    small = [one[area <= LARGE_FACE] for one, area in zip(mine, areas, strict=True)]
    yield from zip(bodies, small if any(map(len, small)) else mine, strict=True)


def face_areas(mesh: TriangleMesh, faces: NDArray[np.int64]) -> FloatArray:
    """Area of each of these faces, square metres."""
    areas: FloatArray = np.linalg.norm(face_normals(mesh.triangles[faces])[0], axis=1) / 2
    return areas


def _log_faces_of(
    writer: RecordingWriter, assembly: Assembly, body: int, found: dict[Moment, list[NDArray[np.int64]]]
) -> None:
    path = f"{body_path(assembly.bodies[body].name)}/missed_faces"
    # A row without faces after each stretch, else the patch would stay for ever: the viewer shows the latest row.
    last = len(writer.clock.ns) - 1
    rows = sorted({(0, 0), *found, *((frame + 1, 0) for frame, _ in found if frame < last)})
    triangles = pushed_out(assembly.bodies[body].mesh.triangles)
    per_row = [np.unique(np.concatenate(found[row])) if row in found else NO_FACES for row in rows]
    corners = triangles[np.concatenate(per_row)].reshape(-1, 3).astype(np.float32)
    counts = [3 * len(faces) for faces in per_row]
    writer.rows_later(path, rows, rr.Mesh3D.columns(vertex_positions=corners), counts)
    writer.static(path, rr.Mesh3D.from_fields(albedo_factor=MISSED_FACES))


NO_FACES: Final = np.zeros(0, dtype=np.int64)


def pushed_out(triangles: FloatArray) -> FloatArray:
    """Triangles (f, 3, 3) moved along their normals by ``PUSHED_OUT``; a face without area stays where it is."""
    moved: FloatArray = triangles + PUSHED_OUT * face_normals(triangles)[1][:, None]
    return moved
