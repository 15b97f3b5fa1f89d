"""What a close-up of a moment shows: from where, the body that touches nothing in white, the solid around it, the gap.

The eye is data, not layout: a camera whose pose changes from moment to moment. The viewer tracks it, so wherever the
cursor goes, by click, key or play, the view stands before the nearest moment with nothing in between.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import rerun as rr

from cdcore import TriangleMesh
from cdcore.bounding.sphere import sphere_in_mode
from cdcore.numerics import FloatArray
from replay.comparison.false_contacts import FalseContact
from replay.comparison.outcome import Miss, Outcome
from replay.effects.output import vector_of
from replay.outputs.camera import CLOSE_UP, Eye, Obstacles, across, look_rotation, placed, towards_user
from replay.outputs.moments import FocusMoment
from replay.outputs.palette import INVENTED, MISSED, Rgba
from replay.outputs.rerun_log.columns import RecordingWriter, Steps, entity
from replay.outputs.rerun_log.stage import Label, beside, in_front
from replay.outputs.rerun_log.world import body_path
from replay.outputs.shapes import bends, edges_of, face_normals
from replay.pipeline.run_result import RunResult
from replay.pipeline.sentences import length_words

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
        return []
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

        def things(shown: FocusMoment | None, body: int = body, lines: FloatArray = lines) -> list[FloatArray]:
            return [*lines] if (shown, body) in drawn else []

        writer.steps(path, steps, things, _strips)
        # Wires ignore alpha: a row without lines hides them.
        colour, radius = [INVENTED], rr.Radius.ui_points(1.4)
        writer.static(path, rr.LineStrips3D.from_fields(colors=colour, radii=radius))


def _strips(lines: list[Any]) -> rr.ComponentColumnList:
    return rr.LineStrips3D.columns(strips=np.array(lines, dtype=np.float32).reshape(-1, 2, 3))


def sharp_edges(mesh: TriangleMesh) -> FloatArray:
    """Edges (k, 2, 3) at which two faces of a solid meet at an angle."""
    edges, faces = edges_of(mesh)
    return edges[bends(face_normals(mesh.triangles)[1], faces) < SHARP_COSINE]
