"""How sure the figures of a run are: how many contacts they rest on, what was varied, and whether times can be read."""

from collections.abc import Sequence
from typing import Final

from replay import words
from replay.auditing.loss import fraction_of
from replay.auditing.sampling_offsets import PHASES
from replay.auditing.wilson import Proportion
from replay.document.cost import busy_text
from replay.document.ranking import Rank
from replay.document.run_document import RunDocument
from replay.words import plural

WIDE: Final = 0.5
"""Width of an interval that says too little: it spans half of 0 to 100 %."""


def certainty(document: RunDocument, ranks: Sequence[Rank]) -> list[str]:
    """Return sentences on what the figures rest on; none where nothing was audited."""
    if not ranks:
        return []
    contacts = ranks[-1].contacts
    made_up = "made-up " if "synthetic" in document.session.facts else ""
    session = f"One {made_up}session with {plural(contacts, 'contact')}"
    sentences = [f"{session}{_interval(ranks[0])}." if contacts else f"{session}."]
    every = (counts for rank in ranks for counts in (rank.missed_counts, rank.late_counts))
    ranges = [counts for counts in every if counts is not None and counts[0] != counts[1]]
    if ranges:
        sentences.append(f"{words.count_range(ranges[0])}: best to worst of {PHASES} start times of sampling.")
    return [*sentences, *filter(None, [_noise(document, ranks), busy_text(document)])]


def _interval(worst: Rank) -> str:
    """The 95 % interval of the figure that the first sentence is about; ``""``: there is none."""
    leading: Proportion | None = worst.false if worst.leads_false else worst.missed
    if leading is None:
        return ""
    what = "false contact" if worst.leads_false else "missed contacts"
    few = ", too few for a sure rate" if leading.upper - leading.lower > WIDE else ""
    value = words.as_percentage(fraction_of(leading))
    interval = words.interval(leading.lower, leading.upper)
    return f"{few}: the {value} of {what} may be {interval} (95 % interval)"


def _noise(document: RunDocument, ranks: Sequence[Rank]) -> str:
    """Whether tracker noise was tried, and how many contacts hold in it."""
    proof = document.audit[ranks[0].label].noise_proof
    if document.noise is None or proof is None:
        return "Tracker noise: not tried (--noise)."
    contacts = plural(ranks[-1].contacts, "contact")
    return f"{proof.contacts} of {contacts} hold in {plural(document.noise.copies, 'copy', 'copies')} with noise."
