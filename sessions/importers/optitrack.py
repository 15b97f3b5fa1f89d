"""Motive's CSV export: rigid bodies and bones; a preamble names units, rotation type and coordinate space.

Motive's space is right-handed, +Y up. A row without numbers is a body that was not seen: it is flagged as lost.

Source: OptiTrack, documentation of Motive, *Data Export: CSV* (format versions 1.21 and later).
"""

import csv
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Final

from sessions.errors import ImportFileError
from sessions.importers.csv_columns_and_units import CsvLayout, PoseColumns
from sessions.importers.csv_table import LONGEST_LINE, CsvTable
from sessions.importers.importing import METRES_PER_UNIT, SourceFrame, is_inverse, numbered_name, session_of_tables
from sessions.importers.ledger import Ledger
from sessions.input_files import FIRST_BYTES, check_encoding, open_input
from sessions.model.assumption import Assumption, Origin, Subject
from sessions.model.session import Session

BODIES: Final = ("Rigid Body", "Bone")
AXES: Final = "gltf"
HEAD_LINES: Final = 12  # The lines that name columns are among these; Motive writes 7 or 8
LINES_WITHOUT_ID: Final = 4  # Kinds, names, parts and axes; Motive adds a line of IDs, newer ones of parents, too
FIRST, TIMES = "Format Version", ("Time (Seconds)", "Time")


def read_optitrack(source: Path, *, convention: str | None = None, rotations: str | None = None) -> Session:
    """Rigid bodies and bones of a Motive CSV export.

    Parameters
    ----------
    convention : axes, where the export was not made with Motive's own (``z-up``).
    rotations : their direction, of ``ROTATIONS``; ``None``: that of a pose.

    Raises ``ImportFileError``: names file, line and what to export.
    """
    facts, above, heads = _preamble(source)
    ledger = Ledger(source)
    table = CsvTable(source, ledger, CsvLayout(skip_lines=above, header_lines=heads))
    euler = facts.get("Rotation Type", "Quaternion")
    if euler != "Quaternion" and sorted(euler) != ["X", "Y", "Z"]:
        raise ImportFileError(f"{source}: line 1: no Rotation Type {euler!r}; export with Quaternion")
    unit = facts.get("Length Units", "")
    if unit and unit.lower() not in METRES_PER_UNIT:
        raise ImportFileError(f"{source}: line 1: no length unit {unit!r}; there are: {', '.join(METRES_PER_UNIT)}")
    space = facts.get("Coordinate Space", "Global")
    if space != "Global":
        raise ImportFileError(
            f"{source}: line 1: poses are in space {space!r}; export them with Coordinate Space Global"
        )
    time = next((column for column in table.columns[:3] if column.endswith(TIMES)), TIMES[0])
    stamps = table.stamps(time, "s")
    bodies, notes = _bodies(table, euler)
    ledger.book("rows", read=len(table), kept=len(table))
    ledger.book("names", read=len(bodies), kept=len(bodies))
    tables = {name: table.poses(columns, stamps) for name, columns in bodies.items()}
    is_euler = euler != "Quaternion"
    assumed = [f"Euler angles {euler} in degrees about own axes"] if is_euler else []
    clock = f"seconds since the take began ({facts.get('Capture Start Time', 'no date in the file')})"
    frame = SourceFrame.in_axes(convention, AXES, unit.lower(), clock, assumed)
    frame = replace(frame, others=_rotation_assumptions(euler), inverse_rotations=is_inverse(rotations))
    return session_of_tables(tables, frame, ledger, [*notes, *table.notes])


def _rotation_assumptions(rotation_type: str) -> tuple[Assumption, ...]:
    """The order of quaternions, which the heads of columns name, or of angles, whose unit nothing names."""
    if rotation_type == "Quaternion":
        return (Assumption(Subject.QUATERNION_ORDER, "xyzw", Origin.FILE),)
    degrees = Assumption(Subject.ANGLE_UNIT, "deg", Origin.GUESS, reason="Motive exports angles in degrees")
    return Assumption(Subject.EULER_ORDER, rotation_type, Origin.FILE), degrees


def _preamble(source: Path) -> tuple[dict[str, str], int, int]:
    """The fields of line 1, the number of lines above those that name columns, and the number of these."""
    with open_input(source, "recording", ImportFileError) as stream:
        check_encoding(source, stream.read(FIRST_BYTES))
    try:
        with source.open(encoding="utf-8-sig", newline="") as file:
            lines = iter(lambda: file.readline(LONGEST_LINE), "")
            rows = list(islice(csv.reader(lines), HEAD_LINES))
    except (UnicodeDecodeError, csv.Error) as error:
        raise ImportFileError(f"{source}: this is no CSV text in UTF-8 ({error}); save it as UTF-8") from None
    starts = [row[1] if row[:1] == [""] and len(row) > 1 else row[0] if row else "" for row in rows]
    if starts[:1] != [FIRST]:
        raise ImportFileError(f"{source}: line 1 does not begin with {FIRST!r}; export from Motive with the header on")
    # Motive 1.21 leaves the words Type and Name out: ",,Rigid Body" and "Frame,Time".
    first = next(
        (k for k, row in enumerate(rows) if row[:2] == ["", "Type"] or (row[:2] == ["", ""] and _kinds(row))), -1
    )
    if first < 0 or "Frame" not in starts:
        raise ImportFileError(
            f"{source}: no lines that begin with ',Type' and 'Frame' name the columns; export it again with its header"
        )
    last = starts.index("Frame")
    return dict(zip(rows[0][::2], rows[0][1::2], strict=False)), first, last - first + 1


def _kinds(row: list[str]) -> bool:
    """Whether a row names kinds of what is tracked."""
    return bool({*row[2:]} & {*BODIES, "Marker", "Rigid Body Marker"})


def _bodies(table: CsvTable, euler: str) -> tuple[dict[str, PoseColumns], list[str]]:
    """Body -> its columns, and a note of each body that is numbered because another bears its name.

    Columns are a place X Y Z, then a quaternion X Y Z W or angles in the order of turning.
    """
    order, kind = ("XYZW", "quaternion_xyzw") if euler == "Quaternion" else (euler, "euler")
    bodies, notes = dict[str, PoseColumns](), list[str]()
    for name, columns in _tracked_columns(table):
        try:
            position = tuple(columns["Position", axis] for axis in "XYZ")
            rotation = tuple(columns["Rotation", axis] for axis in order)
        except KeyError as missing:
            what = f"{name!r} has no column {' '.join(missing.args[0])!r}"
            raise ImportFileError(f"{table.source}: {what}; export it with Rotation Type Quaternion") from None
        body = numbered_name(name, bodies)
        if body != name:
            notes.append(f"{body}: another body of the name {name}")
        bodies[body] = PoseColumns(position, rotation, kind, euler)
    if not bodies:
        raise ImportFileError(
            f"{table.source}: no rigid body or bone is in it, only markers; export it again with rigid bodies on"
        )
    return bodies, notes


def _tracked_columns(table: CsvTable) -> list[tuple[str, dict[tuple[str, str], str]]]:
    """Each rigid body and bone: its name, and its columns by part and axis.

    Bodies of one name differ in kind or ID, or begin anew where a column comes again.
    """
    heads = table.heads
    ids = heads[2] if len(heads) > LINES_WITHOUT_ID else [""] * len(table.columns)
    tracked: list[tuple[str, dict[tuple[str, str], str]]] = []
    latest: dict[tuple[str, str, str], dict[tuple[str, str], str]] = {}
    for kind, name, number, component, axis, column in zip(
        heads[0], heads[1], ids, heads[-2], heads[-1], table.columns, strict=True
    ):
        if kind not in BODIES:
            continue
        columns = latest.get((kind, name, number))
        if columns is None or (component, axis) in columns:
            columns = latest[kind, name, number] = {}
            tracked.append((name, columns))
        columns[component, axis] = column
    return tracked
