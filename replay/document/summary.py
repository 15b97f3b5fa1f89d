"""A run as a document, with all settings, seeds and versions needed to compute each of them again."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from time import perf_counter
from typing import Final

import msgspec
import numpy as np
from msgspec import structs

from cdcore import Detection, Verdict
from cdcore.detectors.detector_table import TABLE
from cdcore.numerics import FloatArray
from replay.auditing.compare import VERDICT_FRAMES
from replay.auditing.outcome import counts_by_pair
from replay.auditing.sampling_offsets import OffsetCounts
from replay.auditing.wilson import INTERVALS_CAPTION
from replay.detection.run_detector import Run
from replay.detection.sample_times import sample_quantiles, sampled_frames
from replay.document.cost import BUDGET_MS
from replay.document.detector import DetectorRecord, DetectorTimes, LongestStage, Quantiles, SampleTimes
from replay.document.file_hash import file_hash
from replay.document.machine import machine, versions
from replay.document.run_document import RunDocument
from replay.document.run_result import RunResult
from replay.document.scores import audit_of_detector, pair_records
from replay.document.session import (
    AssumptionRecord,
    BodyRecord,
    DroppedFrames,
    EffectRecord,
    FindingRecord,
    FlaggedPoses,
    NoiseRecord,
    PlanRecord,
    RecordingMark,
    SessionRecord,
    SettingsRecord,
    Window,
)
from replay.effects.effect_plan import Plan
from replay.effects.effect_summary import effect_summary, plan_summary
from replay.prepare.session_scan import SessionScan
from replay.settings import Lineup, RunSettings
from sessions import Session
from sessions.doctor.timing import typical_step
from sessions.mcap.metadata import NOT_STATED
from sessions.model.assumption import ASSUMPTIONS_FACT
from sessions.scene_files.answers import recording_assumptions

CAVEAT: Final = (
    "This is about the recorded poses and these meshes; tracker noise (VIVE: 0.14-0.77 mm frame to frame) is larger "
    "than most margins."
)
"""Stands below every result that is read by people."""

REPORTED_FACTS: Final = frozenset(
    (
        "format",
        "profile",
        "source_units",
        "source_convention",
        "handedness",
        "conversions",
        "vr_type",
        "headset_model",
        "scene_file",
        "clock",
        "pseudonym",
        "consent",
        "recovered",
        "synthetic",
        "seed",
        "noise",
        "jitter",
        "contacts_clock",
        "contacts_clock_offset_s",
        "contacts_clock_drift",
        "contacts_clock_residual_s",
    )
)
"""Facts that leave the session file, in summary and report. Any other may lead to a person, so it is only counted."""


def document_of_run(
    result: RunResult,
    runs: Mapping[str, Run],
    scan: SessionScan,
    planned: Plan,
    *,
    settings: RunSettings,
    lineup: Lineup,
    start_time: float,
) -> RunDocument:
    """Return everything that was settled and counted, without the answers; ``start_time`` is a ``perf_counter``."""
    repair = result.repaired
    return RunDocument(
        caveat=CAVEAT,
        intervals=INTERVALS_CAPTION,
        session=_session(result, scan),
        settings=msgspec.convert(settings.as_json(lineup), SettingsRecord),
        window=Window(start=settings.start, end=settings.end),
        seed=settings.seed,
        tau=settings.tau,
        pairs=pair_records(result),
        oracle=result.oracle,
        detectors={
            label: structs.replace(
                _detector(run, len(result.episodes[label]), result.phases.get(label)), flicker=result.flicker.get(label)
            )
            for label, run in runs.items()
        },
        audit={label: audit_of_detector(result, label) for label in result.comparisons},
        noise=None if result.noise is None else msgspec.convert(result.noise.settings, NoiseRecord),
        policy=repair.policy.as_json(),
        findings=tuple(msgspec.convert(finding.as_json(), FindingRecord) for finding in repair.findings),
        flagged=tuple(msgspec.convert(vars(span), FlaggedPoses) for span in repair.spans),
        flagged_verdicts={label: _verdicts_in_doubt(result, label) for label in runs},
        versions=versions(),
        machine=machine(),
        plan=msgspec.convert(plan_summary(planned), PlanRecord),
        effects=msgspec.convert(effect_summary(result.effects, perf_counter() - start_time), dict[str, EffectRecord]),
        answers=(),
    )


def _verdicts_in_doubt(result: RunResult, label: str) -> dict[str, int]:
    """Verdicts of a detector that rest on a pose in doubt, by verdict; those without a pose rest on none."""
    detection, verdict_counts = result.detections[label], np.zeros(len(Verdict), dtype=np.int64)
    for start in range(0, len(detection.verdict), VERDICT_FRAMES):
        verdict = detection.verdict[start : start + VERDICT_FRAMES]
        is_flagged = result.flags.of_pairs(result.assembly.pairs, start, start + VERDICT_FRAMES)
        verdict_counts += np.bincount(verdict[is_flagged > 0], minlength=len(Verdict))
    verdict_counts[Verdict.NO_POSE] = 0
    return {verdict.name.lower(): int(verdict_counts[verdict]) for verdict in Verdict if verdict_counts[verdict]}


def _session(result: RunResult, scan: SessionScan) -> SessionRecord:
    assembly, session = result.assembly, result.session
    times = assembly.motion.times
    return SessionRecord(
        # Files are called after people: the recording is known by its content, a session by its id.
        id=session_digest(result),
        recording=recording_mark(Path(session.origin)),
        digest=result.repaired.digest,
        scene=session.scene.name,
        frames=len(times),
        duration=float(times[-1] - times[0]),
        median_step=typical_step(times),
        dropped_frames=DroppedFrames(repeated=scan.repeated, backwards=scan.backwards),
        first_stamp_ns=int(assembly.stamp_ns[0]),
        left_out=tuple(assembly.left_out),
        notes=tuple(assembly.notes),
        facts={name: value for name, value in session.facts.items() if name in REPORTED_FACTS},
        facts_withheld=sum(_is_withheld(name, value) for name, value in session.facts.items()),
        # Without the names of files, which may be those of people.
        assumptions=tuple(
            AssumptionRecord(subject=row.title_by_bodies, value=row.value, sentence=row.sentence)
            for row in recording_assumptions(session)
        ),
        bodies={
            body.name: BodyRecord(faces=len(body.mesh.faces), proxy=body.name in assembly.proxies)
            for body in assembly.bodies
        },
    )


def _is_withheld(key: str, value: str) -> bool:
    return key not in REPORTED_FACTS and key != ASSUMPTIONS_FACT and value != NOT_STATED


def session_digest(result: RunResult) -> str:
    """Return the id of a session, which does not name its file: 16 hex digits over every pose and the stretch."""
    end_stamps = result.assembly.stamp_ns[[0, -1]].tolist()
    return hashlib.sha256(f"{result.repaired.digest} {end_stamps}".encode()).hexdigest()[:16]


def recording_mark(session_file: Path) -> RecordingMark | None:
    """By what a recording is known again, whatever its file is called; ``None``: there is no such file."""
    if not session_file.is_file():
        return None
    return RecordingMark(bytes=session_file.stat().st_size, sha256=file_hash(session_file))


def session_name(session: Session, identity: str) -> str:
    """Return the name of a session on pages: scene, pseudonym or id; never its file, which may name a person."""
    pseudonym = session.facts.get("pseudonym", NOT_STATED)
    return session.scene.name or ("" if pseudonym == NOT_STATED else pseudonym) or f"session {identity}"


def _detector(run: Run, contacts: int, offsets: OffsetCounts | None) -> DetectorRecord:
    detection = run.detection
    verdicts = counts_by_pair(detection.verdict, len(Verdict)).sum(axis=0)
    return DetectorRecord(
        name=run.spec.name,
        spec=run.spec.text,
        settings=dict(run.settings),
        covers=detection.covers,
        online=run.detector.online,
        live=run.live,
        approximate=detection.approximate,
        contacts=contacts,
        faces_queried=run.faces,
        verdicts={verdict.name.lower(): int(verdicts[verdict]) for verdict in Verdict if verdicts[verdict]},
        seconds=_seconds(run, offsets),
        work={name: int(np.sum(value)) for name, value in detection.work.items()},
        digest=detection.digest,
        faces_digest=detection.faces_digest if detection.face_sets is not None else None,
        release=run.spec.release,
    )


def _seconds(run: Run, offsets: OffsetCounts | None) -> DetectorTimes:
    stages = {name: float(np.sum(value)) for name, value in run.detection.seconds.items()}
    rate_hz = run.settings.get("rate_hz") if run.spec.name in TABLE else None
    every_frame = None if offsets is None else offsets.every_frame
    return DetectorTimes(
        prepare=run.prepare,
        warm_up=run.warm,
        detect=run.detect,
        per_frame_mean=run.seconds_per_frame,
        processor_fraction=run.processor_fraction,
        stages=stages,
        longest_stage=_longest_stage(stages),
        sample_times=sample_times(run.detection, rate_hz),
        at_every_frame=None if every_frame is None else every_frame.seconds,
    )


def _longest_stage(stages: Mapping[str, float]) -> LongestStage | None:
    """The stage that takes most of the seconds; ``None`` where none takes any."""
    seconds_of_stages = sum(stages.values())
    if seconds_of_stages <= 0:
        return None
    longest = max(stages, key=stages.__getitem__)
    return LongestStage(stage=longest, fraction=stages[longest] / seconds_of_stages)


def sample_times(detection: Detection, rate_hz: float | None) -> SampleTimes | None:
    """Quantiles of seconds over the samples, in all and by stage, and the fraction of samples over budget.

    A sample is a frame on which the detector ran, as ``sampled_frames`` says. ``None``: frames were not timed one by
    one.
    """
    total = frame_seconds(detection)
    if total is None or not len(total):
        return None
    samples = sampled_frames(detection.times, rate_hz)
    of_all = _quantiles(total[samples])
    return SampleTimes(
        median=of_all.median,
        p95=of_all.p95,
        p99=of_all.p99,
        max=of_all.max,
        samples=int(samples.sum()),
        over_budget=float(np.mean(total[samples] > BUDGET_MS / 1e3)),
        stages={name: _quantiles(np.asarray(value)[samples]) for name, value in detection.seconds.items()},
    )


def _quantiles(seconds: FloatArray) -> Quantiles:
    return msgspec.convert(sample_quantiles(seconds), Quantiles)


def frame_seconds(detection: Detection) -> FloatArray | None:
    """Seconds of every frame, all stages together, (T,); ``None`` where frames were not timed one by one."""
    stages = list(detection.seconds.values())
    if not stages or not all(isinstance(stage, np.ndarray) for stage in stages):
        return None
    return np.sum(np.array(stages, dtype=np.float64), axis=0)
