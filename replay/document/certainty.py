"""How sure the figures of a run are: how many contacts they rest on, what was varied, and whether times can be read."""

from collections.abc import Sequence
from typing import Final

from replay import words
from replay.auditing.loss import fraction_of
from replay.auditing.wilson import Proportion
from replay.document.ranking import Rank, any_decided
from replay.document.run_document import RunDocument
from replay.words import plural

WIDEST_INTERVAL: Final = 0.5
"""Width of an interval that says too little: it spans half of 0 to 100 %."""


def certainty(document: RunDocument, ranks: Sequence[Rank], fixed: Rank | None = None) -> list[str]:
    """Return sentences on what the figures rest on, the main one first; none where nothing was audited.

    ``fixed``: the row of the measured Fix that is recommended; ``None``: no Fix is.
    """
    if not ranks:
        return []
    contacts = ranks[-1].contacts
    made_up = "made-up " if "synthetic" in document.session.facts else ""
    sentences = [_interval_sentence(ranks[0]) if contacts else _without_contacts(document)]
    if fixed is not None and contacts:
        sentences.append(_fix_interval(fixed))
    sentences.append(f"One {made_up}session{'; 95 % intervals' if contacts else ''}.")
    return [*sentences, _noise_sentence(document, ranks)]


def _without_contacts(document: RunDocument) -> str:
    """How sure the figures of a session without any contact of the reference are."""
    if not any_decided(document):
        return "Not at all: nothing was compared."
    return f"Only of false contact: {document.oracle} found no contact to compare, so none could be missed."


def _interval_sentence(worst: Rank) -> str:
    """The 95 % interval of the figure that the first sentence is about, with the contacts that it rests on."""
    larger_fault: Proportion | None = worst.false if worst.leads_false else worst.missed
    assert larger_fault is not None, "an audited detector has its fractions"
    error_word = "false" if worst.leads_false else "missed"
    percentage = words.as_percentage(fraction_of(larger_fault))
    interval = words.interval(larger_fault.lower, larger_fault.upper)
    may_be = f"{percentage} {error_word} may be {interval}"
    contacts = plural(worst.contacts, "contact")
    if larger_fault.upper - larger_fault.lower > WIDEST_INTERVAL:
        return f"Not very: with {contacts}, {may_be}."
    return f"With {contacts}, {may_be}."


def _fix_interval(fixed: Rank) -> str:
    """The 95 % interval of the false contact that a Fix leaves, and the contacts on which it was measured."""
    measured = f"The fix was measured on the same {plural(fixed.contacts, 'contact')}"
    if fixed.false is None:
        return f"{measured}."
    value = words.as_percentage(fraction_of(fixed.false))
    return f"{measured}: its {value} false may be {words.interval(fixed.false.lower, fixed.false.upper)}."


def _noise_sentence(document: RunDocument, ranks: Sequence[Rank]) -> str:
    """Whether tracker noise was tried, and how many contacts hold in it."""
    noise_proof = document.audit[ranks[0].label].noise_proof
    if document.noise is None or noise_proof is None:
        return "Tracker noise: not tried (--noise)."
    contacts = plural(ranks[-1].contacts, "contact")
    return f"{noise_proof.contacts} of {contacts} hold in {plural(document.noise.copies, 'copy', 'copies')} with noise."
