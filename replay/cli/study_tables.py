"""A study and a check of printed tables, as a terminal shows them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from rich.console import Group
from rich.text import Text

from replay.cli.terminal import line, terminal
from replay.outputs.tables import FAINT, FOUND, STRONG, WARNING, Marked, table
from replay.studies.class_study import tables
from replay.studies.class_study.analysis import Study
from replay.studies.class_study.class_runs import ClassRuns
from replay.studies.class_study.class_tables import class_counts
from replay.studies.class_study.published import AGREES, INCONSISTENT, Remark

MARKS = {INCONSISTENT: WARNING, "weak": FOUND, AGREES: FAINT}
"""Kind of a remark -> its mark, the worst kind first."""

HEAD = ("outcome", "predictor", "n", "beta", "p (Holm)", "conclusion")
GROUP_HEAD = ("outcome", "n", "difference", "p (Holm)", "conclusion")


def study_tables(study: Study | None, runs: ClassRuns | None) -> Group:
    """Whether a conclusion changes with the detector, and what was found, in 24 lines; the page holds the rest."""
    counts = class_counts(runs) if runs is not None else tables.study_counts(study) if study is not None else ""
    first = [Text(), line(tables.opening(study, counts), STRONG)]
    if study is None:
        return terminal(*first)
    if not study.regressions and not study.groups:
        first.append(line(f"{tables.headlines(study)[0]}."))
    parts = [tables.coefficient_table(study).only(*HEAD).first(MOST_ROWS, MORE)] if study.regressions else []
    parts += [tables.group_table(study).only(*GROUP_HEAD).first(MOST_GROUPS, MORE)] if study.groups else []
    alphas = ", ".join(f"{name} {one.alpha:.2f}" for name, one in study.reliabilities.items())
    last = [line(f"Cronbach's alpha: {alphas}", FAINT)] if alphas else []
    if doubts := [
        f"{len(found)} {what}"
        for found, what in ((study.refusals, "not given"), (study.warnings, "of little weight"))
        if found
    ]:
        last.append(line(f"Results {', '.join(doubts)}: the page says which and why.", WARNING))
    bare = [
        replace(part, notes=part.notes[-1:] if part.notes[-1:] and "more on" in part.notes[-1] else ())
        for part in parts
    ]
    return terminal(*first, *bare, *last, line(OBSERVED, FAINT))


MOST_ROWS, MOST_GROUPS = 6, 2
MORE: Final = "{} more on the page"
OBSERVED: Final = "Associations in the students observed; no figure here says what causes what."


def check_table(remarks: Sequence[Remark]) -> Group:
    """What contradicts itself first, then what is weak, then what agrees."""
    ordered = sorted(remarks, key=lambda remark: list(MARKS).index(remark.kind))
    rows = [(Marked(one.kind, MARKS[one.kind]), one.table, one.row, one.message) for one in ordered]
    wrong = sum(one.kind == INCONSISTENT for one in remarks)
    said = f"{wrong} of {len(remarks)} checks contradict the print" if wrong else "every printed figure agrees"
    head = ("", "table", "row", "recomputed from the printed figures")
    return terminal(Text(), line(said, STRONG), table("", head, rows, words=4))
