"""A tradeoff on the page: the advice, wrong contacts against time, and a row per setting."""

from typing import Any, Final

from replay.base.shown import plural
from replay.outputs.plots import Axis, Dot, Plot, scatter
from replay.outputs.tradeoff_table import how_measured, tradeoff_table
from replay.pipeline.run_result import Tradeoff

CHART: Final = (960.0, 420.0)


def tradeoff_values(done: Tradeoff) -> dict[str, Any]:
    """What ``tradeoff.html`` shows."""
    return {
        "advice": done.advice, "chart": _chart(done) if done.rows else None, "cut": done.cut,
        "measured": (_replayed(done), *how_measured(done)),
        "table": tradeoff_table("Every setting that was tried", done.rows),
    }  # fmt: skip


def _chart(done: Tradeoff) -> Plot:
    # Those on the front come first: they find room for their names.
    rows = sorted(done.rows, key=lambda row: not row["front"])
    dots = []
    for row in rows:
        name = f"{row['label']}: {round(row['wrong'], 1):g}"
        dots.append(Dot(name, row["mean_ms"], row["wrong"], "front" if row["front"] else ""))
    words = "Wrong contacts: missed, late or cut short, and false"
    up = Axis.of("wrong contacts; green: the front", [1.0, *(dot.y for dot in dots)], 3, zero=True)
    return scatter(dots, words, "mean ms a frame", up, CHART)


def _replayed(done: Tradeoff) -> str:
    """What was replayed, and beside which detector."""
    about = done.about
    things = (("bodies", "body", "bodies"), ("pairs", "pair", "pairs"), ("contacts", "contact", "contacts"))
    numbers = ", ".join(plural(about[key], *words) for key, *words in things)
    return f"{about['session']}: {about['seconds'] / 60:.2g} min, {numbers}; reference: {about['oracle']}."
