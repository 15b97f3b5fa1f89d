"""Replays a session through detectors and audits them; knows neither terminal nor file nor picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Final

from cdcore import Detection
from replay.base.progress import Progress, Silent
from replay.comparison.causes import examine
from replay.comparison.compare import compare
from replay.comparison.contact_duration import ContactDurations, StepRates, contact_durations
from replay.comparison.episodes import episodes
from replay.comparison.false_contacts import FalseReporter, false_contacts
from replay.comparison.holding import holdings
from replay.comparison.look_phases import OffsetCounts, over_phases
from replay.comparison.matching import EpisodeMatches, match_episodes
from replay.comparison.noisy_contacts import in_noise
from replay.comparison.outcome import Comparison, Episode
from replay.comparison.tolerance import TAU, Tolerance
from replay.detection.compile_notice import compiling_announced
from replay.detection.detector_spec import (
    TRUSTED,
    DetectorSpec,
    SpecLike,
    SpecsLike,
    parse_detector,
    parse_detectors,
)
from replay.detection.recorded import RECORDED
from replay.detection.run_detector import Run, run_detector
from replay.effects.effect_plan import Plan, plan
from replay.effects.effects_runner import run_effects
from replay.effects.recorded import recorded
from replay.errors import DetectorSpecError, NoiseError
from replay.pipeline.diagnosis import answers
from replay.pipeline.faces import face_source, recall_of_faces
from replay.pipeline.ranking import ranking
from replay.pipeline.run_result import Measured, RunResult
from replay.pipeline.summary import summarise
from replay.prepare.assemble import AssemblyLayout, Pairs, assemble, lay_out
from replay.prepare.assembly import Assembly
from replay.prepare.flags import Flags
from replay.prepare.holding_poses import held
from replay.prepare.noise import COPIES, parse_noise
from replay.prepare.policy import KEEP, Policy, PolicyLike, parse_policy
from replay.prepare.repair import Repair, repair_session
from sessions import Session

SUBJECT: Final = "hybrid-qaco"
"""What a run audits by default: the paper's pipeline."""

NO_ORACLE: Final = "none"


@dataclass(frozen=True)
class Lineup:
    """Every detector of a run, the oracle among them, and the oracle's label or ``""``; labels to be asked ``live``."""

    specs: tuple[DetectorSpec, ...]
    oracle: str
    live: frozenset[str] = frozenset()


def line_up(detectors: SpecsLike | None, oracle: SpecLike | None) -> Lineup:
    """Settle which detectors run and which of them is the oracle.

    Parameters
    ----------
    detectors : ``None``: the usual ones; ``()``: none, effects only.
    oracle : a label among them, or another detector; ``None``: the most trusted one; ``"none"``: no audit.

    Raises ``DetectorSpecError``: words that name no detector.
    """
    specs: tuple[DetectorSpec, ...] = (DetectorSpec(SUBJECT, SUBJECT),)
    if detectors is not None:
        specs = parse_detectors(detectors)
        if not specs:
            return Lineup((), "")
    if oracle == NO_ORACLE:
        return Lineup(specs, "", frozenset(one.label for one in specs))
    trusted = parse_detector(TRUSTED if oracle is None else oracle)
    return _with_oracle(specs, trusted)


def _with_oracle(specs: tuple[DetectorSpec, ...], trusted: DetectorSpec) -> Lineup:
    for spec in specs:
        by_label = spec.label == trusted.name and not trusted.settings
        if by_label or (spec.name, dict(spec.settings)) == (trusted.name, dict(trusted.settings)):
            # Beside others it is timed as they are; alone there is nothing to compare its time with.
            return Lineup(specs, spec.label, frozenset(one.label for one in specs) if len(specs) > 1 else frozenset())
    if trusted.label in {spec.label for spec in specs}:
        raise DetectorSpecError(
            f"the oracle and a detector are both called {trusted.label!r}; write oracle=... with a label"
        )
    return Lineup((*specs, trusted), trusted.label, frozenset(one.label for one in specs))


@dataclass(frozen=True, eq=False)
class Prepared:
    """What every verb that asks detectors about a session starts from: the same poses, the same pairs.

    ``plan`` is the scene's; ``treatment`` holds the session as the policy leaves it; ``layout`` is that of
    ``assembly``.
    """

    plan: Plan
    treatment: Repair
    layout: AssemblyLayout
    assembly: Assembly


def prepared(
    session: Session, *, pairs: Pairs | None = None, start: float | None = None, end: float | None = None,
    policy: PolicyLike | Policy | None = None, looking: bool = True, progress: Progress | None = None,
) -> Prepared:  # fmt: skip
    """Examine and repair a session by the policy, choose its pairs, and assemble it.

    ``looking``: whether a detector will run; the other parameters are as for ``replay.run``.
    """
    progress, planned = progress or Silent(), plan(session.scene)
    rules = parse_policy(policy)
    # What a scene's effects do not name is not looked at, unless somebody asks for pairs, or looks about.
    alone = session.scene.effects is not None and not session.gaze and pairs is None and (planned.pairs or not looking)
    with progress.stage("examine"):
        treatment = repair_session(held(session, start, end), rules, planned.bodies if alone else None)
    with progress.stage("assemble"):
        wanted = _wanted(planned, pairs, treatment.session, looking)
        layout = lay_out(treatment.session, pairs=wanted, looking=looking, jumps=treatment.jumps)
        assembly = assemble(treatment.session, start=start, end=end, layout=layout)
    return Prepared(planned, treatment, layout, assembly)


def compute(
    session: Session, *, detectors: SpecsLike | None = None, oracle: SpecLike | None = None, pairs: Pairs | None = None,
    start: float | None = None, end: float | None = None, seed: int = 0, faces: bool = False, tau: float = TAU,
    policy: PolicyLike | Policy | None = None, offline: bool = False, noise: Sequence[str] | str = (),
    noise_copies: int = COPIES, progress: Progress | None = None, out: Path | None = None,
) -> RunResult:  # fmt: skip
    """As ``replay.run``, of a session in memory: examine and repair, assemble, detect, compare, number the misses.

    ``detectors`` and ``oracle`` are as for ``line_up``; ``None`` runs none where the scene's plan needs none. ``out``
    is only noted in the result. Raises ``ReplayError``, ``CollisionCoreError`` or ``SessionError``: one sentence each.
    """
    progress, began, planned = progress or Silent(), perf_counter(), plan(session.scene)
    lineup = _called_for(planned, detectors, oracle, reported=_reports(session), live=not offline)
    blur = parse_noise([noise] if isinstance(noise, str) else noise, noise_copies)
    if blur and not lineup.oracle:
        raise NoiseError("noise is asked of an oracle about its contacts; name detectors, or leave out the noise")
    ready = prepared(
        session, pairs=pairs, start=start, end=end, policy=policy, looking=bool(lineup.specs), progress=progress
    )
    treatment, layout, assembly, session = ready.treatment, ready.layout, ready.assembly, ready.treatment.session
    runs: dict[str, Run] = {}
    for spec in lineup.specs:
        with progress.stage(spec.label, len(assembly.motion)) as advance, compiling_announced(progress):
            runs[spec.label] = run_detector(
                spec, assembly, seed=seed, faces=spec.label in (lineup.oracle, *planned.detectors), advance=advance,
                live=spec.label in lineup.live,
            )  # fmt: skip
    # Misses are examined with other kernels; without a detection no compiler is loaded.
    with progress.stage("audit"), compiling_announced(progress if runs else None):
        found = {label: episodes(run.detection, assembly.motion.valid) for label, run in runs.items()}
        again = face_source(assembly, seed, runs.get(lineup.oracle))
        tolerance = Tolerance(assembly, again, tau)
        truth = found.get(lineup.oracle, ())
        held = holdings(assembly, session, truth) if lineup.oracle else ()
        comparisons, matches = _compared(runs, lineup.oracle, found, tolerance, held)
        dwell, phases, often = None, dict[str, OffsetCounts](), dict[str, float]()
        if lineup.oracle:
            loose, trusted = tuple(one for one in truth if one not in set(held)), runs[lineup.oracle].detection
            dwell = _durations(assembly, trusted, loose, tolerance, seed)
            phases, often = over_phases(
                {one: runs[one] for one in matches}, assembly, trusted, loose, held, tolerance, seed
            )
        missed, causes = examine(comparisons, truth, runs, assembly, again)
        false = {
            label: false_contacts(
                assembly, one, FalseReporter(runs[label].detector, runs[label].detection, runs[one.oracle].detection)
            )
            for label, one in comparisons.items()
        }
    noisy = None
    if blur:
        with progress.stage("noise", len(assembly.motion)) as advance:
            noisy = in_noise(blur, assembly, session.scene, runs[lineup.oracle], truth, seed, advance)
    recall, watched = recall_of_faces(comparisons, found, runs, assembly, progress) if faces else ({}, {})
    effects = recorded(session, assembly)
    if planned.effects:
        with progress.stage("effects"):
            believed = frozenset(kind for kind, rule in treatment.policy.rules.items() if rule.action == KEEP)
            detections = _believed(planned, runs, lineup.oracle)
            effects |= run_effects(planned, session, assembly, detections, believed)
    measured = Measured(
        session=session, assembly=assembly, detections={label: run.detection for label, run in runs.items()},
        oracle=lineup.oracle, comparisons=comparisons, episodes=found, misses=missed, matches=matches,
        face_recall=recall, false=false, causes=causes, dwell=dwell, phases=phases, at_every_frame=often, holdings=held,
        effects=effects, treatment=treatment, noise=noisy, flags=Flags.of(treatment.spans, assembly, session.scene),
        detectors={label: run.detector for label, run in runs.items()}, watched=watched,
    )  # fmt: skip
    summary = summarise(measured, runs, layout.scan, planned, window=(start, end), seed=seed, tau=tau, began=began)
    ranks = ranking(summary)
    told = answers(measured, summary, ranks)
    summary["answers"] = [answer.as_json() for answer in told]
    return RunResult(**vars(measured), summary=summary, ranking=ranks, answers=told, out=out)


def _called_for(
    planned: Plan, detectors: SpecsLike | None, oracle: SpecLike | None, *, reported: bool, live: bool
) -> Lineup:
    """The detectors to run: those asked for, else the usual ones if the plan or an oracle needs them, and the effects'.

    Unasked, what an engine ``reported`` comes first. Live are those asked for; an oracle that is not among them, and
    whom only effects ask, see the whole motion.
    """
    if detectors is None and oracle in (None, "none") and not planned.detection:
        return Lineup((), "")
    lineup = line_up(detectors, oracle)
    if detectors is None and reported and lineup.oracle not in ("", RECORDED):
        lineup = replace(lineup, specs=(DetectorSpec(RECORDED, RECORDED), *lineup.specs))
    there = {spec.name for spec in lineup.specs} | ({TRUSTED} if lineup.specs else set())
    more = [DetectorSpec(name, name) for name in planned.detectors if name not in there]
    return Lineup((*lineup.specs, *more), lineup.oracle, lineup.live if live else frozenset())


def _reports(session: Session) -> bool:
    """Whether the recording holds what an engine reported about bodies that can be looked at."""
    return any(session.meshes.keys() >= {one.body_a, one.body_b} for one in session.live_contacts)


def _wanted(planned: Plan, asked: Pairs | None, session: Session, looking: bool) -> Pairs | None:
    """The pairs asked for, and those that effects ask about; ``None``, all that move, where there are neither."""
    if session.scene.effects is None:
        return asked
    fixed = {body.id for body in session.scene.bodies if body.fixed is not None}
    there = {name for name in (*session.names, *fixed) if name in session.meshes}
    wanted = [*(asked or ()), *(pair for pair in planned.pairs or () if there.issuperset(pair))]
    return None if looking and not wanted else wanted


def _believed(planned: Plan, runs: dict[str, Run], oracle: str) -> dict[str, Detection]:
    """What effects read: of the detector their specs name, else of the oracle, else of the first."""
    chosen = runs.get(oracle) or next(iter(runs.values()), None)
    by_name = {run.spec.name: run for run in reversed(runs.values()) if not run.spec.settings}
    found = {name: by_name.get(name, chosen) for name in planned.detectors}
    return {name: run.detection for name, run in found.items() if run is not None}


def _compared(
    runs: dict[str, Run],
    oracle: str,
    found: dict[str, tuple[Episode, ...]],
    tolerance: Tolerance,
    held: tuple[Episode, ...],
) -> tuple[dict[str, Comparison], dict[str, EpisodeMatches]]:
    """By label: pair-frames held to the oracle's, and contacts matched with its own."""
    comparisons, matches = {}, {}
    for label, run in runs.items():
        if oracle and label != oracle:
            answer, truth = run.detection, runs[oracle].detection
            one = comparisons[label] = compare(answer, truth, (label, oracle), tolerance.judge(answer, truth), held)
            reach = 1 if (answer.covers, truth.covers) == ("instants", "intervals") else 0
            matches[label] = match_episodes(one, found[oracle], found[label], reach=reach)
    return comparisons, matches


def _durations(
    assembly: Assembly, oracle: Detection, contacts: tuple[Episode, ...], tolerance: Tolerance, seed: int
) -> ContactDurations:
    """How long the contacts lasted; beside an oracle of intervals a look sees what ``exact`` sees at a frame."""
    seen, between = oracle, oracle.covers == "intervals"
    if between and contacts:
        exact = DetectorSpec(TRUSTED, TRUSTED)
        seen = run_detector(exact, assembly, seed=seed, faces=False, advance=lambda _: None).detection
    rates = StepRates(seen, contacts, tolerance.judge(oracle, oracle), int(between))
    return replace(contact_durations(assembly, oracle, contacts), rates=rates)
