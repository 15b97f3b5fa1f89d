"""The meaning of the columns of a CSV and their units: by a mapping file, by the words of their names, or built in.

A unit stands in the heading of a column (`unit_in_name`), in the row of units below it (`unit_in_cell`), or in the
mapping; `with_stated_units` says which counts, and refuses what contradicts. The words are those of
``csv_vocabulary.toml``. The built-in mapping is for the CSV of the README's Unity script: a row per body and time, and
further rows for triggers and collisions.
"""

import re
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import permutations
from pathlib import Path
from typing import Any, Final

import numpy as np

from sessions.errors import ImportFileError, SessionError
from sessions.geometry.rotations import quaternion_from_matrix, quaternion_from_vector
from sessions.importers.given_meshes import MESH_KEYS
from sessions.importers.importing import QUATERNION_TOLERANCE, ROTATIONS
from sessions.importers.ledger import LARGEST_SECONDS, Numbers
from sessions.input_files import TomlTable, nearest, parse_toml, read_text
from sessions.meshes.axes_text import axes_as_text
from sessions.meshes.conventions import Convention, convention, quaternion_from_euler, same_euler_order

VOCABULARY: Final[dict[str, Any]] = tomllib.loads(Path(__file__).with_name("csv_vocabulary.toml").read_text("utf-8"))
"""What words of a column's name say: its kind, the axis of an angle, a unit; words of flags; and wall clocks."""
LENGTHS: Final = ("m", "cm", "mm", "inch", "ft")
"""Units of lengths that a mapping may say."""
STATED_LENGTHS: Final = (*LENGTHS, "um")
"""Units of lengths that a file may state; of one that no mapping has a person is asked."""
CLOCK_NS: Final[Mapping[str, float]] = {
    "s": 1e9,
    "ms": 1e6,
    "us": 1e3,
    "ns": 1.0,
    "min": 6e10,
    "h": 3.6e12,
    "ticks": 100.0,
}
"""Nanoseconds per unit of the clock; ``ticks`` are .NET's, counted from the year 1."""
TEXT: Final = "text"
"""The unit of a clock that is written as a date and a time."""
ANGLE_UNITS: Final = ("deg", "rad")
UNITS_OF_MAPPINGS: Final = (*LENGTHS, *CLOCK_NS, *ANGLE_UNITS)
STATED_UNIT: Final = re.compile(r"[\[(]\s*([^\])]+?)\s*[\])]")
"""What a column's name holds in brackets."""
UNITS: Final = frozenset(VOCABULARY["units"]) | frozenset(VOCABULARY["more_units"])
"""What may stand in a cell of the row of units."""
KNOWN_UNITS: Final = frozenset(VOCABULARY["units"].values())
"""Units as a mapping writes them, and those that no mapping has."""
SUFFIXES, TIME_SUFFIXES = frozenset(VOCABULARY["suffixes"]), frozenset(VOCABULARY["time_suffixes"])
TIME_TOKENS: Final = frozenset(VOCABULARY["time"])

ROLES: Final = ("pitch", "yaw", "roll")
"""Names of Euler angles by the directions of the body: about the axis to its right, up, and forward."""
ROTATION_KINDS: Final[Mapping[str, int]] = {
    "quaternion_xyzw": 4,
    "quaternion_wxyz": 4,
    "euler": 3,
    "rotation_vector": 3,
    "matrix": 9,
}
"""What a rotation may be, and how many columns hold it."""
ORDERS: Final = tuple(case("".join(axes)) for axes in permutations("xyz") for case in (str.upper, str.lower))
"""Orders of turning: capital letters turn about axes of the body, small ones about fixed axes."""
ROW_MAJOR: Final = tuple(f"m{row}{column}" for row in range(3) for column in range(4))
"""Names that KITTI's files leave out and logs of OpenVR have (HmdMatrix34_t of its openvr.h)."""
KINDS: Final = ("pose", "enter", "exit", "trigger", "event", "scalar")
OTHER, VALUE = "other", "value"
"""Columns of rows that are no poses."""
MOST_LINES: Final = 1000


def name_and_unit(column: str) -> tuple[list[str], str]:
    """The words of a name, and the unit that it states; one that no mapping has as it stands there."""
    stated = STATED_UNIT.search(column)
    tokens = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+", re.sub(r"[\[(].*?[\])]", "", column))
    unit = VOCABULARY["units"].get(stated[1].lower(), stated[1]) if stated else ""
    *before, last = [token.lower() for token in tokens] or [""]
    if before and (last in SUFFIXES or (last in TIME_SUFFIXES and not TIME_TOKENS.isdisjoint(before))):
        tokens.pop()
        unit = unit or VOCABULARY["units"][last]
    return tokens, unit


def name_tokens_of(column: str) -> list[str]:
    """Returns the words of a column's name."""
    return name_and_unit(column)[0]


def unit_in_name(column: str) -> str:
    """Returns the unit that a column's name states, as a mapping writes it, or ``""``.

    One that no mapping has is the text in the brackets.
    """
    return name_and_unit(column)[1]


def unit_in_cell(cell: str) -> str:
    """Returns the unit in a cell of the row of units, as a mapping writes it, or ``""``."""
    return str(VOCABULARY["units"].get(bare_unit(cell), ""))


def bare_unit(cell: str) -> str:
    """A unit in small letters, without brackets."""
    return cell.strip(" []()").lower()


def is_row_of_units(cells: Sequence[str]) -> bool:
    """Whether cells are units or empty, and one is a unit of a length, a time or an angle."""
    written = [bare_unit(cell) for cell in cells if cell.strip()]
    return any(cell in VOCABULARY["units"] for cell in written) and all(cell in UNITS for cell in written)


def stated_units(units: Iterable[str], kind: Collection[str]) -> list[str]:
    """Returns the different units of a kind, such as lengths, among those that columns state.

    A text in brackets that is no unit at all may be one of this kind.
    """
    return [*dict.fromkeys(unit for unit in units if unit and (unit in kind or unit not in KNOWN_UNITS))]


class Guessable(StrEnum):
    """Keys of a mapping that a draft may guess; those under ``guessed`` are nobody's word."""

    COLUMNS = "columns"
    LENGTH_UNIT = "units"
    TIME_UNIT = "time.unit"
    TIME_FORMAT = "time.format"
    QUATERNION_ORDER = "quaternion"
    EULER_ORDER = "order"
    ANGLE_UNIT = "angle_unit"


@dataclass(frozen=True)
class PoseColumns:
    """The columns of a pose: three of position, and a rotation of one of the kinds of ``ROTATION_KINDS``.

    A rotation vector is the axis times the angle; ``degrees`` is for it and for Euler angles. A matrix is row by row.
    """

    position: tuple[str, ...]
    rotation: tuple[str, ...]
    kind: str = "quaternion_xyzw"
    order: str = ""
    degrees: bool = True
    valid: str = ""
    signs: tuple[int, int, int] = (1, 1, 1)
    """Signs of Euler angles, in the order of their columns."""
    is_angle_unit_stated: bool = True
    is_order_stated: bool = True
    """Whether the mapping says the Euler order; else a convention fixes it."""
    are_roles: bool = False
    """Whether Euler angles are pitch, yaw and roll, in this order, whose axes the convention says."""

    @property
    def numbers(self) -> tuple[str, ...]:
        """The columns that hold numbers."""
        return self.position + self.rotation

    def in_order_of(self, convention: Convention, where: str) -> "PoseColumns":
        """Returns the columns with the Euler order and the signs that a convention fixes.

        Raises ImportFileError: the mapping says another order, or nobody says one.
        """
        if self.kind != "euler":
            return self
        fixed = convention.euler_order
        if fixed and self.order and not same_euler_order(fixed, self.order):
            text = axes_as_text(convention.matrix)
            raise ImportFileError(
                f"{where}: order = {self.order!r} contradicts convention {convention.name!r}, whose Euler order is "
                f"{fixed!r}; leave order out, or give the axes as text: convention = {text!r}"
            )
        if not fixed and not self.order:
            raise ImportFileError(
                f"{where}: nothing says the order of the Euler angles; give order, for example order = 'YXZ'"
            )
        order = self.order or fixed
        axes = role_axes(convention) if self.are_roles else self.order.lower() or "xyz"
        by_axis = dict(zip(axes, self.rotation, strict=True)) if len({*order.lower()}) == 3 else {}
        rotation = tuple(by_axis[axis] for axis in order.lower()) if by_axis else self.rotation
        signs = tuple(convention.euler_signs["xyz".index(axis)] for axis in order.lower())
        return replace(
            self, rotation=rotation, order=order, signs=(signs[0], signs[1], signs[2]), is_order_stated=bool(self.order)
        )

    def quaternions(self, rotations: Numbers) -> Numbers:
        """Quaternions xyzw (n, 4) of what stands behind the position in ``numbers`` (n, 3, 4 or 9); NaN: it is none."""
        if self.kind == "matrix":
            return _of_matrices(rotations.reshape(-1, 3, 3))
        if self.kind == "quaternion_wxyz":
            return rotations[:, [1, 2, 3, 0]]
        if self.kind == "quaternion_xyzw":
            return rotations
        angles = np.radians(rotations) if self.degrees else rotations
        if self.kind == "rotation_vector":
            with np.errstate(over="ignore", invalid="ignore"):
                return quaternion_from_vector(angles)
        return quaternion_from_euler(angles * np.array(self.signs), self.order)


def role_axes(convention: Convention) -> str:
    """Returns the axes of pitch, yaw and roll: those that point right, up, and forward or back."""
    return "".join("xyz"[axis] for axis in convention.axes)


def _of_matrices(matrices: Numbers) -> Numbers:
    """Quaternions (n, 4) of matrices (n, 3, 3); NaN where one is no rotation, mirrored or scaled."""
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(matrices @ matrices.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0)
        is_rotation = (off <= QUATERNION_TOLERANCE) & (np.linalg.det(matrices) > 0.0)
    quaternions = np.full((len(matrices), 4), np.nan)
    for row in np.flatnonzero(is_rotation):
        quaternions[row] = quaternion_from_matrix(matrices[row])
    return quaternions


@dataclass(frozen=True)
class CsvLayout:
    """How the text of a file becomes cells, and a clock stamps."""

    delimiter: str = ","
    decimal: str = "."
    table: str = ""
    """Title of the table to read where a file holds several; ``""``: the first."""
    skip_lines: int = 0
    """Lines above the header, or between it and the title of its table."""
    header_lines: int = 1
    """Of several, a column's name is all its words, with spaces between them."""
    columns: tuple[str, ...] = ()
    """Names of the columns of a file that does not name them."""
    rate_hz: float = 0.0
    """Rows a second of a file without a clock."""
    format: str = ""
    """Of a clock in text, as ``datetime.strptime`` takes it; "": ISO 8601."""
    offset_ns: int = 0
    """What is added to every stamp."""


@dataclass(frozen=True)
class CsvMapping:
    """A mapping; ``bodies`` is set for a wide table (columns per body), ``body`` for a long one (a row per body).

    Without a column ``time`` the rows come at the layout's rate."""

    time: str
    unit: str
    convention: str = ""
    units: str = ""
    """One of ``LENGTHS``; "": that of the headings, of the convention, or else metres."""
    layout: CsvLayout = CsvLayout()
    name: str = ""
    body: PoseColumns | None = None
    bodies: Mapping[str, PoseColumns] = field(default_factory=dict)
    kind: str = ""
    """The column that says what a row of a long table is, one of ``KINDS``; rows of other words are left out."""
    scalars: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """Column and unit of numbers over time, by their names."""
    guessed: frozenset[str] = frozenset()
    """Keys, of ``Guessable``, that a draft guessed and nobody has checked."""
    rotations: str = ""
    """One of ``ROTATIONS``; "": from the body to the world, as a pose."""

    @property
    def poses(self) -> tuple[PoseColumns, ...]:
        """The columns of all bodies."""
        return (self.body, *self.bodies.values()) if self.body is not None else tuple(self.bodies.values())

    def in_order_of(self, axes: Convention, where: str) -> "CsvMapping":
        """Returns the mapping with the Euler orders and the signs that a convention fixes; raises as of a pose."""
        body = self.body and self.body.in_order_of(axes, f"{where}: [body]")
        bodies = {name: columns.in_order_of(axes, f"{where}: [bodies.{name}]") for name, columns in self.bodies.items()}
        return replace(self, body=body, bodies=bodies)


UNITY: Final = CsvMapping(
    time="time",
    unit="s",
    convention="unity",
    name="body",
    body=PoseColumns(("px", "py", "pz"), ("qx", "qy", "qz", "qw"), valid="tracked"),
    kind="kind",
)
"""The CSV of the README's Unity script."""


def read_mapping(path: str | Path) -> CsvMapping:
    """The mapping of a TOML file.

    Raises ``ImportFileError``: all faults at once, each with file, table and key, and what to do.
    """
    with mapping_table(path) as whole:
        clock = whole.table("time") or whole.within({}, "[time]")
        rate = clock.number("rate_hz", 0.0)
        column, unit = "", "s"
        if rate <= 0.0:
            column, unit = clock.text("column", None), clock.text("unit", None, (*CLOCK_NS, TEXT))
        form, offset_ns = clock.text("format"), clock.number("offset", 0.0) * CLOCK_NS.get(unit, 1e9)
        if abs(offset_ns) > LARGEST_SECONDS * 1e9:
            clock.refuse("offset is beyond the years that nanoseconds reach; check its unit")
            offset_ns = 0.0
        clock.done()
        scalars = {}
        for name, table in whole.named_tables("scalars").items():
            scalars[name] = table.text("column", None), table.text("unit")
            table.done()
        long = whole.table("body")
        wide = whole.named_tables("bodies")
        if (long is None) == (not wide):
            whole.refuse("give either [body] (a row per body and time) or [bodies.NAME] (columns per body)")
        return CsvMapping(
            time=column,
            unit=unit,
            convention=convention_key(whole),
            units=whole.text("units", "", LENGTHS),
            layout=CsvLayout(
                delimiter=_letter(whole, "delimiter", ","),
                decimal=_letter(whole, "decimal", "."),
                table=whole.text("table"),
                skip_lines=whole.count("skip_lines", 0, 0, MOST_LINES),
                header_lines=whole.count("header_lines", 1, 1, MOST_LINES),
                columns=whole.texts("columns"),
                rate_hz=rate,
                format=form,
                offset_ns=round(offset_ns),
            ),
            name=long.text("name", None) if long is not None else "",
            body=pose_columns(long) if long is not None else None,
            bodies={name: pose_columns(table) for name, table in wide.items()},
            scalars=scalars,
            guessed=_guessed_keys(whole),
            rotations=rotations_key(whole),
        )


@contextmanager
def mapping_table(path: str | Path) -> Iterator[TomlTable]:
    """The table of a mapping file; ImportFileError at the end: all its faults, each with file, table and key."""
    faults: list[str] = []
    whole = parse_toml(read_text(path, "mapping", ImportFileError), Path(path).name, ImportFileError, faults)
    yield whole
    whole.done(MESH_KEYS)
    if faults:
        raise ImportFileError("; ".join(faults))


def convention_key(whole: TomlTable) -> str:
    """Returns the name or the text of axes under ``convention``; one that nobody knows is refused."""
    name = whole.text("convention")
    try:
        return convention(name).name if name else ""
    except SessionError as error:
        whole.refuse(str(error))
        return ""


def rotations_key(whole: TomlTable) -> str:
    """Returns the direction of rotations under ``rotations``, or ``""``."""
    return whole.text("rotations", "", ROTATIONS)


def _guessed_keys(whole: TomlTable) -> frozenset[str]:
    """The keys under ``guessed``; one that no draft guesses is refused."""
    keys = whole.texts("guessed")
    known = [str(key) for key in Guessable]
    for key in keys:
        if key not in known:
            whole.refuse(f"guessed holds {key!r}{nearest(key, known)}")
    return frozenset(keys)


def _letter(table: TomlTable, key: str, default: str) -> str:
    letter = table.text(key, default)
    if len(letter) != 1 or not letter.isascii() or letter in '"\r\n':
        table.refuse(f"{key} is {letter!r}; give one character")
        return default
    return letter


def pose_columns(table: TomlTable) -> PoseColumns:
    """Reads the columns of a pose from a table of a mapping; nothing else may be in it."""
    kinds = [kind for kind in ROTATION_KINDS if kind in table]
    if len(kinds) != 1:
        table.refuse(
            "give quaternion_xyzw or quaternion_wxyz = [4 columns], euler = {x = column, y = column, z = column} or "
            "{pitch = column, yaw = column, roll = column} with order, rotation_vector = [3 columns], or "
            "matrix = [9 columns, row by row]"
        )
    kind = kinds[0] if kinds else ""
    rotation, order, degrees, are_roles = tuple[str, ...](), "", True, False
    is_angle_unit_stated = "angle_unit" in table
    if kind == "euler":
        order = table.text("order", "", ORDERS)
        axes = table.table(kind) or table.within({}, kind)
        are_roles = any(role in axes for role in ROLES)
        rotation = tuple(axes.text(axis, None) for axis in (ROLES if are_roles else order.lower() or "xyz"))
        axes.done()
        degrees = table.text("angle_unit", "deg", ("deg", "rad")) == "deg"
    elif kind:
        rotation = table.texts(kind, ROTATION_KINDS[kind])
    if kind == "rotation_vector":
        degrees = table.text("angle_unit", None, ("deg", "rad")) == "deg"
    columns = PoseColumns(
        position=table.texts("position", 3),
        rotation=rotation,
        kind=kind,
        order=order,
        degrees=degrees,
        valid=table.text("valid"),
        is_angle_unit_stated=is_angle_unit_stated,
        are_roles=are_roles,
    )
    table.done()
    return columns


def with_stated_units(plan: CsvMapping, unit_of: Callable[[str], str], source: Path) -> CsvMapping:
    """Returns the mapping with the units that the headings or the row of units state, where it leaves them out.

    ``unit_of``: column -> the unit that the file states of it, or ``""``.

    Raises ImportFileError: the mapping contradicts them, columns state several, or one that no mapping has.
    """
    if plan.kind:
        return plan
    positions = [column for pose in plan.poses for column in pose.position]
    _agreed_unit([plan.time] if plan.time else [], plan.unit, [*CLOCK_NS], "unit", unit_of, source)
    length_unit = _agreed_unit(positions, plan.units, STATED_LENGTHS, "units", unit_of, source)
    body = _with_angle_unit(plan.body, unit_of, source) if plan.body else None
    bodies = {name: _with_angle_unit(columns, unit_of, source) for name, columns in plan.bodies.items()}
    return replace(plan, units=length_unit, body=body, bodies=bodies)


def _with_angle_unit(pose: PoseColumns, unit_of: Callable[[str], str], source: Path) -> PoseColumns:
    if pose.kind not in ("euler", "rotation_vector"):
        return pose
    mapped = ("deg" if pose.degrees else "rad") if pose.is_angle_unit_stated else ""
    unit = _agreed_unit(pose.rotation, mapped, ANGLE_UNITS, "angle_unit", unit_of, source)
    return replace(pose, degrees=unit != "rad")


def _agreed_unit(
    columns: Sequence[str], mapped: str, kind: Collection[str], key: str, unit_of: Callable[[str], str], source: Path
) -> str:
    """The unit of columns: that of the mapping, where it does not contradict what they state, or else theirs.

    ``mapped``: the unit under ``key`` of the mapping, or ``""``.
    """
    stated = stated_units(map(unit_of, columns), kind)
    if mapped:
        stated = [unit for unit in stated if unit in kind]
    if not stated or stated == [mapped] or mapped == TEXT:
        return mapped
    where = f"{source}: the columns {', '.join(columns)} state {' and '.join(stated)}"
    if mapped:
        raise ImportFileError(
            f'{where}, and the mapping says {key} = "{mapped}"; correct one of them, or name the columns in the mapping'
        )
    if len(stated) > 1 or stated[0] not in UNITS_OF_MAPPINGS:
        raise ImportFileError(f"{where}; convert them to one unit that a mapping has, and say it: {key}")
    return stated[0]
