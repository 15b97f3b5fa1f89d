"""Which points a line joins: one algorithm, one axis, in order of time; and where words about points do not overlap."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from replay.tradeoff.front import Row


def lines_of(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Name of a line -> its rows, quickest first."""
    lines: dict[str, list[Row]] = {}
    for row in rows:
        lines.setdefault(row["line"], []).append(row)
    return {name: sorted(points, key=lambda row: float(row["ms_per_frame"])) for name, points in lines.items()}


def apart(
    places: Sequence[tuple[float, float]], shift: tuple[float, float], least: float, step: float
) -> list[tuple[float, float]]:
    """Where words about points stand: each shifted from its point, moved on by ``step`` until none is too near another.

    Parameters
    ----------
    places : points, in whatever unit the picture has.
    shift : from a point to its words.
    least : between any two words.
    step : along y, towards where there is room.
    """
    taken: list[tuple[float, float]] = []
    for x, y in places:
        at = x + shift[0], y + shift[1]
        while any(hypot(at[0] - a, at[1] - b) < least for a, b in taken):
            at = at[0], at[1] + step
        taken.append(at)
    return taken
