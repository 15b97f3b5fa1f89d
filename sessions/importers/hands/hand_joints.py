"""Reads the joints of hands from a CSV whose columns are known: positions over time, radii, and when they are valid."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from sessions.importers.csv_table import CsvTable
from sessions.importers.hands.hand_columns import HandLayout, JointColumns
from sessions.importers.hands.joint_names import NamedJoint, side_in
from sessions.importers.ledger import Ledger, Numbers, Rows, Stamps, increasing_rows

MOST_LISTED: Final = 6


@dataclass(frozen=True)
class HandJoints:
    """The joints of one hand, in axes and units of the source.

    Parameters
    ----------
    name : ``left hand``, ``right hand``, or ``hand`` where nothing says a side.
    times_ns : (n,), of all its joints.
    positions : joint -> (n, 3), NaN where it has none.
    radii : joint -> its median radius in units of the source.
    valid : (n,), where the source says that the hand was tracked.
    """

    name: str
    times_ns: Stamps
    positions: Mapping[str, Numbers]
    radii: Mapping[str, float]
    valid: Rows

    @property
    def side(self) -> str:
        """``left``, ``right`` or ``""``."""
        return side_in(self.name)


def read_joints(table: CsvTable, layout: HandLayout, ledger: Ledger) -> list[HandJoints]:
    """The joints of each hand."""
    sides: dict[str, Rows] = {"": np.ones(len(table), dtype=np.bool_)}
    if layout.side:
        sides = dict[str, Rows]()
        for text, rows in table.rows_by_text(layout.side).items():
            side = side_in(text)
            sides[side] = sides.get(side, np.zeros(len(table), dtype=np.bool_)) | rows
    _book_rows(table, layout, sides, ledger)
    samples: dict[str, list[tuple[str, JointColumns, Rows]]] = {}
    for joint, columns, rows in _joint_rows(table, layout):
        for side, own in sides.items():
            kept = rows & own
            if joint.joint and (side or not layout.side) and kept.any():
                hand = f"{joint.side or side} hand".strip()
                samples.setdefault(hand, []).append((joint.joint, columns, kept))
    return [_hand(table, layout, name, rows, ledger) for name, rows in samples.items()]


def _joint_rows(table: CsvTable, layout: HandLayout) -> Iterator[tuple[NamedJoint, JointColumns, Rows]]:
    """Every joint of the file with its columns and its rows."""
    everything = np.ones(len(table), dtype=np.bool_)
    for name, columns in layout.wide.items():
        yield layout.names[name], columns, everything
    if layout.long is None:
        return
    for text, rows in table.rows_by_text(layout.joint).items():
        if text in layout.names:
            yield layout.names[text], layout.long, rows


def _book_rows(table: CsvTable, layout: HandLayout, sides: Mapping[str, Rows], ledger: Ledger) -> None:
    """Book the rows that are read, and those of no hand and of no joint."""
    dropped = dict[str, int]()
    read = np.ones(len(table), dtype=np.bool_)
    if layout.side:
        aside = sides.get("", np.zeros(len(table), dtype=np.bool_))
        dropped["that say neither left nor right"] = int(aside.sum())
        read &= ~aside
    if layout.long is not None:
        others = {
            text: rows & read
            for text, rows in table.rows_by_text(layout.joint).items()
            if text not in layout.names or not layout.names[text].joint
        }
        named = ", ".join(repr(text[:40]) for text in [*others][:MOST_LISTED])
        dropped[f"of joints that no capsule needs: {named}"] = sum(int(rows.sum()) for rows in others.values())
    count = sum(dropped.values())
    ledger.book("rows", read=len(table), kept=len(table) - count, dropped=dropped)


def _hand(
    table: CsvTable, layout: HandLayout, name: str, samples: list[tuple[str, JointColumns, Rows]], ledger: Ledger
) -> HandJoints:
    """One hand, whose joints have the stamps of all of them."""
    tracks, radii = dict[str, tuple[Stamps, Numbers]](), dict[str, float]()
    flag = layout.valid.get(side_in(name)) or layout.valid.get("", "")
    tracked: tuple[Stamps, Rows] | None = None
    last_rows, stamps = np.zeros(0, dtype=np.bool_), np.zeros(0, dtype=np.int64)
    for joint, columns, rows in samples:
        if not np.array_equal(rows, last_rows):
            last_rows, stamps = rows, table.stamps(layout.clock.column, layout.clock.unit, rows)
        positions = table.measurements(columns.position, rows)
        keep = increasing_rows(f"{side_in(name)} {joint}".strip(), stamps, (positions,), ledger)
        tracks[joint] = stamps[keep], positions[keep]
        if flag and tracked is None:
            tracked = stamps[keep], table.flags(flag, rows)[keep]
        radius = _radius_of(table, columns, rows)
        if radius:
            radii[joint] = radius
    times = np.unique(np.concatenate([stamps for stamps, _ in tracks.values()]))
    positions_of = {joint: _at(times, stamps, positions) for joint, (stamps, positions) in tracks.items()}
    valid = np.ones(len(times), dtype=np.bool_)
    if tracked is not None:
        valid = np.zeros(len(times), dtype=np.bool_)
        valid[np.searchsorted(times, tracked[0])] = tracked[1]
    return HandJoints(name, times, positions_of, radii, valid)


def _at(times: Stamps, stamps: Stamps, positions: Numbers) -> Numbers:
    """Positions at all times of a hand, (n, 3); NaN where the joint has none."""
    placed = np.full((len(times), 3), np.nan)
    placed[np.searchsorted(times, stamps)] = positions
    return placed


def _radius_of(table: CsvTable, columns: JointColumns, rows: Rows) -> float:
    """The median radius of a joint in units of the file; 0 where there is none."""
    if not columns.radius and not columns.width:
        return 0.0
    sizes = table.numbers((columns.radius or columns.width,), rows)[:, 0]
    usable = sizes[np.isfinite(sizes) & (sizes > 0.0)]
    median = float(np.median(usable)) if len(usable) else 0.0
    return median if columns.radius else median / 2.0
