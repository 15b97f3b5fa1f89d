"""Selects the samples of a series so that its stamps increase, and accounts for the others.

A few wild stamps cost their own rows and no others. A clock that starts again is refused, because nobody knows how much
time lies between the two recordings that the series then is.
"""

import calendar
import re
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import ImportFileError
from sessions.importers.ledger import Ledger

RESTART_ROWS: Final = 10
"""So many samples in a row that increase among themselves and fit in nowhere are no wild stamps: a clock began anew."""
OUT_OF_ORDER: Final = "with a stamp out of order"
REPEATED: Final = "with the stamp of another sample"
SAME_SAMPLE: Final = "that repeat a sample"

FRACTION: Final = re.compile(r"(?<=:[0-9]{2})[.,]([0-9]+)")
"""The fraction of a second in ISO 8601."""

Numbers = NDArray[np.float64]
Stamps = NDArray[np.int64]
Rows = NDArray[np.bool_]


def increasing(name: str, stamps: Stamps, values: Sequence[Numbers], ledger: Ledger, *, kind: str = "samples") -> Rows:
    """Mask (n,) of the kept samples: the longest subsequence whose stamps increase, of equal stamps the first.

    The account of this ``kind`` and name says what became of the others. ``values``: what the samples hold, arrays
    (n,) or (n, k); they tell a sample that is there twice from two samples of one stamp.

    Raises ``ImportFileError``: the clock starts again.
    """
    keep = longest_increasing(stamps)
    repeated = np.zeros(len(stamps), dtype=np.bool_)
    same = repeated.copy()
    if not keep.all():
        kept = np.flatnonzero(keep)
        match = kept[np.minimum(np.searchsorted(stamps[kept], stamps), len(kept) - 1)]
        repeated = ~keep & (stamps[match] == stamps)
        same[repeated] = _equal(values, np.flatnonzero(repeated), match[repeated])
        _refuse_restart(name, stamps, ~keep & ~same, ledger)
    lost = {REPEATED: int((repeated & ~same).sum()), OUT_OF_ORDER: int((~keep & ~repeated).sum())}
    ledger.book(kind, name, read=len(stamps), kept=int(keep.sum()), dropped=lost, merged={SAME_SAMPLE: int(same.sum())})
    return keep


def iso_nanoseconds(text: str) -> int:
    """Nanoseconds since 1970 of a date and time in ISO 8601, to the last of nine digits; without a zone it is UTC.

    ValueError: it is none.
    """
    match = FRACTION.search(text)
    fraction = (match[1] if match else "")[:9].ljust(9, "0")
    moment = datetime.fromisoformat(FRACTION.sub("", text, count=1) if match else text)
    return calendar.timegm(moment.utctimetuple()) * 1_000_000_000 + int(fraction)


def last_of_each_stamp(name: str, stamps: Stamps, ledger: Ledger) -> NDArray[np.intp]:
    """The rows in order of time, of equal stamps the last, (k,): for states that hold until the next one."""
    order = np.argsort(stamps, kind="stable")
    ends = np.ones(len(stamps), dtype=np.bool_)
    ends[:-1] = np.diff(stamps[order]) > 0
    rows: NDArray[np.intp] = order[ends]
    ledger.book("samples", name, read=len(stamps), kept=len(rows), dropped={REPEATED: len(stamps) - len(rows)})
    return rows


def longest_increasing(stamps: Stamps) -> Rows:
    """The rows of a longest strictly increasing part, (n,); of equal stamps the first that fits.

    Source: Schensted, "Longest increasing and decreasing subsequences", Canadian Journal of Mathematics 13 (1961).
    Cost: O(n) where stamps increase, O(n log n) else.
    """
    keep = np.ones(len(stamps), dtype=np.bool_)
    if (stamps[1:] > stamps[:-1]).all():
        return keep
    # A row after all before it and before all after it is in every longest part; what lies between two of them stands
    # alone.
    keep[1:] &= stamps[1:] > np.maximum.accumulate(stamps)[:-1]
    keep[:-1] &= stamps[:-1] < np.minimum.accumulate(stamps[::-1])[::-1][1:]
    edges = np.flatnonzero(np.diff(np.concatenate([[True], keep, [True]])))
    for first, end in edges.reshape(-1, 2).tolist():
        keep[first + np.array(_longest(stamps[first:end].tolist()), dtype=np.intp)] = True
    return keep


def _longest(values: list[int]) -> list[int]:
    """The places of a longest increasing part, by patience sorting."""
    ends: list[int] = []
    """The least value that a part of each length ends with."""
    indices: list[int] = []
    before = [-1] * len(values)
    for index, value in enumerate(values):
        length = bisect_left(ends, value)
        before[index] = indices[length - 1] if length else -1
        if length == len(ends):
            ends.append(value)
            indices.append(index)
        elif value < ends[length]:
            ends[length], indices[length] = value, index
    chain = []
    index = indices[-1]
    while index >= 0:
        chain.append(index)
        index = before[index]
    return chain


def _equal(values: Sequence[Numbers], rows: NDArray[np.intp], others: NDArray[np.intp]) -> Rows:
    """Whether rows hold the same as others, (n,); NaN is the same as NaN."""
    same = np.ones(len(rows), dtype=np.bool_)
    for column in values:
        left, right = column[rows], column[others]
        alike = (left == right) | (np.isnan(left) & np.isnan(right))
        same &= alike if alike.ndim == 1 else alike.all(axis=1)
    return same


def _refuse_restart(name: str, stamps: Stamps, outside: Rows, ledger: Ledger) -> None:
    """Refuse a series in which many rows follow each other and fit in nowhere."""
    rows = np.flatnonzero(outside)
    if not len(rows):
        return
    breaks = (np.diff(rows) > 1) | (stamps[rows[1:]] <= stamps[rows[:-1]])
    starts = np.concatenate([[0], np.flatnonzero(breaks) + 1])
    lengths = np.diff(np.concatenate([starts, [len(rows)]]))
    longest = int(lengths.argmax())
    if lengths[longest] < RESTART_ROWS:
        return
    first, last = int(rows[starts[longest]]), int(rows[starts[longest] + lengths[longest] - 1])
    begin, end = (float(stamps[row]) / 1e9 for row in (first, last))
    raise ImportFileError(
        f"{ledger.source}: the clock of {name!r} starts again: its samples {first + 1:,} to {last + 1:,} are stamped "
        f"{begin:.3f} s to {end:.3f} s, between others of other times; split the recording there, or correct the stamps"
    )


def rows_lost(stamps: Stamps, groups: Iterable[Rows]) -> int:
    """How many rows an import would drop because stamps repeat or go back, where each group is a body."""
    return sum(int((~longest_increasing(stamps[rows])).sum()) for rows in groups)
