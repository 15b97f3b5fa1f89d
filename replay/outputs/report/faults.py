"""Every miss and every false contact of the page as a card, and the choice of which are shown in which order.

A page runs no script: its choices are rules of style, which ask what is chosen.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

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


@dataclass(frozen=True)
class Choices:
    """What can be chosen, in the order in which it is offered: detectors, kinds, pairs and causes."""

    detector: tuple[str, ...]
    kind: tuple[str, ...]
    pair: tuple[str, ...]
    cause: tuple[str, ...]


def choices(result: RunResult) -> Choices:
    """Of the faults of a run."""
    found = [_values(*fault) for fault in _faults(result)]
    detector, kind, pair, cause = (tuple(dict.fromkeys(one[k] for one in found)) for k in range(4))
    return Choices(detector, kind, tuple(sorted(pair)), tuple(sorted(cause)))


def _values(label: str, kind: str, one: Miss | FalseContact) -> tuple[str, str, str, str]:
    """Of one fault, in the order of ``Choices``."""
    return label, kind, f"{one.body_a} - {one.body_b}", one.cause


def first_of(result: RunResult) -> str:
    """The audited detector whose moments need no name in an address."""
    return next(iter(result.comparisons))


def _faults(result: RunResult) -> Iterator[tuple[str, str, Miss | FalseContact]]:
    for label in result.comparisons:
        yield from ((label, "missed", one) for one in result.misses[label])
        yield from ((label, "false", one) for one in result.false.get(label, ()))


def chooser(offered: Choices) -> Markup:
    """What the reader chooses by, and the rules that follow it."""
    selects, rules = [], []
    for name, values in vars(offered).items():
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
        if result.misses[label]:
            yield page_section(f"Every miss of {label}", *first, miss_cards(result, label, offered))
            first = []
        if result.false.get(label):
            yield page_section(f"Every false contact of {label}", *first, _false_cards(result, label, offered))
            first = []


def miss_cards(result: RunResult, label: str, offered: Choices) -> Markup:
    """A card per miss, the longest cut first; where there are many, clusters above them.

    Misses that no frame shows have a table of their own, in order of time.
    """
    misses = result.misses[label]
    seen, between = seen_and_between(misses)
    words = f"What {label} missed between frames: no frame shows it, so it has no depth; in order of time"
    parts = []
    for title, some in ((f"What {label} missed", seen), (words, between)):
        if shown := some[:MOST_CARDS]:
            made = run_tables.miss_table(title, shown).only(*MISS_HEAD, *SIZES[some is between], LOOK_AT)
            made = run_tables.with_noise(made, [(result, one) for one in shown])
            parts.append(_cards(result, made, "miss", label, shown, offered))
    if len(misses) <= MANY:
        return joined(parts)
    heads = ("pair", "cause", "look at the longest cut", "misses", "frames", "s", "longest cut mm")
    found = page_table(run_tables.cluster_table(label, misses).only(*heads))
    rest = [len(some) - MOST_CARDS for some in (seen, between) if len(some) > MOST_CARDS]
    return joined([found, _folded(len(misses), sum(rest), "misses.parquet", parts)])


def _false_cards(result: RunResult, label: str, offered: Choices) -> Markup:
    """A card per false contact, the longest first."""
    found = sorted(result.false[label], key=lambda one: -one.frames)
    shown = found[:LISTED]
    made = run_tables.false_table(f"What {label} reports falsely, the longest first", shown, label).only(*FALSE_HEAD)
    card = _cards(result, made, "false", label, shown, offered)
    if len(found) <= MANY:
        return card
    return _folded(len(found), max(0, len(found) - LISTED), "false.parquet", [card])


def _folded(count: int, rest: int, file: str, parts: Sequence[Markup]) -> Markup:
    words = f"All {count:,}, each with the command that shows it"
    if rest:
        words = f"The worst {count - rest:,}, each with the command that shows it; the other {rest:,} are in {file}"
    return element("details", element("summary", words), *parts)


def _mended(result: RunResult, label: str, cause: str) -> str:
    """What mends a fault, and what that takes of a frame."""
    way = TO_DO.get(cause, "see its cause")
    right = result.summary["detectors"][result.oracle]["seconds"]["per_frame_mean"]
    takes = f"{1e3 * cost_of_mending(result, label, cause, right):.2g} ms"
    own = way == LOOK and label in result.at_every_frame
    return f"{way}, {takes} each" if own else f"{way}; {result.oracle} takes {takes} a frame"


def _cards(
    result: RunResult, made: Table, kind: str, label: str, shown: Sequence[Miss | FalseContact], offered: Choices
) -> Markup:
    """A table as cards: the number is a link to the moment in the picture, where there is one beside the page."""
    by = "" if label == first_of(result) else label
    names = [column.name for column in made.columns]
    rows, about = [], []
    for row, one in zip(made.rows, shown, strict=True):
        at, cells = address(kind, one.number, by), list(row)
        cells[names.index(kind)] = Marked(str(one.number), STRONG, to="#" + at)
        if by and kind == "miss":
            cells[-1] = Marked(f"replay view RUN --miss {one.number} --by {by}", CODE)
        rows.append((*cells, _mended(result, label, one.cause)))
        about.append({"id": at, **_chosen(offered, label, "missed" if kind == "miss" else kind, one)})
    columns = (*made.columns, Column(MENDED[kind], True))
    return page_table(replace(made, columns=columns, rows=tuple(rows)), about)


def _chosen(offered: Choices, label: str, kind: str, one: Miss | FalseContact) -> dict[str, Any]:
    """The attributes that the rules of style ask for: numbers, so that no name of a body is part of one."""
    values = zip(vars(offered).items(), _values(label, kind, one), strict=True)
    place = {name: told.index(value) + 1 for (name, told), value in values}
    order = f"--time:{round(1e3 * one.start)};--pair:{place['pair']};--cause:{place['cause']}"
    return {f"data_{name}": k for name, k in place.items()} | {"style": order, "class_": kind}
