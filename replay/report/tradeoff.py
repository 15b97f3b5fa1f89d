"""The report's curve: recall against time, the advice, and a row per setting."""

from __future__ import annotations

import base64
from collections.abc import Mapping

from replay.report.markup import Markup, element, joined, table
from replay.run_result import Tradeoff
from replay.tradeoff.front import Row
from replay.tradeoff.output import title_of
from replay.tradeoff.picture import DARK, LIGHT, Theme, picture

HEAD = (
    "setting", "front", "ms per frame [slowest]", "p99 ms (over 11.1)", "s per minute", "missed, % [95 %]",
    "invented, %", "faces, %", "most of its work",
)  # fmt: skip


NOT_DONE = ("skipped", "reused", "held", "cache_hits")
"""Counters of work that was saved."""


def tradeoff_section(done: Tradeoff) -> Markup:
    """Picture, advice and table; the picture is SVG inside the page, for light pages and for dark ones."""
    dark = element("source", srcset=_drawn(done, DARK), media="(prefers-color-scheme: dark)")
    light = element("img", src=_drawn(done, LIGHT), alt=title_of(done), style="width:100%")
    image = element("picture", Markup(dark.removesuffix("</source>")), Markup(light.removesuffix("</img>")))
    advice = element("ul", *(element("li", sentence) for sentence in done.advice))
    cut = []
    if done.cut:
        count = f"{len(done.cut)} settings were not tried, for want of time"
        cut = [element("details", element("summary", count), element("p", f"{', '.join(done.cut)}."))]
    made = done.about["machine"]
    measured = (
        f"Measured on {made['system']} {made['processor']}, {made['cores']} cores, of which this process had "
        f"{min(1.0, done.about['processor_share']):.0%} of its time; compare ratios, not milliseconds. "
        "Milliseconds per frame are the quickest pass [the slowest]; work is counted beside the clock, and is the same "
        "everywhere."
    )
    rows = [_cells(row) for row in sorted(done.rows, key=lambda row: float(row["ms_per_frame"]))]
    whole = table("Every setting that was tried", HEAD, rows)
    return joined([advice, element("figure", image), *cut, element("p", measured), whole])


def _drawn(done: Tradeoff, theme: Theme) -> str:
    drawn = base64.b64encode(picture(done.rows, title_of(done), "svg", theme)).decode("ascii")
    return f"data:image/svg+xml;base64,{drawn}"


def _cells(row: Row) -> tuple[str, ...]:
    return (
        row["label"],
        "yes" if row["front"] else "live" if row["front_online"] else "",
        f"{row['ms_per_frame']:.4f} [{row['ms_high']:.4f}]",
        "" if row["p99_ms"] is None else f"{row['p99_ms']:.3f} ({100 * row['over_share']:.2f} %)",
        f"{row['seconds_per_minute']:.2f}",
        f"{100 * row['missed']:.1f} [{100 * row['missed_low']:.1f}, {100 * row['missed_high']:.1f}]",
        "" if row["precision"] is None else f"{100 * (1 - row['precision']):.1f}",
        "" if row["face_recall"] is None else f"{100 * row['face_recall']:.1f}",
        _counted(row["work"]),
    )


def _counted(work: Mapping[str, int]) -> str:
    """The largest counter of work done: the same on any machine; the table in the run folder has them all."""
    done = [(count, name) for name, count in work.items() if name not in NOT_DONE]
    count, name = max(done, default=(0, ""))
    return f"{count if count < 10_000 else f'{count // 1000:,}k'} {name.replace('_', ' ')}" if count else ""
