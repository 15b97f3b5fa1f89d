"""One row per session and detector: what the student did, as that detector sees it, and how far to trust that."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from cdcore.numerics import IntArray
from replay.auditing.holding import Grasp, are_grasped, grasps, hand_bodies
from replay.auditing.outcome import Episode, Outcome
from replay.auditing.sampling_offsets import OFFSET_SETTING
from replay.document.columns import file_columns
from replay.document.metrics.hands import ACTIVITY_KINDS, fixed_bodies, measure_hands, span_names, task_seconds
from replay.document.metrics.near import NearMiss, close_intervals, without_contact
from replay.document.run_result import RunResult
from replay.document.summary import session_digest
from replay.document.tables import types_of
from sessions.mcap.metadata import NOT_STATED

REACH_WINDOW_S: Final = 0.5
"""A hand touching what it takes this long before or after the press means to."""

METRIC_TYPES: Final = types_of(file_columns("metrics"))
TYPES_OF_MEASURES: Final = types_of(file_columns("measured"))
"""Column -> type; a value nobody measured is null."""

SPILL_EVENT: Final = ("pour", "spill")
HAZARD_EVENT: Final = ("hazard-proximity", "near")
BREAKAGE_EVENT: Final = ("breakage", "broken")
"""Kind of an effect and the name of its events."""

NO_DETECTOR: Final = "none"
"""Stands for the detector where none ran."""

TASK_COLUMN_PREFIX: Final = "task_seconds/"
"""Followed by a task's name: a column for each task of the scene."""


@dataclass(frozen=True)
class _Grasping:
    """Hands, what they grasp, and near misses: the same for every detector of a run."""

    hands: Mapping[int, str]
    grasps: tuple[Grasp, ...] | None
    fixed_bodies: set[int]
    near_misses: tuple[NearMiss, ...]


def metric_rows(result: RunResult) -> list[dict[str, Any]]:
    """One row per detector of the run; a run of effects alone has one, with the detector ``none`` and no contacts."""
    if len(result.assembly.motion) < 2:
        return []
    grasping = _grasping_hands(result)
    session_columns = _columns_of_session(result, grasping)
    if not result.detections:
        return [{**dict.fromkeys(METRIC_TYPES), **session_columns, "detector": NO_DETECTOR}]
    return [
        {**session_columns, **_row_of_detector(result, label, grasping, session_columns["valid_minutes"])}
        for label in result.detections
    ]


def pseudonym(result: RunResult) -> str:
    """The student's pseudonym, or ``""`` where the recording states none."""
    stated_pseudonym = result.session.facts.get("pseudonym", "")
    return "" if stated_pseudonym == NOT_STATED else stated_pseudonym


def effect_metrics(result: RunResult) -> dict[str, Any]:
    """Return the metrics from effects, ``None`` where no effect measures them; breakages also as recorded."""
    last_time = float(result.assembly.motion.times[-1])
    spills, hazards, breakages = (
        _events(result, *event_name) for event_name in (SPILL_EVENT, HAZARD_EVENT, BREAKAGE_EVENT)
    )
    if breakages is None and result.session.scene.effects is None and result.session.events:
        breakages = [event for event in result.session.events if event.name == "break"]
    return {
        "breakages": None if breakages is None else len(breakages),
        "spilled_ml": None if spills is None else sum(float(episode.values["volume_ml"]) for episode in spills),
        "hazard_seconds": None
        if hazards is None
        else sum((last_time if episode.end is None else episode.end) - episode.time for episode in hazards),
    }


def _events(result: RunResult, kind: str, name: str) -> list[Any] | None:
    run = result.effects.get(kind)
    return None if run is None else [event for event in run.events if event.name == name]


def _grasping_hands(result: RunResult) -> _Grasping:
    assembly = result.assembly
    hands, fixed = hand_bodies(assembly, result.session), fixed_bodies(assembly)
    # A scene that declares effects is asked for those alone: the topic of hands is not read for a grasp nobody wants.
    needs_grasps = result.session.scene.effects is None or "grasp" in result.effects
    grasp_spans = grasps(assembly, result.session) if needs_grasps else None
    not_grasped = [
        pair
        for pair, (a, b) in enumerate(assembly.pairs.tolist())
        if not assembly.grasped[pair] and a not in fixed and b not in fixed
    ]
    near_misses = tuple(
        episode
        for episode in close_intervals(assembly, np.array(not_grasped, dtype=np.int64))
        if not is_intended(
            Episode(episode.pair, 0, 0, episode.start, episode.end), assembly.pairs, fixed, hands, grasp_spans or ()
        )
    )
    return _Grasping(hands, grasp_spans, fixed, near_misses)


def _columns_of_session(result: RunResult, grasping: _Grasping) -> dict[str, Any]:
    motion = measure_hands(result.assembly, list(grasping.hands))
    tasks = task_seconds(result.session)
    return {
        "student": pseudonym(result),
        "session": session_digest(result),
        "scene": result.session.scene.name,
        "tool": str(result.document.versions.get("vrlab-replay", "")),
        "valid_minutes": motion.valid_minutes,
        "flagged_share": motion.flagged_fraction,
        "grasp_attempts": None if grasping.grasps is None else len(grasping.grasps),
        "grasps": None if grasping.grasps is None else sum(episode.thing >= 0 for episode in grasping.grasps),
        **effect_metrics(result),
        "path_m": motion.path_m,
        "idle_share": motion.idle_fraction,
        "task_seconds": sum(tasks.values()) if tasks else None,
        **{kind: " + ".join(span_names(result.session, kind)) or None for kind in ACTIVITY_KINDS},
        **{TASK_COLUMN_PREFIX + name: seconds for name, seconds in tasks.items()},
    }


def _row_of_detector(result: RunResult, label: str, grasping: _Grasping, minutes: float) -> dict[str, Any]:
    assembly = result.assembly
    detector_episodes = result.episodes[label]
    segments = [(episode.pair, episode.first, episode.last) for episode in detector_episodes]
    grasped = are_grasped(assembly, result.holdings, segments)
    not_grasped = [episode for episode, is_grasped in zip(detector_episodes, grasped, strict=True) if not is_grasped]
    unintended = [
        episode
        for episode in not_grasped
        if not is_intended(episode, assembly.pairs, grasping.fixed_bodies, grasping.hands, grasping.grasps or ())
    ]
    spans = np.array(
        [(episode.pair, episode.start, episode.end) for episode in detector_episodes], dtype=np.float64
    ).reshape(-1, 3)
    close_spans = without_contact(grasping.near_misses, spans)
    return {
        "settings": settings_digest(result, label),
        "detector": label,
        "recall": recall(result, label),
        "contact_frames": contact_frames(result),
        "contacts_per_min": len(not_grasped) / minutes if minutes else None,
        "unintended_contacts_per_min": len(unintended) / minutes if minutes else None,
        "near_misses": len(close_spans),
    }


def is_intended(
    episode: Episode,
    pairs: IntArray,
    fixed_bodies: set[int],
    hands: Mapping[int, str],
    grasps_of_hands: Sequence[Grasp],
) -> bool:
    """Whether a contact is part of the work: on what carries things, or of a hand with what it takes."""
    a, b = pairs[episode.pair].tolist()
    if a in fixed_bodies or b in fixed_bodies:
        return True
    hand, thing = (a, b) if a in hands else (b, a)
    if hand not in hands:
        return False
    return any(
        grasp.hand == hand
        and grasp.thing in (thing, -1)
        and episode.start <= grasp.end + REACH_WINDOW_S
        and episode.end >= grasp.start - REACH_WINDOW_S
        for grasp in grasps_of_hands
    )


def recall(result: RunResult, label: str) -> float | None:
    """Share of the oracle's contact pair-frames that a detector reports; ``None``: there was none, or no oracle."""
    if label == result.oracle:
        return 1.0 if contact_frames(result) else None
    comparison = result.comparisons.get(label)
    if comparison is None:
        return None
    both_frames, missed_frames = comparison.pair_frames_of(Outcome.BOTH), comparison.pair_frames_of(Outcome.MISSED)
    return both_frames / (both_frames + missed_frames) if both_frames + missed_frames else None


def contact_frames(result: RunResult) -> int | None:
    """Pair-frames that the oracle calls contact, without those of a hand with what it holds; ``None``: no oracle."""
    return sum(contact.frames for contact in result.not_grasped) if result.oracle else None


def settings_digest(result: RunResult, label: str) -> str:
    """The first 16 hex digits over everything that decides a row but the session."""
    detector = result.document.detectors[label]
    settings = dict(detector.settings)
    if OFFSET_SETTING not in detector.spec:
        # The offset that is typical of a session belongs to the session.
        settings.pop(OFFSET_SETTING, None)
    deciding_values = {
        "name": detector.name,
        "settings": settings,
        "oracle": result.oracle,
        "versions": result.document.versions,
    }
    return hashlib.sha256(json.dumps(deciding_values, sort_keys=True, default=str).encode()).hexdigest()[:16]
