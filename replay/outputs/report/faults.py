"""Every miss and every false contact of the page as a card, and the choice of which are shown in which order.

A page runs no script: its choices are rules of style, which ask what is chosen.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

from replay.comparison.clusters import MANY, seen_and_between
from replay.comparison.false_contacts import FalseContact
from replay.comparison.outcome import Miss
from replay.outputs import run_tables
from replay.outputs.moments import LOOK, TO_DO
from replay.outputs.report.markup import Markup, Part, element, page_table
from replay.outputs.tables import STRONG, Column, Marked, Table
from replay.outputs.words import address, false_thing
from replay.pipeline.run_result import RunResult
from replay.pipeline.scores import LISTED, MOST_CARDS, cost_of_mending

MISS_HEAD: Final = ("miss", "at s", "pair", "what", "cause")
SIZES: Final = (("frames", "cut mm", "face pairs"), ("after frame", "first faces"))
"""Columns of misses that a frame shows, and of those that none shows."""

LOOK_AT: Final = "look at it"
FALSE_HEAD: Final = ("false", "at s", "pair", "what", "why", "frames", "mm apart", LOOK_AT)
CLUSTER_HEAD: Final = ("pair", "cause", "look at the longest cut", "misses", "frames", "s", "longest cut mm")
ORDERS: Final = {"": "the worst first", "time": "time", "pair": "pair", "cause": "cause"}

Fault = Miss | FalseContact
Choices = Mapping[str, list[str]]
"""What can be chosen, in the order in which it is offered: detectors, kinds, pairs and causes."""


def choices(result: RunResult) -> Choices:
    """Of the faults of a run."""
    labels = [*result.comparisons]
    found = [_values(label, one) for label in labels for one in result.misses[label]]
    found += [_values(label, one) for label in labels for one in result.false.get(label, ())]
    offered = {name: [*dict.fromkeys(one[name] for one in found)] for one in found[:1] for name in one}
    return {name: sorted(values) if name in ("pair", "cause") else values for name, values in offered.items()}


def _values(label: str, one: Fault) -> dict[str, str]:
    kind = "missed" if isinstance(one, Miss) else "false"
    return {"detector": label, "kind": kind, "pair": f"{one.body_a} - {one.body_b}", "cause": one.cause}


def link_to(result: RunResult, label: str, one: Fault) -> str:
    """Address of the card of a fault."""
    kind = "miss" if isinstance(one, Miss) else "false"
    return address(kind, one.number, "" if label == first_of(result) else label)


def first_of(result: RunResult) -> str:
    """The audited detector whose moments need no name in an address."""
    return next(iter(result.comparisons))


def chooser(offered: Choices) -> list[Part]:
    """What the reader chooses by, and the rules that follow it; nothing where there is no choice."""
    selects, rules = [], []
    for name, values in offered.items():
        if len(values) > 1:
            selects.append(_select(name, {"": "all", **{str(k): value for k, value in enumerate(values, 1)}}))
            rules += [f'body:has(#by-{name} [value="{k}"]:checked) .cards [data-{name}]:not([data-{name}="{k}"])'
                      for k in range(1, len(values) + 1)]  # fmt: skip
    orders = [f'body:has(#by-order [value="{k}"]:checked) .cards tr{{order:var(--{k})}}' for k in ORDERS if k]
    style = Markup(f"<style>{','.join(rules)}{{display:none}}{''.join(orders)}</style>")
    return [element("div", *selects, _select("order", ORDERS), class_="choose"), style] if rules else []


def _select(name: str, values: Mapping[str, str]) -> Markup:
    options = (element("option", words, value=value) for value, words in values.items())
    return element("label", f"{name} ", element("select", *options, id=f"by-{name}"))


def fault_sections(result: RunResult) -> Iterator[tuple[str, list[Part]]]:
    """A part of the page for what each detector missed, and one for what it reports falsely; the larger comes first."""
    offered = choices(result)
    first = chooser(offered)
    for rank in result.ranking[:-1]:
        false = false_thing(result.false.get(rank.label, ()))
        kinds = [("miss", result.misses, miss_cards), (false, result.false, false_cards)]
        for what, found, cards in reversed(kinds) if rank.leads_false else kinds:
            if found.get(rank.label):
                yield f"Every {what} of {rank.label}", [*first, *cards(result, rank.label, offered)]
                first = []


def miss_cards(result: RunResult, label: str, offered: Choices) -> list[Part]:
    """A card per miss, the longest cut first; where there are many, clusters above them.

    Misses that no frame shows have a table of their own, in order of time.
    """
    misses, by = result.misses[label], "" if label == first_of(result) else label
    groups = seen_and_between(misses)
    words = f"What {label} missed between frames: no frame shows it, so it has no depth; in order of time"
    cards = []
    for title, sizes, some in zip((f"What {label} missed", words), SIZES, groups, strict=True):
        if shown := some[:MOST_CARDS]:
            made = run_tables.miss_table(title, shown, by).only(*MISS_HEAD, *sizes, LOOK_AT)
            made = run_tables.with_noise(made, [(result, one) for one in shown])
            cards.append(_cards(result, made, label, shown, offered))
    above = [run_tables.cluster_table(label, misses).only(*CLUSTER_HEAD)] if len(misses) > MANY else []
    left = sum(max(0, len(some) - MOST_CARDS) for some in groups)
    return [*above, *_folded(len(misses), left, "misses.parquet", cards)]


def false_cards(result: RunResult, label: str, offered: Choices) -> list[Part]:
    """A card per false contact, the longest first."""
    found = sorted(result.false[label], key=lambda one: -one.frames)
    shown = found[:LISTED]
    what = "unconfirmed" if all(one.unconfirmed for one in found) else "falsely"
    title = f"What {label} reports {what}, the longest first"
    made = run_tables.false_table(title, shown, label).only(*FALSE_HEAD)
    cards = [_cards(result, made, label, shown, offered)]
    return _folded(len(found), len(found) - len(shown), "false.parquet", cards)


def _folded(count: int, rest: int, file: str, cards: Sequence[Part]) -> list[Part]:
    """Many cards below a line that opens them; a few as they are."""
    if count <= MANY:
        return [*cards]
    words = f"All {count:,}, each with the command that shows it"
    if rest:
        words = f"The worst {count - rest:,}, each with the command that shows it; the other {rest:,} are in {file}"
    return [element("details", element("summary", words), *cards)]


def _cards(result: RunResult, made: Table, label: str, shown: Sequence[Fault], offered: Choices) -> Markup:
    """A table as cards: the number is a link to the moment in the picture, where there is one beside the page.

    The rules of style ask for attributes that are numbers, so that no name of a body is part of one.
    """
    place = next(k for k, column in enumerate(made.columns) if column.name in ("miss", "false"))
    mended = {"miss": "to catch it", "false": "to mend it"}[made.columns[place].name]
    oracle = result.summary["detectors"][result.oracle]
    right, timed = oracle["seconds"]["per_frame_mean"], "live" if oracle["live"] else "offline"
    rows, about = [], []
    for row, one in zip(made.rows, shown, strict=True):
        at, number = link_to(result, label, one), Marked(str(one.number), STRONG, to=f"#{link_to(result, label, one)}")
        way, takes = TO_DO.get(one.cause, "see its cause"), cost_of_mending(result, label, one.cause, right)
        own = f", {1e3 * takes:.2g} ms each" if way == LOOK and label in result.at_every_frame else ""
        cost = own or f"; {result.oracle} takes {1e3 * takes:.2g} ms a frame, {timed}"
        rows.append((*row[:place], number, *row[place + 1 :], way + cost))
        values = _values(label, one)
        data = {f"data_{name}": offered[name].index(value) + 1 for name, value in values.items()}
        order = f"--time:{round(1e3 * one.start)};--pair:{data['data_pair']};--cause:{data['data_cause']}"
        about.append({"id": at, **data, "style": order, "class_": values["kind"]})
    return page_table(replace(made, columns=(*made.columns, Column(mended, True)), rows=tuple(rows)), about)
