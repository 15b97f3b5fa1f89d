"""Texts of the picture, from templates: the answer, what accuracy costs, and what was replayed."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from replay import words
from replay.auditing.misses import FEWEST_LISTED_SHORT
from replay.document.cost import TIMES_SENTENCE, busy_text, cost_sentence
from replay.document.ranking import ranks_with_fixes
from replay.document.run_result import RunResult
from replay.document.summary import CAVEAT
from replay.document.tables import Column, Table, markdown, table
from replay.effects.effect_summary import event_lines
from replay.show.accuracy import run_dots, tradeoff_dots
from replay.show.palette import TICKS, Rgba
from replay.show.plots import Dot
from replay.show.report.markup import render_template
from replay.show.rerun_log.recording_file import entity
from replay.show.rerun_log.timing import colour_of, stage_ms
from replay.show.run_tables import sampling_notes
from replay.show.sections import SectionName, fault_tables, section_of
from replay.show.words import NOT_COMPUTED, PAIR_FRAME_ROWS
from replay.words import plural

TEMPLATE_FOLDER: Final = "show/rerun_log"
"""Of the templates."""

ANSWER_ENTITY: Final = "answer"
ACCURACY_ENTITY: Final = "accuracy/text"
SESSION_ENTITY: Final = "session"

TABLE_LEVEL: Final = 2
"""Level of the heading of a table."""

NO_BREAK_SPACE: Final = "\u00a0"
"""A space at which no line is broken: between a number and its unit."""


def details_path(label: str) -> str:
    """Entity of the text about one detector."""
    return entity("details", label)


def answer_text(result: RunResult) -> str:
    """Text of the answer: error, reasons, remedy, cost of accuracy, and the ranking, the worst first."""
    return render_template(
        f"{TEMPLATE_FOLDER}/answer.md",
        result=result,
        answer=section_of(result, SectionName.ANSWER),
        label=result.answers[0].label,
        moment=result.answers[0].moment,
        doubts=section_of(result, SectionName.SESSION).sentences,
        ranking=ranking_text(result) if len(result.ranking) > 2 else "",
        replayed=replayed_sentence(result),
        caveat=CAVEAT,
        notes=[*section_of(result, SectionName.RANKING).sentences, *sampling_notes(result)],
        tables=_tables(result, SectionName.TIMES, SectionName.SESSION, SectionName.EFFECTS),
    )


def _tables(result: RunResult, *names: SectionName) -> list[str]:
    """Tables of sections in Markdown."""
    return [markdown(table, TABLE_LEVEL) for name in names for table in section_of(result, name).tables]


def ranking_text(result: RunResult) -> str:
    """Every detector in Markdown: its name and what it is in one column, so that all fit beside a picture."""
    contacts = plural(result.ranking[-1].contacts, "contact")
    name_column = Column(contacts, of=lambda rank: f"{rank.label}:{NO_BREAK_SPACE}{rank.what}")
    ranking = section_of(result, SectionName.RANKING).table.narrow().values()
    columns = (replace(column, name=column.short or column.name) for column in ranking.columns)
    return markdown(Table.of([name_column, *columns], ranks_with_fixes(result.ranking, result.document)))


def accuracy_text(result: RunResult) -> str:
    """Text on accuracy: cost of missing nothing, and the accuracy and time of each detector."""
    notes = [*filter(None, [TIMES_SENTENCE, busy_text(result.document)])]
    return render_template(
        f"{TEMPLATE_FOLDER}/accuracy.md",
        cost=cost_sentence(result.document),
        notes=notes,
        tradeoff=result.tradeoff,
        answers=result.answers,
    )


def dots_of(result: RunResult) -> list[tuple[Dot, Rgba]]:
    """A dot a detector, or a setting of a tradeoff, as on the page, and its colour."""
    if result.tradeoff is not None and result.tradeoff.rows:
        dots = tradeoff_dots(result.tradeoff)
        return [(dot, colour_of(number) if dot.kind else TICKS) for number, dot in enumerate(dots)]
    # The measured Fix is no detector of the run: its colour is the next one.
    number_of_label = {label: number for number, label in enumerate(result.detections)}
    return [(dot, colour_of(number_of_label.get(dot.detector, len(number_of_label)))) for dot in run_dots(result)]


def series_names(result: RunResult) -> dict[str, str]:
    """Label -> what a legend says of its times."""
    name_of_label = {}
    for label, detector in result.document.detectors.items():
        sample_times = detector.seconds.sample_times
        tail_text = (
            f", p99 {words.milliseconds(sample_times.p99)}, longest {words.milliseconds(sample_times.max)}"
            if sample_times
            else ""
        )
        name_of_label[label] = f"{label}: mean {words.milliseconds(detector.seconds.per_frame_mean)}{tail_text}"
    return name_of_label


def replayed_sentence(result: RunResult) -> str:
    """Sentence with the duration, frames, bodies and pairs replayed."""
    times, assembly = result.assembly.motion.times, result.assembly
    duration_s = float(times[-1] - times[0]) if len(times) else 0.0
    frames, pairs = plural(len(times), "frame"), plural(len(assembly.pairs), "pair")
    return f"{words.duration(duration_s)}, {frames}, {plural(len(assembly.bodies), 'body', 'bodies')}, {pairs}."


def detector_text(result: RunResult, label: str) -> str:
    """Text on a detector: errors, settings, pair-frames, and milliseconds by stage."""
    counts_table = None
    if label in result.comparisons:
        column_names = (f"against {result.oracle}", *PAIR_FRAME_ROWS.values())
        pair_frames = result.document.audit[label].pair_frames
        counts_table = markdown(
            table("", column_names, [("pair-frames", *(getattr(pair_frames, field) for field in PAIR_FRAME_ROWS))])
        )
    stage_rows = [(stage, words.decimal(ms.mean(), 4)) for stage, ms in stage_ms(result.detections[label]).items()]
    return render_template(
        f"{TEMPLATE_FOLDER}/detector.md",
        answers=[answer for answer in result.answers if answer.label == label],
        setting=result.document.detectors[label].spec,
        counts=counts_table,
        stages=markdown(table("", ("stage", "ms a frame"), stage_rows)),
        tables=[markdown(table, TABLE_LEVEL) for table in fault_tables(result, [label])],
    )


def session_text(result: RunResult) -> str:
    """Text on the session and its events, for a run that compares nothing."""
    return render_template(
        f"{TEMPLATE_FOLDER}/session.md",
        result=result,
        replayed=replayed_sentence(result),
        doubts=section_of(result, SectionName.SESSION).sentences,
        caveat=CAVEAT,
        happened=event_lines(result.effects, FEWEST_LISTED_SHORT),
        nothing=NOT_COMPUTED,
        tables=_tables(result, SectionName.TIMES, SectionName.SESSION, SectionName.EFFECTS),
    )
