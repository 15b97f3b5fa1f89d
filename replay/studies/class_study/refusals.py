"""Refusals of a study: each rule has a name, a reason, and a remedy.

A refusal is a result, not a failure: the analysis goes on and the page lists it. ``StudyRefusedError`` carries it to
where the list is kept.
"""

from typing import Final, NamedTuple

from replay.document.tables import package_toml
from replay.errors import StudyError

LEAST_STUDENTS: Final = 10
"""Below this many students no p-value is given."""

LEAST_IN_CELL: Final = 5
"""No cell of any output summarises fewer students than this: fewer could be recognised."""

PERSONS_PER_ITEM: Final = 5
"""Below this many students per questionnaire item, factor statistics carry a warning (usual advice: 5 to 10)."""


class Rule(NamedTuple):
    """Why a result would mislead, and what would make it possible."""

    reason: str
    lift: str


RULES: Final = {
    name: Rule(*(words.format(students=LEAST_STUDENTS, cell=LEAST_IN_CELL) for words in (row["reason"], row["lift"])))
    for name, row in package_toml("studies/class_study/refusals.toml").items()
}
"""Rule -> why and what lifts it."""


class StudyRefusedError(StudyError):
    """The result ``what``, which a rule (key of ``RULES``) forbids."""

    def __init__(self, rule_name: str, what: str) -> None:
        self.rule, self.what = rule_name, what
        self.reason, self.lift = RULES[rule_name].reason, RULES[rule_name].lift
        super().__init__(f"{what}: refused ({rule_name}): {self.reason}; to lift it, {self.lift}")


def count_text(count: int) -> str:
    """A count of a cell, or that it is too small to be said."""
    return f"fewer than {LEAST_IN_CELL}" if count < LEAST_IN_CELL else f"{count}"
