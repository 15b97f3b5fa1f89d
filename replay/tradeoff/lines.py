"""Which points a line joins: one algorithm, one axis, in order of time; a setting alone is a point of its own."""

from __future__ import annotations

from collections.abc import Sequence

from replay.tradeoff.front import Row


def lines_of(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Name of a line -> its rows, quickest first."""
    lines: dict[str, list[Row]] = {}
    for row in rows:
        lines.setdefault(row["line"], []).append(row)
    return {name: sorted(points, key=lambda row: float(row["ms_per_frame"])) for name, points in lines.items()}
