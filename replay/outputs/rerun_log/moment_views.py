"""Moments in the picture: their list, the close-up of each, and what points at the one nearest to the cursor.

Rerun runs no code of ours at a click. So what is in focus is data over time: a click on a moment moves the cursor, and
close-up and solids there are those of that moment. The eye is data too: a camera whose pose changes from moment to
moment; the view tracks it, so wherever the cursor goes it stands before the nearest moment with nothing in between.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import rerun as rr
from rerun.chunk import RrdReader

from cdcore import TriangleMesh
from cdcore.bounding.bounding_sphere import sphere_best
from cdcore.numerics import FloatArray
from replay.comparison.false_contacts import FalseContact
from replay.comparison.outcome import Miss, Outcome
from replay.effects.output import vector_of
from replay.errors import RunFolderError
from replay.outputs.camera import CLOSE_UP, Eye, Obstacles, across, look_rotation, placed, towards_user
from replay.outputs.moments import KINDS, FocusMoment, focus_rows, leading, moment_line
from replay.outputs.palette import FREE, INVENTED, MISSED, Rgba, albedo, tags_of
from replay.outputs.rerun_log.recording_file import RecordingWriter, Steps, entity, packed, steps_of
from replay.outputs.rerun_log.scene import Colours, body_path
from replay.outputs.rerun_log.stage import Mark, faded, in_front, log_eyes, log_marks, words_beside
from replay.outputs.rerun_log.texts import detector_text
from replay.outputs.shapes import bends, edges_of, face_normals
from replay.pipeline.run_result import RunResult
from replay.pipeline.sentences import length_words

SPACE: Final = "world/focus"
EYE: Final = f"{SPACE}/eye"
PINS: Final = f"{SPACE}/pins"
"""Dots at all faults in the room; a close-up needs none of them."""
ANSWER: Final = "answer"
MOMENTS: Final = "moments/list"
TABLE: Final = "moments/table"

DISTANCES: Final = (CLOSE_UP, 0.45)
"""Metres from the eye to a false contact, at least and at most."""

REACHES: Final = 3.3
"""Distance of the eye in radii of the ball that it shall see whole."""

ROOM: Final = 0.5
"""Metres: a larger ball or solid holds the room and is left out: all glass stands on the bench."""

HALF_BAR: Final = 0.006
"""Metres, half the bar at each end of a measure."""

SHARP_COSINE: Final = float(np.cos(np.radians(1.8)))
"""Edges sharper than this are drawn: the triangles of a flat side are the solver's business."""

DRAWN_EDGES: Final = 40_000
"""Edges of solids that one detector draws at most, 1 MB; the moments that last longest come first."""

GAP: Final[Rgba] = (120, 235, 170, 255)
"""The measure of a gap: it must be seen before glass, a white rod and a yellow solid."""


@dataclass(frozen=True)
class MomentPlace:
    """Where the cursor meets a moment; ``kind``: "miss", "false" or "contact"; ``leads``: the picture opens there."""

    label: str
    kind: str
    number: int
    session_ns: int
    leads: bool


def log_moment_table(writer: RecordingWriter, places: Iterable[MomentPlace]) -> None:
    """Send where to look."""
    writer.static(TABLE, rr.AnyValues(moments=json.dumps([asdict(place) for place in places])))


def read_moments(recording: Path) -> list[MomentPlace]:
    """The moments, as a recording has them; none in one that compares nothing."""
    try:
        chunks = RrdReader(recording).stream().filter(content=f"/{TABLE}").to_chunks()
    except (OSError, ValueError, RuntimeError) as error:
        why = f"{recording} cannot be read as a recording ({error})"
        raise RunFolderError(f"{why}; replay the session again") from error
    batches = [chunk.to_record_batch() for chunk in chunks]
    texts = [batch.column(name)[0].as_py() for batch in batches for name in batch.schema.names if "moments" in name]
    if batches and not texts:
        raise RunFolderError(f"{recording} is a picture of an earlier version; replay the session again")
    return [MomentPlace(**place) for (text,) in texts for place in json.loads(text)]


@dataclass(frozen=True, eq=False)
class CloseUp:
    """How one moment is shown. Bodies are columns of the assembly."""

    eye: Eye
    ends: FloatArray | None = None  # (2, 3) nearest points of both bodies, world metres; ``None`` where not measured
    free: int | None = None  # the body that touches nothing, inside the solid of another
    caged: Sequence[int] = ()  # bodies whose solids are drawn
    hiding: frozenset[int] = frozenset()  # bodies between the eye and what it looks at


def close_ups(result: RunResult, moments: Sequence[FocusMoment]) -> dict[FocusMoment, CloseUp]:
    """How each moment is shown: before the contact that was missed, or so far off that a false one is seen whole."""
    assembly, scene = result.assembly, result.session.scene
    obstacles, views = Obstacles(assembly), {}
    for moment in moments:
        user, fault = towards_user(assembly, scene, moment.frame, moment.point), moment.of
        if isinstance(fault, Miss):
            away = CLOSE_UP * across(np.asarray(fault.normal), user)
            view = CloseUp(Eye(vector_of(np.add(moment.point, away)), moment.point))
        else:
            view = _false_contact(result, moment, user)
        views[moment] = replace(view, hiding=obstacles.hiding(moment.frame, view.eye))
    return views


def _false_contact(result: RunResult, moment: FocusMoment, user: FloatArray) -> CloseUp:
    """Seen from so far off that a ball around the solid, or around the smaller body, is seen whole."""
    assembly, fault = result.assembly, moment.of
    pair = assembly.pairs[moment.pair].tolist()
    balls = {body: sphere_best(assembly.bodies[body].mesh) for body in pair}
    ends, free, caged = None, None, []
    if isinstance(fault, FalseContact):
        ends = None if fault.ends is None else np.array(fault.ends)
        if moment.label in with_solids(result):
            # The body that lies in the hull of the other has no hull drawn around it.
            hollow = [body for body in pair if assembly.names[body] == fault.hollow]
            free = next((body for body in pair if hollow and body not in hollow), None)
            caged = [body for body in hollow or pair if balls[body].radius <= ROOM]
    body = min(caged or pair, key=lambda body: balls[body].radius)
    target = np.asarray(moment.point)
    if caged:
        target = placed(assembly.motion, moment.frame, body, balls[body].centre[None])[0]
    gap = np.zeros(3) if ends is None else ends[1] - ends[0]
    away = np.clip(REACHES * balls[body].radius, *DISTANCES) * across(gap, user)
    return CloseUp(Eye(vector_of(target + away), vector_of(target)), ends, free, caged)


def marks_of(result: RunResult, moment: FocusMoment, view: CloseUp) -> list[Mark]:
    """What is said in a close-up: that a contact was missed, or how far apart the bodies are, with a measure."""
    names, about = result.assembly.names, np.asarray(moment.point)
    if moment.outcome == Outcome.MISSED:
        return words_beside(view.eye, about, f"{moment.label} misses this contact", MISSED, 0.0, 0.36)
    if view.ends is None:
        return words_beside(view.eye, about, f"{moment.label}: false contact", INVENTED, 0.0, 0.36)
    apart = length_words(moment.size)
    words = f"{' and '.join(names[body] for body in result.assembly.pairs[moment.pair])}: {apart} apart"
    if view.free is not None:
        words = f"{names[view.free]} touches nothing: {apart}"
    # From point to point, and a bar across at both ends.
    bar = np.cross(view.ends[1] - view.ends[0], look_rotation(view.eye)[:, 2])
    bar *= HALF_BAR / max(float(np.linalg.norm(bar)), 1e-9)
    lines = [view.ends, *(np.stack([end - bar, end + bar]) for end in view.ends)]
    measure = [Mark(in_front(view.eye, line), GAP, 1.6) for line in lines]
    return [*words_beside(view.eye, view.ends.mean(axis=0), words, GAP, 0.22, -0.36), *measure]


def with_solids(result: RunResult) -> list[str]:
    """Compared detectors with solids other than the meshes."""
    meshes = {id(body.mesh) for body in result.assembly.bodies}
    solids = {label: getattr(result.detectors.get(label), "colliders", ()) for label in result.comparisons}
    return [label for label, bodies in solids.items() if any(id(body.mesh) not in meshes for body in bodies)]


def solid_path(body: str, label: str) -> str:
    """Entity of the solid, below the body: so it moves with it."""
    return f"{body_path(body)}/{entity(f'solid_of_{label}')}"


def _log_cages(
    writer: RecordingWriter, result: RunResult, label: str, views: Mapping[FocusMoment, CloseUp], steps: Steps
) -> None:
    """Send the edges of the solids of one detector in yellow, each while a false contact of it lasts."""
    detector: Any = result.detectors[label]  # whose solids have one or more convex parts each
    left = DRAWN_EDGES
    edges: dict[int, FloatArray] = {}
    drawn: dict[int, dict[FocusMoment, Sequence[Any]]] = {}
    for moment in sorted(views, key=lambda moment: moment.first - moment.last):
        for body in views[moment].caged if moment.label == label else ():
            if body not in edges:
                parts = detector.parts[result.assembly.names[body]]
                edges[body] = np.concatenate([sharp_edges(part) for part in parts])
            left -= len(edges[body])
            if left >= 0:
                drawn.setdefault(body, {})[moment] = [*edges[body]]
    for body, strips in drawn.items():
        # Wires ignore alpha: a row without lines hides them.
        path = solid_path(result.assembly.names[body], label)
        writer.steps(path, steps, strips, _strips)
        looks = rr.LineStrips3D.from_fields(colors=[INVENTED], radii=rr.Radius.ui_points(1.4))
        writer.static(path, looks)


def _strips(lines: list[Any]) -> rr.ComponentColumnList:
    return rr.LineStrips3D.columns(strips=np.array(lines, dtype=np.float32).reshape(-1, 2, 3))


def sharp_edges(mesh: TriangleMesh) -> FloatArray:
    """Edges (k, 2, 3) at which two faces of a solid meet at an angle."""
    edges, faces = edges_of(mesh)
    return edges[bends(face_normals(mesh.triangles)[1], faces) < SHARP_COSINE]


def log_answer(writer: RecordingWriter, result: RunResult, views: Mapping[FocusMoment, CloseUp]) -> None:
    """Send the list, the close-ups, and what stands in the room; ``views``: of all moments in order of time."""
    moments, ns = [*views], writer.clock.ns
    log_list(writer, MOMENTS, result, moments)
    lead, order = leading(result, moments), [*result.comparisons, ""]
    log_moment_table(writer, [
        MomentPlace(
            moment.label, KINDS[moment.outcome], moment.number, int(ns[moment.frame]) + moment.later, moment is lead
        )
        for moment in sorted(moments, key=lambda moment: order.index(moment.label))
    ])  # fmt: skip
    log_eyes(writer, EYE, [(frame, later, views[moment].eye) for frame, later, moment in focus_rows(moments)])
    # Each fault while it lasts; nothing at other times.
    faults = [moment for moment in moments if moment.label]
    steps = steps_of(faults, len(ns), None)
    log_marks(writer, SPACE, steps, {moment: marks_of(result, moment, views[moment]) for moment in faults})
    for label in with_solids(result):
        _log_cages(writer, result, label, views, steps)
    dots = np.array([moment.point for moment in faults], dtype=np.float32).reshape(-1, 3)
    colours = packed(moment.colour for moment in faults)
    writer.static(PINS, rr.Points3D(dots, colors=colours, radii=rr.Radius.ui_points(4.0)))


def log_list(writer: RecordingWriter, path: str, result: RunResult, moments: Sequence[FocusMoment]) -> None:
    """Send one line per moment: a click on its time moves the cursor there."""
    names = [result.assembly.pair_name(moment.pair) for moment in moments]
    widths = max((len(moment.label) for moment in moments), default=0), max(map(len, names), default=0)
    columns = rr.TextLog.columns(
        text=[moment_line(moment, name, widths) for moment, name in zip(moments, names, strict=True)],
        level=[KINDS[moment.outcome] for moment in moments],
        color=packed(moment.colour for moment in moments),
    )
    writer.rows(path, [(moment.frame, moment.later) for moment in moments], columns)


def details_path(label: str, part: str) -> str:
    """Entity of a part of one detector's details."""
    return entity("details", label, part)


def log_details(writer: RecordingWriter, result: RunResult, label: str, moments: Iterable[FocusMoment]) -> None:
    """Send the details of one detector; ``moments``: all of the run in order of time."""
    writer.markdown(details_path(label, "text"), detector_text(result, label))
    log_list(writer, details_path(label, "moments"), result, [moment for moment in moments if moment.label == label])


def focus_colours(result: RunResult, views: Mapping[FocusMoment, CloseUp]) -> Colours:
    """White for a body that touches nothing, while it is said to; translucent what stands before a moment."""
    colours: dict[str, list[tuple[int, int, Rgba]]] = {}
    touched = {body for view in views.values() for body in (view.free, *view.hiding) if body is not None}
    for body in touched:
        name = result.assembly.names[body]
        tags = tags_of(name, result.session.scene)
        for frame, later, moment in focus_rows([*views]):
            view, colour = views[moment], albedo(tags)
            if body == view.free:
                colour = FREE
            elif body in view.hiding:
                colour = faded(colour, tags)
            colours.setdefault(name, []).append((frame, later, colour))
    return colours
