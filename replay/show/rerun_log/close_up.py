"""The close-up of a moment: where it is seen from, what stands around it, and what points at it.

Rerun runs no code of ours at a click. So what is shown is data over time: a click on a moment moves the cursor, and
close-up and solids there are those of that moment. The eye is data too: a camera whose pose changes from moment to
moment; the view tracks it, so wherever the cursor goes it stands before the nearest moment with nothing in between.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import rerun as rr

from cdcore import TriangleMesh
from cdcore.bounding.bounding_sphere import Sphere
from cdcore.numerics import FloatArray
from replay.auditing.fault import Fault
from replay.auditing.outcome import Episode
from replay.document.run_result import RunResult
from replay.show.camera import (
    CLOSE_UP_M,
    Eye,
    eye_before,
    points_in_world,
    towards_user,
    view_rotation,
    viewing_direction,
)
from replay.show.drawn_mesh import bend_cosines, edges_of, face_normals, spans_hollow
from replay.show.palette import FALSE_CONTACT, FREE, Rgba, albedo, fault_colour, fault_key, see_through, tags_of
from replay.show.rerun_log.moments import FrameTime, Moments, nearest_moments, point_of
from replay.show.rerun_log.recording_file import (
    RecordingWriter,
    Steps,
    entity,
    pack_colours,
    pose_columns,
    steps_of,
    times_of,
)
from replay.show.rerun_log.scene import ColourChanges, body_path
from replay.words import length

FOCUS_ENTITY: Final = "world/focus"
EYE_ENTITY: Final = f"{FOCUS_ENTITY}/eye"
LEGEND_ENTITY: Final = f"{FOCUS_ENTITY}/legend"
"""What the colours of a close-up mean; a room has no place for it."""

PINS_ENTITY: Final = f"{FOCUS_ENTITY}/pins"
"""Dots at all faults in the room; a close-up needs none of them."""

TEXT_DISTANCE_FRACTION: Final = 0.4
"""Share of the way from the eye at which words stand: nearer than what they speak of, so that nothing hides them."""

TEXT_HEIGHT: Final = 0.05
"""Height of words, in distances of the eye from what it looks at."""

DOT_POINTS: Final = 0.01
LEADER_POINTS: Final = 0.8
"""Points on the screen: the size of a dot that carries words, and the width of the line from them."""


EYE_DISTANCES_M: Final = (CLOSE_UP_M, 0.45)
"""Metres from the eye to a false contact, at least and at most."""

DISTANCE_RADII: Final = 3.3
"""Distance of the eye in radii of the ball that it shall see whole."""

LARGEST_BALL_M: Final = 0.5
"""Metres: a larger ball or solid holds the room and is left out: all glass stands on the bench."""

HALF_BAR_M: Final = 0.006
"""Metres, half the bar at each end of a measure."""

SHARP_COSINE: Final = float(np.cos(np.radians(1.8)))
"""Edges sharper than this are drawn: the triangles of a flat side are the solver's business."""

MOST_DRAWN_EDGES: Final = 40_000
"""Edges and faces of solids that one detector draws at most, 1.4 MB; the moments that last longest come first."""

SOLID_ALPHA: Final = 90
"""Alpha of the faces of a solid: what is inside it, and the gap, stay visible."""

LID_ALPHA: Final = 130
"""Alpha of the faces that close a hollow; the walls of such a solid have none, so that the real surface is seen."""

LEGEND_POSITION: Final = (0.27, 0.42)
"""Where the first line of the legend stands: right and up on the screen, in distances of the eye."""

LEGEND_SPACING: Final = 0.065
"""From one line of the legend to the next, in the same distances."""

REAL_SURFACE_COLOUR: Final[Rgba] = (156, 201, 245, 255)
"""Of the words about a real surface, as glass is blue."""

GAP_COLOUR: Final[Rgba] = (120, 235, 170, 255)
"""The measure of a gap: it must be seen before glass, a white rod and a yellow solid."""


def close_up_eyes(result: RunResult, moments: Moments, balls: Sequence[Sphere]) -> dict[FrameTime, Eye]:
    """Return the eye of each moment: before the missed contact, or so far off that a false contact is seen whole.

    ``balls``: around each body of the assembly.
    """
    scene, eyes = result.session.scene, dict[FrameTime, Eye]()
    for time, moment in moments.items():
        point = point_of(result, time, moment)
        user_direction = towards_user(result.assembly, scene, time[0], point)
        if isinstance(moment, Fault) and moment.kind.is_miss:
            eyes[time] = eye_before(
                np.asarray(point), CLOSE_UP_M * viewing_direction(np.asarray(moment.evidence.normal), user_direction)
            )
        else:
            eyes[time] = _whole_body_eye(result, time, moment, user_direction, balls)
    return eyes


def _whole_body_eye(
    result: RunResult, time: FrameTime, moment: Fault | Episode, user_direction: FloatArray, balls: Sequence[Sphere]
) -> Eye:
    """Return an eye so far off that a ball around the solid, or around the smaller body, is seen whole."""
    assembly, caged_columns = result.assembly, caged_bodies(result, moment, balls)
    body = min(caged_columns or assembly.pairs[moment.pair].tolist(), key=lambda body: balls[body].radius)
    target = np.asarray(point_of(result, time, moment))
    if caged_columns:
        target = points_in_world(assembly.motion, time[0], body, balls[body].centre[None])[0]
    nearest_points = moment.evidence.nearest if isinstance(moment, Fault) else None
    gap = np.zeros(3) if nearest_points is None else np.subtract(nearest_points[1], nearest_points[0])
    distance = float(np.clip(DISTANCE_RADII * balls[body].radius, *EYE_DISTANCES_M))
    return eye_before(target, distance * viewing_direction(gap, user_direction))


def caged_bodies(result: RunResult, moment: Fault | Episode, balls: Sequence[Sphere]) -> list[int]:
    """Return the bodies whose solids are drawn around a false contact, by column of the assembly.

    The body that reaches into the hull of the other has no hull drawn around it.
    """
    if not isinstance(moment, Fault) or moment.kind.is_miss or moment.detector not in detectors_with_solids(result):
        return []
    names, pair = result.assembly.names, result.assembly.pairs[moment.pair].tolist()
    hollow_bodies = [body for body in pair if names[body] == moment.evidence.hollow]
    return [body for body in hollow_bodies or pair if balls[body].radius <= LARGEST_BALL_M]


def free_body(result: RunResult, moment: Fault | Episode) -> int | None:
    """Return the body that touches nothing, inside the hull of another, by column of the assembly."""
    if not isinstance(moment, Fault) or not moment.evidence.hollow:
        return None
    if moment.detector not in detectors_with_solids(result):
        return None
    names, pair = result.assembly.names, result.assembly.pairs[moment.pair].tolist()
    return next(body for body in pair if names[body] != moment.evidence.hollow)


def hiding_bodies(result: RunResult, frame: int, pair: int, eye: Eye, balls: Sequence[Sphere]) -> list[int]:
    """Return the bodies beside a pair whose ball reaches between an eye and what it looks at in a frame."""
    assembly, hiding_bodies_of = result.assembly, []
    target, view_direction = np.asarray(eye.target), np.subtract(eye.position, eye.target)
    small_bodies = {body for body, ball in enumerate(balls) if ball.radius <= LARGEST_BALL_M}
    for body in small_bodies - {*assembly.pairs[pair].tolist()}:
        centre = points_in_world(assembly.motion, frame, body, balls[body].centre[None])[0]
        fraction = np.clip((centre - target) @ view_direction / (view_direction @ view_direction), 0.0, 1.0)
        if np.linalg.norm(centre - target - fraction * view_direction) <= balls[body].radius:
            hiding_bodies_of.append(body)
    return hiding_bodies_of


def log_close_ups(
    writer: RecordingWriter, result: RunResult, moments: Moments, eyes: Mapping[FrameTime, Eye], balls: Sequence[Sphere]
) -> None:
    """Send the eye, what each close-up says and measures, and the dots of the room."""
    log_eyes(writer, EYE_ENTITY, nearest_moments(moments.keys()), eyes)
    # Each fault while it lasts; nothing at other times.
    faults = {time: fault for time, fault in moments.items() if isinstance(fault, Fault)}
    segments = {time: (time, fault.first, fault.last) for time, fault in faults.items()}
    steps = steps_of(segments, len(writer.clock.ns), None)
    log_marks(writer, FOCUS_ENTITY, steps, {time: _marks(result, fault, eyes[time]) for time, fault in faults.items()})
    legends: dict[FrameTime, list[Mark]] = {}
    for time, fault in faults.items():
        free, hollow_name = free_body(result, fault), fault.evidence.hollow
        free_name = None if free is None else result.assembly.names[free]
        legends[time] = [] if free_name is None else _legend(free_name, hollow_name, fault.detector, eyes[time])
    log_marks(writer, LEGEND_ENTITY, steps, legends)
    for label in detectors_with_solids(result):
        caged_bodies_of_moment = {
            time: caged_bodies(result, fault, balls)
            for time, fault in sorted(faults.items(), key=lambda item: -item[1].frames)
            if fault.detector == label
        }
        _log_cages(writer, result, label, caged_bodies_of_moment, steps)
    fault_points = np.array([fault.point for fault in faults.values()], dtype=np.float32).reshape(-1, 3)
    colours = pack_colours(fault_colour(fault.kind) for fault in faults.values())
    writer.static(PINS_ENTITY, rr.Points3D(fault_points, colors=colours, radii=rr.Radius.ui_points(4.0)))


def _marks(result: RunResult, fault: Fault, eye: Eye) -> list[Mark]:
    """Return the text of a close-up: that a contact was missed, or how far apart the bodies are, with a measure."""
    fault_point = np.asarray(fault.point)
    if fault.kind.is_miss:
        piece_text = "" if fault_key(fault.kind) == "missed" else "a part of "
        text = f"{fault.detector} misses {piece_text}this contact"
        return text_beside(eye, fault_point, text, fault_colour(fault.kind), 0.0, 0.36)
    if fault.evidence.nearest is None:
        return text_beside(eye, fault_point, f"{fault.detector}: false contact", FALSE_CONTACT, 0.0, 0.36)
    gap_text, free_number = length(fault.metres), free_body(result, fault)
    text = f"{' and '.join(fault.bodies)}: {gap_text} apart"
    if free_number is not None:
        text = f"{fault.detector}: contact; {result.assembly.names[free_number]} is {gap_text} away"
    # From point to point, and a bar across at both ends.
    gap_ends = np.array(fault.evidence.nearest)
    end_bar = np.cross(gap_ends[1] - gap_ends[0], view_rotation(eye)[:, 2])
    end_bar *= HALF_BAR_M / max(float(np.linalg.norm(end_bar)), 1e-9)
    lines = [gap_ends, *(np.stack([end - end_bar, end + end_bar]) for end in gap_ends)]
    measure_marks = [Mark(in_front(eye, line), GAP_COLOUR, 1.6) for line in lines]
    return [*text_beside(eye, gap_ends.mean(axis=0), text, GAP_COLOUR, 0.22, -0.36), *measure_marks]


def _legend(free_name: str, hollow_name: str, label: str, eye: Eye) -> list[Mark]:
    """Words beside a body inside the hull of another: which of the three shapes has which colour."""
    lines = [
        (f"yellow: hull of {hollow_name}, for {label}", FALSE_CONTACT),
        (f"blue: real {hollow_name}", REAL_SURFACE_COLOUR),
        (f"white: {free_name}", FREE),
    ]
    right, up = LEGEND_POSITION
    return [
        Mark(in_front(eye, point_on_screen(eye, right, up - LEGEND_SPACING * row)[None]), colour, DOT_POINTS, text)
        for row, (text, colour) in enumerate(lines)
    ]


def detectors_with_solids(result: RunResult) -> list[str]:
    """Compared detectors with solids other than the meshes."""
    meshes = {id(body.mesh) for body in result.assembly.bodies}
    solids = {label: getattr(result.detectors.get(label), "colliders", ()) for label in result.comparisons}
    return [label for label, bodies in solids.items() if any(id(body.mesh) not in meshes for body in bodies)]


def _log_cages(
    writer: RecordingWriter,
    result: RunResult,
    label: str,
    caged_bodies_of_moment: Mapping[FrameTime, Sequence[int]],
    steps: Steps,
) -> None:
    """Send the solids of one detector in yellow, edges and translucent faces, each while a false contact lasts.

    ``caged_bodies_of_moment``: moment -> bodies whose solids are drawn, the moment that lasts longest first.
    """
    detector: Any = result.detectors[label]  # whose solids have one or more convex parts each
    names, edges_left = result.assembly.names, MOST_DRAWN_EDGES
    edges: dict[int, Any] = {}
    corners: dict[int, Any] = {}
    lids: dict[int, bool] = {}
    drawn_moments: dict[int, list[FrameTime]] = {}
    for time, bodies in caged_bodies_of_moment.items():
        for body in bodies:
            if body not in edges:
                edges[body] = np.concatenate([sharp_edges(piece) for piece in detector.parts[names[body]]])
                lids[body], corners[body] = _drawn_faces(detector.parts[names[body]], result.assembly.bodies[body].mesh)
            edges_left -= len(edges[body]) + len(corners[body]) // 3
            if edges_left >= 0:
                drawn_moments.setdefault(body, []).append(time)
    for body, times in drawn_moments.items():
        # Wires ignore alpha: a row without lines hides them.
        path = f"{body_path(names[body])}/{entity(f'solid_of_{label}')}"
        writer.steps(path, steps, dict.fromkeys(times, edges[body]), _wires)
        writer.static(path, rr.LineStrips3D.from_fields(colors=[FALSE_CONTACT], radii=rr.Radius.ui_points(1.4)))
        writer.steps(f"{path}/faces", steps, dict.fromkeys(times, corners[body]), _faces)
        writer.static(
            f"{path}/faces",
            rr.Mesh3D.from_fields(albedo_factor=(*FALSE_CONTACT[:3], LID_ALPHA if lids[body] else SOLID_ALPHA)),
        )


def _drawn_faces(pieces: Sequence[TriangleMesh], mesh: TriangleMesh) -> tuple[bool, FloatArray]:
    """Whether one solid closes a hollow of a mesh, and the corners (n, 3) of its lid; else those of every face."""
    lid = spans_hollow(pieces[0], mesh) if len(pieces) == 1 else np.zeros(0, dtype=np.bool_)
    if lid.any():
        return True, pieces[0].triangles[lid].reshape(-1, 3)
    return False, np.concatenate([piece.triangles for piece in pieces]).reshape(-1, 3)


def _wires(edges: list[Any]) -> rr.ComponentColumnList:
    return rr.LineStrips3D.columns(strips=np.array(edges, dtype=np.float32).reshape(-1, 2, 3))


def _faces(corners: list[Any]) -> rr.ComponentColumnList:
    return rr.Mesh3D.columns(vertex_positions=np.array(corners, dtype=np.float32).reshape(-1, 3))


def sharp_edges(mesh: TriangleMesh) -> FloatArray:
    """Edges (k, 2, 3) at which two faces of a solid meet at an angle."""
    edges, faces = edges_of(mesh)
    return edges[bend_cosines(face_normals(mesh.triangles)[1], faces) < SHARP_COSINE]


def close_up_colours(
    result: RunResult, moments: Moments, eyes: Mapping[FrameTime, Eye], balls: Sequence[Sphere]
) -> ColourChanges:
    """White for a body that touches nothing, while it is said to; translucent what hides a moment.

    The larger body of a pair hides the contact as much as what stands before it, unless it is glass or the ground.
    """
    colours: dict[str, list[tuple[int, int, Rgba]]] = {}
    free_body_of_moment = {time: free_body(result, moment) for time, moment in moments.items()}
    hiding_bodies_of = {
        time: {*hiding_bodies(result, time[0], moment.pair, eyes[time], balls), _larger(result, moment.pair, balls)}
        for time, moment in moments.items()
    }
    changing_bodies = {body for body in free_body_of_moment.values() if body is not None}
    for body in changing_bodies.union(*hiding_bodies_of.values()):
        name = result.assembly.names[body]
        tags = tags_of(name, result.session.scene)
        colour_steps = colours.setdefault(name, [])
        for frame, later_ns, time in nearest_moments(moments.keys()):
            colour = see_through(tags) if body in hiding_bodies_of[time] else albedo(tags)
            colour_steps.append((frame, later_ns, FREE if body == free_body_of_moment[time] else colour))
    return colours


def _larger(result: RunResult, pair: int, balls: Sequence[Sphere]) -> int:
    """Return the body of a pair with the larger bounding sphere."""
    first, second = result.assembly.pairs[pair].tolist()
    return first if balls[first].radius > balls[second].radius else second


@dataclass(frozen=True, eq=False)
class Mark:
    """A dot or words (1, 3), or a line (2, 3), at places in the world, metres; ``size``: points on the screen."""

    places: FloatArray
    colour: Rgba
    size: float
    text: str = ""

    @property
    def layer_name(self) -> str:
        """Entity below that of all marks."""
        if self.text:
            return "words"
        return "lines" if len(self.places) > 1 else "dots"


def text_beside(eye: Eye, anchor_point: FloatArray, text: str, colour: Rgba, right: float, up: float) -> list[Mark]:
    """Words and the line from them; ``right`` and ``up`` on the screen in distances of the eye from what it sees."""
    anchor = point_on_screen(eye, right, up)
    # Words hang below their place: a line from above begins below them.
    start = point_on_screen(eye, right, up - (TEXT_HEIGHT if up > 0 else 0.0))
    points = in_front(eye, np.stack([anchor, start, anchor_point]))
    return [Mark(points[:1], colour, DOT_POINTS, text), Mark(points[1:], colour, LEADER_POINTS)]


def point_on_screen(eye: Eye, right: float, up: float) -> FloatArray:
    """World metres of a place so far right and up on the screen, in distances of the eye from what it sees."""
    axes = view_rotation(eye)
    distance = float(np.linalg.norm(np.subtract(eye.position, eye.target)))
    point: FloatArray = np.asarray(eye.target) + distance * (right * axes[:, 0] + up * axes[:, 1])
    return point


def in_front(eye: Eye, points: FloatArray) -> FloatArray:
    """The same places on the screen (n, 3), so near to the eye that nothing hides them."""
    near_points: FloatArray = np.asarray(eye.position) + TEXT_DISTANCE_FRACTION * (points - eye.position)
    return near_points


def log_marks(writer: RecordingWriter, root: str, steps: Steps, marks: Mapping[Any, Sequence[Mark]]) -> None:
    """Send ``words``, ``lines`` and ``dots`` below a root: the marks of each moment that is shown, and no other."""
    for layer, columns in (("words", _points), ("lines", _strips), ("dots", _points)):
        drawn_moments = {
            moment: [mark for mark in marks_of_moment if mark.layer_name == layer]
            for moment, marks_of_moment in marks.items()
        }
        if any(drawn_moments.values()):
            writer.steps(f"{root}/{layer}", steps, drawn_moments, columns)
    writer.static(f"{root}/words", rr.Points3D.from_fields(show_labels=True))


def _points(marks: Sequence[Mark]) -> rr.ComponentColumnList:
    points = np.array([mark.places for mark in marks], dtype=np.float32).reshape(-1, 3)
    return rr.Points3D.columns(positions=points, labels=[mark.text for mark in marks], **_looks(marks))


def _strips(marks: Sequence[Mark]) -> rr.ComponentColumnList:
    segments = np.array([mark.places for mark in marks], dtype=np.float32).reshape(-1, 2, 3)
    return rr.LineStrips3D.columns(strips=segments, **_looks(marks))


def _looks(marks: Sequence[Mark]) -> dict[str, Any]:
    radii = np.array([rr.Radius.ui_points(mark.size) for mark in marks], dtype=np.float32)
    return {"colors": pack_colours(mark.colour for mark in marks), "radii": radii}


def log_eyes(writer: RecordingWriter, path: str, steps: Steps, eyes: Mapping[Any, Eye]) -> None:
    """Send a camera that stands elsewhere from each step on. A view that tracks it needs no command to follow."""
    step_eyes = [eyes[moment] for *_, moment in steps]
    positions, rotations = (
        np.array([eye.position for eye in step_eyes]),
        np.array([view_rotation(eye) for eye in step_eyes]),
    )
    writer.rows(path, times_of(steps), pose_columns(positions, rotations))
    shape: dict[str, Any] = {"fov_y": 0.9, "aspect_ratio": 1.3, "image_plane_distance": 0.001, "line_width": 0.0}
    writer.static(path, rr.Pinhole(**shape, camera_xyz=rr.ViewCoordinates.RUB))
