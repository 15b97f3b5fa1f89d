"""The front of a tradeoff on a terminal, and a bar that shows it while it grows."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from replay.cli.console import People
from replay.outputs.tables import Table
from replay.pipeline.gates import figure
from replay.tradeoffs.settings import STEP

if TYPE_CHECKING:
    from replay.pipeline.run_result import Tradeoff
    from replay.tradeoffs.sweep import Watch

SHOWN: Final = 4
"""Points of the front beside the bar."""

BUSY: Final = 0.9
"""A process that had less of the clock than this shared its core: a quiet machine gives 0.97 and more."""


def pareto_table(done: "Tradeoff", *, everything: bool = False) -> Table:
    """The front, quickest first; or every row in order of time."""
    from replay.outputs.tradeoff_table import SHOWN as COLUMNS
    from replay.outputs.tradeoff_table import how_measured, quickest_first, tradeoff_table

    about = done.about
    counts = f"{len(done.rows)} settings, {len(done.front)} on the front; {about['contacts']} contacts"
    at_work = about["processor_share"]
    words = f"The machine was busy with other work for {figure(100 * (1 - at_work))} % of the time."
    busy = [words] if at_work <= BUSY else []
    marks = ("front", "front_online", "oracle", "complete")
    rows = [row for row in quickest_first(done.rows) if everything or any(row[mark] for mark in marks)]
    shown = tradeoff_table("", rows).only(*COLUMNS)
    if all(row["axis"] == STEP for row in done.rows):
        adds = [row["value"] for row in done.rows]
        shown = tradeoff_table("", done.rows).only(*COLUMNS[:-1]).beside("what the step adds", adds)
    return shown.titled(counts, *how_measured(done), *busy)


def pareto_words(rows: Sequence[dict[str, Any]]) -> str:
    """The front so far in one line: ``0.003 ms 16.3, 0.007 ms 0``, contacts missed."""
    from replay.outputs.tradeoff_table import front_rows

    pareto = front_rows(rows)
    words = [f"{row['ms_per_frame']:.3g} ms {row['contacts_lost']:.3g}" for row in pareto[-SHOWN:]]
    return ("... " if len(pareto) > SHOWN else "") + ", ".join(words)


@contextmanager
def pareto_bar(people: People) -> "Iterator[Watch]":
    """A bar on a terminal with what runs and the front so far; elsewhere nothing."""
    if not sys.stderr.isatty() or people.quiet:
        yield lambda *_: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
    from rich.table import Column

    # Counts and time keep their room in a narrow terminal; the words give way.
    words = TextColumn("{task.description}", table_column=Column(no_wrap=True, ratio=1))
    count = MofNCompleteColumn(table_column=Column(no_wrap=True, min_width=8))
    columns = (BarColumn(bar_width=12), count, TimeElapsedColumn(Column(no_wrap=True, min_width=7)), words)
    with Progress(*columns, console=Console(stderr=True), expand=True) as bars:
        task = bars.add_task("", total=None)

        def watch(done: int, total: int, label: str, rows: Sequence[dict[str, Any]]) -> None:
            said = f"{label:<26.26} front: {pareto_words(rows)} missed"
            bars.update(task, completed=done, total=total, description=said)

        yield watch
