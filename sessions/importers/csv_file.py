"""Imports a CSV of poses, wide or long, of any convention; doubtful rows are flagged as lost.

Besides poses: collisions, triggers, events, gaze, numbers. Rows left out are counted.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sessions.errors import ImportFileError
from sessions.geometry.rotations import rotated
from sessions.importers.csv_draft import draft_of, has_header
from sessions.importers.csv_mapping import (
    KINDS,
    METRES,
    OTHER,
    PRESETS,
    UNITY,
    VALUE,
    CsvMapping,
    PoseColumns,
    read_mapping,
)
from sessions.importers.csv_table import CsvTable, Rows
from sessions.importers.finish import Imported, side_of, usable_track
from sessions.importers.pose_table import BesidePoses, PoseTable, SourceFrame, Stamps, carried, imported, in_frame
from sessions.meshes.conventions import Convention
from sessions.meshes.conventions import convention as convention_named
from sessions.model.event import Event, LiveContact
from sessions.model.track import HandTrack, Track
from sessions.scene_files.toml_table import nearest

MESH_AXES = {
    "same": "mesh files have the axes of the converted session",
    "x-flipped": "mesh files were exported from Unity as glTF, which flips X instead of Z",
}

HALF_TURN = np.diag([-1.0, 1.0, -1.0, 1.0])

NAMED_KINDS = 5  # Unknown kinds of rows that are named before the sentence ends in dots

MOST_BODIES = 1000  # More names than a laboratory has bodies: then the column holds something else


def read_csv(
    source: Path,
    *,
    mapping: str | Path | CsvMapping | None = None,
    convention: str | None = None,
    mesh_axes: str = "same",
) -> Imported:
    """Everything in a CSV file.

    Parameters
    ----------
    mapping : a mapping file or ``CsvMapping``; ``None``: that of ``PRESETS`` whose columns are there.
    convention : a name in ``CONVENTIONS``; wins over the mapping's.
    mesh_axes : ``same``, or ``x-flipped`` for meshes that a glTF exporter of Unity wrote (it flips X, the poses flip Z:
        without this every mesh is turned by 180 degrees about Y). Source: F_z F_m^-1 with F_m = diag(-1, 1, 1) is
        this half turn.

    Raises ``ImportFileError``: names file, line and column.
    """
    if mesh_axes not in MESH_AXES:
        raise ImportFileError(f"no mesh_axes {mesh_axes!r}; there are: {', '.join(MESH_AXES)}")
    if mapping is not None:
        plan = mapping if isinstance(mapping, CsvMapping) else read_mapping(mapping)
        table = CsvTable(
            source, plan.delimiter, plan.decimal, plan.skip_lines, plan.header_lines, plan.columns, plan.rate_hz, True
        )
        table.format, table.offset_ns = plan.format, plan.offset_ns
        _check_columns(table, plan)
    else:
        if not has_header(source):
            raise draft_of(source)
        table = CsvTable(source)
        plan = _preset(table)
    if not (convention or plan.convention):
        raise ImportFileError("the axes of the CSV are not known; name a convention (for Unity: unity)")
    samples = CsvLog(table, plan).imported(convention_named(convention or plan.convention))
    if mesh_axes == "same":
        return samples
    done = (*samples.conversions, f"{MESH_AXES[mesh_axes]}: turned by 180 degrees")
    return replace(samples, conversions=done, mesh_turn=HALF_TURN)


def _check_columns(table: CsvTable, plan: CsvMapping) -> None:
    """Refuse a mapping that names columns which are not there: all of them at once."""
    wanted = [plan.time, plan.name, *plan.events]
    wanted += [column for pose in (plan.body, *plan.bodies.values()) if pose for column in (*pose.numbers, pose.valid)]
    wanted += [scalar.column for scalar in plan.scalars.values()]
    wanted += [column for ray in plan.gaze.values() for column in (*ray.origin, *ray.direction, ray.valid)]
    missing = [column for column in dict.fromkeys(wanted) if column and column not in table.columns]
    if len(missing) > 1 and len(table.columns) > 1:
        named = ", ".join(repr(column) for column in missing)
        raise ImportFileError(f"{table.source}: no columns {named}; there are: {', '.join(table.columns)}")


def _preset(table: CsvTable) -> CsvMapping:
    """The mapping of a preset that fits the columns of a table."""
    for plan in PRESETS:
        if plan.body is not None and {plan.time, plan.name, *plan.body.numbers} <= {*table.columns}:
            says = plan.body.valid in table.columns
            return plan if says else replace(plan, body=replace(plan.body, valid=""))
    if not {UNITY.time, UNITY.kind, UNITY.name} <= {*table.columns}:
        raise draft_of(table.source)
    return UNITY


class CsvLog:
    """The rows of a CSV as a mapping reads them.

    Where a column says what a row is, rows of the kind ``pose`` are poses. Of the others, the column ``other`` names
    the second body of a contact, the event or the number, and ``value`` holds the words or the number.
    """

    def __init__(self, table: CsvTable, plan: CsvMapping) -> None:
        self._table, self._plan = table, plan
        self._poses = self._of_kind("pose") if plan.kind else table.every

    def imported(self, axes: Convention) -> Imported:
        """Everything that the rows hold."""
        table, plan, notes = self._table, self._plan, []
        if table.skipped:
            notes.append(f"{table.skipped} rows left out that have too few or too many cells")
        if table.cut_short:
            notes.append("the last line has no line break and may be cut short: its pose is flagged as lost")
        contacts, twice = self.live_contacts()
        if twice:
            notes.append(f"{twice} contacts that both bodies reported counted once")
        tables = {name: self._pose_table(columns, rows) for name, columns, rows in self._bodies()}
        clock = f"column {plan.time}, {plan.unit}"
        frame = SourceFrame(axes, plan.units, METRES[plan.units], clock, plan.unit)
        samples = imported(tables, frame, [*notes, *self.unknown_kinds()])
        samples = self._beside(frame, samples.tracks).put_into(samples)
        return replace(samples, events=self.events(), hands=self.hands(), live_contacts=contacts)

    def _of_kind(self, kind: str) -> Rows:
        """Which rows are of a kind, (n,); none where no column tells."""
        return self._table.rows_of(self._plan.kind, kind) if self._plan.kind else ~self._table.every

    def _by_name(self, rows: Rows, column: str = "") -> Iterator[tuple[str, Rows]]:
        """The names in a column of some rows, the bodies' by default, each with its rows."""
        column = column or self._plan.name
        for name in self._table.words(column, rows) if rows.any() else ():
            yield name, rows & self._table.rows_of(column, name)

    def _stamps(self, rows: Rows) -> Stamps:
        return self._table.stamps(self._plan.time, self._plan.unit, rows)

    def _cells(self, rows: Rows, *columns: str) -> Iterator[tuple[Any, ...]]:
        """The stamp of each of these rows and its texts in some columns."""
        if rows.any():
            texts = (self._table.texts(column, rows).tolist() for column in columns)
            yield from zip(self._stamps(rows).tolist(), *texts, strict=True)

    def _bodies(self) -> Iterator[tuple[str, PoseColumns, Rows]]:
        """Each body with its columns and its rows."""
        for name, columns in self._plan.bodies.items():
            yield name, columns, self._table.every
        if self._plan.body is None:
            return
        where = f"{self._table.source}: column {self._plan.name!r}"
        count = len(self._table.words(self._plan.name, self._poses))
        if count > MOST_BODIES:
            raise ImportFileError(f"{where} names {count:,} bodies; is it the column of names?")
        for name, rows in self._by_name(self._poses):
            if not name:
                raise ImportFileError(f"{where}: a pose has no body; fill in the cell")
            yield name, self._plan.body, rows

    def _pose_table(self, columns: PoseColumns, rows: Rows) -> PoseTable:
        numbers = self._table.numbers(columns.numbers, rows)
        valid = self._table.flags(columns.valid, rows) if columns.valid else np.ones(len(numbers), dtype=np.bool_)
        if self._table.cut_short and rows[-1:].any():
            valid[-1] = False
        return PoseTable(self._stamps(rows), numbers[:, :3], columns.quaternions(numbers[:, 3:]), valid)

    def _beside(self, frame: SourceFrame, tracks: Mapping[str, Track]) -> BesidePoses:
        """Gaze and numbers, in columns of their own or in rows of their kind."""
        beside = BesidePoses()
        scalars = [(name, self._poses, one.column, one.unit) for name, one in self._plan.scalars.items()]
        scalars += [(name or "scalar", rows, VALUE, "") for name, rows in self._by_name(self._of_kind("scalar"), OTHER)]
        for name, rows, column, unit in scalars:
            stamps, first = np.unique(self._stamps(rows), return_index=True)
            beside.scalar(name, stamps, self._table.numbers((column,), rows)[first, 0], unit)
        for name, ray in self._plan.gaze.items():
            stamps, first = np.unique(self._stamps(self._poses), return_index=True)
            rays = self._table.numbers((*ray.origin, *ray.direction), self._poses).reshape(-1, 2, 3)[first]
            seen = self._table.flags(ray.valid, self._poses) if ray.valid else self._poses[self._poses]
            origins, directions = frame.axes.points(rays[:, 0]) * frame.metres, frame.axes.points(rays[:, 1])
            near = seen[first]
            if ray.relative_to:
                if ray.relative_to not in tracks:
                    why = nearest(ray.relative_to, [*tracks])
                    raise ImportFileError(f"{self._table.source}: gaze of {name!r}: no body {ray.relative_to!r}{why}")
                origins, directions, posed = carried(tracks[ray.relative_to], stamps, origins, directions)
                near = near & posed
            beside.looked(name, stamps, origins, directions, near)
        for name, rows in self._by_name(self._of_kind("gaze")):
            assert self._plan.body is not None  # only a long table has kinds of rows
            eye, _, _ = usable_track(*in_frame(self._pose_table(self._plan.body, rows), frame))
            beside.looked(name, eye.times_ns, eye.positions, rotated(eye.quaternions_xyzw, (0.0, 0.0, -1.0)), eye.valid)
        return beside

    def live_contacts(self) -> tuple[tuple[LiveContact, ...], int]:
        """The engine's contacts by time, and how many were left out because both bodies reported them."""
        found: dict[tuple[int, frozenset[str], str], LiveContact] = {}
        reported = 0
        for phase in ("enter", "exit"):
            for stamp, first, second in self._cells(self._of_kind(phase), self._plan.name, OTHER):
                reported += 1
                found.setdefault((stamp, frozenset((first, second)), phase), LiveContact(stamp, first, second, phase))
        return tuple(sorted(found.values(), key=lambda contact: contact.time_ns)), reported - len(found)

    def hands(self) -> dict[str, HandTrack]:
        """``student/<side>`` -> trigger, from the rows that hold one; of rows with one stamp the first counts."""
        found = {}
        for name, rows in self._by_name(self._of_kind("trigger")):
            stamps, first = np.unique(self._stamps(rows), return_index=True)
            value = self._table.numbers((VALUE,), rows)[first, 0]
            found[f"student/{side_of(name)}"] = HandTrack(stamps, np.clip(np.nan_to_num(value), 0.0, 1.0))
        return found

    def events(self) -> list[Event]:
        """Rows that are events, and every new text in a column of events, by time."""
        rows = self._cells(self._of_kind("event"), OTHER, VALUE, self._plan.name)
        found = [Event(stamp, name or "event", message, body) for stamp, name, message, body in rows]
        return sorted([*found, *self._event_columns()], key=lambda event: event.time_ns)

    def _event_columns(self) -> Iterator[Event]:
        """An event where a cell is not empty and differs from the row before (of the same body in a long table)."""
        tracks = self._by_name(self._poses) if self._plan.name else [("", self._poses)]
        for body, rows in tracks if self._plan.events else ():
            for column in self._plan.events:
                before = ""
                for stamp, cell in self._cells(rows, column):
                    word = cell.strip()
                    if word and word != before:
                        yield Event(stamp, column, word, body)
                    before = word

    def unknown_kinds(self) -> list[str]:
        """A sentence about the rows whose kind nobody knows."""
        counts = Counter(self._table.texts(self._plan.kind).tolist() if self._plan.kind else ())
        others = {word: count for word, count in counts.items() if word not in KINDS}
        if not others:
            return []
        names = [repr(word[:40]) for word in list(others)[:NAMED_KINDS]]
        names += ["..."] if len(others) > NAMED_KINDS else []
        return [f"{sum(others.values())} rows left out of unknown kind {', '.join(names)}"]
