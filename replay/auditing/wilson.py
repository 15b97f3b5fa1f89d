"""The interval behind every share that is printed: it stays within 0 and 1, and is not empty at 0 of n."""

from collections.abc import Sequence
from math import sqrt
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from replay.auditing.record import Count, Fraction, Record

INTERVALS_CAPTION: Final = (
    "In brackets: 95 % intervals over contacts, not over start times of sampling alone. They are too narrow where "
    "contacts are few and the missed ones are long."
)
"""Explanation of the intervals beside every fraction of contacts, pair-frames and faces.

Coverage falls below 95 % when misses cluster in long contacts: 60 % at n = 18, 85 % at n = 60."""

Z_OF_95_PERCENT: Final = 1.959963984540054
"""Quantile of the normal distribution that leaves 2.5 % above: intervals are at 95 %."""


def wilson_interval(count: float, whole: float) -> tuple[float, float]:
    """Wilson's score interval at 95 % of the share ``count / of``; nothing was counted: anything from 0 to 1.

    Source: E. B. Wilson, Probable inference, the law of succession, and statistical inference, JASA 22 (1927), 209-212.

    Examples
    --------
    >>> low, high = wilson_interval(0, 10)
    >>> low, round(high, 4)
    (0.0, 0.2775)
    """
    if whole <= 0:
        return 0.0, 1.0
    fraction, spread = count / whole, Z_OF_95_PERCENT * Z_OF_95_PERCENT / whole
    centre = fraction + spread / 2
    half = Z_OF_95_PERCENT * sqrt((fraction * (1 - fraction) + spread / 4) / whole)
    lower, upper = (centre - half) / (1 + spread), (centre + half) / (1 + spread)
    return (0.0 if count == 0 else max(0.0, lower)), (1.0 if count == whole else min(1.0, upper))


class Proportion(Record, frozen=True):
    """A count of a whole, and its 95 % interval.

    Parameters
    ----------
    count, of : how many, of how many.
    value : ``count / of``; ``None`` of nothing.
    lower, upper : ends of the interval.
    clusters : contacts or pairs that the members were drawn in; ``None``: one by one.
    squares : over the clusters the sums of count squared, count times whole, and whole squared.
    """

    count: Count
    of: Count
    value: Fraction | None
    lower: Fraction
    upper: Fraction
    clusters: Count | None = None
    squares: tuple[Count, ...] | None = None


def proportion(count: int, of: int, clusters: int | None = None, squares: Sequence[int] = ()) -> Proportion:
    """Return a count of a whole with its interval at 95 %.

    ``squares`` are those of the ``clusters``, as ``Proportion`` has them.
    """
    number = of if clusters is None else _effective_draws(count, of, clusters, squares)
    lower, upper = wilson_interval(number * (count / of) if of else 0, number)
    return Proportion(
        count=count,
        of=of,
        value=count / of if of else None,
        lower=lower,
        upper=upper,
        clusters=clusters,
        squares=None if clusters is None else tuple(squares),
    )


def proportion_of_clusters(counts: ArrayLike, cluster_wholes: ArrayLike) -> Proportion:
    """Return the proportion of members that are drawn in clusters, as pair-frames are drawn in contacts.

    ``counts`` (C,) of ``cluster_wholes`` (C,) are those of each cluster; one without members is none.
    """
    counts_and_wholes = np.array(
        [counts, cluster_wholes], dtype=object
    )  # whole numbers of Python: squares of face pairs pass 64 bits
    (squared_counts, count_whole_products), (_, squared_wholes) = (counts_and_wholes @ counts_and_wholes.T).tolist()
    count, whole_count = counts_and_wholes.sum(axis=1).tolist()
    return proportion(
        count,
        whole_count,
        int((counts_and_wholes[1] > 0).sum()),
        (squared_counts, count_whole_products, squared_wholes),
    )


def pooled_proportion(proportions: Sequence[Proportion]) -> Proportion:
    """Return the proportion of several sessions together, from the counts of each."""
    count = sum(session.count for session in proportions)
    of = sum(session.of for session in proportions)
    if proportions[0].clusters is None:
        return proportion(count, of)
    squares = [sum(column) for column in zip(*(session.squares or () for session in proportions), strict=True)]
    return proportion(count, of, sum(session.clusters or 0 for session in proportions), squares)


def _effective_draws(count: int, whole_count: int, clusters: int, squares: Sequence[int]) -> float:
    """How many independent draws say as much about ``count / of`` as these clusters; all or nothing: their number.

    The variance of the share is that of a ratio of sums. Few or unequal clusters look more alike than they are: so a
    cluster, the mean over members, is left out of the whole, and the quantile is that of Student's t with as many
    degrees as equal clusters would give. Without both, 18 contacts of unequal length cover 90 % instead of 95 %.

    Source: Rao and Scott (1992), Biometrics 48, 577-585; t: Korn and Graubard (1998), Survey Methodology 24, 193-201.
    """
    from scipy.special import stdtrit

    if count in (0, whole_count):
        return clusters
    fraction, (squared, crossed, whole) = count / whole_count, squares
    spread = squared - 2 * fraction * crossed + fraction * fraction * whole
    t_over_z = float(stdtrit(max(whole_count * whole_count / whole - 1.0, 1.0), 0.975)) / Z_OF_95_PERCENT
    # Clusters that are all alike have no spread: the number is then cut to all there are.
    number = (
        fraction * (1 - fraction) * (whole_count - whole / whole_count) ** 2 / max(spread, 1e-9 * whole) / t_over_z**2
    )
    return min(max(number, 1.0), whole_count)
