"""Accuracy beside its price, a row per setting that was tried."""

from collections.abc import Callable, Iterable
from typing import Final

from replay import words
from replay.advice.engine_knobs import Engine, knob_text
from replay.advice.pareto import Row, count_text
from replay.auditing.loss import LOSS_MEANING
from replay.document.columns import reported_false_cell
from replay.document.cost import TIMES_ARE, busy_sentence
from replay.document.run_result import RunResult, Tradeoff
from replay.document.tables import IN_RED, IN_YELLOW, PARTLY, Cell, Marked, Table, columns_of
from replay.words import plural

SHORT: Final = 12
"""Rows of a list that is cut short; those on the front are always in it."""


def _counted(name: str, mark: str = "") -> Callable[[Row], Cell]:
    """How often a setting is wrong in one way, over the sampling offsets."""
    return lambda row: Marked(count_text(row, name), mark if row[name] else "")


COLUMNS: Final = columns_of(
    "show/tradeoff_table.toml",
    {
        "row_of": lambda row: row,
        "missed_range": _counted("missed", IN_RED),
        "late_range": _counted("late", PARTLY),
        "false_contacts_range": _counted("false_contacts", IN_YELLOW),
        "loss": words.loss_number,
        "share": reported_false_cell,
        "plain_share": lambda fraction: "-" if fraction is None else words.as_percentage(fraction),
        "ms_or_dash": lambda ms: "-" if ms is None else words.milliseconds(ms / 1e3),
        "front": lambda on: "front" if on else "",
        "or_dash": lambda words: words or "-",
        "choice_of": lambda row: f"{row['number']}  {knob_text(row['knobs'])}",
    },
)


def tradeoff_table(title: str, rows: Iterable[Row], notes: Iterable[str] = ()) -> Table:
    """These rows, in the order given."""
    return Table.of(COLUMNS["settings"], rows, title, notes)


def tradeoff_list(done: Tradeoff, *, everything: bool = False) -> Table:
    """Table for a terminal: settings by loss, the front marked, long lists cut short."""
    about, rows = done.about, list(done.rows)
    displayed = [row for number, row in enumerate(rows) if everything or row["front"] or number < SHORT]
    title = f"{plural(about['contacts'], 'contact')} in {words.duration(about['seconds'])}, beside {about['oracle']}"
    notes = _more(done, len(rows) - len(displayed))
    if everything:
        notes += how_measured(done)
    made = Table.of(COLUMNS["settings"], displayed, title, notes)
    return made if everything else made.narrow()


def tradeoff_numbers(done: Tradeoff) -> Table:
    """The settings as files have them; numbers of contacts are means over the sampling offsets."""
    return Table.of((column.for_files for column in COLUMNS["settings"]), done.rows)


def _more(done: Tradeoff, hidden: int) -> list[str]:
    """How many rows are not shown, and how many settings were not tried."""
    sentences = []
    if hidden:
        sentences.append(f"{hidden} more with -v")
    if done.cut:
        single = len(done.cut) == 1
        limit = words.duration(done.about["time_limit"] or 0.0)
        sentences.append(f"{len(done.cut)} {'setting was' if single else 'settings were'} not tried within {limit}")
    return [f"... {'; '.join(sentences)}"] if sentences else []


def how_measured(done: Tradeoff) -> tuple[str, ...]:
    """Sentences on the measured times, their repetitions and their accuracy."""
    about, made, check = done.about, done.about["machine"], done.about["clock"]
    ends = "" if check["low"] is None else f" [{words.number(check['low'])}, {words.number(check['high'])}]"
    tie = "a tie" if check["tie"] else f"no tie, so every interval is widened by {words.number(check['widened'])}"
    ranges = any(row["offsets"] > 1 for row in done.rows)
    return (
        f"Loss: {LOSS_MEANING}. front: no other setting is both faster and more accurate.",
        *(
            ["A range is the smallest and largest count over 16 start times of sampling; the mean orders them."]
            if ranges
            else []
        ),
        f"Times: frame by frame, {about['live_frames']:,} frames a pass, in turns with {about['reference']}; no "
        "compilation is in them. Times of this tool on this machine, not of your engine.",
        f"The clock's self-check: {about['reference']} timed twice gives {words.number(check['ratio'])}{ends}, {tie}.",
        f"Measured on {made['system']} {made['processor']}, {made['cores']} cores.",
        *filter(None, [busy_sentence(1 - about["processor_share"])]),
    )


def engine_table(engine: Engine, rows: Iterable[Row], result: RunResult, *, settings: bool = False) -> Table:
    """A row a choice: what is set in the engine and what comes of it; the ``settings`` for ``run`` on request."""
    contacts, seconds = result.ranking[-1].contacts, result.document.session.duration
    session = f"{plural(contacts, 'contact')} in {words.duration(seconds)}, beside {result.oracle}"
    title = f"{engine.name} {engine.version}: {session}"
    notes = (
        f"Loss: {LOSS_MEANING}. A range is over 16 start times of sampling.",
        TIMES_ARE,
        *engine.notes,
        "replay guide what-to-ship: the page behind every row. -v: each row's setting, for replay run --detectors.",
    )
    made = Table.of(COLUMNS["engine"], rows, title, notes)
    return made if settings else made.narrow()
