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
from replay.outputs.moments import LOOK, TO_DO, worst_first
from replay.outputs.report.markup import Markup, element, joined, page_section, page_table
from replay.outputs.tables import CODE, STRONG, Column, Marked, Table
from replay.outputs.words import address
from replay.pipeline.run_result import RunResult
from replay.pipeline.scores import LISTED, MOST_CARDS, cost_of_mending

MENDED: Final = {"miss": "to catch it", "false": "to mend it"}
LOOK_AT: Final = "look at it"
MISS_HEAD: Final = ("miss", "at s", "pair", "what", "cause")
SIZES: Final = (("frames", "cut mm", "face pairs"), ("after frame", "first faces"))
"""Columns of misses that a frame shows, and of those that none shows."""

FALSE_HEAD: Final = ("false", "at s", "pair", "what", "why", "frames", "mm apart", LOOK_AT)
ORDERS: Final = {"": "the worst first", "time": "time", "pair": "pair", "cause": "cause"}


Choices = Mapping[str, list[str]]
"""What can be chosen, in the order in which it is offered: detectors, kinds, pairs and causes."""


def choices(result: RunResult) -> Choices:
    """Of the faults of a run."""
    every: list[tuple[str, str, Miss | FalseContact]] = []
    every += [(label, "missed", one) for label in result.comparisons for one in result.misses[label]]
    every += [(label, "false", one) for label in result.comparisons for one in result.false.get(label, ())]
    found = [_values(*fault) for fault in every]
    offered = {name: [*dict.fromkeys(one[name] for one in found)] for one in found[:1] for name in one}
    return {name: sorted(values) if name in ("pair", "cause") else values for name, values in offered.items()}


def _values(label: str, kind: str, one: Miss | FalseContact) -> dict[str, str]:
    return {"detector": label, "kind": kind, "pair": f"{one.body_a} - {one.body_b}", "cause": one.cause}


def first_of(result: RunResult) -> str:
    """The audited detector whose moments need no name in an address."""
    return next(iter(result.comparisons))


def chooser(offered: Choices) -> Markup:
    """What the reader chooses by, and the rules that follow it."""
    selects, rules = [], []
    for name, values in offered.items():
        if len(values) > 1:
            selects.append(_select(name, {"": "all", **{str(k): value for k, value in enumerate(values, 1)}}))
            rules += [f'body:has(#by-{name} [value="{k}"]:checked) .cards [data-{name}]:not([data-{name}="{k}"])'
                      for k in range(1, len(values) + 1)]  # fmt: skip
    if not rules:
        return Markup()
    orders = [f'body:has(#by-order [value="{k}"]:checked) .cards tr{{order:var(--{k})}}' for k in ORDERS if k]
    style = Markup(f"<style>{','.join(rules)}{{display:none}}{''.join(orders)}</style>")
    return joined([element("div", *selects, _select("order", ORDERS), class_="choose"), style])


def _select(name: str, values: Mapping[str, str]) -> Markup:
    options = (element("option", words, value=value) for value, words in values.items())
    return element("label", f"{name} ", element("select", *options, id=f"by-{name}"))


def fault_sections(result: RunResult) -> Iterator[Markup]:
    """A part of the page for what each detector missed, and one for what it reports falsely."""
    offered = choices(result)
    first = [chooser(offered)]
    for label in worst_first(result):
        for title, found, cards in (
            (f"Every miss of {label}", result.misses[label], miss_cards),
            (f"Every false contact of {label}", result.false.get(label), false_cards),
        ):
            if found:
                yield page_section(title, *first, cards(result, label, offered))
                first = []


def miss_cards(result: RunResult, label: str, offered: Choices) -> Markup:
    """A card per miss, the longest cut first; where there are many, clusters above them.

    Misses that no frame shows have a table of their own, in order of time.
    """
    misses = result.misses[label]
    seen, between = seen_and_between(misses)
    words = f"What {label} missed between frames: no frame shows it, so it has no depth; in order of time"
    parts = []
    for title, sizes, some in ((f"What {label} missed", SIZES[0], seen), (words, SIZES[1], between)):
        if shown := some[:MOST_CARDS]:
            made = run_tables.miss_table(title, shown).only(*MISS_HEAD, *sizes, LOOK_AT)
            made = run_tables.with_noise(made, [(result, one) for one in shown])
            parts.append(_cards(result, made, "miss", label, shown, offered))
    heads = ("pair", "cause", "look at the longest cut", "misses", "frames", "s", "longest cut mm")
    above = [page_table(run_tables.cluster_table(label, misses).only(*heads))] if len(misses) > MANY else []
    rest = sum(max(0, len(some) - MOST_CARDS) for some in (seen, between))
    return joined([*above, _folded(len(misses), rest, "misses.parquet", parts)])


def false_cards(result: RunResult, label: str, offered: Choices) -> Markup:
    """A card per false contact, the longest first."""
    found = sorted(result.false[label], key=lambda one: -one.frames)
    shown = found[:LISTED]
    made = run_tables.false_table(f"What {label} reports falsely, the longest first", shown, label).only(*FALSE_HEAD)
    return _folded(len(found), len(found) - len(shown), "false.parquet",
                   [_cards(result, made, "false", label, shown, offered)])  # fmt: skip


def _folded(count: int, rest: int, file: str, parts: Sequence[Markup]) -> Markup:
    """Many cards below a line that opens them; a few as they are."""
    if count <= MANY:
        return joined(parts)
    words = f"All {count:,}, each with the command that shows it"
    if rest:
        words = f"The worst {count - rest:,}, each with the command that shows it; the other {rest:,} are in {file}"
    return element("details", element("summary", words), *parts)


def _cards(
    result: RunResult, made: Table, kind: str, label: str, shown: Sequence[Miss | FalseContact], offered: Choices
) -> Markup:
    """A table as cards: the number is a link to the moment in the picture, where there is one beside the page.

    The rules of style ask for attributes that are numbers, so that no name of a body is part of one.
    """
    by = "" if label == first_of(result) else label
    place = [column.name for column in made.columns].index(kind)
    oracle = result.summary["detectors"][result.oracle]
    right, timed = oracle["seconds"]["per_frame_mean"], "live" if oracle["live"] else "offline"
    rows, about = [], []
    for row, one in zip(made.rows, shown, strict=True):
        at, cells = address(kind, one.number, by), list(row)
        cells[place] = Marked(str(one.number), STRONG, to="#" + at)
        if by and kind == "miss":
            cells[-1] = Marked(f"replay view RUN --miss {one.number} --by {by}", CODE)
        way, takes = TO_DO.get(one.cause, "see its cause"), cost_of_mending(result, label, one.cause, right)
        own = f", {1e3 * takes:.2g} ms each" if way == LOOK and label in result.at_every_frame else ""
        rows.append((*cells, way + (own or f"; {result.oracle} takes {1e3 * takes:.2g} ms a frame, {timed}")))
        sort = {"miss": "missed"}.get(kind, kind)
        chosen = {name: offered[name].index(value) + 1 for name, value in _values(label, sort, one).items()}
        order = f"--time:{round(1e3 * one.start)};--pair:{chosen['pair']};--cause:{chosen['cause']}"
        data = {f"data_{name}": k for name, k in chosen.items()}
        about.append({"id": at, **data, "style": order, "class_": sort})
    columns = (*made.columns, Column(MENDED[kind], True))
    return page_table(replace(made, columns=columns, rows=tuple(rows)), about)
