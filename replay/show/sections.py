"""The sections of a run: every screen renders these, from the document, and computes nothing of its own."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from replay.document.answer import Reason
from replay.document.headline import answer_reasons, doubts, flicker_notes, undecided_lines
from replay.document.run_result import Summarised
from replay.document.tables import Table, markdown, markdown_text
from replay.show import run_tables
from replay.words import tally_text

MOST_FAULTS: Final = 20
"""Rows of a table of faults; Parquet holds them all."""


class SectionName(StrEnum):
    """The sections of a run, in their order."""

    ANSWER = "Answer"
    RANKING = "Ranking"
    FAULTS = "Faults"
    TIMES = "Times"
    SESSION = "Session"
    EFFECTS = "Effects"


@dataclass(frozen=True)
class Section:
    """Sentences and tables about one question.

    Parameters
    ----------
    name : the question.
    sentences : paragraphs above the tables.
    tables : each with its title and its notes.
    reasons : of the answer: ``When``, ``Why``, ``Do`` and more, each with its text and its command.
    """

    name: SectionName
    sentences: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    reasons: tuple[Reason, ...] = ()

    @property
    def table(self) -> Table:
        """Its first table."""
        return self.tables[0]


def sections(run: Summarised) -> tuple[Section, ...]:
    """Return the sections of a run that hold anything, in their order."""
    all_sections = (section_of(run, name) for name in SectionName)
    return tuple(section for section in all_sections if section.sentences or section.tables)


def section_of(run: Summarised, name: SectionName) -> Section:
    """Return the section of this name; an empty one where the run has nothing to say there."""
    return SECTIONS[name](run)


def _answer_section(run: Summarised) -> Section:
    """The sentence about the worst detector; then when, why, what to do, its cost and how sure."""
    if not run.answers:
        return Section(SectionName.ANSWER)
    return Section(SectionName.ANSWER, (run.answers[0].sentence,), reasons=tuple(answer_reasons(run)))


def _ranking_section(run: Summarised) -> Section:
    """Every detector, and what was not decided; without a reference the contacts of each detector."""
    if run.ranking:
        notes = (*run_tables.range_notes(run), *undecided_lines(run), *flicker_notes(run))
        return Section(SectionName.RANKING, notes, (run_tables.ranking_table(run),))
    contacts = (run_tables.contact_table(run, label) for label in run.document.detectors)
    return Section(SectionName.RANKING, tuple(flicker_notes(run)), tuple(contacts))


def fault_tables(run: Summarised, labels: Iterable[str]) -> Iterator[Table]:
    """Missed and false contacts of each detector: deepest misses first, false contacts of the widest gap first."""
    for label in labels:
        if label not in run.document.audit:
            continue
        tables = {"misses": run_tables.miss_table(run, label), "false": run_tables.false_table(run, label)}
        for name, table in tables.items():
            if table.rows:
                yield table.first(MOST_FAULTS, f"… and {{}} more: see {name}.parquet or --format json")


def _faults_section(run: Summarised) -> Section:
    return Section(SectionName.FAULTS, tables=tuple(fault_tables(run, (rank.label for rank in run.ranking))))


def _times_section(run: Summarised) -> Section:
    tables = (run_tables.cost_table(run),) if run.document.detectors else ()
    return Section(SectionName.TIMES, tables=tables)


def _session_section(run: Summarised) -> Section:
    """Facts of the recording, and doubts about the answer."""
    return Section(SectionName.SESSION, tuple(doubts(run.document)), (run_tables.session_table(run),))


def _effects_section(run: Summarised) -> Section:
    effects = run.document.effects
    if not effects:
        return Section(SectionName.EFFECTS)
    effect_sentences = (f"{kind}: {tally_text(effect.events)}." for kind, effect in effects.items() if effect.events)
    return Section(SectionName.EFFECTS, tuple(effect_sentences), (run_tables.effect_table(run),))


SECTIONS: Final[dict[SectionName, Callable[[Summarised], Section]]] = {
    SectionName.ANSWER: _answer_section,
    SectionName.RANKING: _ranking_section,
    SectionName.FAULTS: _faults_section,
    SectionName.TIMES: _times_section,
    SectionName.SESSION: _session_section,
    SectionName.EFFECTS: _effects_section,
}
"""Name -> section of a run; every screen takes its sentences and tables from here."""


def details(run: Summarised) -> tuple[Section, ...]:
    """Return the sections below answer and ranking, which a screen folds."""
    return tuple(section for section in sections(run) if section.name not in (SectionName.ANSWER, SectionName.RANKING))


def details_markdown(run: Summarised) -> list[str]:
    """Return the sections below answer and ranking in Markdown, each folded below its name."""
    blocks = []
    for section in details(run):
        contents = [*map(markdown_text, section.sentences), *(markdown(table, 4) for table in section.tables)]
        blocks.append("\n\n".join((f"<details><summary>{section.name}</summary>", *contents, "</details>")))
    return blocks
