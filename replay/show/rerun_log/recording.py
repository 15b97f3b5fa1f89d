"""Writes a run as a Rerun recording: everything is computed first and sent in columns, never frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Final
from uuid import uuid4

import numpy as np

from cdcore.bounding.bounding_sphere import Sphere, sphere_best
from replay.auditing.fault import Fault
from replay.document.run_result import RunResult
from replay.effects.effect_summary import events_in_order
from replay.effects.output import Vector
from replay.show.camera import OVERVIEW_ASPECT, Eye, overview
from replay.show.palette import fault_key
from replay.show.report.still import CARD_SIZE, fault_still
from replay.show.rerun_log import documents, lanes
from replay.show.rerun_log.blueprint import Picture, build_blueprint
from replay.show.rerun_log.close_up import LARGEST_BALL_M, close_up_colours, close_up_eyes, log_close_ups
from replay.show.rerun_log.depth import log_depths
from replay.show.rerun_log.effects import log_effects, log_happened
from replay.show.rerun_log.leading_still import log_still
from replay.show.rerun_log.moments import (
    bookmarks,
    key_moments,
    leading_moment,
    log_bookmarks,
    log_moment_lists,
    point_of,
)
from replay.show.rerun_log.pipeline_view import log_pipeline, search_runs
from replay.show.rerun_log.recording_file import RecordingClock, RecordingWriter, recording_file
from replay.show.rerun_log.scene import log_contacts, log_missed_faces, log_touches, log_world
from replay.show.rerun_log.timing import log_accuracy, log_timing

APPLICATION: Final = "vrlab-replay"

MARGIN_M: Final = 0.05
"""Metres around each point that an overview shows."""

NARROW_ASPECT: Final = 0.8
"""Width of the view of the room over its height, beside an answer."""


def write_recording(result: RunResult, path: Path) -> None:
    """Write the picture of a run.

    The application id is new for every recording, because a viewer keeps the first layout it meets per application.
    The file appears under its name when it is complete; ``OSError`` where it cannot be written. Above one hour at 90 Hz
    poses, contacts and timings are strided but for frames with a moment; lanes and misses never are.
    """
    label_order = [rank.label for rank in result.ranking if rank.label in result.comparisons]
    moments = key_moments(result) if label_order else {}
    points = [(time[0], point_of(result, time, moment)) for time, moment in moments.items()]
    bounding_spheres = [sphere_best(body.mesh) for body in result.assembly.bodies]
    picture = Picture(
        result=result,
        answer_eye=_overview_eye(result, points, NARROW_ASPECT),
        effects_eye=_overview_eye(result, _points_of_events(result, bounding_spheres), OVERVIEW_ASPECT),
        balls=bounding_spheres,
        moments=moments,
        eyes=close_up_eyes(result, moments, bounding_spheres),
        order=label_order,
        lanes=lanes.detector_lanes(result, label_order) if label_order else [],
        searches=search_runs(result),
    )
    clock = RecordingClock.of(result.assembly, [frame for frame, _ in moments])
    with recording_file(f"{APPLICATION}-{uuid4().hex}", path, build_blueprint(picture)) as stream:
        opening_time = leading_moment(result, moments) if moments else None
        writer = RecordingWriter(
            stream, clock, None if opening_time is None else int(clock.ns[opening_time[0]]) + opening_time[1]
        )
        writer.name(result.session.scene.name or "Session")
        _log_room(writer, picture)
        _log_tabs(writer, picture)
        if opening_time is not None:
            fault = moments[opening_time]
            if isinstance(fault, Fault):
                log_still(writer, fault_still(result, fault.detector, fault, CARD_SIZE)[0])


def _points_of_events(result: RunResult, balls: Sequence[Sphere]) -> list[tuple[int, Vector]]:
    """Frame of each event, and where its bodies stand, but of those that hold the room: a bench begins at the floor."""
    motion, positions = result.assembly.motion, []
    small_bodies = {
        name: body for body, name in enumerate(result.assembly.names) if balls[body].radius <= LARGEST_BALL_M
    }
    for _, event in events_in_order(result.effects):
        # What ends after the last frame is seen in it.
        frame = int(np.searchsorted(motion.times[:-1], event.time))
        positions += [
            (frame, motion.translations[frame, small_bodies[name]]) for name in event.bodies if name in small_bodies
        ]
    return positions


def _overview_eye(result: RunResult, positions: Sequence[tuple[int, Vector]], aspect: float) -> Eye:
    """An overview of all places, from the user's side at the first; without any, of wherever bodies were."""
    corners = MARGIN_M * np.array([*product((-1.0, 1.0), repeat=3)])
    points = (np.reshape([position for _, position in positions], (-1, 1, 3)) + corners).reshape(-1, 3)
    return overview(result.assembly, result.session.scene, points, positions[0][0] if positions else 0, aspect)


def _log_room(writer: RecordingWriter, picture: Picture) -> None:
    """Bodies, contacts and misses as they stand at the cursor."""
    result = picture.result
    assembly, scene = result.assembly, result.session.scene
    # A run of effects alone needs the bodies that they name, and no other is drawn.
    drawn_bodies = result.document.plan.bodies if scene.effects is not None and not result.detections else {}
    colours = close_up_colours(result, picture.moments, picture.eyes, picture.balls)
    log_world(writer, assembly, scene, drawn_bodies or assembly.names, colours)
    log_touches(writer, result)
    # Contacts of the reference have the colours of the worst detector's misses.
    worst = next(iter(picture.order), "")
    comparison = result.comparisons.get(worst)
    late_misses = [
        (miss.pair, miss.first, miss.last) for miss in result.misses.get(worst, ()) if fault_key(miss.kind) == "late"
    ]
    for label in [result.oracle] if result.oracle else result.detections:
        log_contacts(writer, label, result.detections[label], comparison, late_misses)
    log_missed_faces(writer, result)


def _log_tabs(writer: RecordingWriter, picture: Picture) -> None:
    """Logs the contents of each tab beside the room."""
    result, moments = picture.result, picture.moments
    log_timing(writer, result.detections, documents.series_names(result))
    log_depths(writer, result)
    if picture.order:
        writer.markdown(documents.ANSWER_ENTITY, documents.answer_text(result))
        lanes.log_detector_lanes(writer, result, picture.order, picture.lanes)
        log_accuracy(writer, documents.dots_of(result))
        writer.markdown(documents.ACCURACY_ENTITY, documents.accuracy_text(result))
    else:
        writer.markdown(documents.SESSION_ENTITY, documents.session_text(result))
    if moments:
        log_close_ups(writer, result, moments, picture.eyes, picture.balls)
        log_moment_lists(writer, result, moments)
        log_bookmarks(writer, bookmarks(writer, result, moments))
    for run in picture.searches:
        log_pipeline(writer, run, result, picture.balls)
    for label in result.detections:
        lanes.log_pair_lanes(writer, result, label)
        writer.markdown(documents.details_path(label), documents.detector_text(result, label))
    log_effects(writer, result.effects)
    lanes.log_session_lanes(writer, result)
    if result.effects or picture.activity_lanes:
        log_happened(writer, result.effects, is_leading=not moments)
