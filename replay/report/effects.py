"""The effects of a run on the page: what ran and why, what it found, what it cost, and what was not run."""

from __future__ import annotations

from typing import Final

from replay.effect_summary import happened
from replay.report.markup import Markup, element, joined, table
from replay.run_result import RunResult

EVENT_ROWS: Final = 60
"""Events listed on the page; ``events.parquet`` holds them all."""


def effect_section(result: RunResult) -> Markup:
    """Tables of effects and events, and a line on what was left out."""
    return joined([effect_table(result), event_table(result), left_out(result)])


def effect_table(result: RunResult) -> Markup:
    """A row per effect of the plan."""
    rows = []
    for kind, told in result.summary["effects"].items():
        events = ", ".join(f"{name} {count}" for name, count in told["events"].items()) or "none"
        work = ", ".join(f"{name} {count:,}" for name, count in told["counters"].items())
        skipped = 1.0 - told["frames_run"] / max(1, told["frames"])
        rows.append(
            (
                kind, "; ".join(told["because"]), events, told["trigger"] or "always", work,
                f"{1e3 * told['seconds']:.1f}", f"{100 * told['share']:.1f}", f"{100 * skipped:.1f}",
            )
        )  # fmt: skip
    head = ("effect", "because", "events", "runs only in", "work", "ms", "% of the run", "% skipped")
    return table("Effects", head, rows, words=5)


def event_table(result: RunResult) -> Markup:
    """The first events of all effects, in order of time."""
    found = happened(result.effects)
    rows = [
        (kind, event.name, event.text, f"{event.time:.3f}", "" if event.end is None else f"{event.end:.3f}")
        for kind, event in found[:EVENT_ROWS]
    ]
    more = f", the first {EVENT_ROWS} of {len(found)}" if len(found) > EVENT_ROWS else ""
    return table(f"What the effects found{more}", ("effect", "event", "in words", "from s", "to s"), rows, words=3)


def left_out(result: RunResult) -> Markup:
    """What nobody asked for, and what this version does not compute."""
    planned = result.summary["plan"]
    lines = []
    if planned["not_run"]:
        lines.append(f"Not called for, so not imported and not run: {', '.join(planned['not_run'])}.")
    if not planned["detection"]:
        lines.append("No collision query was made.")
    if planned["not_built"]:
        lines.append(f"Declared, and not computed by this version: {', '.join(planned['not_built'])}.")
    return joined(element("p", line) for line in lines)
