"""An audit as a table for a terminal: matched and unmatched counts of every detector, with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from replay.audit.gates import percent
from replay.cli.run_tables import headlines
from replay.run_result import RunResult


def answers(results: Sequence[RunResult]) -> Group:
    """The answers before any table, under the name of their session where there are several."""
    lines: list[RenderableType] = []
    for result in results:
        lines += [Text(), *([Text(f" {result.session.origin}")] if len(results) > 1 else []), *headlines(result)]
    return Group(*lines)


def audit_tables(audit: Mapping[str, Any]) -> Group:
    """Three tables, a row per detector each: pair-frames, contacts, and why contacts were missed."""
    return Group(Text(), frame_table(audit), Text(), contact_table(audit), Text(), cause_table(audit))


def frame_table(audit: Mapping[str, Any]) -> Table:
    """Pair-frames in the glossary's words."""
    names = ("both", "missed", "missed %", "invented", "within tolerance", "between frames", "left out", "faces found")
    table = _table("pair-frames: one pair of bodies in one frame, beside the oracle", *names)
    for label, figures in audit.items():
        frames = figures["pair_frames"]
        faces = figures["faces"]
        table.add_row(
            label,
            *(f"{frames[name]:,}" for name in ("BOTH", "MISSED")),
            percent(figures["missed"]),
            *(f"{frames[name]:,}" for name in ("INVENTED", "WITHIN_TOLERANCE")),
            _count(figures["between_frames"]),
            f"{frames['LEFT_OUT']:,}",
            "not asked" if faces is None else percent(faces["recall"]),
        )
    return table


def contact_table(audit: Mapping[str, Any]) -> Table:
    """Contacts matched one to one."""
    names = ("oracle", "reported", "matched", "missed", "missed %", "invented", "split", "merged")
    off = ("begin off, ms (worst)", "length off, ms (worst)")
    table = _table("contacts: from the first frame of touching to the last, matched one to one", *names, *off)
    for label, figures in audit.items():
        told = figures["episodes"]
        table.add_row(
            label,
            *(f"{told[name]:,}" for name in ("truth", "found", "matched", "missed")),
            percent(told["missed_share"]),
            *(f"{told[name]:,}" for name in ("invented", "split", "merged")),
            *(_off(told.get(name)) for name in ("onset_error", "duration_error")),
        )
    return table


def cause_table(audit: Mapping[str, Any]) -> Table:
    """The stages that lost contacts, the most frequent first."""
    table = _table("why it missed: the first stage that lost the contact, with the number of misses")
    table.add_column("cause")
    for label, figures in audit.items():
        counts = figures.get("causes", {}).get("misses", {})
        told = sorted((cause for cause in counts if counts[cause]), key=lambda cause: -counts[cause])
        table.add_row(label, ", ".join(f"{cause} {counts[cause]:,}" for cause in told) or "nothing missed")
    return table


def _table(title: str, *columns: str) -> Table:
    words = Text(title, style="bold", no_wrap=True, overflow="ignore")  # or it is folded to the width of the table
    table = Table(box=box.SIMPLE_HEAD, title=words, title_justify="left", pad_edge=False)
    table.add_column("detector", no_wrap=True)
    for name in columns:
        table.add_column(name, justify="right")
    return table


def _count(value: int | str) -> str:
    return f"{value:,}" if isinstance(value, int) else value


def _off(spread: Mapping[str, float] | None) -> str:
    """Milliseconds: the mean, and the worst."""
    if spread is None:
        return ""
    return f"{1e3 * spread['mean']:+.1f} ({1e3 * spread['most_off']:.1f})"
