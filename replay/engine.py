"""Replays a session through detectors and audits them; knows neither terminal nor file nor picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from time import perf_counter
from typing import Any, Final

import numpy as np
from msgspec import structs

from cdcore import Detection, Detector, Motion
from replay.auditing.causes import Audited
from replay.auditing.contact_counts import count_contacts
from replay.auditing.contact_depth import contact_depths
from replay.auditing.episodes import episodes
from replay.auditing.examination import examine
from replay.auditing.false_contacts import false_contacts
from replay.auditing.fault import Fault
from replay.auditing.flicker import find_flicker
from replay.auditing.holding import holdings
from replay.auditing.matching import match_episodes
from replay.auditing.noisy_contacts import in_noise
from replay.auditing.sampling_offsets import PROGRESS_STEPS, OffsetCounts, at_offset, counts_over_offsets, has_offsets
from replay.auditing.tolerance import Reference, Tolerance
from replay.detection.compile_notice import compiling_announced
from replay.detection.detector_spec import TRUSTED_DETECTOR, DetectorSpec
from replay.detection.progress import Advance, Progress, Silent
from replay.detection.run_detector import MOST_FRAMES_IN_MEMORY, Run, make_detector, run_detector
from replay.document.diagnosis import answers_of_run
from replay.document.fault_sentences import explained_faults
from replay.document.machine import give_back_memory
from replay.document.ranking import ranking
from replay.document.result_tables import result_tables, stored_table
from replay.document.run_result import RunResult
from replay.document.summary import document_of_run
from replay.effects.effect_plan import Plan, plan
from replay.effects.effects_runner import recorded_scalars, run_effects
from replay.errors import NoiseError
from replay.prepare.assemble import Pairs, assemble
from replay.prepare.assembly import Assembly
from replay.prepare.flags import Flags
from replay.prepare.holding_poses import load_window
from replay.prepare.noise import NoiseSpec, parse_noise
from replay.prepare.policy import Policy, PolicyLike, parse_policy
from replay.prepare.repair import Repair, repair_session
from replay.prepare.session_input import require_session
from replay.settings import NO_ORACLE, Lineup, RunSettings, line_up
from replay.words import plural
from sessions import Session

COMPARISON_STAGE: Final = "Comparing with the reference"
EXAMINATION_STEPS: Final = 8
"""Steps of progress for the causes of a detector's misses, for its false contacts, for the ends of contacts."""


@dataclass(frozen=True, eq=False)
class PreparedSession:
    """A session as every verb starts from it: the same poses, the same pairs.

    Parameters
    ----------
    plan : bodies, pairs and effects that the scene asks for.
    repaired : the session as the policy leaves it.
    assembly : bodies, pairs and motion of the session, as detectors need them.
    """

    plan: Plan
    repaired: Repair
    assembly: Assembly


def prepare(
    session: Session,
    *,
    pairs: Pairs | None = None,
    start: float | None = None,
    end: float | None = None,
    policy: PolicyLike | Policy | None = None,
    detecting: bool = True,
    progress: Progress | None = None,
    planned: Plan | None = None,
) -> PreparedSession:
    """Examine and repair a session by the policy, choose its pairs, and assemble it.

    ``detecting``: whether a detector will run; ``planned``: the plan of its scene, where there is one already; the
    other parameters are as for ``replay.run``.
    """
    require_session(session, path=False)
    progress = progress or Silent()
    planned = planned or plan(session.scene)
    # Bodies that the scene's effects do not name are left out, unless the caller names pairs.
    only_effects = session.scene.effects is not None and pairs is None and (planned.pairs or not detecting)
    with progress.stage("Examining the recording", 2) as advance:
        window = load_window(session, start, end)
        repaired = repair_session(window, parse_policy(policy), planned.bodies if only_effects else None)
        advance(1)
        chosen_pairs = _chosen_pairs(planned, pairs, repaired.session, detecting)
        assembly = assemble(
            repaired.session, pairs=chosen_pairs, start=start, end=end, detecting=detecting, session_scan=repaired.scan
        )
        advance(1)
    return PreparedSession(planned, repaired, assembly)


def compute(
    session: Session, settings: RunSettings | None = None, *, progress: Progress | None = None, **changes: Any
) -> RunResult:
    """Run a session in memory, like ``replay.run``; nothing is written.

    ``changes`` are fields of ``RunSettings``, in place of those of ``settings``. Raises ``ReplayError``,
    ``CollisionCoreError`` or ``SessionError``: one sentence each.
    """
    began = perf_counter()
    progress = progress or Silent()
    planned = plan(session.scene)
    settings = replace(settings or RunSettings(), **changes)
    lineup = _lineup(planned, settings, session)
    noise_spec = parse_noise(settings.noises, settings.noise_copies)
    if noise_spec and not lineup.oracle:
        raise NoiseError("noise needs detectors and a reference; name detectors, or leave out --noise")
    prepared = prepare(
        session,
        pairs=settings.pairs,
        start=settings.start,
        end=settings.end,
        policy=settings.policy,
        detecting=bool(lineup.specs),
        progress=progress,
        planned=planned,
    )
    # In a recording of hours, what one step frees is too much to be kept for the next.
    release_memory = give_back_memory if len(prepared.assembly.motion) > MOST_FRAMES_IN_MEMORY else lambda: None
    release_memory()
    detectors = _run_detectors(prepared, lineup, settings, progress)
    release_memory()
    result = _audit(prepared, lineup.oracle, detectors, progress)
    flicker = find_flicker(
        detectors.runs, result.episodes, prepared.assembly, detectors.reference, detectors.offsets, settings.seed
    )
    result = replace(result, flicker=flicker)
    if noise_spec:
        result = _with_noise(result, noise_spec, detectors.runs[lineup.oracle], settings.seed, progress)
    effects = recorded_scalars(result.session, prepared.assembly)
    if planned.effects:
        with progress.stage(f"Simulating {plural(len(planned.effects), 'effect')}"):
            detections = _detections_of_effects(planned, detectors.runs, lineup.oracle)
            effects |= run_effects(planned, result.session, prepared.assembly, detections)
    result = replace(result, effects=effects)
    document = document_of_run(
        result, detectors.runs, prepared.repaired.scan, planned, settings=settings, lineup=lineup, start_time=began
    )
    release_memory()
    ranks = ranking(document)
    tables = result_tables(result)
    document = structs.replace(
        document,
        answers=answers_of_run(result, document, ranks),
        tables={name: stored_table(name, table) for name, table in tables.items()},
    )
    return replace(result, tables=tables, document=document, ranking=ranks, answers=document.answers)


def _lineup(planned: Plan, settings: RunSettings, session: Session) -> Lineup:
    """Return the detectors to run: those of the settings, or the default ones if the plan or an oracle needs them.

    Detectors that only effects need are added, and run over the whole motion at once.
    """
    if settings.detectors is None and settings.oracle in (None, NO_ORACLE) and not planned.detection:
        return Lineup()
    lineup = line_up(settings, session)
    present = {spec.name for spec in lineup.specs} | ({TRUSTED_DETECTOR} if lineup.specs else set())
    more = [DetectorSpec(name, name) for name in planned.detectors if name not in present]
    return Lineup((*lineup.specs, *more), lineup.oracle, frozenset() if settings.offline else lineup.live)


@dataclass(frozen=True)
class DetectorRuns:
    """Answers and times of the detectors of a run.

    Parameters
    ----------
    runs : label -> answer and times, in the order of the lineup.
    reference : contacts of the oracle; ``None``: the run has no oracle.
    offsets : label of a detector of a fixed rate -> counts at each sampling offset.
    face_source : the most trusted answer, with faces, for some frames.
    """

    runs: dict[str, Run]
    reference: Reference | None
    offsets: dict[str, OffsetCounts]
    face_source: Callable[[Motion], Detection]


def _run_detectors(
    prepared: PreparedSession, lineup: Lineup, settings: RunSettings, progress: Progress
) -> DetectorRuns:
    """Run every detector; one of a fixed rate samples at the offset whose counts are typical of all offsets."""
    runs: dict[str, Run] = {}
    offsets: dict[str, OffsetCounts] = {}
    assembly, oracle = prepared.assembly, lineup.oracle
    reference, face_source = None, _face_source(assembly, settings.seed, None)
    if not lineup.specs:
        return DetectorRuns(runs, reference, offsets, face_source)
    frames = len(assembly.motion)
    # The oracle comes first: its contacts say which offset is typical.
    specs = sorted(lineup.specs, key=lambda spec: spec.label != oracle)
    fixed_rate = {spec.label for spec in specs if oracle not in ("", spec.label) and has_offsets(spec, frames)}
    stage = f"Replaying {plural(len(specs), 'detector')}"
    with (
        progress.stage(stage, (len(specs) + len(fixed_rate)) * frames) as advance,
        compiling_announced(progress),
    ):
        for spec in specs:
            live, sampled = spec.label in lineup.live, spec
            if spec.label in fixed_rate and reference is not None:
                counts = counts_over_offsets(
                    spec, assembly, reference, settings.seed, is_live=live, advance=_steps_as_frames(advance, frames)
                )
                offsets[spec.label] = counts
                sampled = at_offset(spec, counts)
            faces = spec.label in (oracle, *prepared.plan.detectors)
            run = run_detector(sampled, assembly, seed=settings.seed, faces=faces, advance=advance, live=live)
            runs[spec.label] = replace(run, spec=spec)
            if spec.label == oracle:
                face_source = _face_source(assembly, settings.seed, run)
                tolerance = Tolerance(assembly, face_source, settings.tau)
                reference = Reference.of(run.detection, assembly, prepared.repaired.session, tolerance)
    return DetectorRuns({spec.label: runs[spec.label] for spec in lineup.specs}, reference, offsets, face_source)


def _steps_as_frames(advance: Advance, frames: int) -> Advance:
    """An ``advance`` by ``STEPS`` in all that moves another by ``frames`` in all."""
    done = 0

    def step(count: int) -> None:
        nonlocal done
        before, done = done * frames // PROGRESS_STEPS, done + count
        advance(done * frames // PROGRESS_STEPS - before)

    return step


def _audit(prepared: PreparedSession, oracle: str, detectors: DetectorRuns, progress: Progress) -> RunResult:
    """Compare every detector with the oracle: contacts, misses, false contacts, causes, depths."""
    assembly, session = prepared.assembly, prepared.repaired.session
    runs, reference = detectors.runs, detectors.reference
    contacts = {
        label: reference.episodes
        if reference is not None and label == oracle
        else episodes(run.detection, assembly.motion.valid, assembly.contact_columns)
        for label, run in runs.items()
    }
    result = RunResult(
        session=session,
        assembly=assembly,
        detections={label: run.detection for label, run in runs.items()},
        oracle=oracle,
        episodes=contacts,
        repaired=prepared.repaired,
        flags=Flags.of(prepared.repaired.spans, assembly, session.scene),
        detectors={label: run.detector for label, run in runs.items()},
    )
    if reference is None:
        return replace(result, holdings=holdings(assembly, session)) if runs else result
    truth = contacts[oracle]
    audited = {label: run for label, run in runs.items() if label != oracle}
    # Misses are examined with kernels that no detector has compiled yet.
    with (
        progress.stage(COMPARISON_STAGE, 2 * EXAMINATION_STEPS * len(audited)) as advance,
        compiling_announced(progress),
    ):
        comparisons = {label: reference.compare(run.detection, (label, oracle)) for label, run in audited.items()}
        counts = {label: count_contacts(comparison, truth) for label, comparison in comparisons.items()}
        matches = {
            label: match_episodes(
                comparison, truth, contacts[label], counts[label], most_gap_frames=_reach(runs[label], runs[oracle])
            )
            for label, comparison in comparisons.items()
        }
        subjects = {
            label: Audited(assembly.motion, run.detector, run.detection, reference.detection, run.prolonged)
            for label, run in audited.items()
        }
        examined, causes = examine(comparisons, truth, subjects, runs[oracle], assembly, detectors.face_source)
        depths = contact_depths(assembly, truth, examined)
        advance(EXAMINATION_STEPS * len(comparisons))
        misses: dict[str, tuple[Fault, ...]] = {}
        false: dict[str, tuple[Fault, ...]] = {}
        for label, comparison in comparisons.items():
            subject = subjects[label]
            misses[label] = explained_faults(assembly, reference, subject, depths.misses[label])
            false[label] = explained_faults(assembly, reference, subject, false_contacts(assembly, comparison, subject))
            advance(EXAMINATION_STEPS)
    return replace(
        result,
        comparisons=comparisons,
        misses=misses,
        matches=matches,
        false=false,
        causes=causes,
        phases=detectors.offsets,
        counts=counts,
        reference=reference,
        depths=depths.contacts,
        depth_series=depths.series,
        holdings=reference.holdings,
        not_grasped=reference.contacts,
    )


def _reach(subject: Run, oracle: Run) -> int:
    """Frames between a contact and a report of it: 1 where instants are compared with the intervals they begin."""
    return int((subject.detection.covers, oracle.detection.covers) == ("instants", "intervals"))


def _with_noise(result: RunResult, spec: NoiseSpec, oracle: Run, seed: int, progress: Progress) -> RunResult:
    """Decide noisy copies of the recording again, and say of each miss whether it holds in them."""
    with progress.stage("Replaying copies with noise", len(result.assembly.motion)) as advance:
        truth = result.episodes[result.oracle]
        noise = in_noise(spec, result.assembly, result.session.scene, oracle, truth, seed, advance)
    misses = {
        label: tuple(
            replace(
                miss,
                noise=noise.labels[miss.contact - 1],
                noise_fraction=noise.contacts[miss.contact - 1].fraction,
            )
            for miss in faults
        )
        for label, faults in result.misses.items()
    }
    return replace(result, noise=noise, misses=misses)


def _chosen_pairs(planned: Plan, requested: Pairs | None, session: Session, detecting: bool) -> Pairs | None:
    """Return the pairs that the caller names and those that effects need; ``None``: all that move."""
    if session.scene.effects is None:
        return requested
    fixed = {body.id for body in session.scene.bodies if body.fixed is not None}
    present = {name for name in (*session.names, *fixed) if name in session.meshes}
    chosen_pairs = [*(requested or ()), *(pair for pair in planned.pairs or () if present.issuperset(pair))]
    return None if detecting and not chosen_pairs else chosen_pairs


def _detections_of_effects(planned: Plan, runs: dict[str, Run], oracle: str) -> dict[str, Detection]:
    """Return the detections that effects read: of the detector they name, else of the oracle, else of the first."""
    chosen = runs.get(oracle) or next(iter(runs.values()), None)
    by_name = {run.spec.name: run for run in reversed(runs.values()) if not run.spec.settings}
    by_label = {name: by_name.get(name, chosen) for name in planned.detectors}
    return {name: run.detection for name, run in by_label.items() if run is not None}


def _face_source(assembly: Assembly, seed: int, oracle: Run | None) -> Callable[[Motion], Detection]:
    """The faces of some of the motion's frames by the most trusted detector of instants, made on first use.

    An oracle of intervals, of volumes or of a lower rate says that there is contact, but not in which faces at a frame;
    one that is that detector, and listed faces, has said it.
    """
    if (
        oracle is not None
        and oracle.spec.name == TRUSTED_DETECTOR
        and not oracle.spec.settings
        and oracle.detection.face_sets
    ):
        known = oracle.detection
        return lambda motion: known.take(np.searchsorted(known.times, motion.times))

    @cache
    def trusted() -> Detector:
        return make_detector(DetectorSpec("faces", TRUSTED_DETECTOR), assembly, seed)

    return lambda motion: trusted().detect(motion, faces=True)
