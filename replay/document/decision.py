"""The decision of a run: which detector to ship for this session, why, and which is next best."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from replay.auditing.loss import fraction_of
from replay.detection.recorded import RECORDED
from replay.document.answer import Fix
from replay.document.cost import BUDGET_MS, FRAME, busy_text
from replay.document.placeholders import SESSION
from replay.document.ranking import Rank, fault_text, fixed_rank
from replay.document.run_document import RunDocument

CALL: Final = "To call it from Python:"
CALL_COMMAND: Final = "replay guide your-own-detector"

SHIP_COMMAND: Final = f"replay fix {SESSION} --engine unity"
"""Writes the colliders of a measured Fix for an engine."""

Step = tuple[str, str]
"""Text and command of a Fix."""


@dataclass(frozen=True)
class Decision:
    """The detector to ship, with the reason.

    Parameters
    ----------
    text : the decision, its reason, and the next best.
    command : of the next step; ``""``: there is none.
    rank : the detector that it names; ``None``: this run cannot tell.
    is_fix : whether it is the measured Fix of the worst detector.
    in_code : what to ship in code of one's own, where ``text`` is about an engine; ``None``: ``text`` says it.
    """

    text: str
    command: str = ""
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
    if not ranks[-1].contacts:
        return Decision("Decide with another session: this one has no contact that was compared.")
    in_code = _in_code(document, ranks)
    measured = _measured_fix(document, [rank for rank in ranks[:-1] if not rank.undecided])
    if measured is None:
        return in_code
    rank, fixed, fix = measured
    if fix.command != SHIP_COMMAND or fixed.loss >= rank.loss:
        return in_code
    other = None if in_code.is_fix else replace(in_code, text=_where("In code of your own", in_code.text))
    return Decision(_where("In your engine", fix.text), fix.command, fixed, is_fix=True, in_code=other)


def _measured_fix(document: RunDocument, decided: Sequence[Rank]) -> tuple[Rank, Rank, Fix] | None:
    """The detector that the answer is about, the row of its measured Fix, and the Fix; ``None``: none was measured."""
    if not document.answers:
        return None
    answer = document.answers[0]
    rank, fix = next((rank for rank in decided if rank.label == answer.label), None), answer.fix
    if rank is None or fix is None or fix.figures is None:
        return None
    return rank, fixed_rank(rank, fix.figures, fix.setting), fix


def _where(place: str, text: str) -> str:
    """A sentence after the place it is about."""
    return f"{place}, {text[:1].lower()}{text[1:]}"


def _in_code(document: RunDocument, ranks: Sequence[Rank]) -> Decision:
    """The detector to ship where code of one's own detects contacts."""
    *others, reference = ranks
    # Times of all frames at once are worse evidence than live ones, unless there are no others.
    live = [rank for rank in ranks if document.detectors[rank.label].live] or ranks
    decided = [rank for rank in others if not rank.undecided and rank in live]
    steps: dict[str, Step] = {}
    measured = _measured_fix(document, decided)
    if measured is not None:
        _, fixed, fix = measured
        decided.append(fixed)
        steps[fixed.label] = fix.text, fix.command
    best = min(decided, key=_preference, default=None)
    too_slow = _too_slow(reference) if reference in live else "did not run frame by frame"
    if too_slow:
        return _without_reference(reference, too_slow, best, steps)
    if best is not None and not best.loss and _faster(document, best, reference):
        text = f"Ship {best.label}: no contact of {reference.contacts} missed, none false, and faster than"
        return _with_step(f"{text} {reference.label}, the reference.", best, steps)
    return _with_step(f"{_reference_text(reference)} {_next_best(best)}", reference, {})


def _preference(rank: Rank) -> tuple[float, float, bool, float]:
    """The smallest loss first, then the fewest contacts missed, then the shortest time."""
    return rank.loss, fraction_of(rank.missed), rank.mean is None, rank.mean or 0.0


def _too_slow(reference: Rank) -> str:
    """Why the reference cannot be used live, as the end of a sentence; ``""``: it can."""
    seconds = reference.mean if reference.p99 is None else reference.p99
    if seconds is not None and 1e3 * seconds > BUDGET_MS:
        return f"takes longer than {FRAME}"
    return ""


def _faster(document: RunDocument, best: Rank, reference: Rank) -> bool:
    """Whether times can be compared, and tell that a detector is faster than the reference."""
    known = best.mean is not None and reference.mean is not None and not busy_text(document)
    return known and (best.mean or 0.0) < (reference.mean or 0.0)


def _reference_text(reference: Rank) -> str:
    timed = reference.mean is not None or reference.p99 is not None
    time = f"and within {FRAME}" if timed else "its time not measured"
    return f"Ship {reference.label}, the reference: right by definition, {time}."


def _next_best(best: Rank | None) -> str:
    if best is None:
        return "No other detector of this run decided every contact frame by frame."
    if not best.loss:
        return f"{best.label} is as right, not known to be faster."
    return f"Next best is {best.label}: {fault_text(best)}."


def _without_reference(reference: Rank, too_slow: str, best: Rank | None, steps: dict[str, Step]) -> Decision:
    """The best detector but the reference; none decided: what to try."""
    why = f"{reference.label}, the reference, {too_slow}"
    if best is None:
        text = f"Ship nothing of this run: {why}, and no other detector decided every contact frame by frame."
        return Decision(f"{text} To try other settings:", f"replay tradeoff {SESSION}")
    if best.label in steps:
        text, command = steps[best.label]
        return Decision(f"Ship {best.label}, since {why}. {text}", command, best, is_fix=True)
    return _with_step(f"Ship {best.label}: {fault_text(best)}; {why}.", best, steps)


def _with_step(text: str, rank: Rank, steps: dict[str, Step]) -> Decision:
    """With the command that puts it to work; code of one's own, and an engine, are at work already."""
    change, command = steps.get(rank.label, ("", ""))
    if command:
        return Decision(f"{text} {change}", command, rank, is_fix=True)
    if ":" in rank.what or rank.setting == RECORDED:
        return Decision(text, "", rank, bool(change))
    return Decision(f"{text} {CALL}", CALL_COMMAND, rank, bool(change))
