"""A tradeoff on the page: the advice, losses against time, and a row per setting."""

from typing import Any, Final

from replay import words
from replay.document.run_result import Tradeoff
from replay.show.accuracy import accuracy_plot, tradeoff_dots
from replay.show.tradeoff_table import how_measured, tradeoff_table
from replay.words import plural

CHART: Final = (960.0, 420.0)


def tradeoff_values(done: Tradeoff) -> dict[str, Any]:
    """Values of the template ``tradeoff.html``."""
    chart = accuracy_plot(tradeoff_dots(done), CHART, "; green: the front") if done.rows else None
    return {
        "advice": done.advice,
        "chart": chart,
        "cut": done.cut,
        "measured": (_replayed(done), *how_measured(done)),
        "table": tradeoff_table("Every setting that was tried", done.rows),
    }


def _replayed(done: Tradeoff) -> str:
    """Sentence about the replayed session and its reference."""
    about = done.about
    things = (("bodies", "body", "bodies"), ("pairs", "pair", "pairs"), ("contacts", "contact", "contacts"))
    numbers = ", ".join(plural(about[key], *forms) for key, *forms in things)
    return f"{about['session']}: {words.duration(about['seconds'])}, {numbers}; reference: {about['oracle']}."
