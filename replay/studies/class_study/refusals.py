"""What a study does not say: each rule has a name, a reason, and what would lift it.

A refusal is a result, not a failure: the analysis goes on and the page lists it. ``StudyRefusedError`` carries it to
where the list is kept.
"""

from typing import Final, NamedTuple

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


RULES: Final[dict[str, Rule]] = {
    "one-item": Rule("one item has no internal consistency", "ask at least two items for the construct"),
    "no-variance": Rule("answers that are all equal have neither correlation nor consistency", "collect more answers"),
    "few-students": Rule(
        f"a p-value from fewer than {LEAST_STUDENTS} students depends on each single one of them",
        f"study at least {LEAST_STUDENTS} students",
    ),
    "singular": Rule(
        "the items' correlation matrix has no inverse: an item repeats others, or there are fewer students than items",
        "drop the repeated item or study more students",
    ),
    "collinear": Rule("the predictors determine each other; their shares are not known", "leave one of them out"),
    "ids": Rule(
        "rows whose student is missing or named twice cannot be joined without guessing",
        "give every row one pseudonym, the same in both files",
    ),
    "small-cell": Rule(
        f"a cell with fewer than {LEAST_IN_CELL} students could give a person away",
        "merge groups or study more students",
    ),
    "undeclared-groups": Rule(
        "a comparison chosen after the data were seen finds too much", "declare the groups in the codebook"
    ),
    "provenance": Rule(
        "a figure without its n, its detector and what that detector misses cannot be judged",
        "collect metrics from runs that were audited",
    ),
}  # fmt: skip
"""Rule -> why and what lifts it."""


class StudyRefusedError(StudyError):
    """The result ``what``, which a rule (key of ``RULES``) forbids."""

    def __init__(self, rule: str, what: str) -> None:
        self.rule, self.what = rule, what
        self.reason, self.lift = RULES[rule].reason, RULES[rule].lift
        super().__init__(f"{what}: refused ({rule}): {self.reason}; to lift it, {self.lift}")


def few(count: int) -> str:
    """A count of a cell, or that it is too small to be said."""
    return f"fewer than {LEAST_IN_CELL}" if count < LEAST_IN_CELL else f"{count}"
