"""A study and a check of printed tables, as a terminal shows them."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import Group, RenderableType
from rich.text import Text

from replay.advice.open_guesses import open_guesses_line
from replay.cli.terminal import STYLES, Paragraph, line, terminal
from replay.document.tables import FAINT, IN_BLUE, STRONG, WARNING, Marked, table
from replay.studies.class_study import tables
from replay.studies.class_study.analysis import Study
from replay.studies.class_study.class_answer import class_answer
from replay.studies.class_study.class_runs import ClassRuns, runs_with_open_guesses
from replay.studies.class_study.class_tables import ClassTables, class_counts, places
from replay.studies.class_study.published import AGREES, INCONSISTENT, Remark

MARKS = {INCONSISTENT: WARNING, "weak": IN_BLUE, AGREES: FAINT}
"""Kind of a remark -> its mark, the worst kind first."""


def study_tables(study: Study | None, runs: ClassRuns, out: Path, seed: int = 0, *, verbose: bool = False) -> Group:
    """The answer of the page in ``out`` under its headings; ``verbose``: every result and each reliability too."""
    lines: list[RenderableType] = [
        Text(),
        Paragraph("", tables.opening_sentence(study, class_counts(runs)), STYLES[STRONG]),
    ]
    for row in class_answer(ClassTables(runs, seed), places(runs, out), study):
        links = "; ".join(text for text, _ in row.links)
        lines.append(Paragraph(f"  {row.name:<6}", f"{row.text} {links}." if links else row.text, STYLES[STRONG]))
        below = (row.figures, row.details if verbose else "")
        lines += [Paragraph(" " * 8, text) for text in below if text]
    guesses = open_guesses_line(runs_with_open_guesses(runs), len(runs.metrics))
    lines += [Paragraph("", sentence, STYLES[WARNING]) for sentence in guesses]
    if study is None or not verbose:
        return terminal(*lines)
    results = sorted(_results(study), key=lambda row: row[-1] != "associated")
    result_tables = (
        [table("", ("result", "figure", "conclusion"), results, words=("result", "conclusion"))] if results else []
    )
    alphas = ", ".join(f"{name} {reliability.alpha:.2f}" for name, reliability in study.reliabilities.items())
    last = [Paragraph("", f"Cronbach's alpha: {alphas}.", STYLES[FAINT])] if alphas else []
    return terminal(*lines, *result_tables, *last)


def _results(study: Study) -> Iterator[tuple[str, str, str]]:
    """A line per coefficient and per comparison of groups: what, how much, and what that says."""
    for finding in study.findings:
        name = f"{tables.result_name(finding)}{tables.condition_text(finding)}"
        yield name, f"{finding.beta:+.2f}", finding.conclusion.partition(":")[0]


def check_table(remarks: Sequence[Remark]) -> Group:
    """Table of checks: contradictions first, then weak figures, then figures that agree."""
    ordered = sorted(remarks, key=lambda remark: list(MARKS).index(remark.kind))
    rows = [
        (Marked(finding.kind, MARKS[finding.kind]), finding.table, finding.row, finding.message) for finding in ordered
    ]
    wrong = sum(finding.kind == INCONSISTENT for finding in remarks)
    headline = f"{wrong} of {len(remarks)} checks contradict the print" if wrong else "every printed figure agrees"
    head = ("", "table", "row", "recomputed from the printed figures")
    return terminal(Text(), line(headline, STRONG), table("", head, rows, words=4))
