"""The decision of a run: which detector to ship for this session, why, and which is next best."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from replay.auditing.loss import fraction_of
from replay.detection.recorded import RECORDED_DETECTOR
from replay.document.cost import BUDGET_MS, FRAME_TEXT, busy_text
from replay.document.placeholders import SESSION
from replay.document.ranking import Rank, any_decided, fault_text, fixed_rank
from replay.document.run_document import RunDocument

CALL_HEADING: Final = "To call it from Python:"
CALL_COMMAND: Final = "replay guide your-own-detector"

RIGHT_BY_DEFINITION: Final = "right by definition"

SHIP_COMMAND: Final = f"replay fix {SESSION} --engine unity"
"""Writes the colliders of a measured Fix for an engine."""

FIX_FILES_SENTENCE: Final = "Pieces are child colliders of their body; this writes them as GLB files:"
"""Stands before that command."""


@dataclass(frozen=True)
class Decision:
    """The detector to ship, with the reason.

    Parameters
    ----------
    text : the decision and its reason, in a sentence.
    figures : what it changes, or the next best; ``""``: nothing.
    command : of the next step; ``""``: there is none.
    details : how it was measured and what else was tried; ``""``: nothing.
    rank : the detector that it names; ``None``: this run cannot tell.
    is_fix : whether it is the measured Fix of the worst detector.
    in_code : what to ship in code of one's own, where ``text`` is about an engine; ``None``: ``text`` says it.
    """

    text: str
    figures: str = ""
    command: str = ""
    details: str = ""
    rank: Rank | None = None
    is_fix: bool = False
    in_code: "Decision | None" = None


def shipping_decision(document: RunDocument, ranks: Sequence[Rank]) -> Decision | None:
    """Return which detector to ship; ``None``: nothing was audited.

    Colliders of an engine that are worst, and better once they are cut, are decided first: an engine can ship those.
    In code of one's own the reference counts as right, so it is the one to ship wherever it runs frame by frame in the
    time of a frame, and no other is as right and faster. Else it is the detector, or the measured Fix of one, with the
    smallest loss.
    """
    if not ranks:
        return None
    reference = ranks[-1]
    in_code = _decision_in_own_code(document, ranks)
    measured_fix = _measured_fix(document, [rank for rank in ranks[:-1] if not rank.undecided])
    if (
        measured_fix is None
        or measured_fix.decision.command != SHIP_COMMAND
        or measured_fix.fixed_rank.loss >= measured_fix.rank.loss
    ):
        return in_code if reference.contacts else _another_session(document)
    engine_decision = replace(
        measured_fix.decision, text=f"In your engine, {_with_small_first_letter(measured_fix.decision.text)}"
    )
    # Without a contact nothing tells whether a detector other than the reference would miss one.
    if in_code.is_fix or not (reference.contacts or in_code.rank is reference):
        return engine_decision
    return replace(engine_decision, in_code=_in_own_code(document, in_code, reference))


@dataclass(frozen=True)
class MeasuredFix:
    """The measured Fix of the detector that the answer is about.

    Parameters
    ----------
    rank : the row of the detector.
    fixed_rank : the row of its Fix.
    decision : to ship the Fix.
    """

    rank: Rank
    fixed_rank: Rank
    decision: Decision


def _measured_fix(document: RunDocument, decided_ranks: Sequence[Rank]) -> MeasuredFix | None:
    """The measured Fix of a decided detector; ``None``: none was measured."""
    if not document.answers:
        return None
    answer = document.answers[0]
    rank, fix = next((rank for rank in decided_ranks if rank.label == answer.label), None), answer.fix
    if rank is None or fix is None or fix.figures is None:
        return None
    fixed = fixed_rank(rank, fix.figures, fix.setting, document)
    fix_decision = Decision(fix.text, fix_figures(fix.change, fix.command), fix.command, fix.notes, fixed, is_fix=True)
    return MeasuredFix(rank, fixed, fix_decision)


def fix_figures(change: str, command: str) -> str:
    """Return what a Fix changes, and what its command writes where that is files."""
    return f"{change} {FIX_FILES_SENTENCE}".lstrip() if command == SHIP_COMMAND else change


def _another_session(document: RunDocument) -> Decision:
    """The decision where no contact was compared and nothing was mended."""
    any_compared = any_decided(document)
    reason = (
        f"{document.oracle} found no contact to compare here" if any_compared else "nothing of this one was compared"
    )
    return Decision(f"Decide with another session: {reason}.")


def _in_own_code(document: RunDocument, engine_decision: Decision, reference: Rank) -> Decision:
    """A decision that follows one about an engine, with the place that it is about."""
    decision_text = _with_small_first_letter(engine_decision.text)
    if engine_decision.rank is reference:
        # There only convex Mesh Colliders meet each other, and complex collision is for static bodies: what-to-ship.md.
        engine_clause = (
            ", which Unity and Unreal do not offer" if document.detectors[reference.label].name == "exact" else ""
        )
        decision_text = f"ship {reference.label}{engine_clause}: {reference.what}, {RIGHT_BY_DEFINITION}."
    return replace(engine_decision, text=f"In your own code, {decision_text}")


def _with_small_first_letter(sentence: str) -> str:
    """The sentence as it stands behind a comma."""
    return f"{sentence[:1].lower()}{sentence[1:]}"


def _decision_in_own_code(document: RunDocument, ranks: Sequence[Rank]) -> Decision:
    """The detector to ship where code of one's own detects contacts."""
    *other_ranks, reference = ranks
    # Times of all frames at once are worse evidence than live ones, unless there are no others.
    live_ranks = [rank for rank in ranks if document.detectors[rank.label].live] or ranks
    decided_ranks = [rank for rank in other_ranks if not rank.undecided and rank in live_ranks]
    measured_fix = _measured_fix(document, decided_ranks)
    if measured_fix is not None:
        decided_ranks.append(measured_fix.fixed_rank)
    best_rank = min(decided_ranks, key=_preference_key, default=None)
    too_slow = _too_slow(document, reference) if reference in live_ranks else "did not run frame by frame"
    if too_slow:
        return _without_reference(reference, too_slow, best_rank, measured_fix)
    if (
        best_rank is not None
        and reference.contacts
        and not best_rank.loss
        and _is_faster(document, best_rank, reference)
    ):
        text = (
            f"Ship {best_rank.label}: no contact missed, none false, and faster than {reference.label}, the reference."
        )
        return _shipping(text, "", best_rank, measured_fix)
    return _shipping(_reference_text(reference), _next_best(best_rank) if reference.contacts else "", reference)


def _preference_key(rank: Rank) -> tuple[float, float, bool, float]:
    """The smallest loss first, then the fewest contacts missed, then the shortest time."""
    return rank.loss, fraction_of(rank.missed), rank.mean is None, rank.mean or 0.0


def _too_slow(document: RunDocument, reference: Rank) -> str:
    """Why the reference cannot be used live, as the end of a sentence; ``""``: it can."""
    # By the clock the slowest frames of a busy machine are those in which other programs ran.
    seconds = reference.mean if reference.p99 is None or busy_text(document) else reference.p99
    if seconds is not None and 1e3 * seconds > BUDGET_MS:
        return f"takes longer than {FRAME_TEXT}"
    return ""


def _is_faster(document: RunDocument, best_rank: Rank, reference: Rank) -> bool:
    """Whether times can be compared, and tell that a detector is faster than the reference."""
    are_times_known = best_rank.mean is not None and reference.mean is not None and not busy_text(document)
    return are_times_known and (best_rank.mean or 0.0) < (reference.mean or 0.0)


def _reference_text(reference: Rank) -> str:
    return f"Ship {reference.label}, the reference: {_why_reference(reference)}."


def _why_reference(reference: Rank) -> str:
    """Why the reference is the one to ship, as the end of a sentence."""
    has_times = reference.mean is not None or reference.p99 is not None
    return f"{RIGHT_BY_DEFINITION}, {f'within {FRAME_TEXT}' if has_times else 'its time not measured'}"


def _next_best(best_rank: Rank | None) -> str:
    if best_rank is None:
        return "No other detector of this run decided every contact frame by frame."
    if not best_rank.loss:
        return f"{best_rank.label} is as right, not known to be faster."
    return f"Next best is {best_rank.label}: {fault_text(best_rank)}."


def _without_reference(
    reference: Rank, too_slow: str, best_rank: Rank | None, measured_fix: MeasuredFix | None
) -> Decision:
    """The best detector but the reference; none decided: what to try."""
    reason = f"{reference.label}, the reference, {too_slow}"
    if best_rank is None:
        no_other_detector = "No other detector of this run decided every contact frame by frame."
        command = f"replay tradeoff {SESSION}"
        return Decision(f"Ship nothing of this run: {reason}.", f"{no_other_detector} To try other settings:", command)
    is_fix = measured_fix is not None and best_rank is measured_fix.fixed_rank
    faults = "" if is_fix else f"{best_rank.label}: {fault_text(best_rank)}."
    return _shipping(f"Ship {best_rank.label}: {reason}.", faults, best_rank, measured_fix)


def _shipping(text: str, figures: str, rank: Rank, measured_fix: MeasuredFix | None = None) -> Decision:
    """With the command that puts it to work; code of one's own, and an engine, are at work already."""
    if measured_fix is not None and rank is measured_fix.fixed_rank:
        fix_decision = measured_fix.decision
        fixed_decision = replace(
            fix_decision, text=text, figures=" ".join(filter(None, [figures, fix_decision.text, fix_decision.figures]))
        )
        if fix_decision.command:
            return fixed_decision
    else:
        fixed_decision = Decision(text, figures, rank=rank)
    if ":" in rank.what or rank.setting == RECORDED_DETECTOR:
        return fixed_decision
    return replace(fixed_decision, figures=f"{fixed_decision.figures} {CALL_HEADING}".lstrip(), command=CALL_COMMAND)
