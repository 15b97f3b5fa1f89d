"""An audit as a table for a terminal: matched and unmatched counts of every detector, with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from replay.audit.gates import percent
from replay.cli.run_tables import headlines
from replay.report.audit_parts import FRAME_ROWS
from replay.run_result import RunResult

CONTACT_ROWS: Final = {
    "truth": "the oracle's", "found": "reported", "matched": "matched", "missed": "missed", "invented": "invented",
    "split": "split", "merged": "merged",
}  # fmt: skip
"""Figure -> its word."""


def answers(results: Sequence[RunResult]) -> Group:
    """The answers before any table, under the name of their session where there are several."""
    lines: list[RenderableType] = []
    for result in results:
        lines += [Text(), *([Text(f" {result.session.origin}")] if len(results) > 1 else []), *headlines(result)]
    return Group(*lines)


def audit_tables(audit: Mapping[str, Any]) -> Group:
    """Three tables: pair-frames and contacts with a column per detector, and why contacts were missed."""
    return Group(Text(), frame_table(audit), Text(), contact_table(audit), Text(), cause_table(audit))


def frame_table(audit: Mapping[str, Any]) -> Table:
    """Pair-frames in the glossary's words, a column per detector: so they fit beside each other in any terminal."""
    table = _table("pair-frames: one pair of bodies in one frame, beside the oracle", *audit)
    for word, name in FRAME_ROWS.items():
        table.add_row(word, *(f"{told['pair_frames'][name]:,}" for told in audit.values()))
    table.add_row("missed, of those in contact", *(percent(told["missed"]) for told in audit.values()))
    table.add_row("between frames", *(_count(told["between_frames"]) for told in audit.values()))
    faces = [told["faces"] for told in audit.values()]
    table.add_row("faces found", *("not asked" if one is None else percent(one["recall"]) for one in faces))
    return table


def contact_table(audit: Mapping[str, Any]) -> Table:
    """Contacts matched one to one, a column per detector."""
    table = _table("contacts: from the first frame of touching to the last, matched one to one", *audit)
    found = [told["episodes"] for told in audit.values()]
    for name, word in CONTACT_ROWS.items():
        table.add_row(word, *(f"{one[name]:,}" for one in found))
    table.add_row("missed, of the oracle's", *(percent(one["missed_share"]) for one in found))
    table.add_row("begin off, ms (worst)", *(_off(one.get("onset_error")) for one in found))
    table.add_row("length off, ms (worst)", *(_off(one.get("duration_error")) for one in found))
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


def _table(title: str, *detectors: str) -> Table:
    words = Text(title, style="bold", no_wrap=True, overflow="ignore")  # or it is folded to the width of the table
    table = Table(box=box.SIMPLE_HEAD, title=words, title_justify="left", pad_edge=False)
    table.add_column("" if detectors else "detector", no_wrap=True)
    for label in detectors:
        table.add_column(label, justify="right", overflow="fold")
    return table


def _count(value: int | str) -> str:
    return f"{value:,}" if isinstance(value, int) else value


def _off(spread: Mapping[str, float] | None) -> str:
    """Milliseconds: the mean, and the worst."""
    if spread is None:
        return ""
    return f"{1e3 * spread['mean']:+.1f} ({1e3 * spread['most_off']:.1f})"
