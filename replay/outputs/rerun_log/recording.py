"""Writes a run as a Rerun recording: everything is computed first and sent in columns, never frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Final
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import FloatArray
from cdcore.protocol import counts_as_contact
from replay.effects.effect_summary import happened
from replay.outputs.camera import ASPECT, Eye, overview
from replay.outputs.moments import key_moments, worst_first
from replay.outputs.palette import is_ghost, tags_of
from replay.outputs.rerun_log import lanes
from replay.outputs.rerun_log.accuracy import log_accuracy
from replay.outputs.rerun_log.answer import ANSWER, focus_colours, log_answer
from replay.outputs.rerun_log.blueprint import Picture, build_blueprint
from replay.outputs.rerun_log.close_up import close_ups
from replay.outputs.rerun_log.columns import RecordingClock, RecordingWriter
from replay.outputs.rerun_log.contacts import log_contacts
from replay.outputs.rerun_log.details import log_details
from replay.outputs.rerun_log.effects import log_effects, log_happened
from replay.outputs.rerun_log.findings import log_findings
from replay.outputs.rerun_log.missed import log_missed_faces
from replay.outputs.rerun_log.pipeline import log_pipeline
from replay.outputs.rerun_log.recording_file import recording_file
from replay.outputs.rerun_log.texts import (
    ACCURACY,
    SESSION_TEXT,
    accuracy_text,
    answer_text,
    dots_of,
    series_names,
    session_text,
)
from replay.outputs.rerun_log.timing import log_timing
from replay.outputs.rerun_log.world import log_touches, log_world
from replay.outputs.watched_run import watched_runs
from replay.pipeline.run_result import RunResult

APPLICATION: Final = "vrlab-replay"

SMALL: Final = 0.5
"""Metres: the overview frames bodies up to this size; a bench would push the glasses into a corner."""

AROUND: Final = 0.5
"""How much wider than the bodies of an event the picture of effects is."""

NARROW: Final = 0.8
"""Width of the view of the room over its height, beside an answer."""


def write_recording(result: RunResult, path: Path) -> None:
    """Write the picture of a run.

    The application id is new for every recording, because a viewer keeps the first layout it meets per application.
    The file appears under its name when it is complete; ``OSError`` where it cannot be written. Above one hour at 90 Hz
    poses, contacts and timings are strided except near misses (see ``columns.KEPT_AROUND``); lanes and misses never
    are.
    """
    spans = [(miss.start, miss.end) for misses in result.misses.values() for miss in misses]
    clock = RecordingClock.of(result.assembly, spans)
    order = worst_first(result) if result.comparisons else []
    picture = Picture(
        result=result,
        eye=_eye(result),
        views=close_ups(result, key_moments(result) if order else []),
        order=order,
        lanes=lanes.detector_lanes(result, order) if order else [],
        watched=watched_runs(result),
    )
    with recording_file(f"{APPLICATION}-{uuid4().hex}", path, build_blueprint(picture)) as stream:
        writer = RecordingWriter(stream, clock)
        writer.name(result.session.scene.name or "Session")
        _log_room(writer, picture)
        _log_tabs(writer, picture)


def _log_room(writer: RecordingWriter, picture: Picture) -> None:
    """Bodies, contacts and misses as they stand at the cursor."""
    result = picture.result
    assembly, scene = result.assembly, result.session.scene
    # A run of effects alone needs the bodies that they name, and no other is drawn.
    named = result.summary["plan"]["bodies"] if scene.effects is not None and not result.detections else {}
    log_world(writer, assembly, scene, named or None, focus_colours(result, picture.views))
    misses = [miss for some in result.misses.values() for miss in some]
    log_touches(writer, assembly, misses)
    for label, detection in result.detections.items():
        # Contacts of the reference have the colours of the worst detector's misses.
        against = result.comparisons.get(label, result.comparisons.get(next(iter(picture.order), "")))
        log_contacts(writer, label, assembly, detection, against, curves=label == result.oracle or not result.oracle)
    if misses:
        log_missed_faces(writer, assembly, result.detections[result.oracle], misses)


def _log_tabs(writer: RecordingWriter, picture: Picture) -> None:
    """What each tab shows beside the room."""
    result = picture.result
    if picture.order:
        writer.markdown(ANSWER, answer_text(result))
        lanes.log_detector_lanes(writer, result, picture.order, picture.lanes)
    if picture.views:
        log_answer(writer, result, picture.views)
    for run in picture.watched:
        log_pipeline(writer, run, result)
    log_timing(writer, result.detections, series_names(result))
    if picture.order:
        log_accuracy(writer, *dots_of(result))
        writer.markdown(ACCURACY, accuracy_text(result))
    else:
        writer.markdown(SESSION_TEXT, session_text(result))
    for label in result.detections:
        lanes.log_pair_lanes(writer, result, label)
        log_details(writer, result, label, picture.views)
    log_effects(writer, result.effects)
    lanes.log_session_lanes(writer, result)
    if picture.happened:
        log_happened(writer, result.effects, leads=not result.comparisons)
    log_findings(writer, result)


def _eye(result: RunResult) -> Eye:
    """The overview: misses where there are any, else places where bodies in contact were, else the result."""
    misses = [miss for found in result.misses.values() for miss in found]
    points = _places(result, [miss.point for miss in misses])
    frame, aspect = misses[0].deepest if misses else 0, NARROW if result.comparisons else ASPECT
    return overview(result.assembly, result.session.scene, points, frame, aspect)


def _places(result: RunResult, misses: Sequence[tuple[float, float, float]]) -> FloatArray:
    """World points that the overview shall hold: misses, and movable bodies at their contacts, or at events."""
    assembly, points = result.assembly, [np.array(misses, dtype=np.float64).reshape(-1, 3)]
    trusted = result.detections.get(result.oracle) or next(iter(result.detections.values()), None)
    if trusted is None:
        for _, event in happened(result.effects):
            frame = min(int(np.searchsorted(assembly.motion.times, event.time)), len(assembly.motion) - 1)
            bodies = (assembly.names.index(name) for name in event.bodies if name in assembly.names)
            points += [_boxed(result, body, np.array([frame])) for body in bodies]
        found = np.concatenate(points)
        # Some room around a single glass: what stands beside it tells where it is.
        return found + AROUND * (found - found.mean(axis=0)) if len(found) else found
    for column, bodies in enumerate(assembly.pairs.tolist()):
        frames = np.flatnonzero(counts_as_contact(trusted.verdict[:, column]))
        points += [_boxed(result, body, frames[:: max(1, len(frames) // 200)]) for body in bodies]
    return np.concatenate(points)


def _boxed(result: RunResult, body: int, frames: NDArray[np.int64]) -> FloatArray:
    """Corners (n, 3) of the box around a body in these frames; none of a large one, or of a hand or a headset."""
    assembly = result.assembly
    vertices = assembly.bodies[body].mesh.vertices
    corners = np.array([*product(*zip(vertices.min(axis=0), vertices.max(axis=0), strict=True))], dtype=np.float64)
    tags = tags_of(assembly.names[body], result.session.scene)
    if not len(frames) or np.ptp(corners, axis=0).max() >= SMALL or is_ghost(tags):
        return np.zeros((0, 3))
    turns, places = assembly.motion.rotations[frames, body], assembly.motion.translations[frames, body]
    found: FloatArray = (np.einsum("fij,kj->fki", turns, corners) + places[:, None]).reshape(-1, 3)
    return found
