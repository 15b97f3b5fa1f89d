"""Finds joints of hands in the columns of a CSV, or in the texts of one of its columns, and what else stands there.

A wide table has columns for every joint ("L_XRHand_IndexTip_Px"), a long one a row for every joint (a column
``joint``); in both a column may say the side of a row.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from sessions.importers.csv_columns_and_units import VOCABULARY, PoseColumns
from sessions.importers.csv_draft import Clock, clock_of, incomplete_poses, plain_poses
from sessions.importers.csv_head import CsvHead
from sessions.importers.hands.joint_names import (
    NUMBERED,
    TOKEN,
    NamedJoint,
    joint_of,
    names_finger,
    side_in,
    tokens_of,
)

LEAST_JOINTS: Final = 8
"""Joints of a hand that a file names before it is taken for one of hands."""
MOST_LISTED: Final = 5
AXIS: Final = re.compile(r"([a-z]*?)([xyz])")
LETTER: Final = re.compile("[A-Za-z]")
IN_BRACKETS: Final = re.compile(r"[\[(].*?[\])]")
POSITION_TOKENS: Final = frozenset(VOCABULARY["position"])
ROTATION_TOKENS: Final = (frozenset(VOCABULARY["quaternion_xyzw"]) | frozenset(VOCABULARY["euler"])) - {"r"}
"""Without ``r``, which is the side of a joint."""
OTHER_TOKENS: Final = (frozenset(VOCABULARY["other"]) - {"b"}) | {"direction", "normal", "centre", "center", "scale"}
WITHOUT_MEANING: Final = frozenset(VOCABULARY["noise"])
VALID_TOKENS: Final = frozenset(VOCABULARY["valid"])
SIDE_COLUMNS: Final = frozenset({"hand", "side", "handedness", "type", "chirality"})
JOINT_COLUMNS: Final = frozenset({"joint", "joints", "landmark", "bone", "id", "index", "name", "keypoint"})
LONGEST_SIDE: Final = 3
"""Words of a text that says a side."""


@dataclass(frozen=True)
class JointColumns:
    """The columns of a joint: its position, its radius and the width of its finger (``""``: there is none)."""

    position: tuple[str, str, str]
    radius: str = ""
    width: str = ""


@dataclass(frozen=True)
class HandLayout:
    """The columns of a CSV that hold joints of hands.

    Parameters
    ----------
    clock : the column of time, its unit and its format.
    names : name in the file -> the joint.
    wide : name in the file -> the columns of the joint, where columns are named after joints.
    joint : the column that names the joint of a row, or ``""``; ``long``: the columns of that joint.
    side : the column that says left or right, or ``""``.
    valid : side -> the column that says whether that hand was tracked; ``""`` stands for every hand.
    unknown : names that begin with a finger, and are no known joint.
    bodies : columns of other poses, by their names.
    left_out : other bodies that are not taken, and why.
    numbered : how joints are numbered, or ``""``.
    """

    clock: Clock
    names: Mapping[str, NamedJoint]
    wide: Mapping[str, JointColumns] = field(default_factory=dict)
    joint: str = ""
    long: JointColumns | None = None
    side: str = ""
    valid: Mapping[str, str] = field(default_factory=dict)
    unknown: tuple[str, ...] = ()
    bodies: Mapping[str, PoseColumns] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)
    numbered: str = ""

    @property
    def positions(self) -> list[str]:
        """The columns of all positions of joints."""
        tables = [*self.wide.values(), *([self.long] if self.long else [])]
        return [column for table in tables for column in table.position]


def hand_layout(head: CsvHead, mapped: Mapping[str, NamedJoint] | None = None) -> HandLayout | None:
    """Returns where the joints stand; ``None``: the file is none of hands.

    ``mapped``: joints by their names in the file, as a mapping says them.
    """
    known = mapped or {}
    clock, side, valid = clock_of(head), _side_column(head), _valid_columns(head)
    wide, names, unknown = _wide_joints(head, known)
    if _count_joints(names) >= LEAST_JOINTS:
        used = {column for table in wide.values() for column in table.position}
        others = [column for column in head.columns if column not in used and not _is_of_hand(column, known)]
        return HandLayout(
            clock,
            names,
            wide,
            side=side,
            valid=valid,
            unknown=tuple(unknown),
            bodies=plain_poses(others),
            left_out=incomplete_poses(others),
        )
    joint, names, unknown, numbered = _joint_column(head, known)
    long = _row_position(head)
    if not joint or long is None:
        return None
    used = {*long.position, long.radius, long.width, clock.column, joint, side}
    others = [column for column in head.columns if column not in used and not _is_of_hand(column, known)]
    beside = [name for name in {**plain_poses(others), **incomplete_poses(others)} if name]
    return HandLayout(
        clock,
        names,
        joint=joint,
        long=long,
        side=side,
        valid=valid,
        unknown=tuple(unknown),
        left_out=dict.fromkeys(beside, "its columns repeat in the rows of joints"),
        numbered=numbered,
    )


def unknown_joints(names: Sequence[str]) -> str:
    """A sentence on names that begin with a finger and are no known joint."""
    listed = ", ".join(repr(name[:40]) for name in names[:MOST_LISTED])
    more = f" and {len(names) - MOST_LISTED} more" if len(names) > MOST_LISTED else ""
    verb = "are no known joints" if len(names) > 1 else "is no known joint"
    return (
        f'{listed}{more} {verb} of a hand; say in a mapping under [joints] which joint each is, or "" to leave it out'
    )


def _count_joints(names: Mapping[str, NamedJoint]) -> int:
    return len({entry.joint for entry in names.values() if entry.joint})


def _named_joint(name: str, known: Mapping[str, NamedJoint]) -> NamedJoint | None:
    if name in known:
        return known[name]
    return joint_of(tokens_of(name)) if LETTER.search(name) else None  # most cells are numbers


def _split_last_word(column: str, endings: frozenset[str]) -> tuple[str, str]:
    """A column's name without its last word and without such ``endings`` before it; and the last word."""
    tokens = [*re.finditer(TOKEN, IN_BRACKETS.sub("", column))]
    if len(tokens) > 2 and tokens[-1][0].lower() in VOCABULARY["units"]:
        tokens.pop()
    last = tokens.pop()[0].lower() if tokens else ""
    while tokens and tokens[-1][0].lower() in endings:
        tokens.pop()
    return (column[tokens[0].start() : tokens[-1].end()] if tokens else ""), last


def _position_of(column: str) -> tuple[str, str] | None:
    """The name and the axis of a column of a position; ``None``: it is none."""
    name, last = _split_last_word(column, POSITION_TOKENS | WITHOUT_MEANING)
    match = AXIS.fullmatch(last)
    is_position = match is not None and (not match[1] or match[1] in POSITION_TOKENS)
    if match is None or not is_position or not name or {*tokens_of(name)} & (OTHER_TOKENS | ROTATION_TOKENS):
        return None
    return name, match[2]


def _wide_joints(
    head: CsvHead, known: Mapping[str, NamedJoint]
) -> tuple[dict[str, JointColumns], dict[str, NamedJoint], list[str]]:
    """The columns of each joint, the joints by their names, and names of fingers that are no known joint."""
    positions: dict[str, dict[str, str]] = {}
    radii, widths = dict[tuple[str, ...], str](), dict[tuple[str, ...], str]()
    for column in head.columns:
        position = _position_of(column)
        if position is not None:
            positions.setdefault(position[0], {}).setdefault(position[1], column)
            continue
        name, last = _split_last_word(column, frozenset())
        if name and last in ("radius", "width"):
            (radii if last == "radius" else widths)[tuple(tokens_of(name))] = column
    wide, names, unknown = dict[str, JointColumns](), dict[str, NamedJoint](), list[str]()
    joints = set[NamedJoint]()
    for name, axes in positions.items():
        entry = _named_joint(name, known)
        if entry is None:
            unknown += [name] if names_finger(tokens_of(name)) else []
            continue
        names[name] = entry
        # Where a bone of Leap ends the next one starts: the same joint twice.
        if len(axes) == len("xyz") and entry.joint and entry not in joints:
            joints.add(entry)
            tokens = tuple(tokens_of(name))
            of_finger = (widths.get(tokens[:count], "") for count in range(len(tokens), 0, -1))
            wide[name] = JointColumns(
                (axes["x"], axes["y"], axes["z"]), radii.get(tokens, ""), next(filter(None, of_finger), "")
            )
    return wide, names, unknown


def _is_of_hand(column: str, known: Mapping[str, NamedJoint]) -> bool:
    """Whether a column is of a joint or a finger: its rotation, or something else that is left out."""
    name, _ = _split_last_word(column, POSITION_TOKENS | ROTATION_TOKENS | OTHER_TOKENS | WITHOUT_MEANING)
    return _named_joint(name, known) is not None or names_finger(tokens_of(name))


def _cells(head: CsvHead, column: str) -> list[str]:
    """The different texts of a column's first cells."""
    return [cell for cell in dict.fromkeys(cell.strip() for cell in head.cells(column)) if cell]


def _side_column(head: CsvHead) -> str:
    """The column that is called like a hand or a side, and whose cells all say left or right."""
    for column in head.columns:
        cells = _cells(head, column)
        is_named = not SIDE_COLUMNS.isdisjoint(tokens_of(column))
        if is_named and cells and all(len(tokens_of(cell)) <= LONGEST_SIDE and side_in(cell) for cell in cells):
            return column
    return ""


def _joint_column(head: CsvHead, known: Mapping[str, NamedJoint]) -> tuple[str, dict[str, NamedJoint], list[str], str]:
    """The column that names the joint of a row, its joints, names that are no known joint, how joints are numbered."""
    for column in head.columns:
        cells = _cells(head, column)
        names = {cell: entry for cell in cells if (entry := _named_joint(cell, known)) is not None}
        if _count_joints(names) >= LEAST_JOINTS:
            unknown = [cell for cell in cells if cell not in names and names_finger(tokens_of(cell))]
            return column, names, unknown, ""
        numbers = sorted(int(cell) for cell in cells if re.fullmatch(r"\d{1,2}", cell))
        if len(numbers) != len(cells) or not numbers or JOINT_COLUMNS.isdisjoint(tokens_of(column)):
            continue
        order = NUMBERED.get((numbers[0], numbers[-1]))
        if order is not None and len(numbers) == len(order):
            joints = {str(number): NamedJoint("", joint) for number, joint in zip(numbers, order, strict=True)}
            return column, joints, [], f"{numbers[0]} to {numbers[-1]}"
    return "", {}, [], ""


def _row_position(head: CsvHead) -> JointColumns | None:
    """The columns of the joint of a row."""
    axes, radius, width = dict[str, str](), "", ""
    for column in head.columns:
        name, last = _split_last_word(column, frozenset())
        if {*tokens_of(name)} & (OTHER_TOKENS | ROTATION_TOKENS):
            continue
        match = AXIS.fullmatch(last)
        if match and (not match[1] or match[1] in POSITION_TOKENS):
            axes.setdefault(match[2], column)
        radius = radius or (column if last == "radius" else "")
        width = width or (column if last == "width" else "")
    return JointColumns((axes["x"], axes["y"], axes["z"]), radius, width) if len(axes) == len("xyz") else None


def _valid_columns(head: CsvHead) -> dict[str, str]:
    """Side -> the column that says whether that hand was tracked; ``""`` stands for every hand."""
    columns = dict[str, str]()
    for column in head.columns:
        tokens = tokens_of(column)
        if not VALID_TOKENS.isdisjoint(tokens) and not names_finger(tokens) and joint_of(tokens) is None:
            columns.setdefault(side_in(column), column)
    return columns
