"""Why each detector of a run is wrong, what mends it, and which moment shows it: its ``Answer``."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from replay.base.shown import plural
from replay.comparison.causes import Cause
from replay.comparison.false_contacts import HELD, HOLLOW, SOLIDS, VOLUMES, FalseContact
from replay.comparison.loss import Share, fraction_of
from replay.comparison.misses import NEVER_FOUND, by_depth
from replay.comparison.outcome import Miss, Outcome
from replay.detection.detector_spec import DetectorSpec, parse_detector, spec_text
from replay.detection.recorded import RECORDED
from replay.pipeline.answer import RUN, SESSION, Answer, Fix, KeyMoment
from replay.pipeline.ranking import Rank, counts_over_offsets, fault_words, lost_words
from replay.pipeline.run_result import RunResult
from replay.pipeline.sentences import detector_words, sentence_of
from replay.words import frame_time, rate, share
from sessions.doctor.timing import typical_step


def answers(result: RunResult, summary: Mapping[str, Any], ranks: Sequence[Rank]) -> tuple[Answer, ...]:
    """One for each audited detector, in the order of ``ranks``, the worst first."""
    found = []
    for number, rank in enumerate(ranks[:-1]):
        label, fault = rank.label, _key_fault(result, rank)
        sentence = _sentence(result, summary, rank, worst=number == 0 and len(ranks) > 2)
        answer = Answer(label, sentence)
        if fault is not None:
            fix, moment = _fix(result, summary, rank, fault), _moment(result, fault)
            answer = replace(answer, why=fault.why, fix=fix, moment=moment)
        found.append(answer)
    return tuple(found)


def _sentence(result: RunResult, summary: Mapping[str, Any], rank: Rank, worst: bool) -> str:
    """What is wrong with a detector; ``worst``: it is the worst of several."""
    cut = summary["audit"][rank.label].get("contacts_cut", 0)
    more = f" Lost poses cut {cut} of {plural(rank.contacts, 'contact')}." if cut else ""
    if not rank.contacts and not fraction_of(rank.false):
        return _nothing_happened(result, summary, rank.label) + more
    who, code = f"{sentence_of(rank.what)} ({rank.label})", ":" in rank.what
    whose = "its" if code else "their"
    if not worst:
        return f"{who}: {fault_words(rank, whose=whose)}.{more}"
    if not rank.loss:
        return f"No detector missed a contact or reported a false one.{more}"
    verb = "is" if code or rank.setting == RECORDED else "are"
    return f"{who} {verb} worst: {fault_words(rank, largest=True, whose=whose)}.{more}"


def _nothing_happened(result: RunResult, summary: Mapping[str, Any], label: str) -> str:
    """Why there is no contact that a detector could miss."""
    outcome = result.comparisons[label].outcome
    if (outcome == Outcome.LEFT_OUT).all():
        return f"Nothing compared: {result.oracle} and {label} both decided none of {outcome.size:,} pair-frames."
    verdicts = summary["detectors"][result.oracle].get("verdicts", {})
    lost, every = verdicts.get("NO_POSE", 0), sum(verdicts.values())
    if lost:
        return f"No contact found, but poses are lost in {lost:,} of {every:,} pair-frames, where a contact may be."
    return f"No contact happened, so none for {label} to miss, and it reported none."


def _key_fault(result: RunResult, rank: Rank) -> Miss | FalseContact | None:
    """Of the larger fault of a detector, of its most frequent cause, the longest: the most to look at."""
    misses, false = result.misses.get(rank.label, ()), result.false.get(rank.label, ())
    if (rank.leads_false and false) or not misses:
        cause = _main_cause(false)
        alike = [fault for fault in false if fault.cause == cause]
        return max(alike, key=lambda fault: (fault.frames, -fault.number), default=None)
    never = [miss for miss in misses if miss.kind == NEVER_FOUND] or list(misses)
    cause = _main_cause(never)
    return by_depth(miss for miss in never if miss.cause == cause)[0]


def _main_cause(faults: Sequence[Miss | FalseContact]) -> str:
    """The cause of most frames."""
    frames: Counter[str] = Counter()
    for fault in faults:
        frames[fault.cause] += fault.frames
    return frames.most_common(1)[0][0] if frames else ""


def _moment(result: RunResult, fault: Miss | FalseContact) -> KeyMoment:
    pair, times = (fault.body_a, fault.body_b), result.assembly.motion.times
    if isinstance(fault, FalseContact):
        gap = fault.gap if fault.gap == fault.gap else None
        return KeyMoment("false", fault.number, fault.widest, 0, float(times[fault.widest]), pair, gap)
    frame, later = fault.shown
    return KeyMoment("miss", fault.number, frame, later, float(times[frame]) + later / 1e9, pair, fault.cut_length)


def _fix(result: RunResult, summary: Mapping[str, Any], rank: Rank, fault: Miss | FalseContact) -> Fix | None:
    """What mends a fault: figures where this run holds them, else the command that measures it."""
    figures = summary["detectors"][rank.label]
    spec = parse_detector(f"fix={figures.get('asked', figures['name'])}")
    if spec.name == RECORDED:
        command = f"replay tradeoff {SESSION} --engine unity"
        return Fix("Other settings of the engine: not measured. To measure them:", False, command)
    cause = str(fault.cause)
    if cause in (Cause.BETWEEN_LOOKS, HELD):
        return _at_every_frame(result, rank, spec)
    mended = _mended(spec, cause)
    if mended is None:
        kind = "miss" if isinstance(fault, Miss) else "false"
        # Code of one's own is imported only where the command names it.
        detector = f"{rank.label}={spec.name}" if ":" in spec.name else rank.label
        command = f"replay shrink {RUN} --{kind} {fault.number} --detector {detector}"
        return Fix("Not known. A small test of this fault is made by", False, command)
    words = sentence_of(_words(mended))
    for label, other in summary["detectors"].items():
        if other["name"] == mended.name and _alike(mended, other["settings"]):
            return _measured(words, label, summary)
    needs = ", with the extra engines" if mended.settings.get("shape") == "compound" else ""
    return _unmeasured(f"{words}: not measured. To measure it{needs}:", mended)


def _unmeasured(words: str, spec: DetectorSpec) -> Fix:
    return Fix(words, False, f'replay run {SESSION} --detectors "{spec_text(spec.name, spec.settings)}"')


def _mended(spec: DetectorSpec, cause: str) -> DetectorSpec | None:
    """The detector without a cause; ``None``: nobody knows."""
    if cause in (SOLIDS, HOLLOW, Cause.COLLIDER_SHAPE) and spec.name == "collider":
        rest = {key: value for key, value in spec.settings.items() if key not in ("shape", "pieces")}
        pieces = 2 * int(spec.settings.get("pieces", 16)) if spec.settings.get("shape") == "compound" else 16
        return DetectorSpec("fix", "collider", {"shape": "compound", "pieces": pieces} | rest)
    if cause == Cause.BETWEEN_FRAMES:
        return DetectorSpec("fix", "continuous")
    if cause in DECIDED_BY_TRIANGLES:
        return DetectorSpec("fix", "exact")
    return None


DECIDED_BY_TRIANGLES: Final = frozenset((
    VOLUMES, SOLIDS, HOLLOW, Cause.COLLIDER_SHAPE, Cause.SPHERE_STAGE, Cause.SAMPLING, Cause.BUDGET, Cause.SEARCH,
))  # fmt: skip
"""Causes that testing every triangle removes."""


def _at_every_frame(result: RunResult, rank: Rank, spec: DetectorSpec) -> Fix:
    """Sampling at every frame, which a run of a fixed rate asks beside its sampling offsets."""
    words = f"Sample every frame{_recorded_rate(result)}"
    offsets = result.phases.get(rank.label)
    every = None if offsets is None else offsets.every_frame
    if every is None:
        settings = {key: value for key, value in spec.settings.items() if key != "rate_hz"}
        return _unmeasured(f"{words}: not measured. To measure it:", DetectorSpec("fix", spec.name, settings))
    missed, late = (every.contacts_missed,) * 2, (every.contacts_in_part,) * 2
    took = "" if every.seconds is None else f"; {frame_time(every.seconds)} a frame"
    told = figures_words(lost_words(missed, late, rank.contacts), every.invented)
    return Fix(f"{words}: {told}{took} (measured on this session).", True)


def _recorded_rate(result: RunResult) -> str:
    """`` (90 Hz)``, the usual rate of the recording; ``""`` of a single frame."""
    step = typical_step(result.assembly.motion.times)
    return f" ({rate(1.0 / step)})" if step else ""


def _measured(words: str, label: str, summary: Mapping[str, Any]) -> Fix:
    """With the figures of another detector of this run, or of the reference itself."""
    figures, audit = summary["detectors"][label], summary["audit"].get(label)
    took = f"{frame_time(figures['seconds']['per_frame_mean'])} a frame"
    if audit is None:
        return Fix(f"{words} ({label}), the reference here: {took} (measured on this session).", True)
    missed, late = (counts_over_offsets(audit, name) for name in ("contacts_missed", "contacts_in_part"))
    told = figures_words(lost_words(missed, late, audit["contacts"]), audit.get("phases", audit)["invented"])
    return Fix(f"{words} ({label}): {told}; {took} (measured on this session).", True)


def figures_words(lost: str, false: Share) -> str:
    """``none missed, 3 % false``: what a setting gets wrong, both kinds."""
    return f"{lost or 'none missed or late'}, {share(fraction_of(false))} false"


def _alike(spec: DetectorSpec, settings: Mapping[str, Any]) -> bool:
    """Whether a detector of the run is the one meant; of a compound with any number of pieces."""
    wanted = {"rate_hz": None, **spec.settings}
    return all(settings.get(key) == value for key, value in wanted.items() if key != "pieces")


def _words(spec: DetectorSpec) -> str:
    words = detector_words(spec.name, spec.settings)
    return words.replace("convex pieces", "convex pieces a mesh")
