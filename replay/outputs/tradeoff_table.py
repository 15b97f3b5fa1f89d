"""Accuracy beside its price, a row per setting that was tried."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from replay.base.constants import BUDGET_MS
from replay.base.wilson import OVER_CONTACTS
from replay.outputs.tables import Table, table
from replay.outputs.words import counted
from replay.pipeline.gates import figure
from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.growth import UNITS, growth_answer, leaves_at
from replay.tradeoffs.pareto import LIVE, WHOLE, Row, front_of

OVER_BUDGET: Final = f"p99 ms (over {BUDGET_MS:.1f})"
"""Column: p99 of a live look with its interval, and in brackets the share of frames over the budget."""

HEAD: Final = (
    "#", "setting", "front", "mean ms", OVER_BUDGET, "s per minute", "passes", "missed contacts", "missed, % [95 %]",
    "invented, %", "faces, %", "contained", "most of its work",
)  # fmt: skip
SHOWN: Final = ("setting", "mean ms", OVER_BUDGET, "s per minute", "passes", "missed contacts", "invented, %", "front")
"""Columns where there is little room."""

AT_PHASE: Final = "what a step rate misses of the pair-frames it misses at this run's phase"

NOT_DONE: Final = ("skipped", "reused", "held", "cache_hits")
"""Counters of work that was saved."""


def quickest_first(rows: Iterable[Row]) -> list[Row]:
    """Rows in order of their time per frame."""
    return sorted(rows, key=lambda row: float(row["ms_per_frame"]))


def front_rows(rows: Sequence[Row]) -> list[Row]:
    """The rows on the front, quickest first."""
    by_label = {row["label"]: row for row in rows}
    return [by_label[label] for label in front_of(rows)]


def how_measured(done: Tradeoff) -> tuple[str, ...]:
    """Which times are live, how often they were taken, what the intervals are over, and what was asked."""
    about, made = done.about, done.about["machine"]
    pareto = [row for row in done.rows if row["front"] or row["front_online"]]
    without = [row["label"] for row in pareto if not row["containment"]]
    contained = f"in, but not of {', '.join(without)}" if without else "in"
    phases = max((row["phases"] for row in done.rows), default=1)
    mean = f"; of a step rate it is the mean over {phases} look phases" if phases > 1 else ""
    return (
        f"Live: one frame after the other, {about['live_frames']:,} frames a pass. Offline: the whole session at once.",
        f"Every pass is timed in turns with {about['reference']}; intervals of times are at 95 % over passes, and "
        "those that overlap are a tie.",
        *(_self_check(done, kind) for kind in ("live", "offline")),
        f"Missed contacts are missed whole or in part, at 95 % over contacts{mean}.",
        f"Containment is {contained}; faces are out, but of settings that say so.",
        f"Measured on {made['system']} {made['processor']}, {made['cores']} cores; compare ratios, not milliseconds.",
    )


def _self_check(done: Tradeoff, kind: str) -> str:
    check = done.about["clock"][kind]
    between = "" if check["low"] is None else f" [{check['low']:.3g}, {check['high']:.3g}]"
    held = "a tie" if check["tie"] else f"no tie, so every {kind} interval is widened by {check['widened']:.3g}"
    passes = counted(check["passes"], "pass", "passes")
    twice = f"{done.about['reference']} timed twice gives {check['ratio']:.3g}{between}"
    return f"The clock's self-check, {kind}: {twice}, {held}; {passes}."


def tradeoff_table(title: str, rows: Iterable[Row]) -> Table:
    """These rows, in the order given and numbered in it."""
    cells = (_cells(number, row) for number, row in enumerate(rows, 1))
    return table(title, HEAD, cells, words=HEAD[1:3], notes=(OVER_CONTACTS,))


def _cells(number: int, row: Row) -> tuple[str, ...]:
    marks = ["oracle"] * row["oracle"] + ["front"] * row["front"] + ["live front"] * row["front_online"]
    p99 = "" if row["p99_ms"] is None else f"{_interval(row, *LIVE)} ({figure(100 * row['over_share'])} %)"
    minute = row["seconds_per_minute"] / row["ms_per_frame"]
    lost = f"{row['contacts_lost']:.3g} [{row['lost_low']:.2g}, {row['lost_high']:.2g}] of {row['contacts']}"
    return (
        str(number), row["label"], ", ".join(marks),
        "" if row["mean_ms"] is None else f"{row['mean_ms']:.3g}", p99, _interval(row, *WHOLE, scale=minute),
        f"{row['live_passes']} live, {row['passes']}", lost,
        "{} [{}, {}]".format(*(figure(100 * row[key]) for key in ("missed", "missed_low", "missed_high"))),
        "" if row["precision"] is None else figure(100 * (1 - row["precision"])),
        "" if row["face_recall"] is None else figure(100 * row["face_recall"]),
        "in" if row["containment"] else "out", _most_work(row["work"]),
    )  # fmt: skip


def _interval(row: Row, name: str, low: str, high: str, scale: float = 1.0) -> str:
    """A time and its interval; of one pass there is none."""
    ends = "" if row[low] is None else f" [{scale * row[low]:.3g}, {scale * row[high]:.3g}]"
    return f"{scale * row[name]:.3g}{ends}"


def _most_work(work: Mapping[str, int]) -> str:
    """The largest counter of work done: the same on any machine; the table in the run folder has them all."""
    count, name = max(((count, name) for name, count in work.items() if name not in NOT_DONE), default=(0, ""))
    return f"{count if count < 10_000 else f'{count // 1000:,}k'} {name.replace('_', ' ')}" if count else ""


def growth_table(rows: Sequence[dict[str, Any]]) -> Table:
    """A row a detector: on each axis the size at which it fills a frame, or the largest that fits."""
    axes, names = ([*dict.fromkeys(row[key] for row in rows)] for key in ("axis", "detector"))
    cells = [(name, *(_growth(rows, axis, name) for axis in axes)) for name in names]
    note = f"p99 of live looks, {rows[0]['passes']} passes in turns; containment in, faces out" if rows else ""
    return table(growth_answer(rows), ("detector", *(UNITS[axis] for axis in axes)), cells, notes=(note,))


def _growth(rows: Sequence[dict[str, Any]], axis: str, name: str) -> str:
    size = leaves_at(rows, axis, name)
    largest = max((row["size"] for row in rows if (row["axis"], row["detector"]) == (axis, name)), default=0)
    return f"fits up to {largest:,.0f}" if size is None else f"leaves at {size:,.0f}"
