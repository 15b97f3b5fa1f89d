"""Accuracy beside its price, a row per setting that was tried."""

from collections.abc import Iterable, Sequence
from typing import Final

from replay.base.constants import BUDGET_MS
from replay.outputs.tables import IN_RED, INVENTED, PARTLY, Cell, Marked, Table, table
from replay.pipeline.gates import figure
from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.pareto import BUSY, Row, count_words

HEAD: Final = (
    "setting", "missed", "late or cut short", "false contacts", "wrong", "mean ms", "p99 ms", "front", "false %",
    "passes", "settings",
)  # fmt: skip
SHOWN: Final = HEAD[:8]
"""Columns where there is little room."""

SHORT: Final = 12
"""Rows of a list that is cut short; those on the front are always in it."""


def tradeoff_table(title: str, rows: Iterable[Row]) -> Table:
    """These rows, in the order given."""
    cells = [_cells(row) for row in rows]
    return table(title, HEAD, cells, words=("setting", "front", "settings"), whole=("setting", "settings"))


def tradeoff_list(done: Tradeoff, *, everything: bool = False) -> Table:
    """What a terminal shows: the settings by wrong contacts, the front marked, long lists cut short."""
    about, rows = done.about, list(done.rows)
    shown = [row for number, row in enumerate(rows) if everything or row["front"] or number < SHORT]
    title = f"{about['contacts']} contacts in {about['seconds']:.0f} s, beside {about['oracle']}"
    notes = [*_more(done, len(rows) - len(shown)), *slow_frames(rows)]
    if everything:
        notes += how_measured(done)
    return tradeoff_table(title, shown).only(*(HEAD if everything else SHOWN)).titled(title, *notes)


def _more(done: Tradeoff, hidden: int) -> list[str]:
    """How many rows are not shown, and how many settings were not tried."""
    parts = []
    if hidden:
        parts.append(f"{hidden} more with -v")
    if done.cut:
        one = len(done.cut) == 1
        limit = figure(done.about["time_limit"] or 0.0)
        parts.append(f"{len(done.cut)} {'setting was' if one else 'settings were'} not tried within {limit} s")
    return [f"... {'; '.join(parts)}"] if parts else []


def slow_frames(rows: Sequence[Row]) -> list[str]:
    """The slowest frame of all, and why it was slow; nothing where it fits into a frame of the headset."""
    timed = [row for row in rows if row["p99_ms"] is not None]
    worst = max(timed, key=lambda row: float(row["worst_ms"]), default=None)
    if worst is None or worst["worst_ms"] <= BUDGET_MS:
        return []
    usual = f"{figure(worst['worst_usual_ms'])} ms in the median pass"
    why = f"the search, {usual}" if worst["worst_cause"] == "search" else f"the machine, not the detector ({usual})"
    return [f"Slowest frame: {worst['worst_ms']:.1f} ms at {worst['worst_time']:.2f} s ({worst['label']}): {why}."]


def how_measured(done: Tradeoff) -> tuple[str, ...]:
    """Which times these are, how often they were taken, and how far they hold."""
    about, made, check = done.about, done.about["machine"], done.about["clock"]
    between = "" if check["low"] is None else f" [{check['low']:.3g}, {check['high']:.3g}]"
    tie = "a tie" if check["tie"] else f"no tie, so every interval is widened by {check['widened']:.3g}"
    ranges = any(row["offsets"] > 1 for row in done.rows)
    return (
        "Wrong: missed, late or cut short, and false contacts. On the front is what is surely quicker than all with "
        "fewer wrong contacts.",
        *(
            ["A range is the smallest and the largest count over 16 sampling offsets; the order goes by the mean."]
            if ranges
            else []
        ),
        f"Times: frame by frame, {about['live_frames']:,} frames a pass, in turns with {about['reference']}; no "
        "compilation is in them. Times of this tool on this machine, not of your engine.",
        f"The clock's self-check: {about['reference']} timed twice gives {check['ratio']:.3g}{between}, {tie}.",
        f"Measured on {made['system']} {made['processor']}, {made['cores']} cores.",
        *busy_words(done),
    )


def busy_words(done: Tradeoff) -> list[str]:
    """That the machine was busy, where it was."""
    share = done.about["processor_share"]
    if share >= BUSY:
        return []
    return [f"The machine was busy ({figure(100 * (1 - share))} %): run again for reliable times."]


MARKS: Final = {"missed": IN_RED, "late": PARTLY, "false_contacts": INVENTED, "wrong": ""}
"""Count -> how a number above 0 is marked."""


def count_cell(row: Row, name: str) -> Marked:
    """How often a setting is wrong in one way, over the sampling offsets."""
    return Marked(count_words(row, name), MARKS[name] if row[name] else "")


def false_cell(row: Row) -> Marked:
    """Which percentage of the contact time that a setting reports is false."""
    return Marked("-" if row["false"] is None else figure(100 * row["false"]), INVENTED if row["false"] else "")


def p99_cell(row: Row) -> str:
    """Milliseconds of a slow frame."""
    return "-" if row["p99_ms"] is None else f"{row['p99_ms']:.2f}"


def _cells(row: Row) -> tuple[Cell, ...]:
    return (
        row["label"], *(count_cell(row, name) for name in MARKS), f"{row['mean_ms']:.3f}", p99_cell(row),
        "front" if row["front"] else "", false_cell(row).text, str(row["passes"]), row["settings"] or "-",
    )  # fmt: skip
