"""The front and the advice, from the table alone.

Times are compared by their intervals. Where two intervals overlap, the times are a tie: it goes to what is wrong less
often, then to the complete detector, then to the earlier one. One pass has no interval, and ties with nothing.
"""

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any, Final, TypeAlias, TypeVar

from replay.base.constants import HEADSET_HZ
from replay.base.shown import plural
from replay.pipeline.answer import busy_sentence
from replay.pipeline.gates import figure
from replay.pipeline.ranking import range_words
from replay.tradeoffs.settings import USUAL_HZ

Row: TypeAlias = Mapping[str, Any]
AnyRow = TypeVar("AnyRow", bound=Row)

FEWEST: Final = 3
"""Settings that advice needs."""

CHEAPER: Final = 0.95
"""A p99 above this share of another one is no cheaper."""


def counts(row: Row) -> bool:
    """Whether a row may be on the front: of one that left contact undecided nobody knows what it misses."""
    return not row["contact_frames_undecided"] and row["mean_ms"] is not None


def tied(a: Row, b: Row) -> bool:
    """Whether two times are equal, or their intervals overlap."""
    if a["mean_ms"] == b["mean_ms"]:
        return True
    ends = [row[end] for row in (a, b) for end in ("mean_low", "mean_high")]
    return None not in ends and ends[0] <= ends[3] and ends[2] <= ends[1]


def quicker(a: Row, b: Row) -> bool:
    """Whether one time is surely less than another one."""
    return bool(a["mean_ms"] < b["mean_ms"]) and not tied(a, b)


def winner_of(rows: Sequence[Row]) -> Row:
    """Of the quickest row and all that tie with it, the one to name; of equals the earlier in the table."""
    quickest = min(rows, key=lambda row: float(row["mean_ms"]))
    ties = [row for row in rows if tied(row, quickest)]
    return min(ties, key=lambda row: (row["wrong"], not row["complete"]))


def front_of(rows: Sequence[Row]) -> list[str]:
    """Labels on the front, quickest first: each is surely quicker than all that have fewer wrong contacts."""
    front: list[Row] = []
    left = [row for row in rows if counts(row)]
    for wrong in sorted({row["wrong"] for row in left}):
        best = winner_of([row for row in left if row["wrong"] == wrong])
        if not front or quicker(best, front[-1]):
            front.append(best)
    return [row["label"] for row in reversed(front)]


def contenders_of(rows: Sequence[Row]) -> list[str]:
    """Labels of what is on the front, or would be if its time were known better."""
    left = [row for row in rows if counts(row)]
    return [
        row["label"] for row in left
        if not any(other["wrong"] < row["wrong"] and other["mean_ms"] <= row["mean_ms"] for other in left)
    ]  # fmt: skip


def sorted_rows(rows: Sequence[AnyRow]) -> list[AnyRow]:
    """By wrong contacts, then by the mean; what was not decided comes last."""
    return sorted(rows, key=lambda row: (not counts(row), row["wrong"], row["mean_ms"] or inf))


def advice_of(rows: Sequence[Row], *, processor_share: float = 1.0) -> list[str]:
    """What getting every contact right costs and what less costs; or one sentence that says why there is no advice.

    ``processor_share``: of the seconds on the clock those in which this process was at work.
    """
    candidates = [row for row in rows if counts(row) and row["mean_low"] is not None]
    if len(candidates) < FEWEST:
        were = f"{plural(len(candidates), 'setting')} {'was' if len(candidates) == 1 else 'were'}"
        return [f"No advice: {were} timed twice or more, and advice needs {FEWEST}."]
    if busy := busy_sentence(1 - processor_share):
        return [f"No advice. {busy}"]
    by_label = {row["label"]: row for row in candidates}
    front = front_of(candidates)
    best = by_label[front[-1]]
    cost = (
        f"The fewest wrong contacts, {count_words(best, 'wrong')}, cost" if best["wrong"] else "Missing nothing costs"
    )
    share = figure(100 * best["mean_ms"] * HEADSET_HZ / 1e3)
    first = f"{cost} {_ms(best)} a frame ({best['label']}), {share} % of a {HEADSET_HZ:g} Hz frame."
    other = _usual(candidates, best) or (by_label[front[-2]] if len(front) > 1 else None)
    if other is None:
        return [first, "No setting that was tried is surely quicker."]
    wrong = f"{wrong_words(other)}, {count_words(other, 'false_contacts')} false"
    if not quicker(other, best):
        return [first, f"With {other['label']} a frame takes {_ms(other)}, not surely less: {wrong}."]
    return [first, f"At {_ms(other)} ({other['label']}): {wrong}; {_slow_frames(other, best)}."]


def _usual(rows: Sequence[Row], best: Row) -> Row | None:
    """What an engine does in a new project, as far as it was tried: the meshes at its step, else another rate."""
    rates = [row for row in rows if row["rate_hz"] and row["wrong"] > best["wrong"]]
    return min(rates, key=lambda row: (abs(row["rate_hz"] - USUAL_HZ), row["wrong"]), default=None)


def _ms(row: Row) -> str:
    return f"{row['mean_ms']:.2g} ms"


def count_words(row: Row, name: str) -> str:
    """``0-1``, the smallest and the largest count over the sampling offsets; one number where they are equal."""
    return range_words((row[f"{name}_smallest"], row[f"{name}_largest"]))


def wrong_words(row: Row) -> str:
    """``0-1 of 18 contacts missed, 1-3 late or cut short``."""
    missed = f"{count_words(row, 'missed')} of {plural(row['contacts'], 'contact')} missed"
    return f"{missed}, {count_words(row, 'late')} late or cut short"


def _slow_frames(row: Row, best: Row) -> str:
    if row["p99_ms"] is None or best["p99_ms"] is None or row["p99_ms"] >= CHEAPER * best["p99_ms"]:
        return "slow frames (p99) get no cheaper"
    return f"slow frames (p99) take {row['p99_ms']:.2g} ms in place of {best['p99_ms']:.2g} ms"
