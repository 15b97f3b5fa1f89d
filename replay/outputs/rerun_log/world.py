"""Bodies: a mesh that is sent once, and a pose only where it changed; a body without a pose is not drawn."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore import Motion, TriangleMesh
from replay.comparison.first_touch import at_touch
from replay.comparison.outcome import Miss
from replay.outputs.palette import Rgba, albedo, tags_of
from replay.outputs.rerun_log.columns import RecordingWriter, entity, pose_columns
from replay.outputs.shapes import shaded
from replay.prepare.assembly import Assembly
from sessions.model.scene import Scene


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
