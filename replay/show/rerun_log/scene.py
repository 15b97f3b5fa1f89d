"""The room: bodies that stand where they stood, curves in which surfaces meet, and in red the faces of misses.

A mesh is sent once, and a pose only where it changed; a body without a pose is not drawn.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from itertools import chain
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore import Detection, FaceSets, Motion, TriangleMesh
from cdcore.numerics import FloatArray
from replay.auditing.fault import worst_first
from replay.auditing.first_touch import at_touch
from replay.auditing.outcome import Comparison, Outcome
from replay.document.run_result import RunResult
from replay.prepare.assembly import Assembly
from replay.show.drawn_mesh import face_normals, shaded_mesh
from replay.show.palette import (
    LATE,
    MISSED,
    OUTCOME_STYLES,
    TRUE_CONTACT,
    VEIL_ALPHA,
    Rgba,
    albedo,
    fault_colour,
    tags_of,
)
from replay.show.rerun_log.recording_file import RecordingClock, RecordingWriter, entity, pack_colours, pose_columns
from sessions.model.scene import Scene

MOST_DRAWN_CONTACTS: Final = 20_000
MOST_DRAWN_FACES: Final = 400_000
"""Contacts, and face pairs behind them, that one detector draws at most: 10 MB and a second or two. Glass at rest on a
bench touches it for minutes in hundreds of faces. Beyond this, frames without a moment are strided, and a curve may lag
behind its body by the stride."""

COLOURED_OUTCOMES: Final = (Outcome.MISSED, Outcome.FALSE_CONTACT, Outcome.WITHIN_TOLERANCE)
"""Outcomes with a colour of their own; all other contacts have that of what is found."""

FACE_OFFSET_M: Final = 0.00015
"""Metres that red faces stand off their body, so that the two do not flicker through each other."""

MOST_DRAWN_MISSED_FACES: Final = 200_000
"""Red faces per body at most, 7 MB: beyond it the shallowest misses stay without faces; pins and lanes show them."""

LARGE_FACE_M2: Final = 0.002
"""Square metres, a triangle 6 cm wide and high: larger faces are not painted where smaller ones show the place. Two
triangles of a bench top are two hands wide: painted, they drown the contact, and the curve says where on them it is."""

Faces = NDArray[np.int64]
FrameTime = tuple[int, int]
"""A frame, and nanoseconds after it."""

ColourChanges = Mapping[str, Sequence[tuple[int, int, Rgba]]]
"""Body -> its colour from a frame, and nanoseconds after it, on; a body without a row has that of its tags."""


def body_path(name: str) -> str:
    """Entity of a body; punctuation in its name is escaped."""
    return entity("world", name)


def log_world(
    writer: RecordingWriter, assembly: Assembly, scene: Scene, displayed_names: Container[str], colours: ColourChanges
) -> None:
    """Send meshes and poses of the bodies of ``displayed_names``."""
    writer.static("world", rr.ViewCoordinates.RIGHT_HAND_Y_UP)
    for column, body in enumerate(assembly.bodies):
        if body.name in displayed_names:
            path, default_colour = body_path(body.name), albedo(tags_of(body.name, scene))
            log_shape(writer, f"{path}/mesh", body.mesh)
            has_pose = assembly.motion.valid[:, column]
            _log_colours(writer, f"{path}/mesh", has_pose, colours.get(body.name, ()), default_colour)
            _log_poses(writer, path, assembly.motion, column)


def log_shape(writer: RecordingWriter, path: str, mesh: TriangleMesh) -> None:
    """Send a mesh, without a colour."""
    vertices, normals, faces = shaded_mesh(mesh)
    shape = rr.Mesh3D.from_fields(vertex_positions=vertices, vertex_normals=normals, triangle_indices=faces)
    writer.static(path, shape)


def _log_colours(
    writer: RecordingWriter,
    path: str,
    has_pose: NDArray[np.bool_],
    steps: Sequence[tuple[int, int, Rgba]],
    default_colour: Rgba,
) -> None:
    """Send the colour of a body; one without opacity while it has no pose.

    A transform cannot hide a body: Rerun 0.41 refuses a scale or a quaternion of zero, and draws it at the identity.
    """
    flip_frames = np.flatnonzero(np.diff(has_pose, prepend=~has_pose[:1])).tolist()
    colour_at = {(frame, later): colour for frame, later, colour in steps}
    row_times, colour, rows = sorted({*((frame, 0) for frame in flip_frames), *colour_at}), default_colour, []
    for moment in row_times:
        colour = colour_at.get(moment, colour)
        rows.append((*colour[:3], colour[3] if has_pose[moment[0]] else 0))
    writer.rows(path, row_times, rr.Mesh3D.columns(albedo_factor=np.array(rows, dtype=np.uint8).reshape(-1, 4)))


def _log_poses(writer: RecordingWriter, path: str, motion: Motion, column: int) -> None:
    frames = writer.clock.drawn_frames[motion.valid[writer.clock.drawn_frames, column]]
    translation, rotation = motion.translations[frames, column], motion.rotations[frames, column]
    poses = np.hstack([translation, rotation.reshape(-1, 9)])
    is_changed = np.append(True, (poses[1:] != poses[:-1]).any(axis=1))[: len(frames)]
    writer.rows(path, frames[is_changed], pose_columns(translation[is_changed], rotation[is_changed]))


def log_touches(writer: RecordingWriter, result: RunResult) -> None:
    """Send the poses of both bodies at a touch between frames; on the session timeline alone."""
    assembly = result.assembly
    for miss in chain.from_iterable(result.misses.values()):
        touch = miss.evidence.touch
        if touch is None:
            continue
        ns = writer.clock.ns[touch.frame : touch.frame + 1] + touch.later_ns
        motion = at_touch(assembly, miss.pair, touch).motion
        for body in assembly.pairs[miss.pair].tolist():
            poses = pose_columns(motion.translations[:1, body], motion.rotations[:1, body])
            writer.session_rows(body_path(assembly.names[body]), ns, poses)


def log_contacts(
    writer: RecordingWriter,
    label: str,
    detection: Detection,
    comparison: Comparison | None,
    late_segments: Sequence[tuple[int, int, int]] = (),
) -> None:
    """Send ``world/contacts/<label>``: the curves in which surfaces meet.

    What ``comparison`` calls missed is red, or pink within ``late_segments`` (pair, first and last frame), the rest
    blue. Nothing is sent of a detection without faces or curves.
    """
    face_sets, path = detection.face_sets, entity("world", "contacts", label)
    if face_sets is None or detection.section_source is None:
        return
    contacts, frames = drawn_contacts(writer.clock, face_sets)
    frame_and_pair = face_sets.frame[contacts], face_sets.pair[contacts]
    curves = [
        detection.section(frame, pair)
        for frame, pair in zip(*(indices.tolist() for indices in frame_and_pair), strict=True)
    ]
    curves = [curve[np.isfinite(curve).all(axis=(1, 2))] for curve in curves]
    lengths = np.array([len(curve) for curve in curves], dtype=np.int64)
    outcomes = np.zeros(len(contacts), np.uint8) if comparison is None else comparison.outcome[frame_and_pair]
    curve_colours = [
        OUTCOME_STYLES[code][1] if code in COLOURED_OUTCOMES else TRUE_CONTACT for code in outcomes.tolist()
    ]
    for pair, first, last in late_segments:
        is_late = (
            (frame_and_pair[1] == pair)
            & (frame_and_pair[0] >= first)
            & (frame_and_pair[0] <= last)
            & (outcomes == Outcome.MISSED)
        )
        for index in np.flatnonzero(is_late).tolist():
            curve_colours[index] = LATE
    colours = pack_colours(curve_colours)
    strips = np.concatenate([np.zeros((0, 2, 3)), *curves]).astype(np.float32)
    lines = rr.LineStrips3D.columns(strips=strips, colors=np.repeat(colours, lengths))
    lines_per_frame = np.bincount(np.searchsorted(frames, frame_and_pair[0]), lengths, len(frames))
    writer.rows(path, frames, lines, lines_per_frame.astype(np.int64))
    writer.static(path, rr.LineStrips3D.from_fields(radii=rr.Radius.ui_points(1.8)))


def drawn_contacts(clock: RecordingClock, face_sets: FaceSets) -> tuple[Faces, Faces]:
    """Numbers of the contacts that are drawn, and the frames that get a row; one without contact clears."""
    faces_in_frame = np.zeros(len(clock.ns))
    np.add.at(
        faces_in_frame,
        face_sets.frame,
        np.maximum(1.0 / MOST_DRAWN_CONTACTS, (face_sets.stop - face_sets.start) / MOST_DRAWN_FACES),
    )
    stride = max(1, int(np.ceil(faces_in_frame[clock.drawn_frames].sum())))
    frames = np.union1d(clock.drawn_frames[::stride], clock.moments)
    has_contact = np.isin(frames, face_sets.frame)
    return np.flatnonzero(np.isin(face_sets.frame, frames)), frames[
        has_contact | np.append(True, has_contact[:-1])[: len(has_contact)]
    ]


def log_missed_faces(writer: RecordingWriter, result: RunResult) -> None:
    """Send below each body, in its own frame, per frame its faces that met and were missed, or missed in a part.

    Where the oracle lists no faces, those of each miss's deepest moment, which may lie between frames.
    """
    assembly, misses = result.assembly, [*chain.from_iterable(result.misses.values())]
    painted_at: dict[tuple[int, Rgba], dict[FrameTime, list[Faces]]] = {
        (body, fault_colour(miss.kind)): {} for miss in misses for body in assembly.pairs[miss.pair].tolist()
    }
    faces_left = dict.fromkeys((body for body, _ in painted_at), MOST_DRAWN_MISSED_FACES)
    for miss in worst_first(misses):
        oracle, faces_by_time = result.detections[result.oracle], dict[FrameTime, Faces]()
        if oracle.face_sets is not None:
            faces_by_time = {(frame, 0): oracle.faces(frame, miss.pair) for frame in range(miss.first, miss.last + 1)}
        elif miss.evidence.faces is not None:
            faces_by_time = {miss.moment: miss.evidence.faces}
        for time, faces in faces_by_time.items():
            for body, painted in _faces_to_paint(assembly, miss.pair, faces).items():
                if 0 < len(painted) <= faces_left[body]:
                    faces_left[body] -= len(painted)
                    painted_at[body, fault_colour(miss.kind)].setdefault(time, []).append(painted)
    for (body, colour), faces_at in sorted(painted_at.items()):
        name = "missed_faces" if colour == MISSED else "late_faces"
        path = f"{body_path(assembly.names[body])}/{name}"
        _log_painted_faces(writer, path, assembly.bodies[body].mesh, faces_at, colour)


def _faces_to_paint(assembly: Assembly, pair: int, faces: Faces) -> dict[int, Faces]:
    """Faces to paint of both bodies: large ones only where nothing smaller shows the place."""
    unique_faces = {body: np.unique(side) for body, side in zip(assembly.pairs[pair].tolist(), faces.T, strict=True)}
    small_faces = {
        body: side[face_areas(assembly.bodies[body].mesh, side) <= LARGE_FACE_M2] for body, side in unique_faces.items()
    }
    return small_faces if any(map(len, small_faces.values())) else unique_faces


def face_areas(mesh: TriangleMesh, faces: Faces) -> FloatArray:
    """Area of each of these faces, square metres."""
    areas: FloatArray = np.linalg.norm(face_normals(mesh.triangles[faces])[0], axis=1) / 2
    return areas


def _log_painted_faces(
    writer: RecordingWriter,
    path: str,
    mesh: TriangleMesh,
    faces_at_time: Mapping[FrameTime, Sequence[Faces]],
    colour: Rgba,
) -> None:
    # A row without faces after each stretch, else the patch would stay for ever: the viewer shows the latest row.
    clearing_times = ((frame + 1, 0) for frame, _ in faces_at_time if frame + 1 < len(writer.clock.ns))
    times = sorted({(0, 0), *faces_at_time, *clearing_times})
    no_faces = np.zeros(0, dtype=np.int64)
    faces = [np.unique(np.concatenate([no_faces, *faces_at_time.get(time, ())])) for time in times]
    triangles = mesh.triangles[np.concatenate(faces)]
    corners = (triangles + FACE_OFFSET_M * face_normals(triangles)[1][:, None]).reshape(-1, 3)
    shapes = rr.Mesh3D.columns(vertex_positions=corners.astype(np.float32))
    writer.rows(path, times, shapes, [3 * len(face_group) for face_group in faces])
    writer.static(path, rr.Mesh3D.from_fields(albedo_factor=(*colour[:3], VEIL_ALPHA)))
