"""Imports a CSV of poses, wide or long, of any convention; doubtful rows are flagged as lost.

Besides poses: collisions, triggers, events, numbers. What becomes of every row is in the ledger.
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sessions.errors import ImportFileError
from sessions.importers.csv_assumptions import source_frame, with_stated_units
from sessions.importers.csv_draft import draft_of
from sessions.importers.csv_long_table import column_of_bodies
from sessions.importers.csv_mapping import KINDS, OTHER, UNITY, VALUE, CsvMapping, PoseColumns, read_mapping
from sessions.importers.csv_table import CsvTable
from sessions.importers.csv_text import read_head
from sessions.importers.ledger import Ledger, is_large_loss
from sessions.importers.pose_table import SourceFrame, Stream, imported, numbered
from sessions.importers.stamps import Rows, Stamps, increasing, rows_lost
from sessions.meshes.conventions import Convention
from sessions.meshes.conventions import convention as convention_named
from sessions.model.event import Event, LiveContact
from sessions.model.session import Session
from sessions.model.track import HandTrack
from sessions.names import side_of

NAMED_KINDS = 5  # Unknown kinds of rows that are named
NAMED_COLUMNS = 12  # Columns without a role that are named

MOST_BODIES = 1000  # More names than a laboratory has bodies: then the column holds something else


def read_csv(
    source: Path,
    *,
    mapping: str | Path | CsvMapping | None = None,
    convention: str | None = None,
) -> Session:
    """Everything in a CSV file.

    Parameters
    ----------
    mapping : a mapping file or ``CsvMapping``; ``None``: that of the README's Unity script.
    convention : a name in ``CONVENTIONS``; wins over the mapping's.

    Raises ``ImportFileError``: names file, line and column.
    """
    ledger = Ledger(source)
    if mapping is not None:
        plan = mapping if isinstance(mapping, CsvMapping) else read_mapping(mapping)
        table = CsvTable(source, ledger, plan.layout, mapped=True)
        _check_columns(table, plan)
    else:
        plan, known = UNITY, {UNITY.time, UNITY.kind, UNITY.name}
        head = read_head(source, known)
        table = CsvTable(source, ledger, head.layout)
        if not {*table.columns} >= known:
            raise draft_of(head, table)
    if not (convention or plan.convention):
        raise ImportFileError("the axes of the CSV are not known; name a convention (for Unity: unity)")
    axes = convention_named(convention or plan.convention)
    plan = _in_order_of(with_stated_units(table, plan), axes, str(source))
    return _CsvLog(table, plan, ledger).session(source_frame(table, plan, axes, is_named=bool(convention)))


def _in_order_of(plan: CsvMapping, axes: Convention, where: str) -> CsvMapping:
    """The mapping with the Euler order that the convention fixes."""
    body = plan.body and plan.body.in_order_of(axes, f"{where}: [body]")
    bodies = {name: columns.in_order_of(axes, f"{where}: [bodies.{name}]") for name, columns in plan.bodies.items()}
    return replace(plan, body=body, bodies=bodies)


def _check_columns(table: CsvTable, plan: CsvMapping) -> None:
    """Refuse a mapping that names columns which are not there: all of them at once."""
    columns = [plan.time, plan.name]
    columns += [column for pose in (plan.body, *plan.bodies.values()) if pose for column in (*pose.numbers, pose.valid)]
    columns += [column for column, _ in plan.scalars.values()]
    missing = [column for column in dict.fromkeys(columns) if column and column not in table.columns]
    if len(missing) > 1 and len(table.columns) > 1:
        named = ", ".join(map(repr, missing))
        raise ImportFileError(f"{table.source}: no columns {named}; there are: {', '.join(table.columns)}")


class _CsvLog:
    """The rows of a CSV as a mapping reads them.

    Where a column says what a row is, rows of the kind ``pose`` are poses. Of the others, the column ``other`` names
    the second body of a contact, the event or the number, and ``value`` holds the words or the number.
    """

    def __init__(self, table: CsvTable, plan: CsvMapping, ledger: Ledger) -> None:
        self._table, self._plan, self._ledger = table, plan, ledger
        self._kinds = table.rows_by_text(plan.kind) if plan.kind else {"pose": np.ones(len(table), dtype=np.bool_)}

    def session(self, frame: SourceFrame) -> Session:
        """Everything that the rows hold."""
        table, ledger = self._table, self._ledger
        contacts = self._contacts()
        unknown = {kind: int(rows.sum()) for kind, rows in self._kinds.items() if kind not in KINDS}
        named = ", ".join(repr(kind[:40]) for kind in [*unknown][:NAMED_KINDS])
        count = sum(unknown.values())
        why = f"of {len(unknown)} unknown kinds such as {named}"
        ledger.book("rows", read=len(table), kept=len(table) - count, dropped={why: count})
        self._refuse_long_table()
        tables = {name: table.poses(columns, self._stamps(rows), rows) for name, columns, rows in self._bodies()}
        events = tuple(
            Event(stamp, name or "event", message, body)
            for stamp, name, message, body in self._cells("event", OTHER, VALUE, self._plan.name)
        )
        session = imported(tables, frame, ledger, [*table.notes, *self._unread_columns()], self._numbers())
        return replace(session, events=events, hands=self._hands(), live_contacts=contacts)

    def _refuse_long_table(self) -> None:
        """Refuse a long table that is mapped as a wide one, where a column tells its bodies apart."""
        plan, table = self._plan, self._table
        if not plan.bodies or not plan.time:
            return
        rows = self._kinds["pose"]
        stamps = self._stamps(rows)
        lost = rows_lost(stamps, [np.ones(len(stamps), dtype=np.bool_)])
        if not is_large_loss(lost, len(stamps)):
            return
        used = [plan.time, *(column for body in plan.bodies.values() for column in body.numbers)]
        column = column_of_bodies(table, stamps, used)
        if column:
            raise ImportFileError(
                f"{table.source}: {lost:,} of {len(stamps):,} rows repeat a stamp or go back; column {column!r} tells "
                f"{table.count_different(column)} bodies apart: write [body] with name = {json.dumps(column)} into the "
                "mapping in place of [bodies.NAME]"
            )

    def _unread_columns(self) -> Iterator[str]:
        """A sentence on the columns that the mapping does not name, if there are any."""
        plan = self._plan
        used = {plan.time, plan.name, plan.kind, *(column for column, _ in plan.scalars.values())}
        used |= {column for pose in plan.poses for column in (*pose.numbers, pose.valid)}
        used |= {OTHER, VALUE} if plan.kind else set()
        unread = [column for column in self._table.columns if column and column not in used]
        if unread:
            more = f" and {len(unread) - NAMED_COLUMNS} more" if len(unread) > NAMED_COLUMNS else ""
            yield f"columns that are not read: {', '.join(unread[:NAMED_COLUMNS])}{more}"

    def _stamps(self, rows: Rows) -> Stamps:
        return self._table.stamps(self._plan.time, self._plan.unit, rows)

    def _cells(self, kind: str, *columns: str) -> Iterator[tuple[Any, ...]]:
        """The stamp of each row of a kind and its texts in some columns."""
        if kind in self._kinds:
            rows = self._kinds[kind]
            texts = (self._table.texts(column, rows) for column in columns)
            yield from zip(self._stamps(rows).tolist(), *texts, strict=True)

    def _named(self, kind: str, column: str) -> Iterator[tuple[str, Rows]]:
        """The names in a column of the rows of a kind, each with its rows."""
        if kind in self._kinds:
            yield from self._table.rows_by_text(column, self._kinds[kind]).items()

    def _bodies(self) -> Iterator[tuple[str, PoseColumns, Rows]]:
        """Each body with its columns and its rows."""
        for name, columns in self._plan.bodies.items():
            yield name, columns, self._kinds["pose"]
        if self._plan.body is None:
            return
        where = f"{self._table.source}: column {self._plan.name!r}"
        named = dict(self._named("pose", self._plan.name))
        if len(named) > MOST_BODIES:
            raise ImportFileError(f"{where} names {len(named):,} bodies; is it the column of names?")
        for name, rows in named.items():
            if not name:
                raise ImportFileError(f"{where}: a pose has no body; fill in the cell")
            yield name, self._plan.body, rows

    def _numbers(self) -> Iterator[Stream]:
        """Numbers over time, in columns of their own or in rows of their kind."""
        columns = [(name, self._kinds["pose"], *scalar) for name, scalar in self._plan.scalars.items()]
        columns += [(name or "scalar", rows, VALUE, "") for name, rows in self._named("scalar", OTHER)]
        for name, rows, column, unit in columns:
            yield Stream(name, self._stamps(rows), self._table.numbers((column,), rows)[:, 0], unit)

    def _contacts(self) -> tuple[LiveContact, ...]:
        """The engine's contacts; of those that both bodies reported the first."""
        contacts: dict[tuple[int, frozenset[str], str], LiveContact] = {}
        reported = 0
        for phase in ("enter", "exit"):
            for stamp, first, second in self._cells(phase, self._plan.name, OTHER):
                reported += 1
                contact = LiveContact(stamp, first, second, phase)
                contacts.setdefault((stamp, frozenset((first, second)), phase), contact)
        twice = {"that both bodies reported": reported - len(contacts)}
        self._ledger.book("contacts", read=reported, kept=len(contacts), merged=twice)
        return tuple(contacts.values())

    def _hands(self) -> dict[str, HandTrack]:
        """``student/<side>`` -> trigger, from the rows that hold one; of rows with one stamp the first counts."""
        hands: dict[str, HandTrack] = {}
        for name, rows in self._named("trigger", self._plan.name):
            hand = numbered(f"student/{side_of(name) or name}", hands)
            stamps, values = self._stamps(rows), self._table.numbers((VALUE,), rows)
            keep = increasing(f"trigger {hand}", stamps, (values,), self._ledger)
            pressed = np.clip(np.nan_to_num(values[keep, 0]), 0.0, 1.0)
            hands[hand] = HandTrack(stamps[keep], pressed)
        return hands
