"""Assumptions of a CSV: the meaning of its numbers, and who says so.

The heading of a column or the row of units says it, the format of the Unity script defines it, a draft guessed it (its
key is in ``guessed`` of the mapping), or the user wrote it into the mapping.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from sessions.errors import ImportFileError
from sessions.importers.csv_mapping import CLOCK_NS, LENGTHS, TEXT, CsvMapping, Guessable, PoseColumns
from sessions.importers.csv_table import CsvTable
from sessions.importers.csv_text import STATED_LENGTHS, WORDS, name_tokens_of, stated_units
from sessions.importers.pose_table import SourceFrame
from sessions.meshes.conventions import Convention
from sessions.model.assumption import Assumption, Confidence, Origin, Subject, grouped_assumptions
from sessions.quantities import number

LIKELY_RATES_HZ: Final = (10.0, 250.0)
"""Rates of trackers and headsets; a guessed unit of time that gives another rate is not sure."""

QUATERNION_KINDS: Final = ("quaternion_xyzw", "quaternion_wxyz")
ANGLE_UNITS: Final = ("deg", "rad")
UNITS_OF_MAPPINGS: Final = (*LENGTHS, *CLOCK_NS, *ANGLE_UNITS)
TIME_TOKENS: Final = frozenset(WORDS["time"])


def with_stated_units(table: CsvTable, plan: CsvMapping) -> CsvMapping:
    """Returns the mapping with the units that the headings or the row of units state, where it leaves them out.

    Raises ImportFileError: the mapping contradicts them, columns state several, or one that no mapping has.
    """
    if plan.kind:
        return plan
    positions = [column for pose in plan.poses for column in pose.position]
    _check_unit(table, [plan.time] if plan.time else [], plan.unit, [*CLOCK_NS], "unit")
    length_unit = _check_unit(table, positions, plan.units, STATED_LENGTHS, "units")
    body = _with_angle_unit(table, plan.body) if plan.body else None
    bodies = {name: _with_angle_unit(table, columns) for name, columns in plan.bodies.items()}
    return replace(plan, units=length_unit, body=body, bodies=bodies)


def _with_angle_unit(table: CsvTable, pose: PoseColumns) -> PoseColumns:
    if pose.kind not in ("euler", "rotation_vector"):
        return pose
    given = ("deg" if pose.degrees else "rad") if pose.is_angle_unit_stated else ""
    unit = _check_unit(table, pose.rotation, given, ANGLE_UNITS, "angle_unit")
    return replace(pose, degrees=unit != "rad")


def _check_unit(table: CsvTable, columns: Sequence[str], given: str, kind: Sequence[str], key: str) -> str:
    """The unit of columns: that of the mapping, where it does not contradict what they state, or else theirs.

    ``given``: the unit under ``key`` of the mapping, or ``""``.
    """
    stated = stated_units(map(table.stated_unit, columns), kind)
    if given:
        stated = [unit for unit in stated if unit in kind]
    if not stated or stated == [given] or given == TEXT:
        return given
    where = f"{table.source}: the columns {', '.join(columns)} state {' and '.join(stated)}"
    if given:
        raise ImportFileError(
            f'{where}, and the mapping says {key} = "{given}"; correct one of them, or name the columns in the mapping'
        )
    if len(stated) > 1 or stated[0] not in UNITS_OF_MAPPINGS:
        raise ImportFileError(f"{where}; convert them to one unit that a mapping has, and say it: {key}")
    return stated[0]


def source_frame(table: CsvTable, plan: CsvMapping, axes: Convention, *, is_named: bool) -> SourceFrame:
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
        assumed=(f"lengths in {units}",) if units_origin is Origin.GUESS else (),
        axes_origin=Origin.USER if is_named else by_mapping,
        units_origin=units_origin,
        clock_origin=_clock_origin(plan),
        others=(*_columns(plan), *_time_unit(table, plan), *_rotations(table, plan, axes)),
    )


def _length_unit(table: CsvTable, plan: CsvMapping, axes: Convention) -> tuple[str, Origin]:
    if not plan.units:
        return axes.unit or "m", Origin.FORMAT if plan.kind or axes.unit else Origin.GUESS
    if plan.kind:
        return plan.units, Origin.FORMAT
    columns = [column for pose in plan.poses for column in pose.position]
    return plan.units, _origin(plan, Guessable.LENGTH_UNIT, is_stated=_state_unit(table, columns, plan.units))


def _clock_origin(plan: CsvMapping) -> Origin:
    if plan.kind:
        return Origin.FORMAT
    is_named = not plan.layout.columns and any(word.lower() in TIME_TOKENS for word in name_tokens_of(plan.time))
    return _origin(plan, Guessable.COLUMNS if plan.layout.columns else None, is_stated=is_named)


def _columns(plan: CsvMapping) -> tuple[Assumption, ...]:
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
        reason = "the first format that fits" if origin is Origin.GUESS else ""
        return (Assumption(Subject.TIME_UNIT, form or "ISO 8601", origin, confidence, reason=reason),)
    if plan.kind:
        return (Assumption(Subject.TIME_UNIT, plan.unit, Origin.FORMAT),)
    origin = _origin(plan, Guessable.TIME_UNIT, is_stated=_state_unit(table, [plan.time], plan.unit))
    confidence, reason = Confidence.SURE, ""
    if origin is Origin.GUESS:
        steps = np.diff(np.unique(table.stamps(plan.time, plan.unit)))
        rate = 1e9 / float(np.median(steps)) if len(steps) else math.nan
        reason = f"there are then {number(rate)} samples a second" if len(steps) else "one stamp says no rate"
        if not LIKELY_RATES_HZ[0] <= rate <= LIKELY_RATES_HZ[1]:
            confidence = Confidence.OPEN
    return (Assumption(Subject.TIME_UNIT, plan.unit, origin, confidence, reason=reason),)


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
    """The unit of angles; where nobody says it, angles of one turn of radians at most leave it open."""
    unit = "deg" if columns.degrees else "rad"
    is_stated = _state_unit(table, columns.rotation, unit)
    origin = _origin(plan, Guessable.ANGLE_UNIT, is_stated=is_stated)
    if not columns.is_angle_unit_stated and not is_stated:
        origin = Origin.GUESS
    if origin is not Origin.GUESS:
        return Assumption(Subject.ANGLE_UNIT, unit, origin)
    angles = np.abs(table.numbers(columns.rotation))
    largest = float(np.nanmax(angles, initial=0.0))
    is_open = 0.0 < largest <= 2.0 * math.pi
    return Assumption(
        subject=Subject.ANGLE_UNIT,
        value=unit,
        origin=origin,
        confidence=Confidence.OPEN if is_open else Confidence.SURE,
        reason=f"the largest number is {number(largest)}",
        alternatives=("deg", "rad") if is_open else (),
    )


def _state_unit(table: CsvTable, columns: tuple[str, ...] | list[str], unit: str) -> bool:
    """Whether the headings of columns, or the row of units, say this unit of each."""
    return bool(columns) and all(unit == table.stated_unit(column) for column in columns)


def _origin(plan: CsvMapping, key: Guessable | None, *, is_stated: bool) -> Origin:
    """The file where it states it, else the draft where it guessed it, else who wrote the mapping."""
    if is_stated:
        return Origin.FILE
    return Origin.GUESS if key is not None and key in plan.guessed else Origin.USER
