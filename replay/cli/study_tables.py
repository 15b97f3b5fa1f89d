"""A study and a check of printed tables, as a terminal shows them."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import Group, RenderableType
from rich.text import Text

from replay.advice.open_guesses import open_guesses_line
from replay.cli.terminal import MARK_STYLES, Paragraph, line, stacked
from replay.document.tables import FAINT, IN_BLUE, STRONG, WARNING, Marked, table
from replay.studies.class_study import tables
from replay.studies.class_study.analysis import Study
from replay.studies.class_study.class_answer import class_answer
from replay.studies.class_study.class_runs import ClassRuns, runs_with_open_guesses
from replay.studies.class_study.class_tables import ClassTables, class_counts, places
from replay.studies.class_study.published import KIND_AGREES, KIND_INCONSISTENT, Remark

MARK_OF_FINDING = {KIND_INCONSISTENT: WARNING, "weak": IN_BLUE, KIND_AGREES: FAINT}
"""Kind of a remark -> its mark, the worst kind first."""


def study_tables(study: Study | None, runs: ClassRuns, out: Path, seed: int = 0, *, verbose: bool = False) -> Group:
    """The answer of the page in ``out`` under its headings; ``verbose``: every result and each reliability too."""
    lines: list[RenderableType] = [
        Text(),
        Paragraph("", tables.opening_sentence(study, class_counts(runs)), MARK_STYLES[STRONG]),
    ]
    for row in class_answer(ClassTables(runs, seed), places(runs, out), study):
        links = "; ".join(text for text, _ in row.links)
        lines.append(Paragraph(f"  {row.name:<6}", f"{row.text} {links}." if links else row.text, MARK_STYLES[STRONG]))
        answer_details = (row.figures, row.details if verbose else "")
        lines += [Paragraph(" " * 8, text) for text in answer_details if text]
    guesses_line = open_guesses_line(runs_with_open_guesses(runs), len(runs.metrics))
    lines += [Paragraph("", sentence, MARK_STYLES[WARNING]) for sentence in guesses_line]
    if study is None or not verbose:
        return stacked(*lines)
    sorted_results = sorted(_result_rows(study), key=lambda row: row[-1] != "associated")
    result_tables = (
        [table("", ("result", "figure", "conclusion"), sorted_results, words=("result", "conclusion"))]
        if sorted_results
        else []
    )
    alpha_texts = ", ".join(f"{name} {reliability.alpha:.2f}" for name, reliability in study.reliabilities.items())
    alpha_paragraphs = [Paragraph("", f"Cronbach's alpha: {alpha_texts}.", MARK_STYLES[FAINT])] if alpha_texts else []
    return stacked(*lines, *result_tables, *alpha_paragraphs)


def _result_rows(study: Study) -> Iterator[tuple[str, str, str]]:
    """A line per coefficient and per comparison of groups: what, how much, and what that says."""
    for finding in study.findings:
        result_title = f"{tables.result_name(finding)}{tables.condition_text(finding)}"
        yield result_title, f"{finding.beta:+.2f}", finding.conclusion.partition(":")[0]


def check_table(remarks: Sequence[Remark]) -> Group:
    """Table of checks: contradictions first, then weak figures, then figures that agree."""
    sorted_remarks = sorted(remarks, key=lambda remark: list(MARK_OF_FINDING).index(remark.kind))
    rows = [
        (Marked(finding.kind, MARK_OF_FINDING[finding.kind]), finding.table, finding.row, finding.message)
        for finding in sorted_remarks
    ]
    contradiction_count = sum(finding.kind == KIND_INCONSISTENT for finding in remarks)
    headline = (
        f"{contradiction_count} of {len(remarks)} checks contradict the print"
        if contradiction_count
        else "every printed figure agrees"
    )
    column_names = ("", "table", "row", "recomputed from the printed figures")
    return stacked(Text(), line(headline, STRONG), table("", column_names, rows, words=4))
