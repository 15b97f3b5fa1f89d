"""A tradeoff on the page: the advice, wrong contacts against time, and a row per setting."""

from collections.abc import Iterator
from typing import Final

from replay.base.shown import plural
from replay.outputs.plots import Axis, Dot, scatter
from replay.outputs.report.charts import drawn
from replay.outputs.report.markup import Part, element, listed
from replay.outputs.tradeoff_table import how_measured, tradeoff_table
from replay.pipeline.run_result import Tradeoff

CHART: Final = (960.0, 420.0)


def tradeoff_parts(done: Tradeoff) -> Iterator[Part]:
    """Advice, chart and table."""
    yield listed(done.advice)
    if done.rows:
        # Those on the front come first: they find room for their names.
        rows = sorted(done.rows, key=lambda row: not row["front"])
        dots = []
        for row in rows:
            name = f"{row['label']}: {round(row['wrong'], 1):g}"
            dots.append(Dot(name, row["mean_ms"], row["wrong"], "front" if row["front"] else ""))
        words = "Wrong contacts: missed, late or cut short, and false"
        up = Axis.of("wrong contacts; green: the front", [1.0, *(dot.y for dot in dots)], 3, zero=True)
        chart = drawn(scatter(dots, words, "mean ms a frame", up, CHART))
        yield element("figure", chart, element("figcaption", words), class_="wide-plot", tabindex=0)
    if done.cut:
        count = f"{plural(len(done.cut), 'setting')} not tried, for want of time"
        yield element("details", element("summary", count), element("p", f"{', '.join(done.cut)}."))
    yield listed((_replayed(done), *how_measured(done)))
    yield tradeoff_table("Every setting that was tried", done.rows)


def _replayed(done: Tradeoff) -> str:
    """What was replayed, and beside which detector."""
    about = done.about
    things = (("bodies", "body", "bodies"), ("pairs", "pair", "pairs"), ("contacts", "contact", "contacts"))
    numbers = ", ".join(plural(about[key], *words) for key, *words in things)
    return f"{about['session']}: {about['seconds'] / 60:.2g} min, {numbers}; reference: {about['oracle']}."
