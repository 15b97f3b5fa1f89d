"""A draft of a mapping for a CSV that nobody has described: what its header and its first rows give away.

What they do not give away (the unit of lengths, the axes, the order of angles or of a quaternion) is a commented line
for a person.
"""

import json
import re
from collections.abc import Collection, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import islice, pairwise
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from sessions.errors import ImportFileError
from sessions.importers.csv_columns_and_units import (
    CLOCK_NS,
    LENGTHS,
    ROLES,
    ROW_MAJOR,
    STATED_LENGTHS,
    TEXT,
    VOCABULARY,
    CsvLayout,
    Guessable,
    PoseColumns,
    name_tokens_of,
    stated_units,
    unit_in_cell,
)
from sessions.importers.csv_head import CsvHead, text_format
from sessions.importers.csv_long_table import (
    column_of_bodies,
    column_of_separate_bodies,
    is_interleaved,
    order_of,
    repeats_within,
)
from sessions.importers.csv_missing import without_sentinels
from sessions.importers.csv_table import CsvTable, is_yes
from sessions.importers.ledger import is_large_loss, rows_lost
from sessions.importers.unstated_units import time_unit_by_steps
from sessions.input_files import open_input
from sessions.meshes.conventions import CONVENTIONS
from sessions.meshes.conventions import convention as convention_named

POSITION, XYZW, ANGLES, MATRIX = "position", "quaternion_xyzw", "euler", "matrix"
UNORDERED: Final = "quaternion"
"""The kind of four columns whose order their names do not tell."""
SCALAR_FIRST: Final = "quaternion_wxyz"
NINE: Final = "012345678"
KIND_OF: Final = {word: kind for kind in (POSITION, XYZW, ANGLES) for word in VOCABULARY[kind]}
OTHER, NOISE, TIME, NAMES, VALID = (frozenset(VOCABULARY[kind]) for kind in ("other", "noise", "time", "name", "valid"))
FLAG_TOKENS: Final = frozenset(("is", "was"))
ANGLE_NAMES: Final = VOCABULARY["angle_axes"]
AXIS: Final = re.compile(r"([a-z]*?)([xyzw])")
QUATERNION: Final = frozenset(VOCABULARY[XYZW])
NEARLY_AT_REST: Final = 0.9
"""The size of a quaternion's scalar in the first row from which a body has hardly turned: 52 degrees."""


LARGEST_CLOCK_DIFFERENCE: Final = 0.03
"""Fraction of the time by which two clocks of one recording differ at most: more than any drifts."""

AXES_UNKNOWN: Final = "the axes (convention)"
UNIT_UNKNOWN: Final = "the unit of lengths (m unless you say otherwise)"
ORDER_UNKNOWN: Final = "the order of the angles (order)"
"""A convention that fixes the order says it; of numbers that may be a rotation vector too, more is unknown."""


class UnknownColumnsError(ImportFileError):
    """A CSV of no known log; ``draft`` is a mapping to be checked and completed, ``unknown`` what it lacks.

    ``format`` is that of the import that takes the mapping.
    """

    def __init__(
        self, source: Path, columns: Sequence[str], draft: str, unknown: Sequence[str], format: str = "csv"
    ) -> None:
        self.draft, self.unknown, self.format = draft, tuple(dict.fromkeys(unknown)), format
        listed = ", ".join(columns[:24]) + (", ..." if len(columns) > 24 else "")
        super().__init__(f"{source}: its columns are of no known log: {listed}; describe them with --mapping FILE")

    def unknown_beside(self, convention: str) -> list[str]:
        """Returns what the draft lacks beside all that these axes say; ``""``: nobody named any.

        Raises SessionError: no such axes.
        """
        known = {AXES_UNKNOWN} if convention else set()
        if convention and convention_named(convention).euler_order:
            known.add(ORDER_UNKNOWN)
        return [text for text in self.unknown if text not in known]

    def draft_with_axes(self, convention: str) -> str:
        """Returns the draft with these axes; ``""``: it lacks more than they say and a unit that may be the usual one.

        Raises SessionError: no such axes.
        """
        if not {*self.unknown_beside(convention)} <= {UNIT_UNKNOWN}:
            return ""
        return re.sub(r"^# convention = .*$", f"convention = {json.dumps(convention)}", self.draft, flags=re.MULTILINE)


def draft_of(head: CsvHead, table: CsvTable) -> UnknownColumnsError:
    """The error that says what the columns are, with a draft of their mapping."""
    gaps = _Gaps()
    title, *lines = _lines(head, table, gaps)
    draft = "\n".join([title, *_guessed_line(gaps), *lines, ""])
    return UnknownColumnsError(head.source, head.columns, draft, gaps.unknown)


@dataclass
class _Gaps:
    """The keys of a mapping that a draft guessed, and words on what it leaves to a person."""

    guessed: list[Guessable] = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)


def _guessed_line(gaps: _Gaps) -> Iterator[str]:
    if gaps.guessed:
        yield f"guessed = {json.dumps(gaps.guessed)}   # the file does not say these: take out what you have checked"


def _columns_with_words(head: CsvHead, names: frozenset[str]) -> list[str]:
    """The columns in whose names one of these words is."""
    return [name for name in head.columns if not names.isdisjoint(word.lower() for word in name_tokens_of(name))]


WHOLE: Final = {POSITION: "xyz", XYZW: "xyzw"}
"""Kind of column -> the axes of a whole one."""


@dataclass
class _Body:
    """The columns of a body by what they hold and their axis."""

    columns: dict[tuple[str, str], str] = field(default_factory=dict)
    repeated: list[tuple[str, str]] = field(default_factory=list)
    """Pairs of columns that hold the same by their names, such as a place in the world and in the parent's frame."""

    def columns_of(self, kind: str, axes: str) -> list[str]:
        """The columns of all these axes, or none."""
        columns = [self.columns.get((kind, axis), "") for axis in axes]
        return columns if all(columns) else []

    @property
    def position(self) -> list[str]:
        return self.columns_of(POSITION, "xyz")

    @property
    def lack(self) -> str:
        """Returns words on what nearly a whole pose lacks, in its position or its quaternion; else ``""``."""
        missing = {kind: [axis for axis in axes if (kind, axis) not in self.columns] for kind, axes in WHOLE.items()}
        has_rotation = bool(self.rotation[1])
        if has_rotation and 0 < len(missing[POSITION]) < len(WHOLE[POSITION]):
            return f"its position has no {' and no '.join(missing[POSITION])}"
        if self.position and not has_rotation and 0 < len(missing[XYZW]) < len(WHOLE[XYZW]):
            return f"its quaternion has no {' and no '.join(missing[XYZW])}"
        return ""

    @property
    def rotation(self) -> tuple[str, list[str]]:
        """The kind of the rotation, and its columns; three numbers called a rotation are angles."""
        for kind, axes in ((XYZW, "xyzw"), (MATRIX, NINE)):
            if columns := self.columns_of(kind, axes):
                return kind, columns
        unordered = sorted(axis for kind, axis in self.columns if kind == UNORDERED)
        if len(unordered) == len("xyzw"):
            return UNORDERED, [self.columns[UNORDERED, axis] for axis in unordered]
        return ANGLES, self.columns_of(ANGLES, "xyz") or self.columns_of(XYZW, "xyz")


def _keys(layout: CsvLayout) -> dict[str, object]:
    """The keys of a mapping by which a file is read as its head is."""
    keys: dict[str, object] = {}
    if layout.delimiter != ",":
        keys["delimiter"] = layout.delimiter
    if layout.decimal != ".":
        keys["decimal"] = layout.decimal
    if layout.columns:
        keys["columns"] = layout.columns
    if layout.skip_lines:
        keys["skip_lines"] = layout.skip_lines
    return keys


@dataclass(frozen=True)
class _Reading:
    """A choice of the words of a column's name that say what the column holds; all others name the body.

    ``anywhere``: all words may, not only the one before the axis. ``single_characters``: words of one letter may, such
    as the v of a velocity; otherwise they name a body, such as the L of a left hand.
    """

    anywhere: bool
    single_characters: bool

    def kind_tokens(self, before: Sequence[str], *, axis_says_kind: bool) -> set[str]:
        """The words before an axis, in small letters, that may say what the column holds."""
        tokens = [word.lower() for word in before]
        if not self.anywhere:
            tokens = [] if axis_says_kind else [word for word in tokens if word not in NOISE][-1:]
        return {word for word in tokens if self.single_characters or len(word) > 1}


READINGS: Final = tuple(_Reading(anywhere, single) for anywhere in (False, True) for single in (False, True))
"""The more of a name a reading leaves to the body, the earlier it stands."""


def _bodies(columns: Sequence[str]) -> dict[str, _Body]:
    """The bodies by the reading in which most columns are of a whole pose, and fewest bodies lack a part of theirs."""
    if {*ROW_MAJOR} <= {*columns}:
        cells = {(POSITION, axis): name for axis, name in zip("xyz", ROW_MAJOR[3::4], strict=True)}
        matrix = [name for name in ROW_MAJOR if name[2] != "3"]
        return {"": _Body({**cells, **{(MATRIX, at): name for at, name in zip(NINE, matrix, strict=True)}})}
    return max((_bodies_by(columns, reading) for reading in READINGS), key=_posed_columns)


def _posed_columns(bodies: Mapping[str, _Body]) -> tuple[int, int]:
    """How many columns are of a body with a whole pose, and, below 0, how many bodies lack a part of it."""
    whole = [len(body.columns) for body in bodies.values() if body.position and body.rotation[1]]
    return sum(whole), len(whole) - len(bodies)


def _bodies_by(columns: Sequence[str], reading: _Reading) -> dict[str, _Body]:
    bodies: dict[str, _Body] = {}
    for column in columns:
        role = _role_of(column, reading)
        if role is not None:
            body = bodies.setdefault(role.body, _Body())
            first = body.columns.setdefault((role.kind, role.axis), column)
            if first != column:
                body.repeated.append((first, column))
    return bodies


class _Role(NamedTuple):
    """The body of a column, the kind of its number, and the axis."""

    body: str
    kind: str
    axis: str


def _role_of(column: str, reading: _Reading) -> _Role | None:
    """The role of a column in a pose by its name; ``None``: it has none."""
    tokens = name_tokens_of(column.replace("_RS_R", "").replace("_RS", ""))  # frames of EuRoC
    if not tokens:
        return None
    *before, last = tokens
    number = ""
    if last.isdigit() and before and not (reading.single_characters and before[-1].lower() in QUATERNION):
        # Behind the axis is the number of a body, as in x1, or in x.1 where two columns had the name x.
        *before, last, number = tokens
    match, angle_axis = _axis_in(last), ANGLE_NAMES.get(last.lower(), "")
    kind_tokens = reading.kind_tokens(before, axis_says_kind=bool(angle_axis or (match and match[1])))
    if kind_tokens & OTHER:
        return None
    own = [word for word in before if word.lower() not in kind_tokens & {*KIND_OF} | NOISE]
    name = "_".join([*own, number]) if number else _name(column, own, kind_tokens)
    if last.isdigit():
        return _Role(name, UNORDERED, last)
    if angle_axis:
        return _Role(name, ANGLES, angle_axis)
    if match is None:
        return None
    kind = next(
        (KIND_OF[word.lower()] for word in reversed(before) if word.lower() in kind_tokens & {*KIND_OF}), POSITION
    )
    return _Role(name, KIND_OF.get(match[1], kind), match[2])


def _axis_in(word: str) -> re.Match[str] | None:
    """The kind and the axis in the last word of a name: ``x``, or ``qx``."""
    match = AXIS.fullmatch(word.lower())
    return match if match and match[1] in ("", *KIND_OF) else None


def _name(column: str, own: Sequence[str], kind_tokens: Collection[str]) -> str:
    """The body that a column is of, as it is written there: what is left without the words that say a kind."""
    if not own:
        return ""
    first = column.index(own[0])
    whole = column[first : column.index(own[-1], first) + len(own[-1])]
    return whole if not {*re.findall("[a-z]+", whole.lower())} & KIND_OF.keys() & {*kind_tokens} else "_".join(own)


ROTATION_KINDS = {ANGLES: "in angles", MATRIX: "a matrix", UNORDERED: "four numbers without names of axes"}


def plain_poses(columns: Sequence[str]) -> dict[str, PoseColumns]:
    """Returns the poses of bodies that columns name, of those whose rotations are quaternions that name their axes."""
    return {
        name: PoseColumns(tuple(body.position), tuple(body.rotation[1]), XYZW)
        for name, body in _bodies(columns).items()
        if name and body.position and body.rotation[0] == XYZW and body.rotation[1]
    }


def incomplete_poses(columns: Sequence[str]) -> dict[str, str]:
    """Returns the bodies that `plain_poses` does not take, and why; ``""`` is one without a name."""
    plain, reasons = plain_poses(columns), dict[str, str]()
    for name, body in _bodies(columns).items():
        kind, rotation = body.rotation
        if name in plain or not (body.position or rotation):
            continue
        if not body.position:
            reasons[name] = "it has no position"
        elif not rotation:
            reasons[name] = "it has no rotation"
        elif kind == XYZW:
            reasons[name] = "its columns have no name"
        else:
            reasons[name] = f"its rotation is {ROTATION_KINDS[kind]}"
    return reasons


def _lacks(bodies: Mapping[str, _Body], posed: Container[str]) -> Iterator[str]:
    """Yields words on the bodies whose pose is nearly whole."""
    for name, body in bodies.items():
        if name not in posed and (lack := body.lack):
            yield f"the pose of {name or 'the body'!r}, for {lack}"
    unplaced = [name for name, body in bodies.items() if body.rotation[1] and not body.position and not body.lack]
    unrotated = [name for name, body in bodies.items() if body.position and not body.rotation[1] and not body.lack]
    if unplaced and unrotated:  # points alone have no rotation, and need none
        yield f"the pose of {unrotated[0]!r}, for it has no rotation, and {unplaced[0]!r} has no position"


def _lines(head: CsvHead, table: CsvTable, gaps: _Gaps) -> Iterator[str]:
    """How to read the file, as TOML; what the file does not tell is a commented line, and goes to ``gaps``."""
    bodies, clock = _bodies(head.columns), clock_of(head)
    yield f"# How to read {head.source.name}: a draft of its header. Check it, and complete what is commented."
    yield from (f"{key} = {json.dumps(value)}" for key, value in _keys(head.layout).items())
    if head.columns_by_number:
        gaps.guessed.append(Guessable.COLUMNS)
    gaps.unknown.append(AXES_UNKNOWN)
    yield f'# convention = "unity"   # which axes? one of: {", ".join(CONVENTIONS)}'
    posed = {name: body for name, body in bodies.items() if body.position and body.rotation[1]}
    yield _units(head, [column for body in (posed or bodies).values() for column in body.position], gaps)
    yield from ("", "[time]", *_clock(head, clock, gaps))
    for first, second in [pair for body in posed.values() for pair in body.repeated][:1]:
        gaps.unknown.append(f"which of the columns {first!r} and {second!r} is meant")
    gaps.unknown += _lacks(bodies, posed)
    names = [name for name in _columns_with_words(head, NAMES) if not head.numbers(name)]
    lost = ""
    if ("" in posed or len(posed) == 1) and clock.column:
        numbered = [name for name in _columns_with_words(head, NAMES) if head.numbers(name)]
        if "" not in posed:
            # The columns of a pose have a name of their own: that of a body, unless rows are of several.
            names, numbered = [], [*names, *numbered]
        names, lost = _names_of_bodies(table, clock, names, numbered, bodies)
    if lost and names:
        gaps.unknown.append(f"which rows are left out, for {lost}")
        yield from ("", f"# {lost[0].upper()}{lost[1:]}.")
    elif lost:
        gaps.unknown.append(f"which column tells bodies apart, for as one body {lost}")
        yield from (
            "",
            f"# As one body {lost}.",
            '# If a column tells bodies apart, write [body] and name = "COLUMN" here:',
        )
    gaps.unknown += _by_row(head, table, names, posed)
    flags = _flag_columns(head, posed)
    for name, body in posed.items():
        is_long = bool(names) and (not name or len(posed) == 1)
        title = (
            ["[body]", f"name = {json.dumps(names[0])}"]
            if is_long
            else [f"[bodies.{json.dumps(name or head.source.stem)}]"]
        )
        lines = [*title, f"position = {json.dumps(body.position)}", *_rotation(head, body, gaps)]
        lines += _valid(flags[name], gaps)
        yield from ("", *([f"# {line}" for line in lines] if lost and (not name or len(posed) == 1) else lines))
    if not posed:
        gaps.unknown.append("which columns are a pose")
        yield from ("", "# [bodies.cup]", '# position = ["...", "...", "..."]')
        yield '# quaternion_xyzw = ["...", "...", "...", "..."]'
    for name, body in bodies.items():
        if name not in posed and body.position:
            yield f"# {name or 'a body'} has a place and no rotation, so it is left out: {', '.join(body.position)}"


def _by_row(head: CsvHead, table: CsvTable, names: Collection[str], bodies: Collection[str]) -> Iterator[str]:
    """Yields what columns that no draft reads may change from row to row: the frame of a pose, its unit, its loss.

    ``bodies`` with a pose: a state in numbers is that of a pose only if its column names a body or nothing else.
    """
    frames, units, seen, states = (frozenset(VOCABULARY[kind]) for kind in ("frames", "units_by_row", "seen", "states"))
    names_of_bodies = {"", *("".join(name_tokens_of(body)).lower() for body in bodies)}
    for column in head.columns:
        words = {word.lower() for word in name_tokens_of(column)}
        if not words & (frames | units | seen | states) or words & VALID or column in names:
            continue
        if table.count_different(column) < 2 and not words & units:
            continue
        if words & frames and not head.numbers(column):
            yield f"whether the poses of a row are in the frame that column {column!r} names"
        elif words & units and any(map(unit_in_cell, head.cells(column))):
            yield f"the unit of lengths, which column {column!r} says for each row"
        elif words & seen or (
            words & states
            and all(is_yes(cell) is not None for cell in head.cells(column))
            and (not head.numbers(column) or "".join(_tokens_besides(column, states)) in names_of_bodies)
        ):
            yield f"whether column {column!r} says which poses are lost (valid takes a column of 1 and 0)"


def _tokens_besides(column: str, tokens: Collection[str]) -> list[str]:
    """Returns the words of a column's name, in small letters, without some."""
    return [token.lower() for token in name_tokens_of(column) if token.lower() not in tokens]


def _flag_columns(head: CsvHead, bodies: Collection[str]) -> dict[str, list[str]]:
    """The columns that say whether a pose of each body is valid: those of its name, or else those of no name.

    Of a single body it is every such column.
    """
    flags: dict[str, list[str]] = {}
    for column in _columns_with_words(head, VALID):
        own = [token.lower() for token in name_tokens_of(column)]
        body = "".join(token for token in own if token not in {*VALID, *FLAG_TOKENS, *KIND_OF, *NOISE})
        flags.setdefault(body, []).append(column)
    if len(bodies) == 1:
        return {name: [column for columns in flags.values() for column in columns] for name in bodies}
    return {name: flags.get("".join(name_tokens_of(name)).lower(), flags.get("", [])) for name in bodies}


def _valid(columns: Sequence[str], gaps: _Gaps) -> list[str]:
    """The key of the column that says whether a pose is valid; of several a person takes one."""
    if len(columns) <= 1:
        return [f"valid = {json.dumps(column)}" for column in columns]
    gaps.unknown.append(f"which of the columns {' and '.join(map(repr, columns))} says whether a pose is valid")
    return [f"# valid = {json.dumps(column)}" for column in columns]


def _units(head: CsvHead, columns: Sequence[str], gaps: _Gaps) -> str:
    """The unit of lengths."""
    stated = stated_units(map(head.stated_unit, columns), STATED_LENGTHS)
    if len(stated) == 1 and stated[0] in LENGTHS:
        return f'units = "{stated[0]}"'
    above = _units_above(head)
    if stated:
        gaps.unknown.append(f"the unit of lengths (the headings say {', '.join(stated)})")
    elif above:
        gaps.unknown.append(f"the unit of lengths (a line above the header says {', '.join(above)})")
    else:
        gaps.unknown.append(UNIT_UNKNOWN)
    numbers = [number for column in columns for number in without_sentinels(head.numbers(column))]
    limits = f"places run from {min(numbers):g} to {max(numbers):g}" if numbers else ""
    return f'# units = "m"   # {", ".join(LENGTHS[:-1])} or {LENGTHS[-1]}? {limits}'


def _units_above(head: CsvHead) -> list[str]:
    """The units of lengths that lines above the header name; of one letter or two those behind the word unit."""
    with open_input(head.source, "recording", ImportFileError) as stream:
        lines = [*islice(stream, head.layout.skip_lines)]
    units = list[str]()
    for line in lines:
        words = re.findall("[a-zµμ]+", line.decode("utf-8", errors="replace").lower())
        for before, word in pairwise(["", *words]):
            if len(word) > 2 or word in ("mm", "cm") or before in VOCABULARY["units_by_row"]:
                units.append(unit_in_cell(word))
    return [unit for unit in dict.fromkeys(units) if unit in STATED_LENGTHS]


def _rotation(head: CsvHead, body: _Body, gaps: _Gaps) -> Iterator[str]:
    """The rotation of a body."""
    kind, rotation = body.rotation
    if kind == UNORDERED:
        gaps.unknown.append(f"the order of the quaternion ({XYZW} or {SCALAR_FIRST})")
        yield f"# In which order? The file does not tell{_likely_order(head, rotation)}. Take one of the two:"
        yield f"# {XYZW} = {json.dumps(rotation)}   # x, y, z, w"
        yield f"# {SCALAR_FIRST} = {json.dumps(rotation)}   # w, x, y, z"
        return
    if kind != ANGLES:
        yield f"{kind} = {json.dumps(rotation)}"
        return
    # By their axes or roles, whatever order a person writes below; which axis a role is depends on the convention.
    roles = [name_tokens_of(column)[-1].lower() for column in rotation]
    names = roles if {*roles} == {*ROLES} else "xyz"
    angles = ", ".join(f"{name} = {json.dumps(column)}" for name, column in zip(names, rotation, strict=True))
    yield f"{kind} = {{{angles}}}"
    is_vector_possible = rotation == body.columns_of(XYZW, "xyz")
    gaps.unknown.append("the order of the angles (order), or rotation_vector" if is_vector_possible else ORDER_UNKNOWN)
    yield '# order = "XYZ"   # the order of turning; capital letters turn about axes of the body'
    yield '# angle_unit = "deg"   # deg or rad'
    if is_vector_possible:
        yield f"# rotation_vector = {json.dumps(rotation)}   # in place of euler and order, if it is axis times angle"


def _likely_order(head: CsvHead, rotation: Sequence[str]) -> str:
    """A guess of which of four numbers is the scalar, which is near 1 where a body has hardly turned; else nothing."""
    sizes = [float(np.abs(head.numbers(column)[:1]).sum()) for column in (rotation[0], rotation[-1])]
    if max(sizes) < NEARLY_AT_REST or min(sizes) > 1.0 - NEARLY_AT_REST:
        return ""
    column, order = (rotation[0], "scalar first") if sizes[0] > sizes[1] else (rotation[-1], "scalar last")
    return f"; {column} begins near 1, so that {order} is likely"


class Clock(NamedTuple):
    """The column of time, its unit ("" where nothing tells it), and the format of a clock in text."""

    column: str
    unit: str
    format: str = ""


def clock_of(head: CsvHead) -> Clock:
    """The clock of a file as far as its head tells."""
    column = next(iter(_columns_with_words(head, TIME)), "")
    if not column:
        return Clock("", "")
    form = text_format(head.cells(column))
    if form is not None:
        return Clock(column, TEXT, form)
    unit = head.stated_unit(column)
    if unit and unit not in CLOCK_NS:
        return Clock(column, "")
    return Clock(column, unit or time_unit_by_steps(head.numbers(column)))


def _increases(head: CsvHead, column: str) -> bool:
    """Whether a column holds a larger number in every row, as clocks and numbers of rows do."""
    values = head.numbers(column)
    return len(values) == len(head.rows) > 1 and bool((np.diff(values) > 0).all())


def _clock(head: CsvHead, clock: Clock, gaps: _Gaps) -> Iterator[str]:
    """The keys under ``[time]``."""
    if not clock.column:
        gaps.unknown.append("the rate (rate_hz), because there is no clock")
        yield "# rate_hz = 90   # rows a second; no column is called like a time"
        for column in filter(partial(_increases, head), head.columns):
            yield f"# column = {json.dumps(column)}   # in place of rate_hz, if it is the time: it increases"
        return
    yield f"column = {json.dumps(clock.column)}"
    if clock.unit == TEXT:
        yield 'unit = "text"'
        yield f"format = {json.dumps(clock.format)}" if clock.format else "# ISO 8601"
        if clock.format:
            gaps.guessed.append(Guessable.TIME_FORMAT)
        return
    if not clock.unit:
        gaps.unknown.append(f"the unit of time{_unclear_clock(head, clock.column)}")
    elif clock.unit != head.stated_unit(clock.column):
        gaps.guessed.append(Guessable.TIME_UNIT)
    if clock.unit and (other := _other_clock(head, clock)):
        gaps.unknown.append(f"which of the columns {clock.column!r} and {other!r} is the clock")
        yield f"# column = {json.dumps(other)}   # or this one, with its unit: it runs at another rate"
    yield f'unit = "{clock.unit}"' if clock.unit else '# unit = "s"   # s, ms, us, ns, min, h or ticks (.NET)'
    values = head.numbers(clock.column)
    if values and values[0] < 0:
        yield f"offset = {-values[0]!r}   # in that unit: no stamp of a session lies before 0"


def _other_clock(head: CsvHead, clock: Clock) -> str:
    """Another column that is called like a time and runs at another rate than the clock, or ``""``."""
    elapsed_ns = _elapsed_ns(head, clock.column, clock.unit)
    for column in _columns_with_words(head, TIME):
        unit = head.stated_unit(column) or time_unit_by_steps(head.numbers(column))
        if column == clock.column or unit not in CLOCK_NS or not _increases(head, column):
            continue
        other_ns = _elapsed_ns(head, column, unit)
        if abs(other_ns - elapsed_ns) > LARGEST_CLOCK_DIFFERENCE * max(other_ns, elapsed_ns):
            return column
    return ""


def _elapsed_ns(head: CsvHead, column: str, unit: str) -> float:
    """Nanoseconds from the first to the last of the first rows by a clock in this unit."""
    values = head.numbers(column)
    return (values[-1] - values[0]) * CLOCK_NS[unit]


def _unclear_clock(head: CsvHead, column: str) -> str:
    """Why the first rows do not tell the unit of a clock, where it is more than a rate that several units may have."""
    values = head.numbers(column)
    if not head.rows:
        return f": there are no rows below the names of {len(head.columns)} columns"
    if not values:
        return f": {head.cells(column)[0]!r} is of no known format of times (format)"
    if len(values) > 1 and max(np.diff(values)) <= 0:
        return f": {column!r} never increases within the first {len(values)} rows"
    return ""


def _names_of_bodies(
    table: CsvTable, clock: Clock, names: list[str], numbered: list[str], bodies: Mapping[str, _Body]
) -> tuple[list[str], str]:
    """The columns that name bodies, by all rows, and what is lost where none does, or in spite of it.

    ``names``: columns of text that are called so; ``numbered``: others that may be it.
    """
    try:
        if clock.unit == TEXT:
            stamps = table.stamps(clock.column, TEXT, form=clock.format)
        else:
            stamps = order_of(table.numbers((clock.column,))[:, 0])
    except ImportFileError:  # the import by the mapping says what is wrong with the clock
        return names, ""
    groups = table.rows_by_text(names[0]).values() if names else [np.ones(len(table), dtype=np.bool_)]
    lost = rows_lost(stamps, groups)
    if is_large_loss(lost, len(table)):  # rows that stand twice are merged
        distinct = table.distinct_rows()
        lost = rows_lost(stamps, [rows & distinct for rows in groups])
    used = [clock.column, *(column for body in bodies.values() for column in body.columns.values())]
    if not is_large_loss(lost, len(table)):
        # Rows whose stamps all differ are those of one body, unless a column of names takes turns.
        if names:
            return names, ""
        alternating = (column for column in numbered if is_interleaved(table, column))
        named = [column for column in alternating if column == column_of_bodies(table, stamps, used)]
        position = next((body.position for body in bodies.values() if body.position), ())
        separate = column_of_separate_bodies(table, position, used) if position and not named else ""
        return named or [*filter(None, [separate])], ""
    column = names[0] if names else column_of_bodies(table, stamps, used)
    if column:
        return [column], repeats_within(table, stamps, column, used)
    return [], f"{lost:,} of {len(table):,} rows are dropped: they repeat a stamp or go back"
