"""What a CSV says besides poses: collisions the engine reported, triggers, events; nothing said is left out unsaid."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sessions.event import Event
from sessions.hand import HandTrack
from sessions.importers.csv_mapping import CsvMapping
from sessions.importers.csv_table import CsvTable
from sessions.importers.finish import side_of
from sessions.live_contact import LiveContact

Rows = NDArray[np.bool_]

NAMED_KINDS = 5
"""Unknown kinds of rows that are named before the sentence ends in dots."""


def live_contacts(table: CsvTable, plan: CsvMapping) -> tuple[tuple[LiveContact, ...], list[str]]:
    """The engine's contacts by time, and what was done: a contact that both bodies report counts once."""
    if plan.rows is None:
        return (), []
    found: dict[tuple[int, frozenset[str], str], LiveContact] = {}
    reported = 0
    for phase, word in (("enter", plan.rows.enter), ("exit", plan.rows.exit)):
        rows = _of_kind(table, plan, word)
        for stamp, first, second in zip(
            _stamps(table, plan, rows),
            _cells(table, plan.name, rows),
            _cells(table, plan.rows.other, rows),
            strict=True,
        ):
            reported += 1
            found.setdefault((stamp, frozenset((first, second)), phase), LiveContact(stamp, first, second, phase))
    twice = reported - len(found)
    words = [f"{twice} contacts that both bodies reported counted once"] if twice else []
    return tuple(sorted(found.values(), key=lambda contact: contact.time_ns)), words


def hands(table: CsvTable, plan: CsvMapping) -> dict[str, HandTrack]:
    """``student/<side>`` -> trigger, from the rows that hold one; of rows with one stamp the first counts."""
    if plan.rows is None or not plan.rows.trigger:
        return {}
    pulled = _of_kind(table, plan, plan.rows.trigger)
    found = {}
    for name in table.words(plan.name, pulled):
        rows = pulled & table.rows_of(plan.name, name)
        stamps, first = np.unique(table.stamps(plan.time, plan.unit, rows), return_index=True)
        value = table.numbers((plan.rows.value,), rows)[first, 0]
        found[f"student/{side_of(name)}"] = HandTrack(stamps, np.clip(np.nan_to_num(value), 0.0, 1.0))
    return found


def events(table: CsvTable, plan: CsvMapping) -> list[Event]:
    """Rows that are events, and every new text in a column of events, by time."""
    found = [*_event_rows(table, plan), *_event_columns(table, plan)]
    return sorted(found, key=lambda event: event.time_ns)


def unknown_kinds(table: CsvTable, plan: CsvMapping) -> list[str]:
    """A sentence about the rows whose kind the mapping does not know."""
    if plan.rows is None:
        return []
    known = {plan.rows.pose, plan.rows.enter, plan.rows.exit, plan.rows.trigger, plan.rows.event}
    others = {word: count for word, count in table.counts(plan.rows.column).items() if word not in known}
    if not others:
        return []
    names = [repr(word[:40]) for word in list(others)[:NAMED_KINDS]] + ["..."] * (len(others) > NAMED_KINDS)
    return [f"{sum(others.values())} rows left out of unknown kind {', '.join(names)}"]


def _event_rows(table: CsvTable, plan: CsvMapping) -> Iterator[Event]:
    if plan.rows is None or not plan.rows.event:
        return
    rows = _of_kind(table, plan, plan.rows.event)
    if not rows.any():
        return
    names, bodies = _cells(table, plan.rows.other, rows), _cells(table, plan.name, rows)
    words = _cells(table, plan.rows.value, rows) if plan.rows.value else [""] * len(names)
    for stamp, name, body, message in zip(_stamps(table, plan, rows), names, bodies, words, strict=True):
        yield Event(stamp, name or plan.rows.event, message, body)


def _event_columns(table: CsvTable, plan: CsvMapping) -> Iterator[Event]:
    """An event where a cell is not empty and differs from the row before (of the same body in a long table)."""
    if not plan.events:
        return
    every = np.ones(len(table), dtype=np.bool_)
    poses = every if plan.rows is None else _of_kind(table, plan, plan.rows.pose)
    parts = (
        {"": poses}
        if not plan.name
        else {n: poses & table.rows_of(plan.name, n) for n in table.words(plan.name, poses)}
    )
    for body, rows in parts.items():
        stamps = _stamps(table, plan, rows)
        for column in plan.events:
            before = ""
            for stamp, cell in zip(stamps, _cells(table, column, rows), strict=True):
                word = cell.strip()
                if word and word != before:
                    yield Event(stamp, column, word, body)
                before = word


def _of_kind(table: CsvTable, plan: CsvMapping, word: str) -> Rows:
    if plan.rows is None or not word:
        return np.zeros(len(table), dtype=np.bool_)
    return table.rows_of(plan.rows.column, word)


def _stamps(table: CsvTable, plan: CsvMapping, rows: Rows) -> list[int]:
    stamps: list[int] = table.stamps(plan.time, plan.unit, rows).tolist() if rows.any() else []
    return stamps


def _cells(table: CsvTable, column: str, rows: Rows) -> list[str]:
    cells: list[str] = table.texts(column, rows).tolist() if rows.any() else []
    return cells
