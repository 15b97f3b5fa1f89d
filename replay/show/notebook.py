"""A run in a notebook and at a Python prompt: the ranking, the answer, charts, and where the picture is."""

from dataclasses import dataclass
from functools import partial
from itertools import accumulate
from shlex import quote
from textwrap import wrap
from typing import Final

from replay.document.placeholders import RUN, SESSION
from replay.document.run_result import RunResult
from replay.document.tables import text_of
from replay.errors import AuditError
from replay.show.accuracy import accuracy_plot, run_dots
from replay.show.palette import LIGHT_COLOURS
from replay.show.report.first_screen import comparison_of
from replay.show.report.markup import render_template
from replay.show.report.page import view_of
from replay.show.sections import SectionName, details, section_of
from replay.words import duration, plural, safe_text

MOST_LINES: Final = 15
"""Lines of a ``repr`` at most."""

MOST_DETECTORS: Final = 6
"""Rows of the ranking in a ``repr``."""

MOST_WRAPPED: Final = 4
"""Lines of a sentence."""

LINKED_FILES: Final = {"report.html": "report", "run.rrd": "picture for Rerun"}
"""Files of a run folder that are linked."""

LINE_COLUMNS: Final = 100

SCATTER_SIZE: Final = (760.0, 250.0)
"""Width of a plot, and height of its upper half: its text has 10 pixels at least in a cell of 600."""

LANE_HEIGHT: Final = 44.0
TITLE_LETTERS: Final = 74
LEGEND_LETTER_WIDTH: Final = 7.0


def run_text(result: RunResult) -> str:
    """A run in at most fifteen lines: what was replayed, the ranking, the answer, where it was written."""
    lines = [_run_sentence(result)]
    if result.ranking:
        narrow_table = section_of(result, SectionName.RANKING).table.narrow()
        narrow_table = narrow_table.only("detector", *narrow_table.values().head)
        cells = [narrow_table.head] + [[text_of(cell) for cell in row] for row in narrow_table.cells()]
        rows_kept, hidden_count = cells[: MOST_DETECTORS + 1], len(cells) - MOST_DETECTORS - 1
        widths = [max(len(row[k]) for row in rows_kept) for k in range(len(narrow_table.head))]
        lines += [_text_row(row, widths) for row in rows_kept]
        lines += [f"... and {hidden_count} more in .ranking"] if hidden_count > 0 else []
        lines += wrap(section_of(result, SectionName.ANSWER).sentences[0], LINE_COLUMNS)[:MOST_WRAPPED]
    else:
        lines += [
            f"{label}: {plural(len(contacts), 'contact')}"
            for label, contacts in list(result.contacts.items())[:MOST_DETECTORS]
        ]
    lines.append(_location_sentence(result))
    return "\n".join(
        line if len(line) <= LINE_COLUMNS else line[: LINE_COLUMNS - 3] + "..." for line in lines[:MOST_LINES]
    )


def run_html(result: RunResult) -> str:
    """The ranking as a table, the answer below it, and a link to the report and to the picture."""
    ranking = section_of(result, SectionName.RANKING)
    files = [name for name in LINKED_FILES if result.out and (result.out / name).is_file()]
    return render_template(
        "show/notebook.html",
        what=_run_sentence(result),
        where=_location_sentence(result),
        ranking=ranking.table if result.ranking else None,
        undecided=ranking.sentences,
        answer=section_of(result, SectionName.ANSWER),
        details=details(result),
        command_of=partial(_filled_command, result=result),
        links=result.out and [((result.out / name).as_posix(), LINKED_FILES[name]) for name in files],
    )


@dataclass(frozen=True)
class Plot:
    """A drawing for a notebook; ``svg`` can be written to a file."""

    svg: str
    detectors: int

    def __repr__(self) -> str:
        return f"Plot of {plural(self.detectors, 'detector')}: accuracy against cost, and contacts over time"

    def _repr_svg_(self) -> str:
        return self.svg


def run_plot(result: RunResult) -> Plot:
    """Accuracy against cost and the timeline of all detectors; ``AuditError``: nothing was compared."""
    if not result.ranking:
        raise AuditError(
            "nothing was compared in this run, so there is nothing to plot; run it with a reference (oracle=...)"
        )
    dots, timeline = run_dots(result), comparison_of(view_of(result)).timeline
    scatter = accuracy_plot(dots, SCATTER_SIZE) if dots else None
    title = wrap(safe_text(section_of(result, SectionName.ANSWER).sentences[0]), TITLE_LETTERS)
    scatter_top = 22 * len(title) + 16
    legend_top = scatter_top + (SCATTER_SIZE[1] if scatter else 0) + 12
    lanes = [
        (label, what, lane, legend_top + 24 + LANE_HEIGHT * number)
        for number, (label, what, lane) in enumerate(timeline.lanes)
    ]
    legend_entries = [(kind, label) for kind, label in timeline.legend if kind in LIGHT_COLOURS]
    legend_positions = accumulate((LEGEND_LETTER_WIDTH * len(label) + 44 for _, label in legend_entries), initial=12.0)
    svg = render_template(
        "show/plot.svg",
        width=SCATTER_SIZE[0],
        height=legend_top + 24 + LANE_HEIGHT * len(lanes) + 26,
        alternative=" ".join([*title, *(f"{label}: {lane.words}." for label, _, lane in timeline.lanes)]),
        title=title,
        scatter=scatter,
        scatter_top=scatter_top,
        legend=[(kind, label, x) for (kind, label), x in zip(legend_entries, legend_positions, strict=False)],
        legend_top=legend_top,
        lanes=lanes,
        ticks=timeline.ticks,
        colours={**LIGHT_COLOURS, "contact": LIGHT_COLOURS["right"]},
        paper="#ffffff",
        ink="#17212d",
        faint="#536070",
        rule="#e4e9ef",
    )
    return Plot(svg, len(lanes))


def _run_sentence(result: RunResult) -> str:
    session = result.document.session
    bodies = plural(len(session.bodies), "body", "bodies")
    pairs = plural(len(result.document.pairs), "pair")
    origin = f" of {result.session.origin}" if result.session.origin else ""
    return f"Run{origin}: {session.frames:,} frames in {duration(session.duration)}, {bodies}, {pairs}"


def _location_sentence(result: RunResult) -> str:
    if result.out is None:
        return "Nothing was written: .write(folder) writes report, tables and picture; .plot() and .view() show it."
    return f"Written to {result.out}; .plot() and .view() show it here."


def _filled_command(command: str, result: RunResult) -> str:
    recording, folder = result.session.origin or SESSION, str(result.out or RUN)
    return command.replace(SESSION, quote(recording)).replace(RUN, quote(folder))


def _text_row(cells: list[str], widths: list[int]) -> str:
    first_cell, *other_cells = zip(cells, widths, strict=True)
    return "  ".join([first_cell[0].ljust(first_cell[1]), *(cell.rjust(width) for cell, width in other_cells)])
