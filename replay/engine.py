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
from replay.auditing.flicker import find_flicker
from replay.auditing.holding import are_grasped, holdings
from replay.auditing.matching import match_episodes
from replay.auditing.noisy_contacts import in_noise
from replay.auditing.sampling_offsets import STEPS, OffsetCounts, at_offset, counts_over_offsets, has_offsets
from replay.auditing.tolerance import Reference, Tolerance
from replay.detection.compile_notice import compiling_announced
from replay.detection.detector_spec import TRUSTED, DetectorSpec
from replay.detection.progress import Advance, Progress, Silent
from replay.detection.run_detector import MOST_FRAMES_IN_MEMORY, Run, make_detector, run_detector
from replay.document.diagnosis import answers
from replay.document.fault_sentences import noise_remark, why_false, why_missed
from replay.document.machine import give_back_memory
from replay.document.ranking import ranking
from replay.document.result_tables import result_tables, stored
from replay.document.run_result import RunResult
from replay.document.summary import document_of_run
from replay.effects.effect_plan import Plan, plan
from replay.effects.effects_runner import recorded, run_effects
from replay.errors import NoiseError
from replay.prepare.assemble import Pairs, assemble
from replay.prepare.assembly import Assembly
from replay.prepare.flags import Flags
from replay.prepare.holding_poses import load_window
from replay.prepare.noise import parse_noise
from replay.prepare.policy import Policy, PolicyLike, parse_policy
from replay.prepare.repair import Repair, repair_session
from replay.prepare.session_input import require_session
from replay.settings import NO_ORACLE, Lineup, RunSettings, line_up
from replay.words import plural
from sessions import Session

COMPARING: Final = "Comparing with the reference"
EXAMINING: Final = 8
"""Steps of progress for the causes of a detector's misses, for its false contacts, for the ends of contacts."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """Plan, repaired session and assembly from which every verb starts: the same poses, the same pairs.

    ``plan`` is the scene's; ``repaired`` holds the session as the policy leaves it.
    """

    plan: Plan
    repaired: Repair
    assembly: Assembly


def prepared(
    session: Session,
    *,
    pairs: Pairs | None = None,
    start: float | None = None,
    end: float | None = None,
    policy: PolicyLike | Policy | None = None,
    looking: bool = True,
    progress: Progress | None = None,
) -> Prepared:
    """Examine and repair a session by the policy, choose its pairs, and assemble it.

    ``looking``: whether a detector will run; the other parameters are as for ``replay.run``.
    """
    require_session(session, path=False)
    progress, planned = progress or Silent(), plan(session.scene)
    rules = parse_policy(policy)
    # What a scene's effects do not name is not looked at, unless somebody asks for pairs.
    alone = session.scene.effects is not None and pairs is None and (planned.pairs or not looking)
    with progress.stage("Examining the recording", 2) as advance:
        repaired = repair_session(load_window(session, start, end), rules, planned.bodies if alone else None)
        advance(1)
        chosen_pairs = _chosen_pairs(planned, pairs, repaired.session, looking)
        assembly = assemble(
            repaired.session, pairs=chosen_pairs, start=start, end=end, looking=looking, session_scan=repaired.scan
        )
        advance(1)
    return Prepared(planned, repaired, assembly)


def compute(
    session: Session, settings: RunSettings | None = None, *, progress: Progress | None = None, **changes: Any
) -> RunResult:
    """Run a session in memory, like ``replay.run``; nothing is written.

    ``changes`` are fields of ``RunSettings``, in place of those of ``settings``. Raises ``ReplayError``,
    ``CollisionCoreError`` or ``SessionError``: one sentence each.
    """
    progress, began, planned = progress or Silent(), perf_counter(), plan(session.scene)
    settings = replace(settings or RunSettings(), **changes)
    lineup = _called_for(planned, settings, session)
    noise_spec = parse_noise(settings.noises, settings.noise_copies)
    if noise_spec and not lineup.oracle:
        raise NoiseError("noise needs detectors and a reference; name detectors, or leave out --noise")
    ready = prepared(
        session,
        pairs=settings.pairs,
        start=settings.start,
        end=settings.end,
        policy=settings.policy,
        looking=bool(lineup.specs),
        progress=progress,
    )
    # Of a recording of hours, what one step frees is too much to be kept for the next.
    release_memory = give_back_memory if len(ready.assembly.motion) > MOST_FRAMES_IN_MEMORY else lambda: None
    release_memory()
    detected = _detected(ready, lineup, settings, progress)
    release_memory()
    runs, result = detected.runs, _audited(ready, lineup.oracle, detected, progress)
    flicker = find_flicker(runs, result.episodes, ready.assembly, detected.reference, detected.offsets, settings.seed)
    result = replace(result, flicker=flicker)
    if noise_spec:
        with progress.stage("Replaying copies with noise", len(ready.assembly.motion)) as advance:
            trusted, truth = runs[lineup.oracle], result.episodes[lineup.oracle]
            noise = in_noise(noise_spec, ready.assembly, session.scene, trusted, truth, settings.seed, advance)
            misses = {
                label: tuple(
                    replace(
                        miss,
                        noise=noise.labels[miss.contact - 1],
                        noise_fraction=noise.contacts[miss.contact - 1].fraction,
                    )
                    for miss in of_detector
                )
                for label, of_detector in result.misses.items()
            }
            result = replace(result, noise=noise, misses=misses)
    effects = recorded(result.session, ready.assembly)
    if planned.effects:
        with progress.stage(f"Simulating {plural(len(planned.effects), 'effect')}"):
            believed = _believed(planned, runs, lineup.oracle)
            effects |= run_effects(planned, result.session, ready.assembly, believed)
    result = replace(result, effects=effects)
    document = document_of_run(
        result, runs, ready.repaired.scan, planned, settings=settings, lineup=lineup, began=began
    )
    release_memory()
    ranks = ranking(document)
    tables = result_tables(result)
    complete = structs.replace(
        document, answers=answers(result, document, ranks), tables={name: stored(name, tables[name]) for name in tables}
    )
    return replace(result, tables=tables, document=complete, ranking=ranks, answers=complete.answers)


def _called_for(planned: Plan, settings: RunSettings, session: Session) -> Lineup:
    """The detectors to run: those asked for, else the usual ones if the plan or an oracle needs them, and the effects'.

    Those whom only effects ask see the whole motion.
    """
    if settings.detectors is None and settings.oracle in (None, NO_ORACLE) and not planned.detection:
        return Lineup()
    lineup = line_up(settings, session)
    present = {spec.name for spec in lineup.specs} | ({TRUSTED} if lineup.specs else set())
    more = [DetectorSpec(name, name) for name in planned.detectors if name not in present]
    return Lineup((*lineup.specs, *more), lineup.oracle, frozenset() if settings.offline else lineup.live)


@dataclass(frozen=True)
class Detected:
    """Answers and times of each detector, by label, in the order of the lineup.

    ``reference``: the oracle's contacts, ``None`` without an oracle; ``offsets``: of a fixed rate the counts at each
    sampling offset; ``face_source``: the most trusted answer, with faces, for some frames.
    """

    runs: dict[str, Run]
    reference: Reference | None
    offsets: dict[str, OffsetCounts]
    face_source: Callable[[Motion], Detection]


def _detected(ready: Prepared, lineup: Lineup, settings: RunSettings, progress: Progress) -> Detected:
    """Ask every detector; one of a fixed rate samples at the offset whose counts are typical of all offsets."""
    runs: dict[str, Run] = {}
    offsets: dict[str, OffsetCounts] = {}
    assembly, oracle = ready.assembly, lineup.oracle
    frames = len(assembly.motion)
    if not lineup.specs:
        return Detected(runs, None, offsets, _face_source(assembly, settings.seed, None))
    # The oracle comes first: its contacts say which offset is typical.
    specs = sorted(lineup.specs, key=lambda spec: spec.label != oracle)
    rated = {spec.label for spec in specs if oracle not in ("", spec.label) and has_offsets(spec, frames)}
    reference, face_source = None, _face_source(assembly, settings.seed, None)
    name = f"Replaying {plural(len(specs), 'detector')}"
    with (
        progress.stage(name, (len(specs) + len(rated)) * frames) as advance,
        compiling_announced(progress),
    ):
        for spec in specs:
            live, chosen = spec.label in lineup.live, spec
            if spec.label in rated and reference is not None:
                counts = counts_over_offsets(
                    spec, assembly, reference, settings.seed, live=live, advance=_steps_as_frames(advance, frames)
                )
                offsets[spec.label] = counts
                chosen = at_offset(spec, counts)
            faces = spec.label in (oracle, *ready.plan.detectors)
            run = run_detector(chosen, assembly, seed=settings.seed, faces=faces, advance=advance, live=live)
            runs[spec.label] = replace(run, spec=spec)
            if spec.label == oracle:
                face_source = _face_source(assembly, settings.seed, run)
                tolerance = Tolerance(assembly, face_source, settings.tau)
                reference = Reference.of(run.detection, assembly, ready.repaired.session, tolerance)
    return Detected({spec.label: runs[spec.label] for spec in lineup.specs}, reference, offsets, face_source)


def _steps_as_frames(advance: Advance, frames: int) -> Advance:
    """An ``advance`` by ``STEPS`` in all that moves another by ``frames`` in all."""
    done = 0

    def step(count: int) -> None:
        nonlocal done
        before, done = done * frames // STEPS, done + count
        advance(done * frames // STEPS - before)

    return step


def _audited(ready: Prepared, oracle: str, detected: Detected, progress: Progress) -> RunResult:
    """The answers held to the oracle's: contacts, misses, false contacts, causes, sampling offsets."""
    assembly, session = ready.assembly, ready.repaired.session
    runs, reference = detected.runs, detected.reference
    by_label = {
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
        episodes=by_label,
        repaired=ready.repaired,
        flags=Flags.of(ready.repaired.spans, assembly, session.scene),
        detectors={label: run.detector for label, run in runs.items()},
    )
    if reference is None:
        return replace(result, holdings=holdings(assembly, session)) if runs else result
    audited = {label: run for label, run in runs.items() if label != oracle}
    # Misses are examined with other kernels.
    with progress.stage(COMPARING, 2 * EXAMINING * len(audited)) as advance, compiling_announced(progress):
        truth = by_label[oracle]
        comparisons = {label: reference.compare(run.detection, (label, oracle)) for label, run in audited.items()}
        counts = {label: count_contacts(comparison, truth) for label, comparison in comparisons.items()}
        matches = {
            label: match_episodes(
                # A contact at an instant still speaks for the interval that begins there.
                comparison,
                truth,
                by_label[label],
                counts[label],
                reach=int((runs[label].detection.covers, runs[oracle].detection.covers) == ("instants", "intervals")),
            )
            for label, comparison in comparisons.items()
        }
        subjects = {
            label: Audited(assembly.motion, run.detector, run.detection, reference.truth, run.prolonged)
            for label, run in audited.items()
        }
        misses, causes = examine(comparisons, truth, subjects, runs[oracle], assembly, detected.face_source)
        depths = contact_depths(assembly, truth, misses)
        misses = dict(depths.misses)
        advance(EXAMINING * len(comparisons))
        false = {}
        for label, comparison in comparisons.items():
            by, holding_episodes = subjects[label], reference.holdings
            grasped = are_grasped(
                assembly, holding_episodes, [(miss.pair, miss.first, miss.last) for miss in misses[label]]
            )
            misses[label] = tuple(
                replace(
                    miss,
                    grasped=in_hand,
                    why=why_missed(miss, label, by, truth[miss.contact - 1])
                    + noise_remark(miss.depth, at_least=miss.depth_at_least),
                )
                for miss, in_hand in zip(misses[label], grasped, strict=True)
            )
            reported = false_contacts(assembly, comparison, by)
            grasped = are_grasped(
                assembly, holding_episodes, [(contact.pair, contact.first, contact.last) for contact in reported]
            )
            false[label] = tuple(
                replace(contact, grasped=in_hand, why=why_false(contact, label, by))
                for contact, in_hand in zip(reported, grasped, strict=True)
            )
            advance(EXAMINING)
    return replace(
        result,
        comparisons=comparisons,
        misses=misses,
        matches=matches,
        false=false,
        causes=causes,
        phases=detected.offsets,
        counts=counts,
        reference=reference,
        depths=depths.contacts,
        depth_series=depths.series,
        holdings=reference.holdings,
        not_grasped=reference.contacts,
    )


def _chosen_pairs(planned: Plan, requested: Pairs | None, session: Session, looking: bool) -> Pairs | None:
    """The pairs asked for, and those that effects ask about; ``None``, all that move, where there are neither."""
    if session.scene.effects is None:
        return requested
    fixed = {body.id for body in session.scene.bodies if body.fixed is not None}
    present = {name for name in (*session.names, *fixed) if name in session.meshes}
    chosen_pairs = [*(requested or ()), *(pair for pair in planned.pairs or () if present.issuperset(pair))]
    return None if looking and not chosen_pairs else chosen_pairs


def _believed(planned: Plan, runs: dict[str, Run], oracle: str) -> dict[str, Detection]:
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
    if oracle is not None and oracle.spec.name == TRUSTED and not oracle.spec.settings and oracle.detection.face_sets:
        known = oracle.detection
        return lambda motion: known.take(np.searchsorted(known.times, motion.times))

    @cache
    def trusted() -> Detector:
        return make_detector(DetectorSpec("faces", TRUSTED), assembly, seed)

    return lambda motion: trusted().detect(motion, faces=True)
