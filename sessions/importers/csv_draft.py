"""A draft of a mapping for a CSV that nobody has described: what its header and its first rows give away.

What they do not give away (the unit of lengths, the axes, the order of angles) is a commented line for a person.
"""

import csv
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Final

import numpy as np

from sessions.errors import ImportFileError
from sessions.importers.csv_mapping import LENGTHS
from sessions.input_files import opened
from sessions.meshes.conventions import CONVENTIONS

HEAD_BYTES: Final = 200_000
LOOKED_AT: Final = 200  # Rows that a unit and a kind of column are told by
DELIMITERS: Final = (",", ";", "\t", " ")

PLACE, TURN, ANGLES = "position", "quaternion_xyzw", "euler"
KIND_OF: Final = {
    **dict.fromkeys(("p", "t", "pos", "position", "trans", "translation", "loc", "location"), PLACE),
    **dict.fromkeys(("q", "quat", "quaternion", "r", "rot", "rotation", "ori", "orientation"), TURN),
    **dict.fromkeys(("euler", "angle", "angles"), ANGLES),
}
"""Words of a column's name -> what it holds; x, y, z without such a word are a place."""
OTHER: Final = frozenset(
    "v a b w vel velocity acc accel gyro gyr mag bias omega linear angular forward dir direction".split()  # noqa: SIM905
)
"""Words of columns that are no pose."""
NOISE: Final = frozenset(("rs", "transform", "pose", "world", "local", "global"))
AXIS: Final = re.compile(r"([a-z]*?)([xyzw])")
TURNS: Final = {"pitch": "x", "yaw": "y", "roll": "z"}
TIME: Final = frozenset(
    ("time", "timestamp", "timestamps", "stamp", "t", "ts", "clock", "elapsed", "seconds", "datetime")
)
NAMES: Final = frozenset(("name", "body", "object", "device", "id", "tracker", "joint", "target", "label"))
UNITS: Final = {
    "sec": "s", "second": "s", "seconds": "s", "msec": "ms", "nsec": "ns", "usec": "us", "millimeters": "mm",
    "meters": "m", "metres": "m", **{unit: unit for unit in ("s", "ms", "us", "ns", "m", "cm", "mm", "deg", "rad")},
}  # fmt: skip
FORMATS: Final = (
    "%m/%d/%Y %H:%M:%S:%f", "%m/%d/%Y %H:%M:%S.%f", "%m/%d/%Y %H:%M:%S", "%d.%m.%Y %H:%M:%S.%f",
    "%d.%m.%Y %H:%M:%S", "%Y/%m/%d %H:%M:%S.%f", "%H:%M:%S.%f", "%H:%M:%S",
)  # fmt: skip
"""Wall clocks beside ISO 8601, as ``datetime.strptime`` takes them; the first that fits is taken."""
STEPS: Final = (("s", 5e-4, 0.5), ("ms", 0.5, 500.0), ("us", 500.0, 5e5), ("ns", 5e5, 5e8))
"""Unit of a clock -> the steps between rows that a recording of 2 to 2,000 Hz has in it."""
TICKS: Final = (621_355_968_000_000_000, 662_380_416_000_000_000)
""".NET ticks of 1970 and of 2100; as nanoseconds of the Unix epoch these are the years 1989 to 1990."""
KITTI: Final = tuple(f"m{row}{column}" for row in range(3) for column in range(4))
TUM: Final = ("timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw")


class UnknownColumnsError(ImportFileError):
    """A CSV of no known log; ``draft`` is a mapping to be checked and completed, ``unknown`` what it lacks."""

    def __init__(self, source: Path, columns: Sequence[str], draft: str, unknown: Sequence[str]) -> None:
        self.draft, self.unknown = draft, tuple(unknown)
        shown = ", ".join(columns[:24]) + (", ..." if len(columns) > 24 else "")
        super().__init__(f"{source}: its columns are of no known log: {shown}; describe them with --mapping FILE")


@dataclass
class _Head:
    """The head of a file: its columns, their first cells, and how it is to be read."""

    columns: tuple[str, ...]
    rows: list[list[str]]
    keys: dict[str, object] = field(default_factory=dict)

    def cells(self, column: str) -> list[str]:
        return [row[self.columns.index(column)] for row in self.rows]

    def numbers(self, column: str) -> list[float]:
        return [float(cell.replace(",", ".")) for cell in self.cells(column) if _numbers([cell])]


def draft_of(source: Path) -> UnknownColumnsError:
    """The error that says what the columns are, with a draft of their mapping."""
    head = _looked(source)
    draft = _Draft(source, head)
    return UnknownColumnsError(source, head.columns, "\n".join(draft.lines()) + "\n", draft.unknown)


def has_header(source: Path) -> bool:
    """Whether line 1 may name columns: it is no comment and holds more than numbers."""
    with opened(source, "recording", ImportFileError) as stream:
        line = stream.readline(HEAD_BYTES).decode("utf-8-sig", errors="replace").strip()
    return not (line.startswith("#") or (line and _numbers(cells := re.split(r"[,;\s]+", line)) == len(cells)))


def _looked(source: Path) -> _Head:
    with opened(source, "recording", ImportFileError) as stream:
        text = stream.read(HEAD_BYTES).decode("utf-8-sig", errors="replace")
    lines = text.splitlines()[: LOOKED_AT + 50]
    for delimiter in DELIMITERS:
        cells = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=delimiter)]
        data = next((k for k, row in enumerate(cells) if len(row) > 1 and _numbers(row) * 2 >= len(row)), None)
        if data is not None:
            return _told(cells, data, delimiter, lines)
    return _Head(tuple(re.split("[,;\t]", lines[0])) if lines else (), [])


def _told(cells: list[list[str]], data: int, delimiter: str, lines: list[str]) -> _Head:
    """The head of a file whose row ``data`` is the first one of numbers."""
    header = cells[data - 1] if data else []
    keys: dict[str, object] = {} if delimiter == "," else {"delimiter": delimiter}
    if delimiter in ";\t" and any(re.fullmatch(r"-?\d+,\d+", cell) for cell in cells[data]):
        keys["decimal"] = ","
    named = len(header) == len(cells[data]) or (header and not _numbers(header) and not header[0].startswith("#"))
    if named:
        rows = [row for row in cells[data : data + LOOKED_AT] if len(row) == len(header)]
        return _Head(tuple(header), rows, keys | ({"skip_lines": data - 1} if data > 1 else {}))
    rows = [row for row in cells[data : data + LOOKED_AT] if len(row) == len(cells[data])]
    keys |= {"skip_lines": data} if data else {}
    words = lines[data - 1].lstrip("#% ").split() if data else []
    if len(words) != len(rows[0]):
        known = {len(KITTI): KITTI, len(TUM): TUM}.get(len(rows[0]))
        words = list(known or (f"column_{k + 1}" for k in range(len(rows[0]))))
    return _Head(tuple(words), rows, {**keys, "columns": words})


def _numbers(row: list[str]) -> int:
    return sum(re.fullmatch(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?|nan|NaN", cell) is not None for cell in row)


@dataclass
class _Body:
    """The columns of a body: what they hold -> axis -> column."""

    columns: dict[str, dict[str, str]] = field(default_factory=dict)
    unit: str = ""

    def add(self, kind: str, axis: str, column: str) -> None:
        self.columns.setdefault(kind, {}).setdefault(axis, column)

    @property
    def place(self) -> list[str]:
        found = self.columns.get(PLACE, {})
        return [found[axis] for axis in "xyz"] if {*"xyz"} <= found.keys() else []

    @property
    def turn(self) -> tuple[str, list[str]]:
        """What the rotation is, and its columns; three numbers called a rotation are angles."""
        found = self.columns.get(TURN, {})
        if {*"xyzw"} <= found.keys():
            return TURN, [found[axis] for axis in "xyzw"]
        found = {**found, **self.columns.get(ANGLES, {})}
        return ANGLES, [found[axis] for axis in "xyz"] if {*"xyz"} <= found.keys() else []


def _bodies(columns: Sequence[str]) -> dict[str, _Body]:
    found: dict[str, _Body] = {}
    for column in columns:
        words, unit = _words(column)
        if not words:
            continue
        *before, last = words
        if "RS" in before:  # EuRoC: p_RS_R_x is a place, its R a frame
            before = [word for word in before if word not in ("RS", "R")]
        kind = next((KIND_OF[word.lower()] for word in reversed(before) if word.lower() in KIND_OF), PLACE)
        match = AXIS.fullmatch(last.lower())
        axis = TURNS.get(last.lower(), "")
        if axis:
            kind = ANGLES
        elif match and (not match[1] or match[1] in KIND_OF):
            kind, axis = KIND_OF.get(match[1], kind), match[2]
        if not axis or {word.lower() for word in before} & OTHER:
            continue
        body = found.setdefault(_name(column, before), _Body())
        body.add(kind, axis, column)
        body.unit = body.unit or (unit if kind == PLACE else "")
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


class _Draft:
    """The lines of a draft, and what a person must still say."""

    def __init__(self, source: Path, head: _Head) -> None:
        self._source, self._head, self._bodies = source, head, _bodies(head.columns)
        self.unknown: list[str] = []

    def _ask(self, what: str, line: str) -> str:
        """A commented line for what the file does not tell."""
        self.unknown.append(what)
        return f"# {line}"

    def lines(self) -> Iterator[str]:
        """How to read the file, as TOML."""
        yield f"# How to read {self._source.name}: a draft of its header. Check it, and complete what is commented."
        yield from (f"{key} = {json.dumps(value)}" for key, value in self._head.keys.items())
        names = ", ".join(CONVENTIONS)
        yield self._ask("the axes (convention)", f'convention = "unity"   # which axes? one of: {names}')
        unit = next((body.unit for body in self._bodies.values() if body.unit), "")
        if unit in LENGTHS:
            yield f'units = "{unit}"'
        else:
            places = [
                number for body in self._bodies.values() for one in body.place for number in self._head.numbers(one)
            ]
            spread = f"places run from {min(places):g} to {max(places):g}" if places else ""
            what = "the unit of lengths (m unless you say otherwise)"
            yield self._ask(what, f'units = "m"   # m, cm or mm? {spread}')
        yield from ("", "[time]", *self._clock(), *self._poses())

    def _poses(self) -> Iterator[str]:
        if {*KITTI} <= {*self._head.columns}:
            yield from ("", f"[bodies.{json.dumps(self._source.stem)}]", 'position = ["m03", "m13", "m23"]')
            yield f"matrix = {json.dumps([f'm{row}{column}' for row in range(3) for column in range(3)])}"
            return
        posed = {name: body for name, body in self._bodies.items() if body.place and body.turn[1]}
        names = [name for name in self._head.columns if _has_word(name, NAMES) and not self._head.numbers(name)]
        for name, body in posed.items():
            if names and not name:
                yield from ("", "[body]", f"name = {json.dumps(names[0])}")
            else:
                yield from ("", f"[bodies.{json.dumps(name or self._source.stem)}]")
            kind, turn = body.turn
            yield f"position = {json.dumps(body.place)}"
            yield f"{kind} = {json.dumps(turn)}"
            if kind == ANGLES:
                words = 'order = "XYZ"   # the order of turning; capital letters turn about axes of the body'
                yield self._ask("the order of the angles (order)", words)
                yield '# angle_unit = "deg"   # deg or rad'
        if not posed:
            yield from ("", self._ask("which columns are a pose", "[bodies.cup]"), '# position = ["...", "...", "..."]')
            yield '# quaternion_xyzw = ["...", "...", "...", "..."]'
        for name, body in self._bodies.items():
            if name not in posed and body.place:
                yield f"# {name or 'a body'} has a place and no rotation, so it is left out: {', '.join(body.place)}"

    def _clock(self) -> Iterator[str]:
        column = next((name for name in self._head.columns if _has_word(name, TIME)), "")
        if not column:
            words = "rate_hz = 90   # rows a second; the file has no column of time"
            yield self._ask("the rate (rate_hz), because there is no clock", words)
            return
        yield f"column = {json.dumps(column)}"
        cells, values = self._head.cells(column), self._head.numbers(column)
        form = text_format(cells[0]) if cells else None
        if form is not None:
            yield 'unit = "text"'
            yield f"format = {json.dumps(form)}" if form else "# ISO 8601"
            return
        unit, steps = _words(column)[1], [step for step in np.diff(values) if step > 0]
        if steps and unit not in ("s", "ms", "us", "ns"):
            step = float(np.median(steps))
            unit = next((name for name, low, high in STEPS if low <= step < high), "")
            if TICKS[0] <= values[0] < TICKS[1]:
                unit = "ticks"
        yield (
            f'unit = "{unit}"'
            if unit
            else self._ask("the unit of time", 'unit = "s"   # s, ms, us, ns or ticks (.NET)')
        )
        if values and values[0] < 0:
            yield f"offset = {-values[0]!r}   # in that unit: no stamp of a session lies before 0"


def _has_word(column: str, known: frozenset[str]) -> bool:
    return bool(known & {word.lower() for word in _words(column)[0]})


def text_format(cell: str) -> str | None:
    """The format of a wall-clock text: "" for ISO 8601, else as ``strptime`` takes it; ``None`` where it is none."""
    if _numbers([cell]):
        return None
    for form in ("", *FORMATS):
        try:
            _ = datetime.strptime(cell, form) if form else datetime.fromisoformat(cell)
        except ValueError:
            continue
        return form
    return None
