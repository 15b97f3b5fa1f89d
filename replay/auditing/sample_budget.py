"""Budgets of frames in which misses are examined: a long miss in some of its frames, and not more than that in all."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from cdcore.numerics import IntArray

Item = TypeVar("Item")


@dataclass(frozen=True)
class SampleBudget:
    """Limits of an examination.

    Parameters
    ----------
    per_miss : frames of one miss at most.
    total : pair-frames of all misses together, as far as each gets one.
    """

    per_miss: int
    total: int

    def frames_per_miss(self, misses: int) -> int:
        """Return the frames that each of so many misses gets, at least one."""
        return min(self.per_miss, max(1, self.total // max(1, misses)))


def spread_frames(first: int, last: int, most: int) -> IntArray:
    """Return at most ``most`` frames of a segment, evenly spread with both ends; a single one lies in the middle."""
    if most == 1:
        return np.array([(first + last) // 2])
    return np.unique(np.round(np.linspace(first, last, most)).astype(np.int64))


def grouped_by_size(items: Iterable[Item], size: Callable[[Item], int], most: int) -> Iterator[list[Item]]:
    """Yield the items in order, in groups of at most ``most`` in size; a larger item is a group by itself."""
    group: list[Item] = []
    used = 0
    for item in items:
        if group and used + size(item) > most:
            yield group
            group, used = [], 0
        group.append(item)
        used += size(item)
    if group:
        yield group
