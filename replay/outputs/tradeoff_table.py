"""Accuracy beside its price, a row per setting that was tried."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Final

from replay.base.tables import IN_RED, INVENTED, PARTLY, Cell, Column, Marked, Table, text_of
from replay.pipeline.answer import busy_sentence
from replay.pipeline.gates import figure
from replay.pipeline.run_result import RunResult, Tradeoff
from replay.tradeoffs.engine_knobs import Engine, knob_words
from replay.tradeoffs.pareto import Row, count_words

SHOWN: Final = 8
"""Columns where there is little room."""

SHORT: Final = 12
"""Rows of a list that is cut short; those on the front are always in it."""


def _count(heading: str, meaning: str, name: str, mark: str = "") -> Column:
    """How often a setting is wrong in one way, over the sampling offsets."""
    return Column(
        heading, int, meaning, lambda row: row,
        show=lambda row: Marked(count_words(row, name), mark if row[name] else ""),
    )  # fmt: skip


def _false(share: float | None) -> Cell:
    return "-" if share is None else Marked(figure(100 * share), INVENTED if share else "")


MISSED: Final = _count("missed", "contacts never found", "missed", IN_RED)
LATE: Final = _count("late or cut short", "contacts found in part", "late", PARTLY)
WRONG: Final = _count("wrong", "missed, late or cut short, and false contacts", "wrong")
FALSE: Final = Column("false %", float, "share of the reported contact time that is false", "false", show=_false)
P99: Final = Column(
    "p99 ms", float, "time of a slow frame", "p99_ms", "ms", lambda ms: "-" if ms is None else f"{ms:.2f}"
)
MEAN: Final = Column("mean ms", float, "time of a frame", "ms", "ms", ".3f")
SETTINGS_TRIED: Final = (
    Column("setting", str, "its short name", "label", whole=True),
    MISSED,
    LATE,
    _count("false contacts", "reported where the reference has none", "false_contacts", INVENTED),
    WRONG,
    replace(MEAN, of="mean_ms"),
    P99,
    Column("front", bool, "surely quicker than all with fewer wrong contacts", show=lambda on: "front" if on else ""),
    replace(FALSE, show=lambda share: text_of(_false(share))),
    Column("passes", int, "how often all frames were timed"),
    Column("settings", str, "the detector with its settings", show=lambda words: words or "-", whole=True),
)


def tradeoff_table(title: str, rows: Iterable[Row], notes: Iterable[str] = ()) -> Table:
    """These rows, in the order given."""
    return Table.of(SETTINGS_TRIED, rows, title, notes)


def tradeoff_list(done: Tradeoff, *, everything: bool = False) -> Table:
    """What a terminal shows: the settings by wrong contacts, the front marked, long lists cut short."""
    about, rows = done.about, list(done.rows)
    shown = [row for number, row in enumerate(rows) if everything or row["front"] or number < SHORT]
    title = f"{about['contacts']} contacts in {about['seconds']:.0f} s, beside {about['oracle']}"
    notes = _more(done, len(rows) - len(shown))
    if everything:
        notes += how_measured(done)
    return Table.of(SETTINGS_TRIED if everything else SETTINGS_TRIED[:SHOWN], shown, title, notes)


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
        *filter(None, [busy_sentence(1 - about["processor_share"])]),
    )


ENGINE_ROWS: Final = (
    Column("setting", of=lambda row: f"{row['number']}  {knob_words(row['knobs'])}"),
    MISSED,
    LATE,
    FALSE,
    WRONG,
    MEAN,
    P99,
    Column("settings", of="setting", whole=True),
)


def engine_table(engine: Engine, rows: Iterable[Row], result: RunResult, *, settings: bool = False) -> Table:
    """A row a choice: what is set in the engine and what comes of it; the ``settings`` for ``run`` on request."""
    contacts, seconds = result.ranking[-1].contacts, result.summary["session"]["duration"]
    title = f"{engine.name} {engine.version}: {contacts} contacts in {seconds:.0f} s, beside {result.oracle}"
    notes = (
        "false %: of the contact time reported. wrong: missed, late or cut short, and false contacts; a range is over "
        "16 sampling offsets. Times of this tool on this machine, not of your engine.",
        *engine.notes,
        "replay guide engines: the page behind every row. -v: the setting of every row, for replay run --detectors.",
    )
    return Table.of(ENGINE_ROWS if settings else ENGINE_ROWS[:-1], rows, title, notes)


def before_after(before: Mapping[str, Any], after: Mapping[str, Any], result: RunResult, engine: Engine) -> Table:
    """A hull a body, and the pieces, as ``run`` counts them."""
    first = Column("", of="what", whole=True)
    rows = [{"what": "before: a hull a body", **before}, {"what": "after: these pieces", **after}]
    title = f"{result.ranking[-1].contacts} contacts, {engine.name} at {engine.step_hz:g} steps a second"
    return Table.of((first, FALSE, MISSED, LATE, Column("pieces", int), MEAN), rows, title)


PIECES: Final = (
    Column("body", whole=True),
    Column("file"),
    Column("pieces", int),
    Column("triangles at most", int, of="triangles"),
    Column("mesh outside by, mm", float, of="outside_mm", show=".2f"),
    Column("cut", of="how"),
)


def piece_table(bodies: Iterable[Row]) -> Table:
    """A row a body: its file, and how far the pieces hold its mesh."""
    return Table.of(PIECES, bodies, "Convex pieces")
