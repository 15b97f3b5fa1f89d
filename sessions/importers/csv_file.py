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
from sessions.importers.csv_mapping import METRES, PRESETS, UNITY, CsvMapping, PoseColumns, read_mapping
from sessions.importers.csv_table import CsvTable, Rows
from sessions.importers.finish import Imported, side_of, usable_track
from sessions.importers.pose_table import BesidePoses, PoseTable, SourceFrame, carried, imported, in_frame
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
    samples = _samples(table, plan, convention_named(convention or plan.convention))
    if mesh_axes == "same":
        return samples
    done = (*samples.conversions, f"{MESH_AXES[mesh_axes]}: turned by 180 degrees")
    return replace(samples, conversions=done, mesh_turn=HALF_TURN)


def _check_columns(table: CsvTable, plan: CsvMapping) -> None:
    """Refuse a mapping that names columns which are not there: all of them at once."""
    kinds, poses = plan.kinds, [*(plan.bodies or {}).values(), *([plan.body] if plan.body else [])]
    wanted = [plan.time, plan.name, kinds.column, kinds.other, kinds.value, *plan.events]
    wanted += [column for pose in poses for column in (*pose.numbers, pose.valid)]
    wanted += [scalar.column for scalar in plan.scalars.values()]
    wanted += [column for ray in plan.gaze.values() for column in (*ray.origin, *ray.direction, ray.valid)]
    missing = [column for column in dict.fromkeys(wanted) if column and column not in table.columns]
    if len(missing) > 1 and len(table.columns) > 1:
        named = ", ".join(repr(column) for column in missing)
        raise ImportFileError(f"{table.source}: no columns {named}; there are: {', '.join(table.columns)}")


def _preset(table: CsvTable) -> CsvMapping:
    """The mapping of a preset that fits the columns of a table."""
    plans = [plan for some in PRESETS.values() for plan in some]
    for plan in plans:
        if plan.body is not None and {plan.time, plan.name, *plan.body.numbers} <= {*table.columns}:
            says = plan.body.valid in table.columns
            return plan if says else replace(plan, body=replace(plan.body, valid=""))
    if not {UNITY.time, UNITY.kinds.column, UNITY.name} <= {*table.columns}:
        raise draft_of(table.source)
    return plans[0]


def _samples(table: CsvTable, plan: CsvMapping, axes: Convention) -> Imported:
    notes = []
    if table.skipped:
        notes.append(f"{table.skipped} rows left out that have too few or too many cells")
    if table.cut_short:
        notes.append("the last line has no line break and may be cut short: its pose is flagged as lost")
    tables = {name: _poses(table, plan, columns, rows) for name, columns, rows in _bodies(table, plan)}
    contacts, twice = live_contacts(table, plan)
    frame = SourceFrame(axes, plan.units, METRES[plan.units], f"column {plan.time}, {plan.unit}", plan.unit)
    samples = imported(tables, frame, [*notes, *twice, *unknown_kinds(table, plan)])
    samples = _beside(table, plan, frame, samples.tracks).put_into(samples)
    return replace(samples, events=events(table, plan), hands=hands(table, plan), live_contacts=contacts)


def _bodies(table: CsvTable, plan: CsvMapping) -> Iterator[tuple[str, PoseColumns, Rows]]:
    """Each body with its columns and its rows."""
    if plan.bodies is not None:
        for name, columns in plan.bodies.items():
            yield name, columns, table.every
    elif plan.body is not None:
        poses = pose_rows(table, plan)
        names = table.words(plan.name, poses)
        if len(names) > MOST_BODIES:
            raise ImportFileError(
                f"{table.source}: column {plan.name!r} names {len(names):,} bodies; is it the column of names?"
            )
        for name in names:
            if not name:
                raise ImportFileError(f"{table.source}: column {plan.name!r}: a pose has no body; fill in the cell")
            yield name, plan.body, poses & table.rows_of(plan.name, name)


def _poses(table: CsvTable, plan: CsvMapping, columns: PoseColumns, rows: Rows) -> PoseTable:
    numbers = table.numbers(columns.numbers, rows)
    stamps = table.stamps(plan.time, plan.unit, rows)
    valid = table.flags(columns.valid, rows) if columns.valid else np.ones(len(numbers), dtype=np.bool_)
    if table.cut_short and rows[-1:].any():
        valid[-1] = False
    return PoseTable(stamps, numbers[:, :3], columns.quaternions(numbers[:, 3:]), valid)


def _beside(table: CsvTable, plan: CsvMapping, frame: SourceFrame, tracks: Mapping[str, Track]) -> BesidePoses:
    """Gaze and numbers, in columns of their own or in rows of their kind."""
    beside, poses = BesidePoses(), pose_rows(table, plan)
    for name, (rows, column, unit) in scalar_cells(table, plan, poses).items():
        stamps, first = np.unique(table.stamps(plan.time, plan.unit, rows), return_index=True)
        beside.scalar(name, stamps, table.numbers((column,), rows)[first, 0], unit)
    for name, ray in plan.gaze.items():
        stamps, first = np.unique(table.stamps(plan.time, plan.unit, poses), return_index=True)
        rays = frame.axes.points(table.numbers((*ray.origin, *ray.direction), poses).reshape(-1, 2, 3))[first]
        seen = table.flags(ray.valid, poses)[first] if ray.valid else np.ones(len(first), dtype=np.bool_)
        origins, directions = rays[:, 0] * frame.metres, rays[:, 1]
        if ray.relative_to:
            if ray.relative_to not in tracks:
                why = nearest(ray.relative_to, [*tracks])
                raise ImportFileError(f"{table.source}: gaze of {name!r}: no body {ray.relative_to!r}{why}")
            origins, directions, near = carried(tracks[ray.relative_to], stamps, origins, directions)
            seen = seen & near
        beside.looked(name, stamps, origins, directions, seen)
    looked = rows_of_kind(table, plan, plan.kinds.gaze)
    if plan.body is None or not looked.any():
        return beside
    for name in table.words(plan.name, looked):
        pose = _poses(table, plan, plan.body, looked & table.rows_of(plan.name, name))
        eye, _, _ = usable_track(*in_frame(pose, frame))
        forward = rotated(eye.quaternions_xyzw, (0.0, 0.0, -1.0))
        beside.looked(name, eye.times_ns, eye.positions, forward, eye.valid)
    return beside


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
    counts = Counter(table.texts(kinds.column).tolist() if kinds.column else ())
    others = {word: count for word, count in counts.items() if word not in known}
    if not others:
        return []
    names = [repr(word[:40]) for word in list(others)[:NAMED_KINDS]] + ["..."] * (len(others) > NAMED_KINDS)
    return [f"{sum(others.values())} rows left out of unknown kind {', '.join(names)}"]


def pose_rows(table: CsvTable, plan: CsvMapping) -> Rows:
    """Which rows hold a pose, (n,)."""
    return rows_of_kind(table, plan, plan.kinds.pose) if plan.kinds.column else table.every


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
