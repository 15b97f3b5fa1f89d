"""The report's curve: recall against time, the advice, and a row per setting."""

from __future__ import annotations

import base64

from replay.outputs.report.markup import Markup, element, joined, page_table
from replay.outputs.tradeoff_table import HEAD, quickest_first, tradeoff_table
from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.output import title_of
from replay.tradeoffs.picture import DARK, LIGHT, Theme, picture


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
        "Milliseconds per frame are the quickest pass, then the slowest; work is counted beside the clock, and is "
        "the same everywhere."
    )
    whole = tradeoff_table("Every setting that was tried", quickest_first(done.rows)).only(*HEAD[1:])
    return joined([advice, element("figure", image), *cut, element("p", measured), page_table(whole)])


def _drawn(done: Tradeoff, theme: Theme) -> str:
    drawn = base64.b64encode(picture(done.rows, title_of(done), "svg", theme)).decode("ascii")
    return f"data:image/svg+xml;base64,{drawn}"
