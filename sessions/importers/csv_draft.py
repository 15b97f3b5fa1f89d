"""A draft of a mapping for a CSV that nobody has described: what its header and its first rows give away.

What they do not give away (the unit of lengths, the axes, the order of angles) is a commented line for a person.
"""

import csv
import json
import re
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any, Final

import numpy as np

from sessions.errors import ImportFileError
from sessions.importers.csv_mapping import CLOCK_NS, LENGTHS, ROW_MAJOR
from sessions.input_files import opened
from sessions.meshes.conventions import CONVENTIONS

HEAD_BYTES: Final = 200_000
LOOKED_AT: Final = 200  # Rows that a unit and a kind of column are told by
DELIMITERS: Final = (",", ";", "\t", " ")

PLACE, TURN, ANGLES, MATRIX = "position", "quaternion_xyzw", "euler", "matrix"
NINE: Final = "012345678"
WORDS: Final[dict[str, Any]] = tomllib.loads(Path(__file__).with_name("csv_words.toml").read_text("utf-8"))
"""What words of a column's name say: its kind, the axis of an angle, a unit; and wall clocks beside ISO 8601."""
KIND_OF: Final = {word: kind for kind in (PLACE, TURN, ANGLES) for word in WORDS[kind]}
OTHER, NOISE, TIME, NAMES, VALID = (frozenset(WORDS[kind]) for kind in ("other", "noise", "time", "name", "valid"))
TURNS, UNITS = WORDS["turns"], WORDS["units"]
AXIS: Final = re.compile(r"([a-z]*?)([xyzw])")
STEPS: Final = (("s", 5e-4, 0.5), ("ms", 0.5, 500.0), ("us", 500.0, 5e5), ("ns", 5e5, 5e8))
"""Unit of a clock -> the steps between rows that a recording of 2 to 2,000 Hz has in it."""
TICKS: Final = (621_355_968_000_000_000, 662_380_416_000_000_000)
""".NET ticks of 1970 and of 2100; as nanoseconds of the Unix epoch these are the years 1989 to 1990."""
NAMELESS: Final = {12: ROW_MAJOR, 8: ("timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw")}
"""Columns of files that do not name them, by their number: KITTI and TUM."""
NUMBER: Final = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?|nan|NaN")


class UnknownColumnsError(ImportFileError):
    """A CSV of no known log; ``draft`` is a mapping to be checked and completed, ``unknown`` what it lacks."""

    def __init__(self, source: Path, columns: Sequence[str], draft: str, unknown: Sequence[str]) -> None:
        self.draft, self.unknown = draft, tuple(unknown)
        shown = ", ".join(columns[:24]) + (", ..." if len(columns) > 24 else "")
        super().__init__(f"{source}: its columns are of no known log: {shown}; describe them with --mapping FILE")


def draft_of(source: Path) -> UnknownColumnsError:
    """The error that says what the columns are, with a draft of their mapping."""
    head, unknown = _head_of(source), list[str]()
    draft = "\n".join([*_lines(source, head, unknown), ""])
    return UnknownColumnsError(source, head.columns, draft, unknown)


def has_header(source: Path) -> bool:
    """Whether a line above the rows names their columns."""
    return "columns" not in _head_of(source).keys


@dataclass
class _Head:
    """The head of a file: its columns, the cells of the first rows, and the keys by which it is to be read."""

    columns: Sequence[str]
    rows: list[list[str]]
    keys: dict[str, object] = field(default_factory=dict)

    def cells(self, column: str) -> list[str]:
        return [row[self.columns.index(column)] for row in self.rows]

    def numbers(self, column: str) -> list[float]:
        return [float(cell.replace(",", ".")) for cell in self.cells(column) if NUMBER.fullmatch(cell)]

    def named(self, words: frozenset[str]) -> list[str]:
        """The columns in whose names one of these words is."""
        return [name for name in self.columns if not words.isdisjoint(word.lower() for word in _words(name)[0])]


def _head_of(source: Path) -> _Head:
    with opened(source, "recording", ImportFileError) as stream:
        text = stream.read(HEAD_BYTES).decode("utf-8-sig", errors="replace")
    lines = text.splitlines()[: LOOKED_AT + 50]
    for delimiter in DELIMITERS:
        cells = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=delimiter)]
        data = next((k for k, row in enumerate(cells) if len(row) > 1 and _numbers(row) * 2 >= len(row)), None)
        if data is not None:
            break
    else:
        return _Head(re.split("[,;\t]", lines[0]) if lines else (), [])
    keys: dict[str, object] = {} if delimiter == "," else {"delimiter": delimiter}
    if delimiter in ";\t" and any(re.fullmatch(r"-?\d+,\d+", cell) for cell in cells[data]):
        keys["decimal"] = ","
    above, width, columns = data - 1, len(cells[data]), cells[data - 1] if data else []
    if len(columns) != width and (not columns or _numbers(columns) or columns[0].startswith("#")):
        above = data  # no line names the columns, or a comment does
        columns = lines[data - 1].lstrip("#% ").split() if data else []
        if len(columns) != width:
            columns = list(NAMELESS.get(width, (f"column_{k + 1}" for k in range(width))))
        keys["columns"] = columns
    if above > 0:
        keys["skip_lines"] = above
    return _Head(columns, [row for row in cells[data : data + LOOKED_AT] if len(row) == len(columns)], keys)


def _numbers(row: Sequence[str]) -> int:
    return sum(NUMBER.fullmatch(cell) is not None for cell in row)


@dataclass
class _Body:
    """The columns of a body by what they hold and their axis."""

    columns: dict[tuple[str, str], str] = field(default_factory=dict)

    def held(self, kind: str, axes: str) -> list[str]:
        """The columns of all these axes, or none."""
        found = [self.columns.get((kind, axis), "") for axis in axes]
        return found if all(found) else []

    @property
    def place(self) -> list[str]:
        return self.held(PLACE, "xyz")

    @property
    def turn(self) -> tuple[str, list[str]]:
        """What the rotation is, and its columns; three numbers called a rotation are angles."""
        for kind, axes in ((TURN, "xyzw"), (MATRIX, NINE)):
            if columns := self.held(kind, axes):
                return kind, columns
        return ANGLES, self.held(ANGLES, "xyz") or self.held(TURN, "xyz")


def _bodies(columns: Sequence[str]) -> dict[str, _Body]:
    if {*ROW_MAJOR} <= {*columns}:
        places = {(PLACE, axis): name for axis, name in zip("xyz", ROW_MAJOR[3::4], strict=True)}
        turns = [name for name in ROW_MAJOR if name[2] != "3"]
        return {"": _Body({**places, **{(MATRIX, at): name for at, name in zip(NINE, turns, strict=True)}})}
    found: dict[str, _Body] = {}
    for column in columns:
        words, _ = _words(column.replace("_RS_R", "").replace("_RS", ""))  # frames of EuRoC
        if not words:
            continue
        *before, last = words
        kind = next((KIND_OF[word.lower()] for word in reversed(before) if word.lower() in KIND_OF), PLACE)
        match = AXIS.fullmatch(last.lower())
        axis = TURNS.get(last.lower(), "")
        if axis:
            kind = ANGLES
        elif match and (not match[1] or match[1] in KIND_OF):
            kind, axis = KIND_OF.get(match[1], kind), match[2]
        if axis and not {word.lower() for word in before} & OTHER:
            found.setdefault(_name(column, before), _Body()).columns.setdefault((kind, axis), column)
    return found


def _name(column: str, words: Sequence[str]) -> str:
    """The body that a column is of, as it is written there: what is left of the words."""
    own = [word for word in words if word.lower() not in {*KIND_OF, *NOISE}]
    if not own:
        return ""
    first = column.index(own[0])
    whole = column[first : column.index(own[-1], first) + len(own[-1])]
    return whole if not {*re.findall("[a-z]+", whole.lower())} & KIND_OF.keys() else "_".join(own)


def _words(column: str) -> tuple[list[str], str]:
    """The words of a name, and the unit that it states."""
    stated = re.search(r"[\[(]\s*([A-Za-z]+)\s*[\])]", column)
    words = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+", re.sub(r"[\[(].*?[\])]", "", column))
    unit = UNITS.get(stated[1].lower(), "") if stated else ""
    if len(words) > 1 and words[-1].lower() in UNITS:
        unit = unit or UNITS[words.pop().lower()]
    return words, unit


def _lines(source: Path, head: _Head, unknown: list[str]) -> Iterator[str]:
    """How to read the file, as TOML; what the file does not tell is a commented line, and goes to ``unknown``."""
    bodies = _bodies(head.columns)
    places = [column for body in bodies.values() for column in body.place]
    yield f"# How to read {source.name}: a draft of its header. Check it, and complete what is commented."
    yield from (f"{key} = {json.dumps(value)}" for key, value in head.keys.items())
    unknown.append("the axes (convention)")
    yield f'# convention = "unity"   # which axes? one of: {", ".join(CONVENTIONS)}'
    unit = next((unit for column in places if (unit := _words(column)[1]) in LENGTHS), "")
    if unit:
        yield f'units = "{unit}"'
    else:
        unknown.append("the unit of lengths (m unless you say otherwise)")
        numbers = [number for column in places for number in head.numbers(column)]
        spread = f"places run from {min(numbers):g} to {max(numbers):g}" if numbers else ""
        yield f'# units = "m"   # m, cm or mm? {spread}'
    yield from ("", "[time]", *_clock(head, unknown))
    posed = {name: body for name, body in bodies.items() if body.place and body.turn[1]}
    names = [name for name in head.named(NAMES) if not head.numbers(name)]
    for name, body in posed.items():
        if names and not name:
            yield from ("", "[body]", f"name = {json.dumps(names[0])}")
        else:
            yield from ("", f"[bodies.{json.dumps(name or source.stem)}]")
        kind, turn = body.turn
        yield f"position = {json.dumps(body.place)}"
        if kind == ANGLES:  # by their axes, whatever order a person writes below
            angles = ", ".join(f"{axis} = {json.dumps(column)}" for axis, column in zip("xyz", turn, strict=True))
            yield f"{kind} = {{{angles}}}"
            unknown.append("the order of the angles (order)")
            yield '# order = "XYZ"   # the order of turning; capital letters turn about axes of the body'
            yield '# angle_unit = "deg"   # deg or rad'
        else:
            yield f"{kind} = {json.dumps(turn)}"
        if len(posed) == 1 and (valid := head.named(VALID)):
            yield f"valid = {json.dumps(valid[0])}"
    if not posed:
        unknown.append("which columns are a pose")
        yield from ("", "# [bodies.cup]", '# position = ["...", "...", "..."]')
        yield '# quaternion_xyzw = ["...", "...", "...", "..."]'
    for name, body in bodies.items():
        if name not in posed and body.place:
            yield f"# {name or 'a body'} has a place and no rotation, so it is left out: {', '.join(body.place)}"


def _clock(head: _Head, unknown: list[str]) -> Iterator[str]:
    column = next(iter(head.named(TIME)), "")
    if not column:
        unknown.append("the rate (rate_hz), because there is no clock")
        yield "# rate_hz = 90   # rows a second; the file has no column of time"
        return
    yield f"column = {json.dumps(column)}"
    form = next(map(text_format, head.cells(column)), None)
    if form is not None:
        yield 'unit = "text"'
        yield f"format = {json.dumps(form)}" if form else "# ISO 8601"
        return
    values, unit = head.numbers(column), _words(column)[1]
    steps = [step for step in np.diff(values) if step > 0]
    if steps and unit not in CLOCK_NS:
        step = float(np.median(steps))
        unit = next((name for name, low, high in STEPS if low <= step < high), "")
        if TICKS[0] <= values[0] < TICKS[1]:
            unit = "ticks"
    if not unit:
        unknown.append("the unit of time")
    yield f'unit = "{unit}"' if unit else '# unit = "s"   # s, ms, us, ns or ticks (.NET)'
    if values and values[0] < 0:
        yield f"offset = {-values[0]!r}   # in that unit: no stamp of a session lies before 0"


def text_format(cell: str) -> str | None:
    """The format of a wall-clock text: "" for ISO 8601, else as ``strptime`` takes it; ``None`` where it is none."""
    for form in ("", *WORDS["formats"]) if not NUMBER.fullmatch(cell) else ():
        with suppress(ValueError):
            _ = datetime.strptime(cell, form) if form else datetime.fromisoformat(cell)
            return form
    return None
