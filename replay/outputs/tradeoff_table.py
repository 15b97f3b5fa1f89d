"""Accuracy beside its price, a row per setting that was tried."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from replay.base.constants import BUDGET_MS
from replay.base.wilson import OVER_CONTACTS
from replay.outputs.tables import Table, table
from replay.pipeline.gates import figure
from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.pareto import Row, front_of

OVER_BUDGET: Final = f"p99 ms (over {BUDGET_MS:.1f})"
"""Column: p99, and in brackets the share of frames that take longer than the budget."""

HEAD: Final = (
    "#", "setting", "front", "ms per frame", "slowest", OVER_BUDGET, "s per minute", "missed, % [95 %]",
    "invented, %", "faces, %", "most of its work",
)  # fmt: skip

AT_PHASE: Final = "what a step rate misses it misses at this run's phase"

NOT_DONE: Final = ("skipped", "reused", "held", "cache_hits")
"""Counters of work that was saved."""


def quickest_first(rows: Iterable[Row]) -> list[Row]:
    """Rows in order of their time per frame."""
    return sorted(rows, key=lambda row: float(row["ms_per_frame"]))


def front_rows(rows: Sequence[Row]) -> list[Row]:
    """The rows on the front, quickest first."""
    by_label = {row["label"]: row for row in rows}
    return [by_label[label] for label in front_of(rows)]


def lines_of(rows: Iterable[Row]) -> dict[str, list[Row]]:
    """Name of a line of the picture -> its rows, quickest first."""
    lines: dict[str, list[Row]] = {row["line"]: [] for row in rows}
    for row in quickest_first(rows):
        lines[row["line"]].append(row)
    return lines


def measured_on(done: Tradeoff) -> str:
    """The machine behind the milliseconds."""
    made = done.about["machine"]
    return f"{made['system']} {made['processor']}, {made['cores']} cores"


def tradeoff_table(title: str, rows: Iterable[Row]) -> Table:
    """These rows, in the order given and numbered in it."""
    cells = (_cells(number, row) for number, row in enumerate(rows, 1))
    return table(title, HEAD, cells, words=HEAD[1:3], notes=(OVER_CONTACTS,))


def _cells(number: int, row: Row) -> tuple[str, ...]:
    marks = ["oracle"] * row["oracle"] + ["front"] * row["front"] + ["live front"] * row["front_online"]
    return (
        str(number), row["label"], ", ".join(marks), f"{row['ms_per_frame']:.4f}", f"{row['ms_high']:.4f}",
        "" if row["p99_ms"] is None else f"{row['p99_ms']:.3f} ({figure(100 * row['over_share'])} %)",
        f"{row['seconds_per_minute']:.2f}",
        "{} [{}, {}]".format(*(figure(100 * row[key]) for key in ("missed", "missed_low", "missed_high"))),
        "" if row["precision"] is None else figure(100 * (1 - row["precision"])),
        "" if row["face_recall"] is None else figure(100 * row["face_recall"]),
        _most_work(row["work"]),
    )  # fmt: skip


def _most_work(work: Mapping[str, int]) -> str:
    """The largest counter of work done: the same on any machine; the table in the run folder has them all."""
    count, name = max(((count, name) for name, count in work.items() if name not in NOT_DONE), default=(0, ""))
    return f"{count if count < 10_000 else f'{count // 1000:,}k'} {name.replace('_', ' ')}" if count else ""
