"""What a result says, and whether it says so with another detector too."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from replay.studies.class_study.groups import GroupDifference
from replay.studies.class_study.joining import DETECTOR, Metrics
from replay.studies.class_study.regression import Coefficient, Regression

LEVEL: Final = 0.05
"""Associated: p after Holm's correction is below this, and the interval leaves out zero."""

UNDECIDED: Final = "undecided"


def associated(coefficient: Coefficient | GroupDifference) -> bool:
    """Whether a coefficient differs from zero: by its p after Holm's correction, and by its interval.

    The two come from different resamplings, permutations and the bootstrap, and among few students they can differ; a
    page that claims an association and prints an interval around zero contradicts itself.
    """
    return coefficient.p_holm is not None and coefficient.p_holm < LEVEL and coefficient.apart


def conclusion(coefficient: Coefficient | GroupDifference) -> str:
    """What a coefficient says, in the words of every table."""
    if associated(coefficient):
        return "associated"
    if coefficient.p is None:
        return "not tested"
    if coefficient.p >= LEVEL:
        return "not told from chance"
    return f"{UNDECIDED} after Holm" if coefficient.apart else f"{UNDECIDED}: interval holds zero"


@dataclass(frozen=True)
class Sensitivity:
    """One result about behaviour, as it is with another detector.

    ``recall`` is what that detector finds of the contacts, ``students`` are those used; ``predictor`` is that of a
    regression, or the groups compared; ``beta`` is the coefficient or the difference, ``None`` where none could be
    computed. ``tested`` says whether both have a p-value, ``changes`` whether the conclusion differs (associated or
    not, and its sign), ``undecided`` whether p and interval leave one of them open.
    """

    detector: str
    recall: float | None
    students: int
    outcome: str
    predictor: str
    beta: float | None
    p_holm: float | None
    changes: bool
    tested: bool
    undecided: bool = False

    @property
    def conclusion(self) -> str:
        """Whether it is another, in the words of every table."""
        return "another conclusion" if self.changes else "the same" if self.tested else "not tested"


Results = dict[tuple[tuple[str, ...], str], tuple[int, float, Coefficient | GroupDifference]]
"""Names of the variables, and the predictor or the groups -> students used, the figure, and what it is judged by."""


def results(regressions: Sequence[Regression], groups: Sequence[GroupDifference]) -> Results:
    """Every coefficient and every difference of groups."""
    found: Results = {}
    for one in regressions:
        names = (one.outcome, *(c.name for c in one.coefficients))
        found |= {(names, c.name): (one.students, c.beta, c) for c in one.coefficients}
    for two in groups:
        found[(two.outcome,), " against ".join(reversed(two.groups))] = (sum(two.students), two.difference, two)
    return found


def compared(before: Results, after: Results, metrics: Metrics) -> Iterator[Sensitivity]:
    """The results that use behaviour, beside those with another detector; each was fitted in its own family of p."""
    for key, (students, was, judged) in before.items():
        if not any(name in metrics.columns for name in key[0]):
            continue
        name, recall = str(metrics.columns[DETECTOR][0]), metrics.recall()
        place = (key[0][0], key[1])
        if key not in after:
            yield Sensitivity(name, recall, students, *place, None, None, changes=False, tested=False)
            continue
        used, now, again = after[key]
        turned = associated(again) and np.sign(was) != np.sign(now)
        changed = associated(judged) != associated(again) or bool(turned)
        tested = judged.p is not None and again.p is not None
        unsure = any(conclusion(one).startswith(UNDECIDED) for one in (judged, again))
        yield Sensitivity(name, recall, used, *place, now, again.p_holm, changed, tested, unsure)
