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


def spread_frames(first: int, last: int, most_frames: int) -> IntArray:
    """Return at most ``most_frames`` frames of a segment, evenly spread with both ends.

    A single one lies in the middle.
    """
    if most_frames == 1:
        return np.array([(first + last) // 2])
    return np.unique(np.round(np.linspace(first, last, most_frames)).astype(np.int64))


def grouped_by_size(items: Iterable[Item], size: Callable[[Item], int], most_size: int) -> Iterator[list[Item]]:
    """Yield the items in order, in groups of at most ``most_size`` in size; a larger item is a group by itself."""
    current_group: list[Item] = []
    group_size = 0
    for item in items:
        if current_group and group_size + size(item) > most_size:
            yield current_group
            current_group, group_size = [], 0
        current_group.append(item)
        group_size += size(item)
    if current_group:
        yield current_group
