"""Colliders to ship, as tables: before and after, the front, a report card a body."""

from collections.abc import Iterable, Mapping
from typing import Any

from replay import words
from replay.document.columns import screen_columns
from replay.document.cost import TIMES_SENTENCE
from replay.document.tables import Table
from replay.words import plural

Row = Mapping[str, Any]


def before_after_table(row_before: Row, row_after: Row, *, contacts: int, step_hz: float, busy_note: str = "") -> Table:
    """A hull a body, and the pieces, as ``run`` counts them.

    ``busy_note``: a note about the times of a busy machine.
    """
    rows = [{"what": "before: a hull a body", **row_before}, {"what": "after: these pieces", **row_after}]
    title = f"{plural(contacts, 'contact')}, colliders at {words.number(step_hz)} steps a second"
    return Table.of(screen_columns("before_after"), rows, title, [TIMES_SENTENCE, *filter(None, [busy_note])])


def front_table(front: Iterable[Row]) -> Table:
    """The choices that nothing with as few pieces beats."""
    return Table.of(screen_columns("pieces_front"), front, "Pieces against loss, of all choices that were tried")


def card_table(bodies: Iterable[Row]) -> Table:
    """Returns a row for the hull of a body, its pieces where it was cut, and each other collider that was measured."""
    rows = []
    for body in bodies:
        rows.append({"body": body["body"], "collider": "hull", **body["before"]})
        if body["after"]["pieces"] > 1:
            rows.append({"body": "", "collider": body["how"], **body["after"]})
        rows += [{"body": "", "collider": card["how"], **card} for card in body["others"]]
    note = "False and missed contact of a body are counted with every other body as its own mesh, at every frame."
    return Table.of(screen_columns("cards"), rows, "Report card of each collider", (note,))
