"""A tradeoff on the page: the advice, losses against time, and a row per setting."""

from typing import Any, Final

from replay import words
from replay.document.run_result import Tradeoff
from replay.show.accuracy import accuracy_plot, tradeoff_dots
from replay.show.tradeoff_table import measurement_sentences, tradeoff_table
from replay.words import plural

CHART_SIZE: Final = (960.0, 420.0)


def tradeoff_values(tradeoff: Tradeoff) -> dict[str, Any]:
    """Values of the template ``tradeoff.html``."""
    chart = accuracy_plot(tradeoff_dots(tradeoff), CHART_SIZE, "; green: the front") if tradeoff.rows else None
    return {
        "advice": tradeoff.advice,
        "chart": chart,
        "cut": tradeoff.cut,
        "measured": (_replayed_sentence(tradeoff), *measurement_sentences(tradeoff)),
        "table": tradeoff_table("Every setting that was tried", tradeoff.rows),
    }


def _replayed_sentence(tradeoff: Tradeoff) -> str:
    """Sentence about the replayed session and its reference."""
    tradeoff_facts = tradeoff.about
    counted_things = (("bodies", "body", "bodies"), ("pairs", "pair", "pairs"), ("contacts", "contact", "contacts"))
    counts_text = ", ".join(plural(tradeoff_facts[key], *forms) for key, *forms in counted_things)
    return (
        f"{tradeoff_facts['session']}: {words.duration(tradeoff_facts['seconds'])}, {counts_text}; "
        f"reference: {tradeoff_facts['oracle']}."
    )
