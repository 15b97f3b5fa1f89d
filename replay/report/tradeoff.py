"""The report's curve: recall against time, the advice, and a row per setting."""

from __future__ import annotations

import base64

from replay.report.markup import Markup, element, joined, table
from replay.tradeoff.output import title_of
from replay.tradeoff.picture import picture
from replay.tradeoff.trading import Tradeoff


def tradeoff_section(done: Tradeoff) -> Markup:
    """Picture, advice and table; the picture is SVG inside the page."""
    drawn = base64.b64encode(picture(done.rows, title_of(done), "svg")).decode("ascii")
    image = element(
        "img", src=f"data:image/svg+xml;base64,{drawn}", alt=title_of(done), style="width:100%;background:#fff"
    )
    head = ("setting", "ms per frame", "p99 ms (over 11.1)", "s per minute", "missed, % [95 %]", "invented", "front")
    ordered = sorted(done.rows, key=lambda row: float(row["ms_per_frame"]))
    advice = element("ul", *(element("li", sentence) for sentence in done.advice))
    cut = [element("p", f"Not tried, for want of time: {', '.join(done.cut)}.")] if done.cut else []
    rows = [
        (
            row["label"],
            f"{row['ms_per_frame']:.4f} [{row['ms_median']:.4f}, {row['ms_high']:.4f}]",
            "" if row["p99_ms"] is None else f"{row['p99_ms']:.3f} ({100 * row['over_share']:.2f} %)",
            f"{row['seconds_per_minute']:.2f}",
            f"{100 * row['missed']:.1f} [{100 * row['missed_low']:.1f}, {100 * row['missed_high']:.1f}]",
            f"{row['invented_pair_frames']:,}",
            "yes" if row["front"] else "live" if row["front_online"] else "",
        )
        for row in ordered
    ]
    return joined([element("figure", image), advice, *cut, table("Every setting that was tried", head, rows)])
