"""Moments in the picture: their list, the close-up of each, and what points at the one nearest to the cursor.

Rerun runs no code of ours at a click. So what is in focus is data over time: a click on a moment moves the cursor, and
close-up and solids there are those of that moment. The eye is data too: a camera whose pose changes from moment to
moment; the view tracks it, so wherever the cursor goes it stands before the nearest moment with nothing in between.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import rerun as rr
from rerun.chunk import RrdReader

from cdcore import TriangleMesh
from cdcore.bounding.bounding_sphere import sphere_in_mode
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
from replay.outputs.rerun_log.stage import Label, beside, faded, in_front, log_eyes, log_labels, log_lines
from replay.outputs.rerun_log.texts import detector_text
from replay.outputs.shapes import bends, edges_of, face_normals
from replay.pipeline.run_result import RunResult
from replay.pipeline.sentences import length_words

TABLE: Final = "moments/table"


@dataclass(frozen=True)
class MomentPlace:
    """Where the cursor meets a moment; ``kind``: "miss", "false" or "contact"; ``leads``: the picture opens there."""

    label: str
    kind: str
    number: int
    session_ns: int
    leads: bool


MOMENT_COLUMNS: Final = tuple(one.name for one in fields(MomentPlace))


def log_moment_table(writer: RecordingWriter, places: Sequence[MomentPlace]) -> None:
    """Send where to look."""
    rows = zip(*map(astuple, places), strict=True)
    columns: dict[str, Any] = {name: list(values) for name, values in zip(MOMENT_COLUMNS, rows, strict=True)}
    for name, kind in (("number", np.int64), ("leads", np.bool_), ("session_ns", np.int64)):
        columns[name] = np.array(columns[name], dtype=kind)
    writer.static(TABLE, rr.AnyValues(**columns))


def read_moments(recording: Path) -> list[MomentPlace]:
    """The moments, as a recording has them; none in one that compares nothing."""
    try:
        chunks = RrdReader(recording).stream().filter(content=f"/{TABLE}").to_chunks()
    except (OSError, ValueError, RuntimeError) as error:
        why = f"{recording} cannot be read as a recording ({error})"
        raise RunFolderError(f"{why}; replay the session again") from error
    columns: dict[str, list[Any]] = {}
    for batch in (chunk.to_record_batch() for chunk in chunks):
        columns |= {name.rpartition(":")[2]: batch.column(name).to_pylist()[0] for name in batch.schema.names}
    return [MomentPlace(*row) for row in zip(*(columns.get(name, []) for name in MOMENT_COLUMNS), strict=True)]


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
    for one in moments:
        point, user = np.asarray(one.point), towards_user(assembly, scene, one.frame, one.point)
        if isinstance(one.of, Miss):
            eye = Eye(vector_of(point + CLOSE_UP * across(np.asarray(one.of.normal), user)), one.point)
            view = CloseUp(eye)
        else:
            measured = one.of.ends if isinstance(one.of, FalseContact) else None
            ends = None if measured is None else np.array(measured)
            free, caged = _solids(result, one)
            away = across(np.zeros(3) if ends is None else ends[1] - ends[0], user)
            view = CloseUp(_backed(result, one, away, caged), ends, free, caged)
        views[one] = replace(view, hiding=obstacles.hiding(one.frame, view.eye))
    return views


def _backed(result: RunResult, moment: FocusMoment, away: FloatArray, caged: Sequence[int]) -> Eye:
    """The eye in a direction, so far off that a ball around the solids, or around the smaller body, is seen whole."""
    assembly = result.assembly
    ends = [*caged] or assembly.pairs[moment.pair].tolist()
    balls = {body: sphere_in_mode(assembly.bodies[body].mesh, "best") for body in ends}
    body = min(balls, key=lambda one: balls[one].radius)
    target = np.asarray(moment.point)
    if caged:
        target = placed(assembly.motion, moment.frame, body, balls[body].centre[None])[0]
    distance = float(np.clip(REACHES * balls[body].radius, *DISTANCES))
    return Eye(vector_of(target + distance * away), vector_of(target))


def _solids(result: RunResult, moment: FocusMoment) -> tuple[int | None, tuple[int, ...]]:
    """The body that lies in the hull of the other, and the bodies whose solids are drawn; none of what asks meshes."""
    names, fault = result.assembly.names, moment.of
    if not isinstance(fault, FalseContact) or moment.label not in with_solids(result):
        return None, ()
    pair = result.assembly.pairs[moment.pair].tolist()
    if not fault.hollow:
        return None, tuple(body for body in pair if _extent(result, body) <= ROOM)
    caged = names.index(fault.hollow)
    free = next(body for body in pair if body != caged)
    return free, (caged,) if _extent(result, caged) <= ROOM else ()


def _extent(result: RunResult, body: int) -> float:
    return float(np.ptp(result.assembly.bodies[body].mesh.vertices, axis=0).max()) / 2


def labels_of(result: RunResult, moment: FocusMoment, view: CloseUp) -> list[Label]:
    """What is said in the close-up: how far apart the bodies are, or that their contact was missed."""
    if moment.outcome == Outcome.MISSED:
        return [beside(view.eye, np.asarray(moment.point), f"{moment.label} misses this contact", MISSED, 0.0, 0.36)]
    if view.ends is None:
        return [beside(view.eye, np.asarray(moment.point), f"{moment.label}: false contact", INVENTED, 0.0, 0.36)]
    names = [result.assembly.names[body] for body in result.assembly.pairs[moment.pair].tolist()]
    apart = length_words(moment.size)
    words = f"{' and '.join(names)}: {apart} apart"
    if view.free is not None:
        words = f"{result.assembly.names[view.free]} touches nothing: {apart}"
    return [beside(view.eye, view.ends.mean(axis=0), words, GAP, 0.22, -0.36)]


def measure(view: CloseUp) -> list[tuple[FloatArray, Rgba]]:
    """Lines that measure a gap: from point to point, and a bar across at both ends."""
    if view.ends is None:
        return []
    ends, back = view.ends, look_rotation(view.eye)[:, 2]
    across = np.cross(ends[1] - ends[0], back)
    across *= HALF_BAR / max(float(np.linalg.norm(across)), 1e-9)
    lines = [ends, *(np.stack([end - across, end + across]) for end in ends)]
    return [(in_front(view.eye, line), GAP) for line in lines]


def with_solids(result: RunResult) -> list[str]:
    """Compared detectors with solids other than the meshes."""
    bodies = result.assembly.bodies
    solids = {label: getattr(result.detectors.get(label), "colliders", ()) for label in result.comparisons}
    return [
        label for label, some in solids.items() if any(one.mesh is not bodies[k].mesh for k, one in enumerate(some))
    ]


def solid_path(body: str, label: str) -> str:
    """Entity of the solid, below the body: so it moves with it."""
    return f"{body_path(body)}/{entity(f'solid_of_{label}')}"


def log_cages(
    writer: RecordingWriter, result: RunResult, label: str, views: Mapping[FocusMoment, CloseUp], steps: Steps
) -> None:
    """Send the edges of the solids of one detector in yellow, each while a false contact of it lasts."""
    detector: Any = result.detectors[label]  # whose solids have one or more convex parts each
    left, drawn = DRAWN_EDGES, set()
    edges: dict[int, FloatArray] = {}
    own = [one for one in views if one.label == label and views[one].caged]
    for one in sorted(own, key=lambda one: one.first - one.last):
        for body in views[one].caged:
            if body not in edges:
                parts = detector.parts[result.assembly.names[body]]
                edges[body] = np.concatenate([sharp_edges(part) for part in parts])
            left -= len(edges[body])
            if left >= 0:
                drawn.add((one, body))
    for body, lines in edges.items():
        path = solid_path(result.assembly.names[body], label)
        shown = {moment: lines for moment, caged in drawn if caged == body}
        writer.steps(path, steps, shown, _strips)
        # Wires ignore alpha: a row without lines hides them.
        colour, radius = [INVENTED], rr.Radius.ui_points(1.4)
        writer.static(path, rr.LineStrips3D.from_fields(colors=colour, radii=radius))


def _strips(lines: list[Any]) -> rr.ComponentColumnList:
    return rr.LineStrips3D.columns(strips=np.array(lines, dtype=np.float32).reshape(-1, 2, 3))


def sharp_edges(mesh: TriangleMesh) -> FloatArray:
    """Edges (k, 2, 3) at which two faces of a solid meet at an angle."""
    edges, faces = edges_of(mesh)
    return edges[bends(face_normals(mesh.triangles)[1], faces) < SHARP_COSINE]


SPACE: Final = "world/focus"
EYE: Final = f"{SPACE}/eye"
PINS: Final = f"{SPACE}/pins"
"""Dots at all faults in the room; a close-up needs none of them."""
ANSWER: Final = "answer"
MOMENTS: Final = "moments/list"


def log_answer(writer: RecordingWriter, result: RunResult, views: Mapping[FocusMoment, CloseUp]) -> None:
    """Send the list, the close-ups, and what stands in the room; ``views``: of all moments in order of time."""
    moments = [*views]
    log_list(writer, MOMENTS, result, moments)
    log_moment_table(writer, _places(writer, result, moments))
    log_eyes(writer, EYE, [(frame, later, views[one].eye) for frame, later, one in focus_rows(moments)])
    faults = [one for one in moments if one.label]
    # Each fault while it lasts; nothing at other times.
    rows = [(one.frame, one.later, min(one.first, one.frame), one.last, one) for one in faults]
    steps = steps_of(rows, len(writer.clock.ns), None)
    log_labels(writer, SPACE, steps, {one: labels_of(result, one, views[one]) for one in faults})
    log_lines(writer, f"{SPACE}/measure", steps, {one: measure(views[one]) for one in faults}, 1.6)
    for label in with_solids(result):
        log_cages(writer, result, label, views, steps)
    dots = np.array([one.point for one in faults], dtype=np.float32).reshape(-1, 3)
    colours = packed(one.colour for one in faults)
    writer.static(PINS, rr.Points3D(dots, colors=colours, radii=rr.Radius.ui_points(4.0)))


def log_list(writer: RecordingWriter, path: str, result: RunResult, moments: Sequence[FocusMoment]) -> None:
    """Send one line per moment: a click on its time moves the cursor there."""
    names = [result.assembly.pair_name(one.pair) for one in moments]
    widths = max((len(one.label) for one in moments), default=0), max(map(len, names), default=0)
    texts = [moment_line(one, name, widths) for one, name in zip(moments, names, strict=True)]
    columns = rr.TextLog.columns(
        text=texts, level=[KINDS[one.outcome] for one in moments], color=packed(one.colour for one in moments)
    )
    writer.rows_later(path, [(one.frame, one.later) for one in moments], columns)


def details_path(label: str, *parts: str) -> str:
    """Entity of a part of one detector's details."""
    return entity("details", label, *parts)


def log_details(writer: RecordingWriter, result: RunResult, label: str, moments: Iterable[FocusMoment]) -> None:
    """Send the details of one detector; ``moments``: all of the run in order of time."""
    writer.markdown(details_path(label, "text"), detector_text(result, label))
    own = [one for one in moments if one.label == label]
    if own:
        log_list(writer, details_path(label, "moments"), result, own)


def focus_colours(result: RunResult, views: Mapping[FocusMoment, CloseUp]) -> Colours:
    """White for a body that touches nothing, while it is said to; translucent what stands before a moment."""
    colours: dict[str, list[tuple[int, int, Rgba]]] = {}
    names = result.assembly.names
    usual = [albedo(tags_of(name, result.session.scene)) for name in names]
    touched = {body for view in views.values() for body in (view.free, *view.hiding) if body is not None}
    for frame, later, one in focus_rows([*views]):
        for body in touched:
            colour = usual[body]
            if body == views[one].free:
                colour = FREE
            elif body in views[one].hiding:
                colour = faded(colour, tags_of(names[body], result.session.scene))
            colours.setdefault(names[body], []).append((frame, later, colour))
    return colours


def _places(writer: RecordingWriter, result: RunResult, moments: Sequence[FocusMoment]) -> list[MomentPlace]:
    """The moments in the order of their detectors."""
    lead, order = leading(result, moments), [*result.comparisons, ""]
    places = [
        MomentPlace(one.label, KINDS[one.outcome], one.number, int(writer.clock.ns[one.frame]) + one.later, k == lead)
        for k, one in enumerate(moments)
    ]
    return sorted(places, key=lambda one: order.index(one.label))
