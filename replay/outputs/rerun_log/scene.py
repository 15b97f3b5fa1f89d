"""The room: bodies that stand where they stood, points and curves where surfaces meet, and in red the faces of misses.

A mesh is sent once, and a pose only where it changed; a body without a pose is not drawn.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore import Detection, FaceSets, Motion, TriangleMesh
from cdcore.numerics import FloatArray, place_points
from replay.comparison.first_touch import at_touch
from replay.comparison.misses import by_depth
from replay.comparison.outcome import Comparison, Miss, Outcome
from replay.outputs.palette import FOUND, MISSED_FACES, OUTCOMES, Rgba, albedo, tags_of
from replay.outputs.rerun_log.recording_file import RecordingClock, RecordingWriter, entity, packed, pose_columns
from replay.outputs.shapes import face_normals, shaded
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


DRAWN_CONTACTS: Final = 20_000
DRAWN_FACES: Final = 400_000
"""Contacts, and face pairs behind them, that one detector draws at most: 10 MB and a second or two. Glass at rest on a
bench touches it for minutes in hundreds of faces. Beyond this, frames in which nothing begins, ends or is missed are
strided, and a curve may lag behind its body by the stride."""


COLOURED: Final = (Outcome.MISSED, Outcome.INVENTED, Outcome.WITHIN_TOLERANCE)
"""Outcomes with a colour of their own; all other contacts have that of what is found."""


PUSHED_OUT: Final = 0.00015
"""Metres that red faces stand off their body, so that the two do not flicker through each other."""

DRAWN_MISSED_FACES: Final = 200_000
"""Red faces per body at most, 7 MB: beyond it the shallowest misses stay without faces; pins and lanes show them."""

LARGE_FACE: Final = 0.002
"""Square metres, a triangle 6 cm wide and high: larger faces are not painted where smaller ones show the place. Two
triangles of a bench top are two hands wide: painted, they drown the contact, and the curve says where on them it is."""


def contacts_path(label: str) -> str:
    """Entity of the contacts of one detector."""
    return entity("world", "contacts", label)


def log_contacts(
    writer: RecordingWriter, label: str, assembly: Assembly, detection: Detection, comparison: Comparison | None
) -> None:
    """Send ``world/contacts/<label>``: a point per contact, and below it the curves in which the surfaces meet.

    What ``comparison`` calls missed is red, the rest blue. Nothing is sent of a detection without faces.
    """
    sets, path = detection.face_sets, contacts_path(label)
    if sets is None:
        return
    entries, frames = drawn_contacts(writer.clock, sets, comparison)
    at = [*zip(sets.frame[entries].tolist(), sets.pair[entries].tolist(), strict=True)]
    curves = [section_of(detection, frame, pair) for frame, pair in at]
    points = [
        contact_point(curve) if len(curve) else _centre(assembly, *place, detection.faces(*place))
        for place, curve in zip(at, curves, strict=True)
    ]
    outcomes = np.zeros(len(at), dtype=np.int64)
    if comparison is not None:
        outcomes = comparison.outcome[sets.frame[entries], sets.pair[entries]].astype(np.int64)
    colours = packed(OUTCOMES[code][1] if code in COLOURED else FOUND for code in outcomes.tolist())
    rows, lengths = np.searchsorted(frames, sets.frame[entries]), np.array([len(one) for one in curves], dtype=np.int64)
    per_row = np.bincount(rows, minlength=len(frames))
    dots = rr.Points3D.columns(positions=np.array(points, dtype=np.float32).reshape(-1, 3), colors=colours)
    writer.rows(path, frames, dots, per_row)
    writer.static(path, rr.Points3D.from_fields(radii=rr.Radius.ui_points(2.5)))
    per_row = np.bincount(rows, weights=lengths, minlength=len(frames)).astype(np.int64)
    joined = np.concatenate([np.zeros((0, 2, 3)), *curves]).astype(np.float32)
    strips = rr.LineStrips3D.columns(strips=joined, colors=np.repeat(colours, lengths))
    writer.rows(f"{path}/section", frames, strips, per_row)
    writer.static(f"{path}/section", rr.LineStrips3D.from_fields(radii=rr.Radius.ui_points(1.6)))


def drawn_contacts(
    clock: RecordingClock, sets: FaceSets, comparison: Comparison | None
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Numbers of the contacts that are drawn, and the frames that get a row; one without contact clears."""
    drawn = _drawn_frames(clock, sets, comparison)
    entries = np.flatnonzero(drawn[sets.frame])
    busy = np.zeros(len(drawn), dtype=np.bool_)
    busy[sets.frame[entries]] = True
    frames = np.flatnonzero(drawn)
    return entries, frames[busy[frames] | np.append(True, busy[frames[:-1]])]


def _drawn_frames(clock: RecordingClock, sets: FaceSets, comparison: Comparison | None) -> NDArray[np.bool_]:
    """Which frames get a row, (T,): all that are kept, or a stride of them, misses first."""
    frames = len(clock.ns)
    load = np.zeros(frames)
    np.add.at(load, sets.frame, np.maximum(1.0 / DRAWN_CONTACTS, (sets.stop - sets.start) / DRAWN_FACES))
    kept = np.zeros(frames, dtype=np.bool_)
    kept[clock.kept] = True
    wanted = np.zeros(frames, dtype=np.bool_)
    if comparison is not None:
        for word in (Outcome.MISSED, Outcome.INVENTED):
            wanted |= (comparison.outcome == word).any(axis=1)
    return _strided(kept & wanted, load) | _strided(kept, load)


def _strided(frames: NDArray[np.bool_], load: FloatArray) -> NDArray[np.bool_]:
    """Every k-th of these frames, with the k that brings their load to 1 at most."""
    stride = max(1, int(np.ceil(load[frames].sum())))
    chosen = np.zeros_like(frames)
    chosen[np.flatnonzero(frames)[::stride]] = True
    return chosen


def section_of(detection: Detection, frame: int, pair: int) -> FloatArray:
    """Segments (k, 2, 3) in which the surfaces meet; k = 0 where the detector computes none."""
    if detection.section_source is None or detection.face_sets is None:
        return np.zeros((0, 2, 3))
    segments = detection.section(frame, pair)
    return segments[np.isfinite(segments).all(axis=(1, 2))]


def _centre(assembly: Assembly, frame: int, pair: int, faces: NDArray[np.integer]) -> FloatArray:
    """A place near a contact without a curve: the mean centroid of the faces of the body whose faces are smaller."""
    motion, places = assembly.motion, []
    for side, body in enumerate(assembly.pairs[pair].tolist()):
        corners = assembly.bodies[body].mesh.triangles[faces[:, side]]
        places.append(place_points(corners, motion.rotations[frame, body], motion.translations[frame, body]))
    smaller: FloatArray = min(places, key=lambda some: float(np.ptp(some, axis=1).max()))
    return smaller.mean(axis=(0, 1))


def contact_point(segments: FloatArray) -> FloatArray:
    """The midpoint of a segment that is nearest to the mean of all: on the surfaces even where the curve is a ring."""
    middles = segments.mean(axis=1)
    away = middles - middles.mean(axis=0)
    nearest: FloatArray = middles[int(np.argmin((away * away).sum(axis=1)))]
    return nearest


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
