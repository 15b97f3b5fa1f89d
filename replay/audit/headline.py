"""What a detector missed, and what each took, in one line each: the same words in terminal, picture and report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from replay.audit.gates import figure
from replay.audit.misses import NEVER_FOUND
from replay.audit.outcome import Outcome
from replay.run_result import RunResult

RECORDED: Final = "recorded"
"""The detector that reads what an engine reported: it takes no time that would mean anything."""


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


def invented(result: RunResult) -> list[str]:
    """A line per detector that reports contact where there is none: who misses nothing may invent everything."""
    lines = []
    for label, comparison in result.comparisons.items():
        wrong, right = comparison.count(Outcome.INVENTED), comparison.count(Outcome.BOTH)
        if wrong:
            share = figure(100 * wrong / (wrong + right))
            lines.append(f"{label} invents {share} % of the contact that it reports, counted in pair-frames.")
    return lines


def price(result: RunResult) -> list[str]:
    """What the oracle took to find every contact counted, beside what was audited; no line where nobody is."""
    if not result.comparisons:
        return []
    told = result.summary["detectors"]
    how = _how(told[result.oracle])
    least = (
        f"Every contact counted here was found by {result.oracle} in {_per_frame(told[result.oracle])} a frame, {how}"
    )
    others: list[str] = []
    for label in result.comparisons:
        if told[label]["name"] != RECORDED:
            other = _how(told[label])
            took = "" if others else " took"
            others.append(f"{label}{took} {_per_frame(told[label])}" + ("" if other == how else f", {other}"))
    return ["; ".join([least, *others]) + ". At 90 Hz a frame lasts 11.1 ms."]


def _how(told: Mapping[str, Any]) -> str:
    return "frame by frame" if told["online"] else "the whole recording at once"


def _per_frame(told: Mapping[str, Any]) -> str:
    return f"{1e3 * told['seconds']['per_frame_mean']:.3g} ms"
