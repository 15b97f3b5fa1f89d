"""A study and a check of printed tables, as a terminal shows them."""

from collections.abc import Sequence

from rich.console import Group
from rich.text import Text

from replay.cli.terminal import line, terminal
from replay.outputs.tables import FAINT, FOUND, STRONG, WARNING, Marked, table
from replay.studies.class_study import tables
from replay.studies.class_study.analysis import Study
from replay.studies.class_study.published import AGREES, INCONSISTENT, Remark

MARKS = {INCONSISTENT: WARNING, "weak": FOUND, AGREES: FAINT}
"""Kind of a remark -> its mark, the worst kind first."""

HEAD = ("outcome", "predictor", "n", "beta", "95 % interval", "p (Holm)", "conclusion")
GROUP_HEAD = ("outcome", "means", "n", "difference", "p (Holm)", "conclusion")
ALPHA_HEAD = ("construct", "items", "n", "Cronbach's alpha", "95 % interval")


def study_tables(study: Study | None) -> Group:
    """Whether a conclusion changes with the detector, what was found, every coefficient, and what is not said."""
    if study is None:
        return terminal(Text(), line(tables.changes(study), STRONG))
    parts = [tables.coefficient_table(study).only(*HEAD)] if study.regressions else []
    parts += [tables.group_table(study).only(*GROUP_HEAD)] if study.groups else []
    parts += [tables.reliability_table(study).only(*ALPHA_HEAD)] if study.reliabilities else []
    said = [*(f"not given: {refused}" for refused in study.refusals), *map(str, study.warnings)]
    first = (line(one, STRONG) for one in [tables.changes(study), *tables.headlines(study)])
    doubts = (line(one, WARNING) for one in said)
    return terminal(Text(), *first, *parts, *doubts, Text(), line(tables.OBSERVED_ONLY, FAINT))


def check_table(remarks: Sequence[Remark]) -> Group:
    """What contradicts itself first, then what is weak, then what agrees."""
    ordered = sorted(remarks, key=lambda remark: list(MARKS).index(remark.kind))
    rows = [(Marked(one.kind, MARKS[one.kind]), one.table, one.row, one.message) for one in ordered]
    wrong = sum(one.kind == INCONSISTENT for one in remarks)
    said = f"{wrong} of {len(remarks)} checks contradict the print" if wrong else "every printed figure agrees"
    head = ("", "table", "row", "recomputed from the printed figures")
    return terminal(Text(), line(said, STRONG), table("", head, rows, words=4))
