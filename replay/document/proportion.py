"""A proportion with its count, its whole and its interval, as every screen shows it."""

from replay.document.record import Count, Fraction, Record


class Proportion(Record, frozen=True, rename={"value": "share", "lower": "low", "upper": "high"}):
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
