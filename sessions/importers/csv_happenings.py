"""What a CSV holds besides poses: collisions, triggers, events, gaze, numbers; rows left out are counted."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from sessions.importers.csv_mapping import CsvMapping
from sessions.importers.csv_table import CsvTable, Rows
from sessions.importers.finish import side_of
from sessions.model.event import Event, LiveContact
from sessions.model.track import HandTrack

NAMED_KINDS = 5  # Unknown kinds of rows that are named before the sentence ends in dots


def live_contacts(table: CsvTable, plan: CsvMapping) -> tuple[tuple[LiveContact, ...], list[str]]:
    """The engine's contacts by time, and what was done: a contact that both bodies report counts once."""
    found: dict[tuple[int, frozenset[str], str], LiveContact] = {}
    reported = 0
    for phase, word in (("enter", plan.kinds.enter), ("exit", plan.kinds.exit)):
        for stamp, first, second in _cells(table, plan, rows_of_kind(table, plan, word), plan.name, plan.kinds.other):
            reported += 1
            found.setdefault((stamp, frozenset((first, second)), phase), LiveContact(stamp, first, second, phase))
    twice = reported - len(found)
    words = [f"{twice} contacts that both bodies reported counted once"] if twice else []
    return tuple(sorted(found.values(), key=lambda contact: contact.time_ns)), words


def hands(table: CsvTable, plan: CsvMapping) -> dict[str, HandTrack]:
    """``student/<side>`` -> trigger, from the rows that hold one; of rows with one stamp the first counts."""
    found = {}
    pulled = rows_of_kind(table, plan, plan.kinds.trigger)
    for name in table.words(plan.name, pulled) if plan.kinds.trigger else ():
        rows = pulled & table.rows_of(plan.name, name)
        stamps, first = np.unique(table.stamps(plan.time, plan.unit, rows), return_index=True)
        value = table.numbers((plan.kinds.value,), rows)[first, 0]
        found[f"student/{side_of(name)}"] = HandTrack(stamps, np.clip(np.nan_to_num(value), 0.0, 1.0))
    return found


def events(table: CsvTable, plan: CsvMapping) -> list[Event]:
    """Rows that are events, and every new text in a column of events, by time."""
    kinds, rows = plan.kinds, rows_of_kind(table, plan, plan.kinds.event)
    found = [
        Event(stamp, name or kinds.event, message, body)
        for stamp, name, body, message in _cells(table, plan, rows, kinds.other, plan.name, kinds.value)
    ]
    return sorted([*found, *_event_columns(table, plan)], key=lambda event: event.time_ns)


def scalar_cells(table: CsvTable, plan: CsvMapping, poses: Rows) -> dict[str, tuple[Rows, str, str]]:
    """Name -> rows, column and unit of every number over time: a column beside the ``poses``, or rows of its kind."""
    kinds, numbered = plan.kinds, rows_of_kind(table, plan, plan.kinds.scalar)
    found = {name: (poses, one.column, one.unit) for name, one in plan.scalars.items()}
    for name in table.words(kinds.other, numbered) if numbered.any() else ():
        found[name or kinds.scalar] = (numbered & table.rows_of(kinds.other, name), kinds.value, "")
    return found


def unknown_kinds(table: CsvTable, plan: CsvMapping) -> list[str]:
    """A sentence about the rows whose kind the mapping does not know."""
    kinds = plan.kinds
    known = {kinds.pose, kinds.enter, kinds.exit, kinds.trigger, kinds.event, kinds.scalar, kinds.gaze}
    counts = table.counts(kinds.column) if kinds.column else {}
    others = {word: count for word, count in counts.items() if word not in known}
    if not others:
        return []
    names = [repr(word[:40]) for word in list(others)[:NAMED_KINDS]] + ["..."] * (len(others) > NAMED_KINDS)
    return [f"{sum(others.values())} rows left out of unknown kind {', '.join(names)}"]


def pose_rows(table: CsvTable, plan: CsvMapping) -> Rows:
    """Which rows hold a pose, (n,)."""
    return rows_of_kind(table, plan, plan.kinds.pose) if plan.kinds.column else np.ones(len(table), dtype=np.bool_)


def _event_columns(table: CsvTable, plan: CsvMapping) -> Iterator[Event]:
    """An event where a cell is not empty and differs from the row before (of the same body in a long table)."""
    if not plan.events:
        return
    poses = pose_rows(table, plan)
    names = table.words(plan.name, poses) if plan.name else [""]
    for body in names:
        rows = poses & table.rows_of(plan.name, body) if plan.name else poses
        for column in plan.events:
            before = ""
            for stamp, cell in _cells(table, plan, rows, column):
                word = cell.strip()
                if word and word != before:
                    yield Event(stamp, column, word, body)
                before = word


def rows_of_kind(table: CsvTable, plan: CsvMapping, word: str) -> Rows:
    """Which rows are of a kind, (n,); none of a kind that the mapping does not name."""
    known = word and plan.kinds.column
    return table.rows_of(plan.kinds.column, word) if known else np.zeros(len(table), dtype=np.bool_)


def _cells(table: CsvTable, plan: CsvMapping, rows: Rows, *columns: str) -> Iterator[tuple[Any, ...]]:
    """The stamp of each of these rows and its text in some columns; "" in a column that has no name."""
    if not rows.any():
        return
    stamps = table.stamps(plan.time, plan.unit, rows).tolist()
    texts = (table.texts(column, rows).tolist() if column else [""] * len(stamps) for column in columns)
    yield from zip(stamps, *texts, strict=True)
