"""Tally of detectors on hard questions: one row a detector and family or case."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from cdcore import Verdict
from cdcore.numerics import BoolArray, ByteArray
from cdcore.protocol import counts_as_contact

WRONG_FIELDS: Final = ("missed", "invented", "within", "refused", "changed")
"""Fields of a tally that count answers which are not exact, tolerance or not."""

EXACT_DETECTORS: Final = frozenset({"exact", "continuous", "aabb", "obb", "rapid-style", "solid-style"})
"""Detectors that promise the exact answer on every finite input: one wrong or refused answer is a failure."""


@dataclass(frozen=True)
class Tally:
    """One detector on one family of triangle pairs or on one case of whole bodies."""

    detector: str
    kind: str  # family or case
    number: int
    name: str
    seed: int
    asked: int  # pairs, pair-frames, crossings or ways to ask again
    # missed, invented: disagreements with the exact answer by more than tau
    missed: int = 0
    invented: int = 0
    within: int = 0  # disagreements about at most tau (none in families whose coordinates are not metres)
    refused: int = 0  # not decided
    unconfirmed: int = 0  # reported by bounding volumes alone where nothing meets; never counted as invented
    changed: int = 0  # answers that were not repeated
    reason: str = ""  # why it refused or missed
    # whether the detector's promise reaches as far as the question: one of instants says nothing of intervals
    promised: bool = True
    file: str | None = None  # where the failing pairs were written, if they were

    @property
    def failed(self) -> int:
        """Questions without the exact answer, tolerance or not."""
        return sum(getattr(self, name) for name in WRONG_FIELDS)

    @property
    def words(self) -> str:
        """Counts in text, or ``passed``."""
        names = {"within": "within tolerance"}
        counts = ((getattr(self, word), names.get(word, word)) for word in (*WRONG_FIELDS, "unconfirmed"))
        return ", ".join(f"{count:,} {word}" for count, word in counts if count) or "passed"


@dataclass(frozen=True)
class StressResult:
    """All tallies, and how to repeat them."""

    seed: int
    pairs: int
    tau: float
    tallies: tuple[Tally, ...]

    @property
    def broken(self) -> list[str]:
        """A sentence for each broken promise: a detector that claims exactness, wrong or undecided."""
        return [
            f"{tally.detector} claims exactness and failed {tally.failed:,} of {tally.asked:,} questions of "
            f"{tally.number:02d} {tally.name} (seed {tally.seed}): {tally.words}"
            for tally in self.tallies
            # A case may ask what cannot be decided, such as containment of an open mesh.
            if tally.detector in EXACT_DETECTORS
            and tally.promised
            and tally.failed > (tally.refused if tally.kind == "case" else 0)
        ]

    def as_json(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self) | {"broken": self.broken}


def judge_answers(
    answers: ByteArray, truth: ByteArray, is_undecided: BoolArray, is_within_tolerance: Callable[[BoolArray], BoolArray]
) -> Mapping[str, BoolArray]:
    """By the fields of a tally, of which of n verdicts (n,) beside true ones (n,) it is said.

    ``is_undecided`` (n,): not decided; ``is_within_tolerance``: which of the wrong ones (n,) are wrong about at most a
    tolerance.
    """
    is_unconfirmed = (answers == Verdict.CANDIDATE) & (truth != Verdict.CONTACT)
    answer = np.where(answers == Verdict.NOT_FOUND, Verdict.CLEAR, answers)
    answer[(answers == Verdict.CANDIDATE) & (truth == Verdict.CONTACT)] = Verdict.CONTACT
    is_wrong = (answer != truth) & ~is_undecided & ~is_unconfirmed
    is_excused = is_wrong & is_within_tolerance(is_wrong)
    is_missed = (
        is_wrong & ~is_excused & (truth != Verdict.CLEAR) & ~((truth == Verdict.CONTAINED) & counts_as_contact(answers))
    )
    return {
        "missed": is_missed,
        "invented": is_wrong & ~is_excused & ~is_missed,
        "within": is_excused,
        "refused": is_undecided,
        "unconfirmed": is_unconfirmed,
    }
