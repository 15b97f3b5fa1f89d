"""The front and the advice, from the table alone: whoever has the table can compute both again.

A row is on the front when no other is at least as quick and misses no more. Rows that do not count: the oracle, whoever
shares its algorithm (nobody judges itself), and those of whose reported pair-frames fewer than ``PRECISION`` are true:
who always says contact misses nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, TypeAlias

Row: TypeAlias = Mapping[str, Any]

PRECISION: Final = 0.5
"""Share of the reported pair-frames that must be contacts; below it most alarms are false."""

OFFLINE_BUDGETS_MS: Final = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
ONLINE_BUDGETS_MS: Final = (0.1, 0.3, 1.0, 3.0, 11.1)


def counts(row: Row) -> bool:
    """Whether a row may be on the front."""
    return not row["oracle"] and row["precision"] is not None and bool(row["precision"] >= PRECISION)


def front_of(rows: Sequence[Row], *, time: str = "ms_per_frame", online: bool = False) -> list[str]:
    """Labels on the front, quickest first; of equals the earlier in the table.

    Parameters
    ----------
    time : column that is the price.
    online : only rows timed frame by frame.
    """
    asked = [row for row in rows if counts(row) and (row["online"] or not online)]
    front: list[Row] = []
    for row in sorted(asked, key=lambda one: (one[time], one["missed"])):
        if not front or row["missed"] < front[-1]["missed"]:
            front.append(row)
    return [row["label"] for row in front]


def advice_of(rows: Sequence[Row]) -> list[str]:
    """Sentences: what to take at which price, for a recording and for a live loop, or that one setting dominates."""
    whole = _advice(rows, "ms_per_frame", OFFLINE_BUDGETS_MS, online=False)
    live = _advice(rows, "p99_ms", ONLINE_BUDGETS_MS, online=True)
    return [f"To audit a recording, {one}." for one in whole] + [f"To ship in a live loop, {one}." for one in live]


def _advice(rows: Sequence[Row], time: str, budgets: Sequence[float], *, online: bool) -> list[str]:
    front = front_of(rows, time=time, online=online)
    by_label = {row["label"]: row for row in rows}
    if not front:
        return []
    if len(front) == 1:
        return [f"{front[0]} dominates: nothing is quicker, nothing misses less: {_misses(by_label[front[0]])}"]
    told, last = [], ""
    for budget in budgets:
        fits = [label for label in front if by_label[label][time] <= budget]
        if fits and fits[-1] != last:
            last = fits[-1]
            what = "with p99 under" if online else "at"
            told.append(f"{what} {budget:g} ms per frame: {last}, {_misses(by_label[last])}")
    return told


def _misses(row: Row) -> str:
    share, low, high = (100 * row[key] for key in ("missed", "missed_low", "missed_high"))
    return f"misses {share:.1f} % [{low:.1f}, {high:.1f}]"
