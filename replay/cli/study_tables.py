"""A study and a check of printed tables, as a terminal shows them."""

from collections.abc import Iterator, Sequence
from typing import Final

from rich.console import Group
from rich.text import Text

from replay.advice.open_guesses import open_guesses_line
from replay.cli.terminal import line, terminal
from replay.document.tables import FAINT, IN_BLUE, STRONG, WARNING, Marked, table
from replay.studies.class_study import tables
from replay.studies.class_study.analysis import Study
from replay.studies.class_study.class_runs import ClassRuns, runs_with_open_guesses
from replay.studies.class_study.class_tables import class_counts
from replay.studies.class_study.published import AGREES, INCONSISTENT, Remark
from replay.words import plural

MARKS = {INCONSISTENT: WARNING, "weak": IN_BLUE, AGREES: FAINT}
"""Kind of a remark -> its mark, the worst kind first."""

MOST_ROWS: Final = 9
OBSERVED: Final = "Associations in the students observed; no figure here says what causes what."


def study_tables(study: Study | None, runs: ClassRuns) -> Group:
    """Whether a conclusion changes with the detector, and what was found, in 24 lines; the page holds the rest."""
    first = [Text(), line(tables.opening(study, class_counts(runs)), STRONG)]
    first += [
        line(sentence, WARNING) for sentence in open_guesses_line(runs_with_open_guesses(runs), len(runs.metrics))
    ]
    if study is None:
        return terminal(*first)
    first.append(line(f"{tables.behind(study)}.", FAINT))
    results = sorted(_results(study), key=lambda row: row[-1] != "associated")
    result_tables = (
        [table("", ("result", "figure", "conclusion"), results, words=("result", "conclusion"))] if results else []
    )
    alphas = ", ".join(f"{name} {reliability.alpha:.2f}" for name, reliability in study.reliabilities.items())
    last = [line(f"Cronbach's alpha: {alphas}.", FAINT)] if alphas else []
    if study.refusals:
        last.append(line(f"{plural(len(study.refusals), 'result')} not given: the page says which and why.", WARNING))
    if any(c.kind == "multiple" for c in study.coefficients):
        last.insert(0, line("* the other predictors held equal", FAINT))
    displayed = [result_table.first(MOST_ROWS, "{} more on the page") for result_table in result_tables]
    return terminal(*first, *displayed, *last, line(OBSERVED, FAINT))


def _results(study: Study) -> Iterator[tuple[str, str, str]]:
    """A line per coefficient and per comparison of groups: what, how much, and what that says."""
    for finding in study.findings:
        name, outcome = tables.readable_name(finding.name), tables.readable_name(finding.outcome)
        footnote = " *" if finding.kind == "multiple" else ""
        what = f"{outcome}: {name}" if finding.kind == "groups" else f"{name}, {outcome}{footnote}"
        yield what, f"{finding.beta:+.2f}", finding.conclusion.partition(":")[0]


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
