"""What a traversal is asked and what it answers: two bodies at many poses, faces that meet, tests counted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final, Protocol

import numpy as np

from cdcore.numerics import BoolArray, FloatArray, IntArray

UNLIMITED: Final = int(np.iinfo(np.int64).max)
"""The budget of a search that runs to completion."""


@dataclass(frozen=True, eq=False)
class PairPoses:
    """K poses of two bodies, and by how much two volumes must be apart in each before they count as apart."""

    turn_a: FloatArray
    move_a: FloatArray
    turn_b: FloatArray
    move_b: FloatArray
    pad: FloatArray


@dataclass(frozen=True, eq=False)
class Searched:
    """What a search of K poses came to."""

    found: IntArray
    """(M, 4): row, face of A, face of B, and 1, or UNDECIDED where only integers can tell; in order of discovery."""
    counts: IntArray
    """(K, C) tests of each row, in the order of the search's ``counters``."""
    truncated: BoolArray
    """(K,): the budget ended before the search did."""


class PairSearch(Protocol):
    """A hierarchy over each body and a way through two of them."""

    counters: ClassVar[tuple[str, ...]]

    def search(self, a: int, b: int, poses: PairPoses, *, every: bool, budget: int) -> Searched:
        """Look for faces that meet: ``every`` one, or the first; at most ``budget`` node and leaf tests a row."""
        ...
