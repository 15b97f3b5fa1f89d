"""Bodies: a mesh that is sent once, and a pose only where it changed; a body without a pose is not drawn."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore import Motion, TriangleMesh
from cdcore.numerics import FloatArray
from replay.comparison.first_touch import at_touch
from replay.comparison.outcome import Miss
from replay.outputs.palette import Rgba, albedo, tags_of
from replay.outputs.rerun_log.columns import RecordingWriter, entity, pose_columns
from replay.prepare.assembly import Assembly
from sessions.model.scene import Scene

CREASE_COSINE: Final = float(np.cos(np.radians(40.0)))
"""Faces that meet at more than 40 degrees keep an edge; shared normals would draw gradients over a bench."""

CREASE_FAN: Final = 256
"""Above this many faces at a vertex (the hub of a cap) each keeps its own normal: the work grows with the square."""


def body_path(name: str) -> str:
    """Entity of a body; punctuation in its name is escaped."""
    return entity("world", name)


Colours = Mapping[str, Sequence[tuple[int, int, Rgba]]]
"""Body -> its colour from a frame, and nanoseconds after it, on; a body without a row has that of its tags."""


def log_world(
    writer: RecordingWriter, assembly: Assembly, scene: Scene, wanted: Container[str] | None = None,
    colours: Colours | None = None,
) -> None:  # fmt: skip
    """Send meshes and poses of the ``wanted`` bodies; ``None``: of all."""
    writer.static("world", rr.ViewCoordinates.RIGHT_HAND_Y_UP)
    for column, body in enumerate(assembly.bodies):
        if wanted is not None and body.name not in wanted:
            continue
        path, usual = body_path(body.name), albedo(tags_of(body.name, scene))
        log_shape(writer, f"{path}/mesh", body.mesh)
        _log_colours(
            writer, f"{path}/mesh", assembly.motion.valid[:, column], (colours or {}).get(body.name, ()), usual
        )
        _log_poses(writer, path, assembly, column)


def log_shape(writer: RecordingWriter, path: str, mesh: TriangleMesh) -> None:
    """Send a mesh, without a colour."""
    vertices, normals, faces = shaded(mesh)
    shape = rr.Mesh3D.from_fields(vertex_positions=vertices, vertex_normals=normals, triangle_indices=faces)
    writer.static(path, shape)


def _log_colours(
    writer: RecordingWriter, path: str, valid: NDArray[np.bool_], steps: Sequence[tuple[int, int, Rgba]], usual: Rgba
) -> None:
    """Send the colour of a body; one without opacity while it has no pose.

    A transform cannot hide a body: Rerun 0.41 refuses a scale or a quaternion of zero, and draws it at the identity.
    """
    flips = [(frame, 0) for frame in np.flatnonzero(np.diff(valid, prepend=~valid[:1])).tolist()]
    at = {(frame, later): colour for frame, later, colour in steps}
    when, colour, rows = sorted({*flips, *at}), usual, []
    for moment in when:
        colour = at.get(moment, colour)
        rows.append(colour if valid[moment[0]] else (*colour[:3], 0))
    writer.rows_later(path, when, rr.Mesh3D.columns(albedo_factor=np.array(rows, dtype=np.uint8).reshape(-1, 4)))


def _log_poses(writer: RecordingWriter, path: str, assembly: Assembly, column: int) -> None:
    kept, motion = writer.clock.kept, assembly.motion
    frames = kept[motion.valid[kept, column]]
    place, turn = motion.translations[frames, column], motion.rotations[frames, column]
    changed = np.ones(len(frames), dtype=np.bool_)
    changed[1:] = (place[1:] != place[:-1]).any(axis=1) | (turn[1:] != turn[:-1]).any(axis=(1, 2))
    writer.rows(path, frames[changed], pose_columns(place[changed], turn[changed]))


def log_touches(writer: RecordingWriter, assembly: Assembly, misses: Iterable[Miss]) -> None:
    """Send the poses of both bodies at a touch between frames; on the session timeline alone."""
    moments: dict[int, dict[int, Motion]] = {}
    for miss in misses:
        if miss.touch is None:
            continue
        there = at_touch(assembly, miss.pair, miss.touch).motion
        for body in assembly.pairs[miss.pair].tolist():
            if _moves(assembly.motion, miss.touch.frame, body):
                ns = int(writer.clock.ns[miss.touch.frame]) + miss.touch.later_ns
                moments.setdefault(body, {})[ns] = there
    for body, at in moments.items():
        stamps = np.array(sorted(at))
        places = np.array([at[ns].translations[0, body] for ns in stamps])
        turns = np.array([at[ns].rotations[0, body] for ns in stamps])
        writer.session_rows(body_path(assembly.bodies[body].name), stamps, pose_columns(places, turns))


def _moves(motion: Motion, frame: int, body: int) -> bool:
    """Whether a body moves to the next frame: else no later row would bring it back."""
    places, turns = motion.translations[frame : frame + 2, body], motion.rotations[frame : frame + 2, body]
    return bool((places[0] != places[1]).any() or (turns[0] != turns[1]).any())


@lru_cache(maxsize=64)  # several tabs have bodies of their own
def shaded(mesh: TriangleMesh) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint32]]:
    """Vertices, unit normals (v, 3) and faces (f, 3) to draw: smooth over gentle edges, flat across sharp ones."""
    normals = _corner_normals(mesh).reshape(-1, 3)
    corner = mesh.faces.reshape(-1).astype(np.int64)
    # Corners of one vertex whose normals agree to 1/100 become one vertex again: a third of the size.
    key = np.concatenate([corner[:, None], np.round(normals * 100).astype(np.int64)], axis=1)
    _, first, number = np.unique(key @ [256**3, 256**2, 256, 1], return_index=True, return_inverse=True)
    vertices = mesh.vertices[corner[first]].astype(np.float32)
    return vertices, normals[first].astype(np.float32), number.reshape(-1, 3).astype(np.uint32)


def face_normals(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normals of triangles (f, 3, 3), each (f, 3): as long as twice the area, and of unit length (0 without area)."""
    area: FloatArray = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(area, axis=1, keepdims=True)
    return area, np.divide(area, length, out=np.zeros_like(area), where=length > 0)


def _corner_normals(mesh: TriangleMesh) -> FloatArray:
    """Unit normal of each corner of each face, (f, 3, 3): area-weighted over the faces that meet it gently."""
    area, unit = face_normals(mesh.triangles)
    vertex = mesh.merged_faces.reshape(-1)
    order = np.argsort(vertex, kind="stable")
    counts = np.bincount(vertex)
    start = np.cumsum(counts) - counts
    reach = np.where(counts[vertex] <= CREASE_FAN, counts[vertex], 0)
    corner = np.repeat(np.arange(len(vertex)), reach)
    offset = np.arange(len(corner)) - np.repeat(np.cumsum(reach) - reach, reach)
    face, other = corner // 3, order[start[vertex[corner]] + offset] // 3
    gentle = np.einsum("ij,ij->i", unit[face], unit[other]) >= CREASE_COSINE
    total = np.stack([np.bincount(corner[gentle], area[other[gentle], k], len(vertex)) for k in range(3)], axis=1)
    norm = np.linalg.norm(total, axis=1, keepdims=True)
    own = np.repeat(unit, 3, axis=0)
    smooth: FloatArray = np.divide(total, norm, out=own, where=norm > 0)
    return smooth.reshape(-1, 3, 3)
