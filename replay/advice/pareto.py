"""The front and the advice, from the table alone.

Rows are ordered by their loss (``replay.auditing.loss``). Times are compared by their intervals. Where two intervals
overlap, the times are a tie: it goes to the smaller loss, then to the complete detector, then to the earlier one. One
pass has no interval, and ties with nothing.
"""

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any, Final, TypeAlias, TypeVar

from replay import words
from replay.advice.settings import USUAL_STEP_HZ
from replay.document.columns import count_text
from replay.document.cost import busy_sentence
from replay.words import plural
from sessions.model.constants import HEADSET_HZ

Row: TypeAlias = Mapping[str, Any]
AnyRow = TypeVar("AnyRow", bound=Row)

LEAST_SETTINGS: Final = 3
"""Settings that advice needs."""

MOST_NAMES: Final = 3
"""Settings that a sentence names."""

CHEAPER_COST_RATIO: Final = 0.95
"""A p99 above this share of another one is no cheaper."""


def is_comparable(row: Row) -> bool:
    """Whether a row may be on the front: of one that left contact undecided nobody knows what it misses."""
    return not row["contact_frames_undecided"] and row["mean_ms"] is not None


def is_tied(a: Row, b: Row) -> bool:
    """Whether two times are equal, or their intervals overlap."""
    if a["mean_ms"] == b["mean_ms"]:
        return True
    interval_ends = [row[end] for row in (a, b) for end in ("mean_low", "mean_high")]
    return None not in interval_ends and interval_ends[0] <= interval_ends[3] and interval_ends[2] <= interval_ends[1]


def is_quicker(a: Row, b: Row) -> bool:
    """Whether one time is surely less than another one."""
    return bool(a["mean_ms"] < b["mean_ms"]) and not is_tied(a, b)


def winner_of(rows: Sequence[Row]) -> Row:
    """Best row among the fastest and those that tie with it; the earlier of equals."""
    quickest_row = min(rows, key=lambda row: float(row["mean_ms"]))
    tied_rows = [row for row in rows if is_tied(row, quickest_row)]
    return min(tied_rows, key=lambda row: (row["loss"], not row["complete"]))


def front_of(rows: Sequence[Row]) -> list[str]:
    """Labels on the front, quickest first: each is surely quicker than all that have a smaller loss."""
    front_labels: list[Row] = []
    remaining_rows = [row for row in rows if is_comparable(row)]
    for smallest_loss in sorted({row["loss"] for row in remaining_rows}):
        best_row = winner_of([row for row in remaining_rows if row["loss"] == smallest_loss])
        if not front_labels or is_quicker(best_row, front_labels[-1]):
            front_labels.append(best_row)
    return [row["label"] for row in reversed(front_labels)]


def contenders_of(rows: Sequence[Row]) -> list[str]:
    """Labels of what is on the front, or would be if its time were known better."""
    comparable_rows = [row for row in rows if is_comparable(row)]
    return [
        row["label"]
        for row in comparable_rows
        if not any(
            other_row["loss"] < row["loss"] and other_row["mean_ms"] <= row["mean_ms"] for other_row in comparable_rows
        )
    ]


def sorted_rows(rows: Sequence[AnyRow]) -> list[AnyRow]:
    """By loss, then by the mean; what was not decided comes last."""
    return sorted(rows, key=lambda row: (not is_comparable(row), row["loss"], row["mean_ms"] or inf))


def advice_of(rows: Sequence[Row], *, processor_fraction: float = 1.0) -> list[str]:
    """Sentences on the cost of full and of lower accuracy; or one sentence why there is no advice.

    On a busy machine times are upper bounds: then the sentences say what each setting of the front gets wrong, and
    advise nothing about cost.
    ``processor_fraction``: of the seconds on the clock those in which this process was at work.
    """
    candidates = [row for row in rows if is_comparable(row) and row["mean_low"] is not None]
    if len(candidates) < LEAST_SETTINGS:
        settings_clause = f"{plural(len(candidates), 'setting')} {'was' if len(candidates) == 1 else 'were'}"
        return [f"No advice: {settings_clause} timed twice or more, and advice needs {LEAST_SETTINGS}."]
    if busy_text := busy_sentence(1 - processor_fraction):
        return [
            _most_accurate(candidates),
            *_rest_of_front(candidates),
            f"{busy_text} No advice about cost until then.",
        ]
    by_label = {row["label"]: row for row in candidates}
    front_labels = front_of(candidates)
    best_row = by_label[front_labels[-1]]
    cost = (
        f"The smallest loss, {words.loss_number(best_row['loss'])}, costs"
        if best_row["loss"]
        else "Missing nothing costs"
    )
    fraction = words.as_percentage(best_row["mean_ms"] * HEADSET_HZ / 1e3)
    errors_sentence = f" It gets wrong: {wrong_text(best_row)}." if best_row["loss"] else ""
    first_sentence = (
        f"{cost} {_ms(best_row)} a frame ({best_row['label']}), {fraction} of a {HEADSET_HZ:g} Hz "
        f"frame.{errors_sentence}"
    )
    comparison_row = _row_of_a_new_project(candidates, best_row) or (
        by_label[front_labels[-2]] if len(front_labels) > 1 else None
    )
    if comparison_row is None:
        return [first_sentence, "No other setting is faster beyond doubt."]
    errors_sentence = wrong_text(comparison_row)
    if not is_quicker(comparison_row, best_row):
        return [
            first_sentence,
            f"With {comparison_row['label']} a frame takes {_ms(comparison_row)}, not surely less: {errors_sentence}.",
        ]
    return [
        first_sentence,
        f"At {_ms(comparison_row)} ({comparison_row['label']}): {errors_sentence}; "
        f"{_slow_frames(comparison_row, best_row)}.",
    ]


def _most_accurate(rows: Sequence[Row]) -> str:
    """Sentence on the settings with the smallest loss, at any cost."""
    smallest_loss = min(row["loss"] for row in rows)
    best_rows = [row for row in rows if row["loss"] == smallest_loss]
    best_labels = ", ".join(row["label"] for row in best_rows[:MOST_NAMES])
    more_text = f" and {len(best_rows) - MOST_NAMES} more" if len(best_rows) > MOST_NAMES else ""
    if smallest_loss == 0.0:
        return f"Every contact is right with {best_labels}{more_text}."
    return (
        f"The smallest loss, {words.loss_number(smallest_loss)}, has {best_labels}{more_text}: "
        f"{wrong_text(best_rows[0])}."
    )


def _rest_of_front(rows: Sequence[Row]) -> list[str]:
    """A sentence on each setting of the front that gets something wrong beyond the smallest loss, the best first."""
    smallest_loss, front_labels = min(row["loss"] for row in rows), front_of(rows)
    others_on_front = [row for row in rows if row["label"] in front_labels and row["loss"] > smallest_loss]
    return [
        f"With {row['label']}: {wrong_text(row)}."
        for row in sorted(others_on_front, key=lambda row: float(row["loss"]))
    ]


def _row_of_a_new_project(rows: Sequence[Row], best_row: Row) -> Row | None:
    """Row closest to an engine's new project: the rate nearest to ``USUAL_STEP_HZ``, then the smallest loss."""
    rates = [row for row in rows if row["rate_hz"] and row["loss"] > best_row["loss"]]
    return min(rates, key=lambda row: (abs(row["rate_hz"] - USUAL_STEP_HZ), row["loss"]), default=None)


def _ms(row: Row) -> str:
    return words.frame_time(row["mean_ms"] / 1e3)


def wrong_text(row: Row) -> str:
    """``0-1 of 18 contacts missed, 1-3 late or cut short, 86 % of its contact time false``."""
    phrases = [
        f"{count_text(row, 'missed')} of {plural(row['contacts'], 'contact')} missed",
        f"{count_text(row, 'late')} late or cut short",
    ]
    if row["false"] is not None:
        phrases.append(f"{words.as_percentage(row['false'])} of its contact time false")
    return ", ".join(phrases)


def _slow_frames(row: Row, best_row: Row) -> str:
    if row["p99_ms"] is None or best_row["p99_ms"] is None or row["p99_ms"] >= CHEAPER_COST_RATIO * best_row["p99_ms"]:
        return "slow samples (p99) get no cheaper"
    p99, best_p99 = (words.frame_time(setting["p99_ms"] / 1e3) for setting in (row, best_row))
    return f"slow samples (p99) take {p99} in place of {best_p99}"
