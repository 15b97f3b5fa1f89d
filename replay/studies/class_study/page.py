"""``study.html``: what a study found, in plain words that claim association and never cause."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from replay.advice.open_guesses import open_guesses_line
from replay.document.tables import Column, Table
from replay.show.report.markup import render_template
from replay.show.report.page_script import TABLES_SCRIPTS, page_script
from replay.studies.class_study.analysis import Study
from replay.studies.class_study.charts import class_charts
from replay.studies.class_study.class_answer import class_answer
from replay.studies.class_study.class_runs import ClassRuns, runs_with_open_guesses
from replay.studies.class_study.class_tables import ClassTables, PageLink, class_counts, sessions_table
from replay.studies.class_study.regression import SIGNIFICANCE_LEVEL
from replay.studies.class_study.tables import (
    OBSERVED_ONLY_NOTE,
    headlines,
    opening_sentence,
    p_text,
    page_table,
    sample_table,
    source_sentence,
    study_tables,
)

REFUSAL_COLUMNS: Final = (
    Column("result", of="what", whole=True),
    Column("rule"),
    Column("reason"),
    Column("what lifts it", of="lift"),
)


MOST_UNMATCHED: Final = 8
"""Codes without a partner that stand at the top of the page."""


@dataclass(frozen=True)
class Heading:
    """The title of a page, and a sentence below its first one; ``""``: none."""

    title: str = "Class"
    note: str = ""


def study_html(
    runs: ClassRuns,
    address_of_run: Mapping[str, PageLink],
    study: Study | None = None,
    heading: Heading = Heading(),
    seed: int = 0,
) -> str:
    """The page as text: of the sessions of a class, and of a study where there is a questionnaire.

    ``address_of_run`` is run -> name and address of its page.
    """
    class_tables = ClassTables(runs, seed)
    open_guesses = open_guesses_line(runs_with_open_guesses(runs), len(runs.metrics))
    template_values: dict[str, Any] = {
        "title": heading.title,
        "opening": opening_sentence(study, class_counts(runs)),
        "note": heading.note,
        "doubts": open_guesses,
        "answer": class_answer(class_tables, address_of_run, study),
        "unmatched": [],
        "study": study,
        "sessions": sessions_table(runs, address_of_run),
        "observed_only": OBSERVED_ONLY_NOTE,
        "contacts": {
            "How detectors differ": class_tables.detectors(),
            "Pairs missed most": class_tables.pairs(),
            "Task, stage, VR type": class_tables.activity_table(),
            "Causes": class_tables.causes(),
        },
        "script": page_script(TABLES_SCRIPTS),
        "charts": class_charts(class_tables, study),
    }
    if study is not None:
        sentences = headlines(study)
        template_values |= {
            "unmatched": list(_unmatched_sentences(study)),
            "headlines": sentences,
            "behind": source_sentence(study),
            "tables": {name: page_table(table) for name, table in study_tables(study).items()},
            "sample": sample_table(study, class_tables.sample()),
            "level": SIGNIFICANCE_LEVEL,
            "reliability": [*_all_items(study), *study.warnings],
            "refusals": Table.of(REFUSAL_COLUMNS, study.refusals, "Results not given"),
        }
    return render_template("studies/class_study/page.html", **template_values)


def _unmatched_sentences(study: Study) -> Iterator[str]:
    """Sentences on students who are in one file only, each named with what may be meant."""
    yield from (f"Code {sentence}." for sentence in study.unmatched[:MOST_UNMATCHED])
    if len(study.unmatched) > MOST_UNMATCHED:
        yield f"{len(study.unmatched) - MOST_UNMATCHED} more codes match nothing."


def _all_items(study: Study) -> Iterator[str]:
    if study.kmo is not None and study.bartlett is not None:
        b = study.bartlett
        yield (
            f"All items together: KMO {study.kmo:.3f}; Bartlett's chi-square "
            f"{b.chi_square:.1f} with {b.degrees} degrees of freedom, p {p_text(b.p)}; n = {b.students}."
        )
