"""What a detector got wrong: a card a pair of bodies with its longest fault, all others folded below it."""

from collections.abc import Callable, Sequence
from typing import Final

from replay.outputs.report.charts import lane
from replay.outputs.report.markup import Markup, element
from replay.outputs.report.run_view import Fault, RunView, fault_address, faults_by_pair, spans
from replay.pipeline.scores import MOST_CARDS
from replay.pipeline.sentences import plural

MOST_PAIRS: Final = 6
"""Cards of a detector; further pairs are folded."""

AROUND: Final = 0.35
"""Share of a fault that its lane shows before and after it."""

LEAST_AROUND: Final = 0.1
"""Seconds."""

Shown = tuple[Markup, str]
"""A picture, and what is seen on it."""

Still = Callable[[Fault | None, bool], Shown]
Look = Callable[[Fault], Markup]
"""Picture of a fault (of the bench where there is none), larger where it is the first of a page; and how to see it in
motion."""


def cards(view: RunView, label: str, still: Still | None, look: Look) -> list[Markup]:
    """The cards of a detector and the rest of its faults; nothing where it made none."""
    groups = faults_by_pair(view, label)
    shown = [_card(view, group, still, look) for group in groups[:MOST_PAIRS]]
    parts = [element("div", *shown, class_="cards")] if shown else []
    if rest := groups[MOST_PAIRS:]:
        lines = [_line(view, fault, pair=True) for group in rest for fault in group]
        parts.append(_folded(f"{plural(len(rest), 'more pair')} of bodies", lines))
    return parts


def _card(view: RunView, group: Sequence[Fault], still: Still | None, look: Look) -> Markup:
    fault, *more = group
    parts = [
        element("h3", _key(fault), f"{fault.name} {fault.number}: {fault.pair[0]} and {fault.pair[1]}"),
        element("p", f"{fault.span}, {plural(fault.frames, 'frame')}, {fault.what}", class_="when"),
        element("p", fault.why),
        _lanes(view, fault),
        look(fault),
    ]
    if more:
        parts.append(_folded(f"{len(more):,} more of this pair", [_line(view, other) for other in more]))
    image = [still(fault, False)[0]] if still else []
    return element("article", *image, element("div", *parts, class_="cb"), class_="card", id=fault_address(view, fault))


def _lanes(view: RunView, fault: Fault) -> Markup:
    """The reference above the detector, around a fault of one pair."""
    around = max(AROUND * (fault.end - fault.start), LEAST_AROUND)
    window = fault.start - around, fault.end + around
    rows = []
    for name in (view.oracle, fault.label):
        found = spans(view, name, fault.pair)
        rows += [element("span", name), lane(found, window, f"{name} from {window[0]:.3f} to {window[1]:.3f} s")]
    return element("div", *rows, class_="mini")


def _line(view: RunView, fault: Fault, *, pair: bool = False) -> Markup:
    address = fault_address(view, fault)
    link = element("a", f"{fault.name} {fault.number}", href=f"#{address}")
    named = f": {fault.pair[0]} and {fault.pair[1]}" if pair else ""
    when = f" at {fault.start:.3f} s, {plural(fault.frames, 'frame')}{named}"
    return element("li", _key(fault), link, when, id=address)


def _folded(words: str, lines: list[Markup]) -> Markup:
    """Lines below a line that opens them; of very many the longest."""
    cut = [] if len(lines) <= MOST_CARDS else [element("li", f"{len(lines) - MOST_CARDS:,} more in the tables")]
    return element("details", element("summary", words), element("ul", *lines[:MOST_CARDS], *cut))


def _key(fault: Fault) -> Markup:
    return element("span", class_=f"k {fault.stretch}")
