"""Accuracy beside its price, a row per setting that was tried."""

from collections.abc import Iterable
from typing import Final

from replay import words
from replay.advice.engine_knobs import Engine, knob_text
from replay.advice.pareto import Row
from replay.auditing.loss import LOSS_MEANING
from replay.document.columns import file_columns, screen_columns
from replay.document.cost import TIMES_SENTENCE, busy_sentence
from replay.document.run_result import RunResult, Tradeoff
from replay.document.tables import Table
from replay.words import plural

MOST_SHORT_ROWS: Final = 12
"""Rows of a list that is cut short; those on the front are always in it."""


def tradeoff_table(title: str, rows: Iterable[Row], notes: Iterable[str] = ()) -> Table:
    """These rows, in the order given."""
    return Table.of(screen_columns("tradeoff"), rows, title, notes)


def tradeoff_list(tradeoff: Tradeoff, *, is_complete: bool = False) -> Table:
    """Table for a terminal: settings by loss, the front marked, long lists cut short."""
    tradeoff_facts, rows = tradeoff.about, list(tradeoff.rows)
    displayed_rows = [row for number, row in enumerate(rows) if is_complete or row["front"] or number < MOST_SHORT_ROWS]
    title = (
        f"{plural(tradeoff_facts['contacts'], 'contact')} in {words.duration(tradeoff_facts['seconds'])}, "
        f"beside {tradeoff_facts['oracle']}"
    )
    notes = _omission_notes(tradeoff, len(rows) - len(displayed_rows))
    if is_complete:
        notes += measurement_sentences(tradeoff)
    built_table = Table.of(screen_columns("tradeoff"), displayed_rows, title, notes)
    return built_table if is_complete else built_table.narrow()


def tradeoff_numbers(tradeoff: Tradeoff) -> Table:
    """The settings as files have them; numbers of contacts are means over the sampling offsets."""
    return Table.of(file_columns("tradeoff"), tradeoff.rows)


def _omission_notes(tradeoff: Tradeoff, hidden_count: int) -> list[str]:
    """How many rows are not shown, and how many settings were not tried."""
    sentences = []
    if hidden_count:
        sentences.append(f"{hidden_count} more with -v")
    if tradeoff.cut:
        is_single = len(tradeoff.cut) == 1
        time_limit = words.duration(tradeoff.about["time_limit"] or 0.0)
        sentences.append(
            f"{len(tradeoff.cut)} {'setting was' if is_single else 'settings were'} not tried within {time_limit}"
        )
    return [f"... {'; '.join(sentences)}"] if sentences else []


def measurement_sentences(tradeoff: Tradeoff) -> tuple[str, ...]:
    """Sentences on the measured times, their repetitions and their accuracy."""
    tradeoff_facts, machine, clock_check = tradeoff.about, tradeoff.about["machine"], tradeoff.about["clock"]
    interval_text = (
        ""
        if clock_check["low"] is None
        else f" [{words.number(clock_check['low'])}, {words.number(clock_check['high'])}]"
    )
    tie_text = (
        "a tie"
        if clock_check["tie"]
        else f"no tie, so every interval is widened by {words.number(clock_check['widened'])}"
    )
    ranges = any(row["offsets"] > 1 for row in tradeoff.rows)
    return (
        f"Loss: {LOSS_MEANING}. front: no other setting is both faster and more accurate.",
        *(
            ["A range is the smallest and largest count over 16 start times of sampling; the mean orders them."]
            if ranges
            else []
        ),
        f"Times: frame by frame, {tradeoff_facts['live_frames']:,} frames a pass, in turns with "
        f"{tradeoff_facts['reference']}; no "
        "compilation is in them. Times of this tool on this machine, not of your engine.",
        f"The clock's self-check: {tradeoff_facts['reference']} timed twice gives "
        f"{words.number(clock_check['ratio'])}{interval_text}, {tie_text}.",
        f"Measured on {machine['system']} {machine['processor']}, {machine['cores']} cores.",
        *filter(None, [busy_sentence(1 - tradeoff_facts["processor_share"])]),
    )


def engine_table(engine: Engine, rows: Iterable[Row], result: RunResult, *, settings: bool = False) -> Table:
    """A row a choice: what is set in the engine and what comes of it; the ``settings`` for ``run`` on request."""
    contacts, seconds = result.ranking[-1].contacts, result.document.session.duration
    session = f"{plural(contacts, 'contact')} in {words.duration(seconds)}, beside {result.oracle}"
    title = f"{engine.name} {engine.version}: {session}"
    notes = (
        f"Loss: {LOSS_MEANING}. A range is over 16 start times of sampling.",
        TIMES_SENTENCE,
        *engine.notes,
        "replay guide what-to-ship: the page behind every row. -v: each row's setting, for replay run --detectors.",
    )
    choice_rows = [{**row, "choice": f"{row['number']}  {knob_text(row['knobs'])}"} for row in rows]
    built_table = Table.of(screen_columns("engine"), choice_rows, title, notes)
    return built_table if settings else built_table.narrow()
