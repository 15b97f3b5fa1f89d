"""Writes a run as a Rerun recording: everything is computed first and sent in columns, never frame by frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Final
from uuid import uuid4

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore.numerics import FloatArray
from cdcore.protocol import counts_as_contact
from replay.comparison.clusters import MANY, by_depth
from replay.comparison.contact_counts import contact_counts
from replay.comparison.outcome import Outcome
from replay.effects.effect_summary import happened
from replay.outputs.camera import Eye, overview
from replay.outputs.lanes import noise_states, ranked_pairs
from replay.outputs.moments import FocusMoment, key_moments, pair_in_focus, worst_first
from replay.outputs.palette import NOISES, OUTCOMES, WHITE, is_ghost, tags_of
from replay.outputs.rerun_log import lanes as lane_log
from replay.outputs.rerun_log import overview as overview_log
from replay.outputs.rerun_log.blueprint import build_blueprint
from replay.outputs.rerun_log.columns import RecordingClock, RecordingWriter, entity, packed
from replay.outputs.rerun_log.contacts import log_contacts
from replay.outputs.rerun_log.effects import log_effects, log_happened
from replay.outputs.rerun_log.findings import log_findings
from replay.outputs.rerun_log.layout import BlueprintInput, Subject
from replay.outputs.rerun_log.missed import log_missed_faces
from replay.outputs.rerun_log.pipeline import log_pipeline
from replay.outputs.rerun_log.pipeline_frame import log_frame
from replay.outputs.rerun_log.recording_file import recording_file
from replay.outputs.rerun_log.report import answer_text, log_cluster_list, report_text
from replay.outputs.rerun_log.search_picture import log_searches
from replay.outputs.rerun_log.solids import log_solids, with_solids
from replay.outputs.rerun_log.timing import cost_text, log_timing
from replay.outputs.rerun_log.tradeoff import log_tradeoff
from replay.outputs.rerun_log.world import log_touches, log_world
from replay.outputs.watched_run import watched_runs
from replay.pipeline.headline import contact_words, headline
from replay.pipeline.run_result import RunResult

APPLICATION: Final = "vrlab-replay"

DETECTOR_LANES: Final = 40
"""Pairs with lanes per detector at most: beyond it nobody scrolls, and every lane costs the viewer a row."""

SMALL: Final = 0.5
"""Metres: the overview frames bodies up to this size; a bench would push the glasses into a corner."""

TABLE: Final = "tradeoff/table"


def write_recording(result: RunResult, path: Path) -> None:
    """Write the picture of a run.

    The application id is new for every recording, because a viewer keeps the first layout it meets per application.
    The file appears under its name when it is complete; ``OSError`` where it cannot be written. Above one hour at 90 Hz
    poses, contacts and timings are strided except near misses (see ``columns.KEPT_AROUND``); lanes and misses never
    are.
    """
    spans = [(miss.start, miss.end) for misses in result.misses.values() for miss in misses]
    clock = RecordingClock.of(result.assembly, spans)
    subjects = [_subject(result, label, k) for k, label in enumerate(result.comparisons)]
    watched = watched_runs(result)
    moments, hiding = overview_log.moment_eyes(result, key_moments(result) if result.comparisons else [])
    lanes = overview_log.overview_lanes(result, worst_first(result)) if moments else None
    eye, spoken_of = _eye(result), _spoken_of(result)
    layout = BlueprintInput(result, subjects, eye, bool(spoken_of), watched, lanes, hiding)
    with recording_file(f"{APPLICATION}-{uuid4().hex}", path, build_blueprint(layout)) as stream:
        stream.send_recording_name(result.session.scene.name or "Session")
        writer = RecordingWriter(stream, clock)
        _log_all(writer, result, subjects, moments)
        lane_log.log_detector_lanes(writer, "detectors", result.assembly, result.detections, spoken_of)
        for run in watched:
            log_pipeline(writer, run, result.assembly)
            log_searches(writer, run, result.assembly, result.session.scene, eye)
            log_frame(writer, run, result.assembly)
        if moments:
            _log_overview(writer, result, moments)


def _subject(result: RunResult, label: str, number: int) -> Subject:
    """Entities of the n-th audited detector: the first one's are those of the format, others have their own folder."""
    words, space, lanes, faces = "report", "world/missed", "lanes", "missed_faces"
    if number:
        words, space = entity("audit", label), entity("world", f"missed_by_{label}")
        lanes, faces = entity("audit", label, "lanes"), entity(f"missed_faces_by_{label}")
    misses, counts = by_depth(result.misses.get(label, ())), contact_counts(result, label)
    return Subject(
        label=label,
        headline=contact_words(counts, label) if counts.contacts else headline(result, label),
        lanes=lane_log.audit_lanes(lanes, result.assembly, result.comparisons[label]),
        longest=misses[0].pair if misses else None,
        words=words,
        many=len(misses) > MANY,
        missed=space,
        faces=faces,
    )


def _log_all(
    writer: RecordingWriter, result: RunResult, subjects: Sequence[Subject], moments: Mapping[FocusMoment, Eye]
) -> None:
    assembly, scene = result.assembly, result.session.scene
    # A run of effects alone needs the bodies that they name, and no other is drawn.
    named = result.summary["plan"]["bodies"] if scene.effects is not None and not result.detections else {}
    log_world(writer, assembly, scene, named or None)
    log_touches(writer, assembly, [miss for misses in result.misses.values() for miss in misses])
    first = next(iter(result.comparisons), "")  # the contacts of the oracle are coloured by its misses
    for label, detection in result.detections.items():
        against = result.comparisons.get(label if label != result.oracle else first)
        log_contacts(writer, label, assembly, detection, against, curves=label == result.oracle or not result.oracle)
    for subject in subjects:
        _log_subject(writer, result, subject, moments)
    counts = {subject.label: contact_counts(result, subject.label) for subject in subjects}
    remarks = {label: contact_words(one) if one.contacts else "" for label, one in counts.items()}
    log_timing(writer, result.detections, remarks)
    writer.markdown(TABLE, cost_text(result.detections, remarks))
    if result.tradeoff is not None:
        log_tradeoff(writer, result.tradeoff)
    log_effects(writer, result.effects)
    lane_log.log_session_lanes(writer, result)
    if result.effects or lane_log.session_lanes(result):
        log_happened(writer, result.effects, leads=not result.comparisons)
    writer.markdown("report", report_text(result))
    log_findings(writer, result)


def _log_overview(writer: RecordingWriter, result: RunResult, moments: Mapping[FocusMoment, Eye]) -> None:
    overview_log.log_overview_lanes(writer, result, worst_first(result), [*moments])
    overview_log.log_moments(writer, result, (overview_log.MOMENTS, overview_log.NOTE, overview_log.SPACE), moments)
    overview_log.log_moment_table(writer, overview_log.moment_places(writer, result, [*moments]))
    writer.markdown(overview_log.ANSWER, answer_text(result))
    pair = pair_in_focus([*moments], len(result.assembly.motion))
    for label in with_solids(result):
        log_solids(writer, result, label, pair)


def _log_subject(
    writer: RecordingWriter, result: RunResult, subject: Subject, moments: Mapping[FocusMoment, Eye]
) -> None:
    assembly, misses = result.assembly, result.misses.get(subject.label, ())
    oracle = result.detections[result.oracle]
    for path, column in subject.lanes.items():
        if column is None:
            lane_log.log_number_lane(writer, path, misses)
        else:
            lane_log.log_lane(writer, path, result.comparisons[subject.label].outcome[:, column], OUTCOMES)
            if result.noise is not None:
                states = noise_states(result.noise, result.episodes[result.oracle], column, len(assembly.motion))
                lane_log.log_lane(writer, lane_log.noise_lane(path), states, NOISES)
    log_missed_faces(writer, subject.faces, assembly, oracle, misses)
    listed, note = f"{subject.words}/missed", f"{subject.words}/nearest_miss"
    own = {one: eye for one, eye in moments.items() if one.label == subject.label and one.outcome == Outcome.MISSED}
    if own:
        overview_log.log_moments(writer, result, (listed, note, subject.missed), own)
    else:
        none = rr.TextLog.columns(text=[f"nothing missed by {subject.label}"], level=["none"], color=packed([WHITE]))
        writer.rows(listed, [0], none)
    log_cluster_list(writer, f"{subject.words}/clusters", misses, {one.number: one for one in own})


def _spoken_of(result: RunResult) -> list[int]:
    """Columns with lanes per detector: those with audit lanes, or without an audit those anyone calls contact."""
    ranked: dict[int, None] = {}
    for comparison in result.comparisons.values():
        ranked.update(dict.fromkeys(ranked_pairs(comparison, result.assembly.held)))
    for detection in result.detections.values():
        said = [counts_as_contact(column).any() for column in detection.verdict.T]
        ranked.update(dict.fromkeys(np.flatnonzero(said).tolist()))
    return list(ranked)[:DETECTOR_LANES]


def _eye(result: RunResult) -> Eye:
    """The overview: misses where there are any, else places where bodies in contact were."""
    misses = [miss for found in result.misses.values() for miss in found]
    points = _places(result, [miss.point for miss in misses])
    return overview(result.assembly, result.session.scene, points, misses[0].deepest if misses else 0)


def _places(result: RunResult, misses: Sequence[tuple[float, float, float]]) -> FloatArray:
    """World points that the overview shall hold: misses, and movable bodies at their contacts, or at events."""
    assembly, points = result.assembly, [np.array(misses, dtype=np.float64).reshape(-1, 3)]
    trusted = result.detections.get(result.oracle) or next(iter(result.detections.values()), None)
    if trusted is None:
        for _, event in happened(result.effects):
            frame = min(int(np.searchsorted(assembly.motion.times, event.time)), len(assembly.motion) - 1)
            bodies = (assembly.names.index(name) for name in event.bodies if name in assembly.names)
            points += [_boxed(result, body, np.array([frame])) for body in bodies]
        return np.concatenate(points)
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
