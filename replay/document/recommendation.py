"""The detector of a run to use, from its ranking and its times."""

from collections.abc import Sequence

from replay.auditing.loss import fraction_of
from replay.document.cost import BUDGET_MS, busy_text
from replay.document.ranking import Rank, fault_text
from replay.document.run_document import RunDocument
from sessions.model.constants import HEADSET_HZ


def recommendation(document: RunDocument, ranks: Sequence[Rank]) -> str:
    """Return which detector to use and which is next best; ``""``: nothing was audited.

    The reference counts as right, so it is the one to use wherever it runs frame by frame in the time of a frame, and
    no other is as right and faster.
    """
    if not ranks:
        return ""
    *others, reference = ranks
    if not reference.contacts:
        return "This session cannot tell: it has no contact that was compared."
    # Times of all frames at once are worse evidence than live ones, unless there are no others.
    live = [rank for rank in ranks if document.detectors[rank.label].live] or ranks
    decided = [rank for rank in others if not rank.undecided and rank in live]
    too_slow = _too_slow(reference) if reference in live else "did not run frame by frame"
    samples = "its mean time fits" if reference.p99 is None else "99 of 100 of its samples fit"
    fits = f"it is the reference, and {samples} into a {HEADSET_HZ:g} Hz frame"
    if not decided:
        only = f"{reference.label}, the reference, {too_slow}" if too_slow else f"{reference.label}: {fits}"
        return f"{only}. No other detector of this run decided every contact frame by frame."
    best = min(decided, key=_preference)
    if too_slow:
        return f"{best.label}: {fault_text(best)}. {reference.label}, the reference, {too_slow}."
    if not best.loss:
        return f"{_quicker(document, best, reference)}: no contact of {reference.contacts} missed, none false."
    return f"{reference.label}: {fits}. Next best is {best.label}: {fault_text(best)}."


def _preference(rank: Rank) -> tuple[float, float, bool, float]:
    """The smallest loss first, then the fewest contacts missed, then the shortest time."""
    return rank.loss, fraction_of(rank.missed), rank.mean is None, rank.mean or 0.0


def _too_slow(reference: Rank) -> str:
    """Why the reference cannot be used live, as the end of a sentence; ``""``: it can."""
    seconds = reference.mean if reference.p99 is None else reference.p99
    if seconds is not None and 1e3 * seconds > BUDGET_MS:
        return f"takes longer than a {HEADSET_HZ:g} Hz frame"
    return ""


def _quicker(document: RunDocument, best: Rank, reference: Rank) -> str:
    """The quicker one of two that are equally right; both where their times cannot be compared."""
    if best.mean is None or reference.mean is None or busy_text(document):
        return f"{best.label} or {reference.label} (the reference)"
    if best.mean < reference.mean:
        return f"{best.label}, faster than {reference.label} (the reference)"
    return f"{reference.label} (the reference), as fast as {best.label} or faster"
