"""The decision of a run: which detector to ship for this session, why, and which is next best."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from replay.auditing.loss import fraction_of
from replay.detection.recorded import RECORDED
from replay.document.cost import BUDGET_MS, FRAME, busy_text
from replay.document.placeholders import SESSION
from replay.document.ranking import Rank, any_decided, fault_text, fixed_rank
from replay.document.run_document import RunDocument

CALL: Final = "To call it from Python:"
CALL_COMMAND: Final = "replay guide your-own-detector"

RIGHT: Final = "right by definition"

SHIP_COMMAND: Final = f"replay fix {SESSION} --engine unity"
"""Writes the colliders of a measured Fix for an engine."""

FIX_WRITES: Final = "Pieces are child colliders of their body; this writes them as GLB files:"
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


def decision(document: RunDocument, ranks: Sequence[Rank]) -> Decision | None:
    """Return which detector to ship; ``None``: nothing was audited.

    Colliders of an engine that are worst, and better once they are cut, are decided first: an engine can ship those.
    In code of one's own the reference counts as right, so it is the one to ship wherever it runs frame by frame in the
    time of a frame, and no other is as right and faster. Else it is the detector, or the measured Fix of one, with the
    smallest loss.
    """
    if not ranks:
        return None
    reference = ranks[-1]
    in_code = _in_code(document, ranks)
    measured = _measured_fix(document, [rank for rank in ranks[:-1] if not rank.undecided])
    if measured is None or measured.decision.command != SHIP_COMMAND or measured.fixed.loss >= measured.rank.loss:
        return in_code if reference.contacts else _another_session(document)
    made = replace(measured.decision, text=f"In your engine, {_with_small_first_letter(measured.decision.text)}")
    # Without a contact nothing tells whether a detector other than the reference would miss one.
    if in_code.is_fix or not (reference.contacts or in_code.rank is reference):
        return made
    return replace(made, in_code=_in_own_code(document, in_code, reference))


@dataclass(frozen=True)
class MeasuredFix:
    """The measured Fix of the detector that the answer is about.

    Parameters
    ----------
    rank : the row of the detector.
    fixed : the row of its Fix.
    decision : to ship the Fix.
    """

    rank: Rank
    fixed: Rank
    decision: Decision


def _measured_fix(document: RunDocument, decided: Sequence[Rank]) -> MeasuredFix | None:
    """The measured Fix of a decided detector; ``None``: none was measured."""
    if not document.answers:
        return None
    answer = document.answers[0]
    rank, fix = next((rank for rank in decided if rank.label == answer.label), None), answer.fix
    if rank is None or fix is None or fix.figures is None:
        return None
    fixed = fixed_rank(rank, fix.figures, fix.setting, document)
    shipped = Decision(fix.text, fix_figures(fix.change, fix.command), fix.command, fix.notes, fixed, is_fix=True)
    return MeasuredFix(rank, fixed, shipped)


def fix_figures(change: str, command: str) -> str:
    """Return what a Fix changes, and what its command writes where that is files."""
    return f"{change} {FIX_WRITES}".lstrip() if command == SHIP_COMMAND else change


def _another_session(document: RunDocument) -> Decision:
    """The decision where no contact was compared and nothing was mended."""
    compared = any_decided(document)
    why = f"{document.oracle} found no contact to compare here" if compared else "nothing of this one was compared"
    return Decision(f"Decide with another session: {why}.")


def _in_own_code(document: RunDocument, decided: Decision, reference: Rank) -> Decision:
    """A decision that follows one about an engine, with the place that it is about."""
    text = _with_small_first_letter(decided.text)
    if decided.rank is reference:
        # There only convex Mesh Colliders meet each other, and complex collision is for static bodies: what-to-ship.md.
        place = ", which Unity and Unreal do not offer" if document.detectors[reference.label].name == "exact" else ""
        text = f"ship {reference.label}{place}: {reference.what}, {RIGHT}."
    return replace(decided, text=f"In your own code, {text}")


def _with_small_first_letter(sentence: str) -> str:
    """The sentence as it stands behind a comma."""
    return f"{sentence[:1].lower()}{sentence[1:]}"


def _in_code(document: RunDocument, ranks: Sequence[Rank]) -> Decision:
    """The detector to ship where code of one's own detects contacts."""
    *others, reference = ranks
    # Times of all frames at once are worse evidence than live ones, unless there are no others.
    live = [rank for rank in ranks if document.detectors[rank.label].live] or ranks
    decided = [rank for rank in others if not rank.undecided and rank in live]
    measured = _measured_fix(document, decided)
    if measured is not None:
        decided.append(measured.fixed)
    best = min(decided, key=_preference, default=None)
    too_slow = _too_slow(document, reference) if reference in live else "did not run frame by frame"
    if too_slow:
        return _without_reference(reference, too_slow, best, measured)
    if best is not None and reference.contacts and not best.loss and _faster(document, best, reference):
        text = f"Ship {best.label}: no contact missed, none false, and faster than {reference.label}, the reference."
        return _ship(text, "", best, measured)
    return _ship(_reference_text(reference), _next_best(best) if reference.contacts else "", reference)


def _preference(rank: Rank) -> tuple[float, float, bool, float]:
    """The smallest loss first, then the fewest contacts missed, then the shortest time."""
    return rank.loss, fraction_of(rank.missed), rank.mean is None, rank.mean or 0.0


def _too_slow(document: RunDocument, reference: Rank) -> str:
    """Why the reference cannot be used live, as the end of a sentence; ``""``: it can."""
    # By the clock the slowest frames of a busy machine are those in which other programs ran.
    seconds = reference.mean if reference.p99 is None or busy_text(document) else reference.p99
    if seconds is not None and 1e3 * seconds > BUDGET_MS:
        return f"takes longer than {FRAME}"
    return ""


def _faster(document: RunDocument, best: Rank, reference: Rank) -> bool:
    """Whether times can be compared, and tell that a detector is faster than the reference."""
    known = best.mean is not None and reference.mean is not None and not busy_text(document)
    return known and (best.mean or 0.0) < (reference.mean or 0.0)


def _reference_text(reference: Rank) -> str:
    return f"Ship {reference.label}, the reference: {_why_reference(reference)}."


def _why_reference(reference: Rank) -> str:
    """Why the reference is the one to ship, as the end of a sentence."""
    timed = reference.mean is not None or reference.p99 is not None
    return f"{RIGHT}, {f'within {FRAME}' if timed else 'its time not measured'}"


def _next_best(best: Rank | None) -> str:
    if best is None:
        return "No other detector of this run decided every contact frame by frame."
    if not best.loss:
        return f"{best.label} is as right, not known to be faster."
    return f"Next best is {best.label}: {fault_text(best)}."


def _without_reference(reference: Rank, too_slow: str, best: Rank | None, measured: MeasuredFix | None) -> Decision:
    """The best detector but the reference; none decided: what to try."""
    why = f"{reference.label}, the reference, {too_slow}"
    if best is None:
        others = "No other detector of this run decided every contact frame by frame."
        command = f"replay tradeoff {SESSION}"
        return Decision(f"Ship nothing of this run: {why}.", f"{others} To try other settings:", command)
    is_fix = measured is not None and best is measured.fixed
    faults = "" if is_fix else f"{best.label}: {fault_text(best)}."
    return _ship(f"Ship {best.label}: {why}.", faults, best, measured)


def _ship(text: str, figures: str, rank: Rank, measured: MeasuredFix | None = None) -> Decision:
    """With the command that puts it to work; code of one's own, and an engine, are at work already."""
    if measured is not None and rank is measured.fixed:
        fix = measured.decision
        made = replace(fix, text=text, figures=" ".join(filter(None, [figures, fix.text, fix.figures])))
        if fix.command:
            return made
    else:
        made = Decision(text, figures, rank=rank)
    if ":" in rank.what or rank.setting == RECORDED:
        return made
    return replace(made, figures=f"{made.figures} {CALL}".lstrip(), command=CALL_COMMAND)
