"""Imports a CSV of poses, wide or long, of any convention, and keeps what each number was taken to mean, and why.

Besides poses: collisions, triggers, events, numbers. Doubtful rows are flagged as lost; what becomes of every row is in
the ledger. The heading of a column or the row of units says what a number means, the format of the Unity script defines
it, a draft guessed it (its key is in ``guessed`` of the mapping), or the user wrote it into the mapping.

The way of a row: `CsvTable` cuts the text into cells. A `CsvMapping` says which columns are a pose and in which units.
`read_csv` gives each body a `PoseTable` of its rows. `session_of_tables` makes it a `Track`: increasing stamps, metres,
canonical axes. `Frames.from_tracks` aligns the bodies, and `finish_import` adds meshes.
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from sessions.errors import ImportFileError
from sessions.importers.csv_columns_and_units import (
    CLOCK_NS,
    KINDS,
    OTHER,
    TIME_TOKENS,
    UNITY,
    VALUE,
    CsvMapping,
    Guessable,
    PoseColumns,
    name_tokens_of,
    read_mapping,
    with_stated_units,
)
from sessions.importers.csv_draft import draft_of
from sessions.importers.csv_head import read_head
from sessions.importers.csv_long_table import column_of_bodies
from sessions.importers.csv_table import NAMED_COLUMNS, CsvTable
from sessions.importers.importing import SourceFrame, Stream, is_inverse, numbered_name, session_of_tables
from sessions.importers.ledger import Ledger, Rows, Stamps, increasing_rows, is_large_loss, rows_lost
from sessions.importers.unstated_units import (
    angle_unit_assumption,
    largest_angle,
    likely_angle_unit,
    time_unit_assumption,
    usual_length_unit,
)
from sessions.meshes.conventions import Convention
from sessions.meshes.conventions import convention as convention_named
from sessions.model.assumption import Assumption, Confidence, Origin, Subject, grouped_assumptions
from sessions.model.event import Event, LiveContact
from sessions.model.session import HandTrack, Session
from sessions.names import side_of
from sessions.quantities import number

NAMED_KINDS: Final = 5
"""Unknown kinds of rows that an account names."""
MOST_BODIES: Final = 1000
"""More names than a laboratory has bodies: then the column holds something else."""
RECORDINGS: Final = frozenset(
    ("participant", "subject", "user", "student", "person", "session", "recording", "trial", "take", "block", "run")
)
"""Words in the name of a column that tells recordings apart, and no bodies."""
LAST_ROW_TOLERANCE: Final = 1e-6
"""By which the last row of a matrix of a pose may be off 0, 0, 0."""

QUATERNION_KINDS: Final = ("quaternion_xyzw", "quaternion_wxyz")


def read_csv(
    source: Path,
    *,
    mapping: str | Path | CsvMapping | None = None,
    convention: str | None = None,
    rotations: str | None = None,
) -> Session:
    """Everything in a CSV file.

    Parameters
    ----------
    mapping : a mapping file or ``CsvMapping``; ``None``: that of the README's Unity script.
    convention : a name in ``CONVENTIONS``; wins over the mapping's.
    rotations : their direction, of ``ROTATIONS``; wins over the mapping's.

    Raises ``ImportFileError``: names file, line and column.
    """
    ledger = Ledger(source)
    table, plan = _table_and_mapping(source, mapping, ledger)
    if not (convention or plan.convention):
        raise ImportFileError("the axes of the CSV are not known; name a convention (for Unity: unity)")
    axes = convention_named(convention or plan.convention)
    for pose in plan.poses:
        _check_last_row(table, pose)
    plan = with_stated_units(plan, table.stated_unit, source)
    plan = plan.in_order_of(axes, str(source))
    log = _CsvLog(table, plan, ledger)
    frame = _source_frame(table, plan, axes, is_named=bool(convention))
    return log.session(replace(frame, inverse_rotations=is_inverse(rotations or plan.rotations)))


def _table_and_mapping(
    source: Path, mapping: str | Path | CsvMapping | None, ledger: Ledger
) -> tuple[CsvTable, CsvMapping]:
    """The cells of a file and the meaning of its columns.

    Raises ImportFileError: the mapping names columns that are not there; without a mapping, `UnknownColumnsError` with
    a draft of one, where the columns are not those of the Unity script.
    """
    if mapping is not None:
        plan = mapping if isinstance(mapping, CsvMapping) else read_mapping(mapping)
        table = CsvTable(source, ledger, plan.layout, mapped=True)
        _check_columns(table, plan)
        return table, plan
    known = {UNITY.time, UNITY.kind, UNITY.name}
    head = read_head(source, known)
    table = CsvTable(source, ledger, head.layout)
    if not {*table.columns} >= known:
        raise draft_of(head, table)
    return table, UNITY


def _check_columns(table: CsvTable, plan: CsvMapping) -> None:
    """Refuse a mapping that names columns which are not there: all of them at once."""
    columns = [plan.time, plan.name]
    columns += [column for pose in plan.poses for column in (*pose.numbers, pose.valid)]
    columns += [column for column, _ in plan.scalars.values()]
    missing = [column for column in dict.fromkeys(columns) if column and column not in table.columns]
    if len(missing) > 1 and len(table.columns) > 1:
        named = ", ".join(map(repr, missing))
        raise ImportFileError(f"{table.source}: no columns {named}; there are: {', '.join(table.columns)}")


def _check_last_row(table: CsvTable, pose: PoseColumns) -> None:
    """Refuse matrices whose last row, in columns that are not read, holds a place: they are written transposed."""
    first = pose.rotation[0]
    last = [first.removesuffix("m00") + f"m3{column}" for column in range(3)]
    # Columns of no other rotation are called so.
    if not {*last} <= {*table.columns} or {*last} & {*pose.position}:
        return
    entries = table.numbers(last)
    wrong = np.flatnonzero((np.abs(entries) > LAST_ROW_TOLERANCE).any(axis=1))
    if len(wrong):
        raise ImportFileError(
            f"{table.source}: the columns {', '.join(last)} hold {entries[wrong[0]].tolist()} in place of zeros: the "
            "matrices are written column by column; name those of matrix in the other order, and these as position"
        )


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
        streams = list(self._numbers())
        session = session_of_tables(tables, frame, ledger, [*table.notes, *self._unread_columns()], streams)
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
        if column and not RECORDINGS.isdisjoint(word.lower() for word in name_tokens_of(column)):
            raise ImportFileError(
                f"{table.source}: {lost:,} of {len(stamps):,} rows repeat a stamp or go back; column {column!r} tells "
                f"{table.count_different(column)} recordings apart: keep the rows of one of them in the file"
            )
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

    def _rows_by_name(self, kind: str, column: str) -> Iterator[tuple[str, Rows]]:
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
        named = dict(self._rows_by_name("pose", self._plan.name))
        if len(named) > MOST_BODIES:
            raise ImportFileError(f"{where} names {len(named):,} bodies; is it the column of names?")
        for name, rows in named.items():
            if not name:
                raise ImportFileError(f"{where}: a pose has no body; fill in the cell")
            yield name, self._plan.body, rows

    def _numbers(self) -> Iterator[Stream]:
        """Numbers over time, in columns of their own or in rows of their kind."""
        columns = [(name, self._kinds["pose"], *scalar) for name, scalar in self._plan.scalars.items()]
        columns += [(name or "scalar", rows, VALUE, "") for name, rows in self._rows_by_name("scalar", OTHER)]
        for name, rows, column, unit in columns:
            yield Stream(name, self._stamps(rows), self._table.measurements((column,), rows)[:, 0], unit)

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
        for name, rows in self._rows_by_name("trigger", self._plan.name):
            hand = numbered_name(f"student/{side_of(name) or name}", hands)
            stamps, values = self._stamps(rows), self._table.numbers((VALUE,), rows)
            keep = increasing_rows(f"trigger {hand}", stamps, (values,), self._ledger)
            pressed = np.clip(np.nan_to_num(values[keep, 0]), 0.0, 1.0)
            hands[hand] = HandTrack(stamps[keep], pressed)
        return hands


def _source_frame(table: CsvTable, plan: CsvMapping, axes: Convention, *, is_named: bool) -> SourceFrame:
    """Returns the meaning of a CSV's numbers, each with who says it.

    Parameters
    ----------
    plan : with the Euler orders that the convention fixes.
    is_named : whether an option names the axes.
    """
    by_mapping = Origin.FORMAT if plan.kind else Origin.USER
    units, units_origin = _length_unit(table, plan, axes)
    return SourceFrame(
        axes=axes,
        units=units,
        clock=f"column {plan.time}, {plan.unit}" if plan.time else f"{plan.layout.rate_hz:g} rows a second",
        assumed=(*((f"lengths in {units}",) if units_origin is Origin.GUESS else ()), *_doubtful_angles(table, plan)),
        axes_origin=Origin.USER if is_named else by_mapping,
        units_origin=units_origin,
        clock_origin=_clock_origin(plan),
        others=(*_unnamed_columns(plan), *_time_unit(table, plan), *_rotations(table, plan, axes)),
    )


def _length_unit(table: CsvTable, plan: CsvMapping, axes: Convention) -> tuple[str, Origin]:
    if not plan.units:
        return usual_length_unit(axes), Origin.FORMAT if plan.kind or axes.unit else Origin.GUESS
    if plan.kind:
        return plan.units, Origin.FORMAT
    columns = [column for pose in plan.poses for column in pose.position]
    return plan.units, _origin(plan, Guessable.LENGTH_UNIT, is_stated=_state_unit(table, columns, plan.units))


def _clock_origin(plan: CsvMapping) -> Origin:
    if plan.kind:
        return Origin.FORMAT
    is_named = not plan.layout.columns and any(word.lower() in TIME_TOKENS for word in name_tokens_of(plan.time))
    return _origin(plan, Guessable.COLUMNS if plan.layout.columns else None, is_stated=is_named)


def _unnamed_columns(plan: CsvMapping) -> tuple[Assumption, ...]:
    """The meaning of columns that no line of the file names."""
    if Guessable.COLUMNS not in plan.guessed:
        return ()
    named = ", ".join(plan.layout.columns)
    return (Assumption(Subject.COLUMNS, named, Origin.GUESS, Confidence.OPEN, reason="by how many there are"),)


def _time_unit(table: CsvTable, plan: CsvMapping) -> tuple[Assumption, ...]:
    """The unit of the clock, or the format of a clock in text; none without a clock."""
    if not plan.time:
        return ()
    form = plan.layout.format
    if plan.unit not in CLOCK_NS:
        origin = _origin(plan, Guessable.TIME_FORMAT, is_stated=not form)
        confidence = Confidence.OPEN if origin is Origin.GUESS else Confidence.SURE
        reason = "it fits the first rows" if origin is Origin.GUESS else ""
        return (Assumption(Subject.TIME_UNIT, form or "ISO 8601", origin, confidence, reason=reason),)
    if plan.kind:
        return (Assumption(Subject.TIME_UNIT, plan.unit, Origin.FORMAT),)
    origin = _origin(plan, Guessable.TIME_UNIT, is_stated=_state_unit(table, [plan.time], plan.unit))
    if origin is Origin.GUESS:
        return (time_unit_assumption(plan.unit, table.stamps(plan.time, plan.unit)),)
    return (Assumption(Subject.TIME_UNIT, plan.unit, origin),)


def _rotations(table: CsvTable, plan: CsvMapping, axes: Convention) -> list[Assumption]:
    """The order of quaternions and of Euler angles, and the unit of angles; bodies of one reading are one row."""
    named = {"": plan.body, **plan.bodies}
    rows = list[Assumption]()
    for name, columns in named.items():
        if columns is None or columns.kind == "matrix":
            continue
        bodies = (name,) if name else ()
        rows += [replace(row, bodies=bodies) for row in _rotation(table, plan, columns, axes)]
    return [row if len(named) > 2 or plan.body else replace(row, bodies=()) for row in grouped_assumptions(rows)]


def _rotation(table: CsvTable, plan: CsvMapping, columns: PoseColumns, axes: Convention) -> list[Assumption]:
    if columns.kind in QUATERNION_KINDS:
        order = columns.kind.removeprefix("quaternion_")
        return [
            Assumption(
                subject=Subject.QUATERNION_ORDER,
                value=order,
                origin=Origin.FORMAT if plan.kind else _quaternion_origin(plan, columns, order),
                description=", ".join(columns.rotation),
            )
        ]
    rows = [_angle_unit(table, plan, columns)]
    if columns.kind == "euler":
        rows.append(_euler_order(plan, columns, axes))
    return rows


def _quaternion_origin(plan: CsvMapping, columns: PoseColumns, order: str) -> Origin:
    """A heading whose last word ends with the axis names it."""
    ends = [name_tokens_of(column)[-1:] for column in columns.rotation]
    is_stated = not plan.layout.columns and all(
        bool(end) and end[0].lower().endswith(axis) for end, axis in zip(ends, order, strict=True)
    )
    guess = Guessable.COLUMNS if plan.layout.columns and not _is_unnamed(columns) else Guessable.QUATERNION_ORDER
    return _origin(plan, guess, is_stated=is_stated)


def _is_unnamed(columns: PoseColumns) -> bool:
    """Whether names such as q1 to q4 leave the order of a quaternion to the user."""
    return all(column[-1:].isdigit() for column in columns.rotation)


def _euler_order(plan: CsvMapping, columns: PoseColumns, axes: Convention) -> Assumption:
    if columns.is_order_stated:
        return Assumption(Subject.EULER_ORDER, columns.order, _origin(plan, Guessable.EULER_ORDER, is_stated=False))
    return Assumption(Subject.EULER_ORDER, columns.order, Origin.FORMAT, reason=f"the convention {axes.name} fixes it")


def _angle_unit(table: CsvTable, plan: CsvMapping, columns: PoseColumns) -> Assumption:
    unit = "deg" if columns.degrees else "rad"
    is_stated = _state_unit(table, columns.rotation, unit)
    origin = _origin(plan, Guessable.ANGLE_UNIT, is_stated=is_stated)
    if origin is Origin.GUESS or not (columns.is_angle_unit_stated or is_stated):
        return angle_unit_assumption(unit, largest_angle([table.measurements(columns.rotation)]))
    return Assumption(Subject.ANGLE_UNIT, unit, origin)


def _doubtful_angles(table: CsvTable, plan: CsvMapping) -> Iterator[str]:
    """Yields a sentence on the angles of each body that are likely in the other unit."""
    for name, columns in {"": plan.body, **plan.bodies}.items():
        if columns is None or columns.kind not in ("euler", "rotation_vector"):
            continue
        largest, unit = largest_angle([table.measurements(columns.rotation)]), "deg" if columns.degrees else "rad"
        likely = likely_angle_unit(unit, largest)
        if likely != unit:
            angles = f"angles of {name}" if name else "angles"
            yield f"{angles} in {unit}, though the largest is {number(largest)}, as of {likely}"


def _state_unit(table: CsvTable, columns: tuple[str, ...] | list[str], unit: str) -> bool:
    """Whether the headings of columns, or the row of units, say this unit of each."""
    return bool(columns) and all(unit == table.stated_unit(column) for column in columns)


def _origin(plan: CsvMapping, key: Guessable | None, *, is_stated: bool) -> Origin:
    """The file where it states it, else the draft where it guessed it, else who wrote the mapping."""
    if is_stated:
        return Origin.FILE
    return Origin.GUESS if key is not None and key in plan.guessed else Origin.USER
