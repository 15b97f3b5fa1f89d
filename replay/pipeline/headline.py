"""Sentences about what a detector missed and how long it took, the same in terminal, picture and report."""

from __future__ import annotations

from replay.base.constants import BUDGET_MS, HEADSET_HZ
from replay.comparison.misses import NEVER_FOUND
from replay.comparison.outcome import Outcome
from replay.detection.recorded import RECORDED
from replay.pipeline.gates import figure
from replay.pipeline.run_result import RunResult


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
    """A line per detector that reports contact where there is none: one that misses nothing may invent everything."""
    lines = []
    for label, comparison in result.comparisons.items():
        wrong, right = comparison.count(Outcome.INVENTED), comparison.count(Outcome.BOTH)
        if wrong:
            share = figure(100 * wrong / (wrong + right))
            lines.append(f"{label} invents {share} % of the contact that it reports, counted in pair-frames.")
    return lines


def price(result: RunResult) -> list[str]:
    """A line with the time of the oracle and of each audited detector; no line where none is audited."""
    if not result.comparisons:
        return []
    figures = result.summary["detectors"]
    ways = {
        label: "frame by frame" if one["online"] else "the whole recording at once" for label, one in figures.items()
    }
    took = {label: f"{1e3 * one['seconds']['per_frame_mean']:.3g} ms" for label, one in figures.items()}
    trusted = result.oracle
    parts = [f"Every contact counted here was found by {trusted} in {took[trusted]} a frame, {ways[trusted]}"]
    for label in result.comparisons:
        if figures[label]["name"] != RECORDED:
            verb = " took" if len(parts) == 1 else ""
            way = "" if ways[label] == ways[trusted] else f", {ways[label]}"
            parts.append(f"{label}{verb} {took[label]}{way}")
    return [f"{'; '.join(parts)}. At {HEADSET_HZ:g} Hz a frame lasts {BUDGET_MS:.1f} ms."]
