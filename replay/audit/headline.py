"""What a detector missed, in one line: the same words in the terminal, the picture and the report."""

from __future__ import annotations

from replay.audit.misses import NEVER_FOUND
from replay.run_result import RunResult


def headline(result: RunResult, label: str) -> str:
    """Contacts of the oracle that the subject never found, and those it found only in part; fit for a title.

    Counts contacts, not numbers: a contact that was lost twice is one contact missed in part.
    """
    contacts = len(result.episodes.get(result.oracle, ()))
    if not contacts:
        return f"No contact found by {result.oracle}, so none for {label} to miss"
    misses = result.misses.get(label, ())
    touched = {miss.episode for miss in misses}
    whole = {miss.episode for miss in misses if miss.kind == NEVER_FOUND}
    part = len(touched - whole)
    things = f"{contacts} contact" + "s" * (contacts != 1)
    if not touched:
        return f"None of {things} missed by {label}"
    if not whole:
        return f"{part} of {things} missed in part by {label}"
    return f"{len(whole)} of {things} missed by {label}" + (f", {part} more in part" if part else "")
