"""Groups of misses of one pair that lie close together in time, the deepest first: dozens instead of hundreds."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from replay.comparison.outcome import Miss

MANY: Final = 40
"""Misses up to which a list is read line by line; more are shown as at most so many clusters, if there are as many as
that without joining pairs."""

SHORTEST_GAP: Final = 0.25
"""Seconds without a miss that part two clusters of a pair, at least."""


@dataclass(frozen=True)
class Cluster:
    """Misses of one pair that lie close together in time, in order of time."""

    misses: tuple[Miss, ...]

    @property
    def deepest(self) -> Miss:
        """The miss with the longest cut."""
        return by_depth(self.misses)[0]

    @property
    def frames(self) -> int:
        """How many frames were missed."""
        return sum(miss.frames for miss in self.misses)

    @property
    def span(self) -> tuple[float, float]:
        """Seconds of the first missed frame and of the last."""
        return self.misses[0].start, max(miss.end for miss in self.misses)

    @property
    def causes(self) -> str:
        """The causes, the most frequent first, with counts where they differ."""
        counts = Counter(miss.cause for miss in self.misses).most_common()
        return counts[0][0] if len(counts) == 1 else ", ".join(f"{cause} ({count})" for cause, count in counts)


def by_depth(misses: Iterable[Miss]) -> list[Miss]:
    """Misses with the longest cut first; those that no frame shows come last, in order of time."""
    return sorted(misses, key=lambda miss: (-miss.cut_length, miss.number))


def seen_and_between(misses: Iterable[Miss]) -> tuple[list[Miss], list[Miss]]:
    """Misses that a frame shows, the longest cut first, and those that none shows, in order of time.

    The latter have no cut to be ranked by: the surfaces only touch at the moment that is known.
    """
    ordered = by_depth(misses)
    return [miss for miss in ordered if miss.touch is None], [miss for miss in ordered if miss.touch is not None]


def clusters(misses: Sequence[Miss], most: int = MANY) -> list[Cluster]:
    """At most ``most`` clusters, if there are no more pairs than that, the one with the deepest miss first.

    The misses of a pair are parted where it was without one for longest, and never for less than ``SHORTEST_GAP``.
    """
    columns: dict[int, list[Miss]] = {}
    for miss in sorted(misses, key=lambda one: (one.start, one.number)):
        columns.setdefault(miss.pair, []).append(miss)
    gaps = [
        (after.start - before.end, pair, k)
        for pair, column in columns.items()
        for k, (before, after) in enumerate(pairwise(column), 1)
        if after.start - before.end > SHORTEST_GAP
    ]
    widest = sorted(gaps, key=lambda gap: (-gap[0], gap[1:]))[: max(0, most - len(columns))]
    found = []
    for pair, column in columns.items():
        cuts = [0, *sorted(k for _, other, k in widest if other == pair), len(column)]
        found += [Cluster(tuple(column[first:after])) for first, after in pairwise(cuts)]
    return sorted(found, key=lambda one: (-one.deepest.cut_length, one.deepest.number))
