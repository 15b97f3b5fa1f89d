"""Writes a run as a Rerun recording: everything is computed first and sent in columns, never frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Final
from uuid import uuid4

import numpy as np

from replay.comparison.outcome import Miss
from replay.effects.effect_summary import happened
from replay.outputs.camera import ASPECT, Eye, overview
from replay.outputs.moments import FocusMoment, key_moments, worst_first
from replay.outputs.rerun_log import lanes, texts
from replay.outputs.rerun_log.blueprint import Picture, build_blueprint
from replay.outputs.rerun_log.effects import log_effects, log_happened
from replay.outputs.rerun_log.moment_views import ANSWER, close_ups, focus_colours, log_answer, log_details
from replay.outputs.rerun_log.pipeline import log_pipeline
from replay.outputs.rerun_log.recording_file import RecordingClock, RecordingWriter, recording_file
from replay.outputs.rerun_log.scene import log_contacts, log_missed_faces, log_touches, log_world
from replay.outputs.rerun_log.timing import log_accuracy, log_timing
from replay.outputs.watched_run import watched_runs
from replay.pipeline.run_result import RunResult

APPLICATION: Final = "vrlab-replay"

ROOM: Final = 0.05
"""Metres around each point that the overview shows."""

NARROW: Final = 0.8
"""Width of the view of the room over its height, beside an answer."""


def write_recording(result: RunResult, path: Path) -> None:
    """Write the picture of a run.

    The application id is new for every recording, because a viewer keeps the first layout it meets per application.
    The file appears under its name when it is complete; ``OSError`` where it cannot be written. Above one hour at 90 Hz
    poses, contacts and timings are strided except near misses (see ``RecordingClock``); lanes and misses never
    are.
    """
    misses = [miss for some in result.misses.values() for miss in some]
    clock = RecordingClock.of(result.assembly, [(miss.start, miss.end) for miss in misses])
    order = worst_first(result) if result.comparisons else []
    moments = key_moments(result) if order else []
    picture = Picture(
        result=result,
        eye=_eye(result, moments),
        views=close_ups(result, moments),
        order=order,
        lanes=lanes.detector_lanes(result, order) if order else [],
        watched=watched_runs(result),
    )
    with recording_file(f"{APPLICATION}-{uuid4().hex}", path, build_blueprint(picture)) as stream:
        writer = RecordingWriter(stream, clock)
        writer.name(result.session.scene.name or "Session")
        _log_room(writer, picture, misses)
        _log_tabs(writer, picture)


def _log_room(writer: RecordingWriter, picture: Picture, misses: Sequence[Miss]) -> None:
    """Bodies, contacts and misses as they stand at the cursor."""
    result = picture.result
    assembly, scene = result.assembly, result.session.scene
    # A run of effects alone needs the bodies that they name, and no other is drawn.
    named = result.summary["plan"]["bodies"] if scene.effects is not None and not result.detections else {}
    log_world(writer, assembly, scene, named or assembly.names, focus_colours(result, picture.views))
    log_touches(writer, assembly, misses)
    # Contacts of the reference have the colours of the worst detector's misses.
    worst = result.comparisons.get(next(iter(picture.order), ""))
    for label in [result.oracle] if result.oracle else result.detections:
        log_contacts(writer, label, assembly, result.detections[label], worst)
    if misses:
        log_missed_faces(writer, assembly, result.detections[result.oracle], misses)


def _log_tabs(writer: RecordingWriter, picture: Picture) -> None:
    """What each tab shows beside the room."""
    result = picture.result
    log_timing(writer, result.detections, texts.series_names(result))
    if picture.order:
        writer.markdown(ANSWER, texts.answer_text(result))
        lanes.log_detector_lanes(writer, result, picture.order, picture.lanes)
        log_accuracy(writer, texts.dots_of(result))
        writer.markdown(texts.ACCURACY, texts.accuracy_text(result))
    else:
        writer.markdown(texts.SESSION_TEXT, texts.session_text(result))
    if picture.views:
        log_answer(writer, result, picture.views)
    for run in picture.watched:
        log_pipeline(writer, run, result)
    for label in result.detections:
        lanes.log_pair_lanes(writer, result, label)
        log_details(writer, result, label, picture.views)
    log_effects(writer, result.effects)
    lanes.log_session_lanes(writer, result)
    if result.effects or picture.doing:
        log_happened(writer, result.effects, leads=not result.comparisons)


def _eye(result: RunResult, moments: Sequence[FocusMoment]) -> Eye:
    """The overview: of all moments, or of the events where nothing is compared; else of wherever bodies were."""
    motion, names = result.assembly.motion, result.assembly.names
    points, frame = [moment.point for moment in moments], moments[0].frame if moments else 0
    for _, event in happened(result.effects) if not result.detections else ():
        frame = min(int(np.searchsorted(motion.times, event.time)), len(motion) - 1)
        points += [motion.translations[frame, names.index(name)] for name in event.bodies if name in names]
    corners = ROOM * np.array([*product((-1.0, 1.0), repeat=3)])
    boxes = (np.reshape(points, (-1, 1, 3)) + corners).reshape(-1, 3)
    return overview(result.assembly, result.session.scene, boxes, frame, NARROW if moments else ASPECT)
