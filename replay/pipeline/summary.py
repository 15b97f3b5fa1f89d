"""A run as figures in JSON, with all settings, seeds and versions needed to compute each of them again."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from time import perf_counter
from typing import Any, Final

import numpy as np

from cdcore import Detection, Verdict
from cdcore.detectors import DETECTORS, OPTIONAL
from cdcore.numerics import FloatArray
from replay.auditing.look_phases import OffsetCounts
from replay.auditing.outcome import counts_by_pair
from replay.base.constants import BUDGET_MS, CAVEAT, VERDICT_FRAMES
from replay.base.file_hash import file_hash
from replay.base.machine import machine, versions
from replay.base.wilson import OVER_CONTACTS
from replay.detection.detector_spec import spec_text
from replay.detection.run_detector import Run
from replay.detection.sample_times import quantiles, sampled_frames
from replay.effects.effect_plan import Plan
from replay.effects.effect_summary import effect_summary, plan_summary
from replay.pipeline.run_result import RunResult
from replay.pipeline.scores import pair_figures, score
from replay.pipeline.settings import Lineup, RunSettings
from replay.prepare.session_scan import SessionScan
from sessions import Session
from sessions.doctor.timing import typical_step
from sessions.mcap_format.metadata import NOT_STATED
from sessions.model.assumption import ASSUMPTIONS_FACT, Assumption
from sessions.scene_files.answers import recording_assumptions

SCHEMA: Final = "vrlab-replay/run/1"

REPORTED_FACTS: Final = frozenset((
    "format", "profile", "source_units", "source_convention", "handedness", "conversions", "vr_type", "headset_model",
    "scene_file", "clock", "pseudonym", "consent", "recovered", "synthetic", "seed", "noise", "jitter",
    "contacts_clock", "contacts_clock_offset_s", "contacts_clock_drift", "contacts_clock_residual_s",
))  # fmt: skip
"""Facts that leave the session file, in summary and report. Any other may lead to a person, so it is only counted."""


def summarise(
    result: RunResult, runs: Mapping[str, Run], seen: SessionScan, planned: Plan, *, settings: RunSettings,
    lineup: Lineup, began: float,
) -> dict[str, Any]:  # fmt: skip
    """Everything that was settled and counted; ``began`` is the ``perf_counter`` at which the run began."""
    return {
        "schema": SCHEMA, "caveat": CAVEAT, "intervals": OVER_CONTACTS, "session": _session(result, seen),
        "settings": settings.as_json(lineup), "window": {"start": settings.start, "end": settings.end},
        "seed": settings.seed, "tau": settings.tau,
        "pairs": [
            {
                "name": result.assembly.pair_name(p),
                "held": bool(result.assembly.held[p]),
                "containment": {k: one.containment[p] for k, one in result.detections.items() if one.containment},
                **figures,
            }
            for p, figures in enumerate(pair_figures(result))
        ],
        "oracle": result.oracle,
        "detectors": {
            label: _detector(run, len(result.episodes[label]), result.phases.get(label)) for label, run in runs.items()
        },
        "audit": {label: score(result, label) for label in result.comparisons},
        "noise": None if result.noise is None else result.noise.settings,
        **result.treatment.as_json(),
        "flagged_verdicts": {label: _flagged(result, label) for label in runs},
        "versions": versions(), "machine": machine(), "plan": plan_summary(planned),
        "effects": effect_summary(result.effects, perf_counter() - began),
    }  # fmt: skip


def _flagged(result: RunResult, label: str) -> dict[str, int]:
    """Verdicts of a detector that rest on a pose in doubt, by verdict; those without a pose rest on none."""
    detection, count = result.detections[label], np.zeros(len(Verdict), dtype=np.int64)
    for start in range(0, len(detection.verdict), VERDICT_FRAMES):
        verdict = detection.verdict[start : start + VERDICT_FRAMES]
        flag = result.flags.of_pairs(result.assembly.pairs, start, start + VERDICT_FRAMES)
        count += np.bincount(verdict[flag > 0], minlength=len(Verdict))
    return {verdict.name: int(count[verdict]) for verdict in Verdict if count[verdict] and verdict != Verdict.NO_POSE}


def _session(result: RunResult, seen: SessionScan) -> dict[str, Any]:
    assembly, session = result.assembly, result.session
    times = assembly.motion.times
    return {
        # Files are called after people: the recording is known by its content, a session by its id.
        "id": session_digest(result), "recording": recording_mark(Path(session.origin)),
        "digest": result.treatment.digest,
        "scene": session.scene.name, "frames": len(times),
        "duration": float(times[-1] - times[0]), "median_step": typical_step(times),
        "dropped_frames": {"repeated": seen.repeated, "backwards": seen.backwards},
        "first_stamp_ns": int(assembly.stamp_ns[0]), "left_out": list(assembly.left_out),
        "notes": list(assembly.notes), "facts": {k: v for k, v in session.facts.items() if k in REPORTED_FACTS},
        "facts_withheld": sum(_is_withheld(key, value) for key, value in session.facts.items()),
        "assumptions": [_assumption_figures(row) for row in recording_assumptions(session)],
        "bodies": {
            body.name: {"faces": len(body.mesh.faces), "proxy": body.name in assembly.proxies}
            for body in assembly.bodies
        },
    }  # fmt: skip


def _is_withheld(key: str, value: str) -> bool:
    return key not in REPORTED_FACTS and key != ASSUMPTIONS_FACT and value != NOT_STATED


def _assumption_figures(row: Assumption) -> dict[str, str]:
    """An assumption without the names of files, which may be those of people."""
    return {"what": row.title_by_bodies, "value": row.value, "said": row.sentence}


def session_digest(result: RunResult) -> str:
    """What tells this session from others without naming its file: 16 hex digits over every pose and the stretch."""
    stretch = result.assembly.stamp_ns[[0, -1]].tolist()
    return hashlib.sha256(f"{result.treatment.digest} {stretch}".encode()).hexdigest()[:16]


def recording_mark(file: Path) -> dict[str, Any] | None:
    """By what a recording is known again, whatever its file is called; ``None``: there is no such file."""
    if not file.is_file():
        return None
    return {"bytes": file.stat().st_size, "sha256": file_hash(file)}


def session_name(session: Session, identity: str) -> str:
    """What pages call a session: its scene, or its pseudonym, or its id; never its file, which may name a person."""
    pseudonym = session.facts.get("pseudonym", NOT_STATED)
    return session.scene.name or ("" if pseudonym == NOT_STATED else pseudonym) or f"session {identity}"


def _detector(run: Run, contacts: int, offsets: OffsetCounts | None) -> dict[str, Any]:
    detection = run.detection
    verdicts = counts_by_pair(detection.verdict, len(Verdict)).sum(axis=0)
    seconds = _seconds(run)
    if offsets is not None and offsets.every_frame is not None and offsets.every_frame.seconds is not None:
        seconds["at_every_frame"] = offsets.every_frame.seconds
    return {
        "name": run.spec.name, "asked": spec_text(run.spec.name, run.spec.settings), "settings": dict(run.settings),
        "covers": detection.covers, "online": run.detector.online, "live": run.live,
        "approximate": detection.approximate, "contacts": contacts,
        "faces_asked": run.faces,
        "verdicts": {verdict.name: int(verdicts[verdict]) for verdict in Verdict if verdicts[verdict]},
        "seconds": seconds,
        "work": {name: int(np.sum(value)) for name, value in detection.work.items()},
        "digest": detection.digest, "faces_digest": detection.faces_digest if detection.face_sets is not None else None,
    }  # fmt: skip


def _seconds(run: Run) -> dict[str, Any]:
    stages = {name: float(np.sum(value)) for name, value in run.detection.seconds.items()}
    frames = len(run.detection.times)
    longest, whole = max(stages, key=stages.__getitem__, default=""), sum(stages.values())
    share = {"stage": longest, "share": stages[longest] / whole} if whole > 0 else None
    taken = {"prepare": run.prepare, "warm_up": run.warm, "detect": run.detect, "per_frame_mean": run.detect / frames}
    rate_hz = run.settings.get("rate_hz") if run.spec.name in (*DETECTORS, *OPTIONAL) else None
    samples = sample_figures(run.detection, rate_hz)
    if run.processor_share is not None:
        taken["processor_share"] = run.processor_share
    return {**taken, "stages": stages, "longest_stage": share, **({} if samples is None else {"per_frame": samples})}


def sample_figures(detection: Detection, rate_hz: float | None) -> dict[str, Any] | None:
    """Quantiles of seconds over the samples, in all and by stage, and the share of samples over budget.

    A sample is a frame on which the detector ran, as ``sampled_frames`` says. ``None``: frames were not timed one by
    one.
    """
    total = frame_seconds(detection)
    if total is None or not len(total):
        return None
    samples = sampled_frames(detection.times, rate_hz)
    by_stage = {name: quantiles(np.asarray(value)[samples]) for name, value in detection.seconds.items()}
    over_budget = float(np.mean(total[samples] > BUDGET_MS / 1e3))
    return {**quantiles(total[samples]), "looks": int(samples.sum()), "over_budget": over_budget, "stages": by_stage}


def frame_seconds(detection: Detection) -> FloatArray | None:
    """Seconds of every frame, all stages together, (T,); ``None`` where frames were not timed one by one."""
    stages = list(detection.seconds.values())
    if not stages or not all(isinstance(stage, np.ndarray) for stage in stages):
        return None
    return np.sum(np.array(stages, dtype=np.float64), axis=0)
