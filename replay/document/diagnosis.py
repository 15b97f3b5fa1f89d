"""Why each detector of a run is wrong, what mends it, and which moment shows it: its ``Answer``."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from math import isfinite, isnan
from typing import Any, Final

from msgspec import structs

from cdcore.detectors.detector_table import detector_row, settings_of
from replay.auditing.fault import Cause, Fault, FaultKind, worst_first
from replay.auditing.loss import fraction_of, loss
from replay.auditing.outcome import Outcome
from replay.auditing.sampling_offsets import OFFSET_SETTING
from replay.auditing.wilson import proportion
from replay.detection.detector_spec import DetectorSpec, parse_detector
from replay.detection.recorded import RECORDED_DETECTOR
from replay.document.answer import Answer, Fix, FixFigures, KeyMoment
from replay.document.audit import DetectorAudit
from replay.document.before_after import Count, Errors, change_text, errors_of_rank
from replay.document.cost import busy_text
from replay.document.detector_labels import detector_label, sentence_of
from replay.document.fault_sentences import what_text, when_texts
from replay.document.placeholders import RUN, SESSION
from replay.document.ranking import Rank, fault_text
from replay.document.run_document import RunDocument
from replay.document.run_result import RunResult
from replay.prepare.frame_times import frame_rate
from replay.words import plural, rate


def answers_of_run(result: RunResult, document: RunDocument, ranks: Sequence[Rank]) -> tuple[Answer, ...]:
    """One for each audited detector, in the order of ``ranks``, the worst first."""
    answers_made = []
    for number, rank in enumerate(ranks[:-1]):
        label, fault = rank.label, _key_fault(result, rank)
        sentence = _sentence(result, document, rank, worst=number == 0 and len(ranks) > 2)
        answer = Answer(label, sentence)
        if rank.undecided:
            # Contacts that were left undecided come first in the sentence, and no fault explains them.
            answer = structs.replace(answer, why=_undecided_sentence(document.audit[label], label))
        elif fault is not None:
            measured_fix, (frame, later_ns) = _suggested_fix(result, document, ranks, rank, fault), fault.moment
            moment = KeyMoment(
                kind=fault.kind.category.value,
                number=fault.number,
                frame=frame,
                later_ns=later_ns,
                seconds=float(result.assembly.motion.times[frame]) + later_ns / 1e9,
                pair=fault.bodies,
                metres=None if isnan(fault.metres) else fault.metres,
            )
            when, other_times = when_texts(result, document, rank, fault, moment.seconds)
            answer = structs.replace(
                answer,
                why=fault.why,
                fix=measured_fix,
                moment=moment,
                what=what_text(fault),
                when=when,
                other_times=other_times,
                other_causes=_other_causes(result, rank, of_misses=fault.kind.is_miss),
            )
        answers_made.append(answer)
    return tuple(answers_made)


def _sentence(result: RunResult, document: RunDocument, rank: Rank, worst: bool) -> str:
    """Return a sentence about the faults of a detector; ``worst``: it is the worst of several."""
    contacts_cut = document.audit[rank.label].contacts_cut
    cut_sentence = f" Lost poses cut {contacts_cut} of {plural(rank.contacts, 'contact')}." if contacts_cut else ""
    if not rank.contacts and not fraction_of(rank.false):
        return _nothing_happened(result, document, rank.label) + cut_sentence
    subject = f"{sentence_of(rank.what)} ({rank.label})"
    is_recorded = rank.setting == RECORDED_DETECTOR
    is_singular = is_recorded or detector_row(document.detectors[rank.label].name).is_singular
    verb, possessive = ("is", "its") if is_singular else ("are", "their")
    if not worst:
        return f"{subject}: {fault_text(rank, possessive=possessive)}.{cut_sentence}"
    if not rank.loss:
        return f"No detector missed a contact or reported a false one.{cut_sentence}"
    return f"{subject} {verb} worst: {fault_text(rank, largest=True, possessive=possessive)}.{cut_sentence}"


def _undecided_sentence(audit: DetectorAudit, label: str) -> str:
    """Return a sentence about pair-frames that a detector left undecided, with its reasons."""
    undecided_frames = plural(audit.contact_frames_undecided, "pair-frame")
    reasons = "; ".join(audit.undecided_reasons)
    return f"{label} did not decide {undecided_frames} in contact{': ' + reasons if reasons else ''}."


def _nothing_happened(result: RunResult, document: RunDocument, label: str) -> str:
    """Why there is no contact that a detector could miss."""
    outcome = result.comparisons[label].outcome
    verdicts = document.detectors[result.oracle].verdicts
    lost_count, verdict_count = verdicts.get("no_pose", 0), sum(verdicts.values())
    if 0 < lost_count == verdict_count:
        return f"Nothing compared: each of {lost_count:,} pair-frames lacks the pose of a body."
    if (outcome == Outcome.LEFT_OUT).all():
        return f"Nothing compared: {result.oracle} and {label} decided no pair-frame of {outcome.size:,} together."
    if lost_count:
        return (
            f"No contact found, but poses are lost in {lost_count:,} of {verdict_count:,} pair-frames, where "
            f"a contact may be."
        )
    return f"No contact happened, and {label} reported none."


def _key_fault(result: RunResult, rank: Rank) -> Fault | None:
    """Return the worst fault of the most frequent cause, of the kind that weighs more in the loss."""
    misses, false_contacts = result.misses.get(rank.label, ()), result.false.get(rank.label, ())
    if (rank.leads_false and false_contacts) or not misses:
        cause = _main_cause((fault.cause, fault.frames) for fault in false_contacts)
        return next(iter(worst_first(fault for fault in false_contacts if fault.cause == cause)), None)
    never_reported = [miss for miss in misses if miss.kind is FaultKind.NEVER_REPORTED] or list(misses)
    cause = _main_cause((miss.cause, miss.frames) for miss in never_reported)
    return worst_first(miss for miss in never_reported if miss.cause == cause)[0]


def _other_causes(result: RunResult, rank: Rank, *, of_misses: bool) -> str:
    """Return why the detector has faults of the other category: the most frequent cause; ``""``: it has none."""
    misses, false_contacts = result.misses.get(rank.label, ()), result.false.get(rank.label, ())
    other_faults: Sequence[Fault] = false_contacts if of_misses else misses
    never_reported = [other for other in other_faults if other.kind is FaultKind.NEVER_REPORTED]
    other_faults = never_reported or other_faults
    if not other_faults:
        return ""
    cause = _main_cause((other.cause, other.frames) for other in other_faults)
    faults_of_cause = [other for other in other_faults if other.cause == cause]
    example = max(faults_of_cause, key=lambda other: (other.frames, -other.number))
    if len(other_faults) == 1:
        return example.why
    fault_names = (
        "false contacts"
        if not example.kind.is_miss
        else "missed contacts"
        if never_reported
        else "late or short contacts"
    )
    count_text = f"{len(faults_of_cause)} of the {len(other_faults)} {fault_names} that are listed"
    return f"{example.why} That is the cause of {count_text}."


def _main_cause(frames_of: Iterable[tuple[Cause, int]]) -> Cause | None:
    """The cause of most frames."""
    frames_by_cause: Counter[Cause] = Counter()
    for cause, frame_count in frames_of:
        frames_by_cause[cause] += frame_count
    return frames_by_cause.most_common(1)[0][0] if frames_by_cause else None


def _suggested_fix(result: RunResult, document: RunDocument, ranks: Sequence[Rank], rank: Rank, fault: Fault) -> Fix:
    """Return a setting that removes a fault: measured in this run and better, else the command that measures it."""
    spec = parse_detector(f"fix={document.detectors[rank.label].spec}")
    if spec.name == RECORDED_DETECTOR:
        command = f"replay tradeoff {SESSION} --engine unity"
        return Fix("Other settings of the engine: not measured. To measure them:", False, command)
    cause = fault.cause
    if cause in (Cause.BETWEEN_SAMPLES, Cause.LAST_ANSWER):
        every_frame = _fix_at_every_frame(result, document, rank, spec)
        if every_frame is not None:
            return every_frame
    runs = _Runs(document, ranks)
    for spec_without_cause, text in _detectors_without_cause(spec, cause):
        if runs.is_same_detector(spec_without_cause, rank.label):
            continue
        label = runs.label_of(spec_without_cause)
        if label is None:
            return _fix_not_measured(f"{sentence_of(text)}: not measured. To measure it:", spec_without_cause)
        if runs.rank_of(label).loss < rank.loss:
            return _fix_measured_in_run(sentence_of(text), rank, runs.rank_of(label), document)
    # Code of one's own is imported only where the command names it.
    detector = f"{rank.label}={spec.name}" if ":" in spec.name else rank.label
    command = f"replay shrink {RUN} --{fault.kind.category} {fault.number} --detector {detector}"
    return Fix("No cure is known. To make a small test of this fault:", False, command)


def pieces_may_help(result: RunResult, rank: Rank) -> bool:
    """Whether the larger fault of a detector comes from colliders that convex pieces can replace."""
    spec, fault = parse_detector(f"fix={rank.setting}"), _key_fault(result, rank)
    if spec.name != "collider" or spec.settings.get("shape") == "mesh" or rank.undecided:
        return False
    return fault is not None and fault.cause in COLLIDER_CAUSES


class _Runs:
    """The detectors of a run by all of their settings, and the row of each in the ranking."""

    def __init__(self, document: RunDocument, ranks: Sequence[Rank]) -> None:
        self._seed, self._detectors = document.seed, document.detectors
        self._ranks = {rank.label: rank for rank in ranks}

    def label_of(self, spec: DetectorSpec) -> str | None:
        """The audited detector, or the reference, that has just these settings, wherever its sampling starts."""
        return next((label for label in self._ranks if self.is_same_detector(spec, label)), None)

    def is_same_detector(self, spec: DetectorSpec, label: str) -> bool:
        """Whether a detector of the run is the one meant, in every setting that decides its answers."""
        run_detector = self._detectors[label]
        if (run_detector.name, run_detector.release) != (spec.name, spec.release):
            return False
        spec_settings = asdict(settings_of(spec.name, dict(spec.settings)))
        if "seed" in spec_settings:
            spec_settings["seed"] = spec.settings.get("seed", self._seed)
        return _deciding_settings(spec_settings) == _deciding_settings(run_detector.settings)

    def rank_of(self, label: str) -> Rank:
        """Its row of the ranking."""
        return self._ranks[label]


def _deciding_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """The settings that decide answers: pieces are those of a compound, and an offset belongs to the session."""
    unused_settings = (
        {OFFSET_SETTING} if settings.get("shape") == "compound" else {OFFSET_SETTING, "pieces", "method", "cut"}
    )
    return {key: value for key, value in settings.items() if key not in unused_settings}


def _fix_not_measured(change: str, spec: DetectorSpec) -> Fix:
    return Fix(change, False, f'replay run {SESSION} --detectors "{spec.text}"')


def _detectors_without_cause(spec: DetectorSpec, cause: Cause) -> Iterator[tuple[DetectorSpec, str]]:
    """Detectors without a cause, the nearest to the one that has it first, each in words; none where nobody knows."""
    table_row = detector_row(spec.name)
    setting = table_row.contact_offset
    if cause == Cause.CONTACT_OFFSET and setting and table_row.takes_no_offset:
        fixed_spec = DetectorSpec("fix", spec.name, {**spec.settings, setting: 0.0})
        yield fixed_spec, f"no contact offset ({setting}=0)"
    if cause == Cause.RELEASE_DISTANCE:
        yield replace(spec, label="fix", release=0.0), "no release distance"
    if cause == Cause.CONTAINMENT and spec.settings.get("containment") is False:
        fixed_spec = DetectorSpec("fix", spec.name, {**spec.settings, "containment": True})
        yield fixed_spec, "test whether one body is inside the other (containment=true)"
    if cause in COLLIDER_CAUSES and spec.name == "collider":
        shape = spec.settings.get("shape", "hull")
        pieces = 2 * int(spec.settings.get("pieces", FEWEST_PIECES)) if shape == "compound" else FEWEST_PIECES
        if shape != "mesh" and pieces <= MOST_PIECES:
            other_settings = {key: value for key, value in spec.settings.items() if key not in ("shape", "pieces")}
            fixed_spec = DetectorSpec("fix", "collider", {"shape": "compound", "pieces": pieces} | other_settings)
            yield fixed_spec, _setting_label(fixed_spec)
    if cause == Cause.BETWEEN_FRAMES:
        fixed_spec = DetectorSpec("fix", "continuous")
        yield fixed_spec, _setting_label(fixed_spec)
    if cause in DECIDED_BY_TRIANGLES:
        fixed_spec = DetectorSpec("fix", "exact")
        yield fixed_spec, _setting_label(fixed_spec)


MEASURED_SENTENCE: Final = "Measured on this session."

FEWEST_PIECES: Final = 16
MOST_PIECES: Final = 64
"""Convex pieces that a compound is asked for first, and at most: CoACD gives no more of a beaker."""

COLLIDER_CAUSES: Final = frozenset((Cause.COLLIDERS_MEET, Cause.HULL_FILLS_HOLLOW, Cause.COLLIDER_SHAPE))
"""Causes that a closer collider removes."""

DECIDED_BY_TRIANGLES: Final = frozenset(
    (
        Cause.BOUNDING_VOLUMES,
        Cause.COLLIDERS_MEET,
        Cause.HULL_FILLS_HOLLOW,
        Cause.CONTACT_OFFSET,
        Cause.LAST_ANSWER,
        Cause.COLLIDER_SHAPE,
        Cause.CONTAINMENT,
        Cause.SPHERE_STAGE,
        Cause.SAMPLING,
        Cause.BUDGET,
        Cause.SEARCH,
        Cause.BETWEEN_SAMPLES,
    )
)
"""Causes that testing every triangle of every frame removes."""


def _fix_at_every_frame(result: RunResult, document: RunDocument, rank: Rank, spec: DetectorSpec) -> Fix | None:
    """Sampling at every frame, which a run of a fixed rate asks beside its sampling offsets; ``None``: no better."""
    change = f"Sample every frame{_recorded_rate(result)}"
    offsets = result.phases.get(rank.label)
    every_frame_counts = None if offsets is None else offsets.every_frame
    settings = {key: value for key, value in spec.settings.items() if key not in ("rate_hz", OFFSET_SETTING)}
    spec_at_every_frame = replace(spec, settings=settings)
    if every_frame_counts is None:
        return _fix_not_measured(f"{change}: not measured. To measure it:", spec_at_every_frame)
    if (
        loss(
            proportion(every_frame_counts.contacts_missed, rank.contacts),
            every_frame_counts.missed,
            every_frame_counts.false_contact,
        )
        >= rank.loss
    ):
        return None
    missed_count, late_count = every_frame_counts.contacts_missed, every_frame_counts.late_or_cut_short
    is_idle = not busy_text(document)
    errors_after = Errors(
        contacts=rank.contacts,
        false=fraction_of(every_frame_counts.false_contact),
        missed=Count(missed_count, missed_count, missed_count),
        late=Count(late_count, late_count, late_count),
        seconds=every_frame_counts.seconds if is_idle else None,
    )
    errors_before = errors_of_rank(rank, rank.mean if is_idle else None)
    figures = FixFigures(
        what=detector_label(spec_at_every_frame.name, settings, spec_at_every_frame.release),
        missed=proportion(missed_count, rank.contacts),
        late_or_cut_short=proportion(late_count, rank.contacts),
        time_missed=every_frame_counts.missed,
        false=every_frame_counts.false_contact,
        missed_counts=(missed_count, missed_count),
        late_counts=(late_count, late_count),
        offsets=1,
        mean=every_frame_counts.seconds,
        p99=None,
    )
    return Fix(
        text=f"{change}.",
        measured=True,
        setting=spec_at_every_frame.text,
        figures=figures,
        change=f"{change_text(errors_before, errors_after)}.",
        notes=MEASURED_SENTENCE,
    )


def _recorded_rate(result: RunResult) -> str:
    """`` (90 Hz)``, the rate of the recording; ``""`` of a single frame."""
    frames_hz = frame_rate(result.assembly.motion.times)
    return f" ({rate(frames_hz)})" if isfinite(frames_hz) else ""


def _fix_measured_in_run(change_sentence: str, rank: Rank, other_rank: Rank, document: RunDocument) -> Fix:
    """With the errors of another detector of this run, or of the reference itself."""
    if other_rank.label not in document.audit:
        reference_sentence = "the reference here: it counts as right"
        return Fix(f"{change_sentence} ({other_rank.label}), {reference_sentence}.", True, detector=other_rank.label)
    is_idle = not busy_text(document)
    errors_before, errors_after = (
        errors_of_rank(rank_of_both, rank_of_both.mean if is_idle else None) for rank_of_both in (rank, other_rank)
    )
    change = f"{change_text(errors_before, errors_after)}."
    return Fix(
        f"{change_sentence} ({other_rank.label}).",
        True,
        detector=other_rank.label,
        change=change,
        notes=MEASURED_SENTENCE,
    )


def _setting_label(spec: DetectorSpec) -> str:
    """Return the label of a detector, with the most pieces that it may cut a mesh into."""
    label = detector_label(spec.name, spec.settings)
    most_prefix = "up to " if spec.settings.get("shape") == "compound" else ""
    return most_prefix + label.replace("convex pieces", "convex pieces a mesh")
