"""Keeps the rows whose stamps increase, and the account of all rows: read, kept, dropped or merged, and why.

Every reader books here, and nothing is booked that does not add up: ``read = kept + dropped + merged``. Merged is what
says the same as something kept, such as a row that is there twice; dropped is lost. Kept are samples whose stamps
increase: a few wild stamps cost their own rows and no others, and a clock that starts again is refused, because nobody
knows how much time lies between the two recordings that the series then is. The session's fact ``ledger`` holds the
books, and with it the metadata of its file.
"""

import json
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import ImportFileError

Numbers = NDArray[np.float64]
Stamps = NDArray[np.int64]
Rows = NDArray[np.bool_]

FACT: Final = "ledger"
"""The key of the ledger among the facts of a session."""
LARGEST_UNREPORTED_LOSS: Final = 0.01
"""Fraction of what was read of a kind and body; what is dropped above it is a warning."""
KINDS: Final = (
    "rows",
    "samples",
    "poses",
    "transforms",
    "messages",
    "streams",
    "names",
    "contacts",
    "trials",
    "files",
    "faces",
    "nodes",
)
"""What is counted; a stamp is counted as the sample that bears it, and of the samples kept some hold a pose."""
MOST_ENTRIES: Final = 100_000
"""Entries that are read back from a file: more than a kind each of as many bodies as a session may have."""
LARGEST_SECONDS: Final = 9.0e9  # Just below what int64 nanoseconds hold
RESTART_ROWS: Final = 10
"""So many samples in a row that increase among themselves and fit in nowhere are no wild stamps: a clock began anew."""
LARGEST_DISORDER: Final = 0.5
"""Fraction of samples out of order above which the whole series is in none."""
OUT_OF_ORDER: Final = "with a stamp out of order"
REPEATED: Final = "with the stamp of another sample"
SAME_SAMPLE: Final = "that repeat a sample"
POSES: Final = "poses"
"""The kind of the samples kept: those that hold no pose are dropped by every run, unless its policy says otherwise."""
FLAGGED: Final = "flagged as lost"


@dataclass(frozen=True)
class Entry:
    """The account of one kind of one body.

    Parameters
    ----------
    kind : one of ``KINDS``.
    body : the body, stream or file it is about; "" for the whole recording.
    read, kept : counts.
    dropped, merged : reason -> count.
    """

    kind: str
    body: str
    read: int
    kept: int
    dropped: Mapping[str, int] = field(default_factory=dict)
    merged: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        counts = (self.read, self.kept, *self.dropped.values(), *self.merged.values())
        assert min(counts) >= 0, f"{self.kind} of {self.body!r}: a count is negative: {self}"
        balance = self.kept + self.lost + sum(self.merged.values())
        assert self.read == balance, f"{self.kind} of {self.body!r}: read {self.read:,}, accounted for {balance:,}"

    @property
    def lost(self) -> int:
        """How many were dropped."""
        return sum(self.dropped.values())

    @property
    def is_large_loss(self) -> bool:
        """Whether more was dropped than goes without a warning."""
        return is_large_loss(self.lost, self.read)

    def joined(self, other: "Entry") -> "Entry":
        """The sum of two accounts of the same kind and body."""
        dropped, merged = Counter(self.dropped), Counter(self.merged)
        dropped.update(other.dropped)
        merged.update(other.merged)
        return Entry(self.kind, self.body, self.read + other.read, self.kept + other.kept, dropped, merged)

    @property
    def loss(self) -> str:
        """How many were dropped of how many, and why, without the body."""
        return f"{self.lost:,} of {self.read:,} {self.kind} dropped: {_reasons(self.dropped)}"

    @property
    def merger(self) -> str:
        """How many were merged of how many, and why, without the body."""
        return f"{sum(self.merged.values()):,} of {self.read:,} {self.kind} merged: {_reasons(self.merged)}"


def _reasons(counts: Mapping[str, int]) -> str:
    """Reasons, each with its count where there are several."""
    if len(counts) == 1:
        return next(iter(counts))
    return "; ".join(f"{count:,} {reason}" for reason, count in counts.items())


class Ledger:
    """The accounts of one import, in the order in which they are opened."""

    def __init__(self, source: Path | str, entries: Iterable[Entry] = ()) -> None:
        self.source = source
        self._entries = {(entry.kind, entry.body): entry for entry in entries}

    def book(
        self,
        kind: str,
        body: str = "",
        *,
        read: int,
        kept: int,
        dropped: Mapping[str, int] | None = None,
        merged: Mapping[str, int] | None = None,
    ) -> None:
        """Add to the account of a kind and body; AssertionError where the counts do not add up. Zeros are left out."""
        assert kind in KINDS, f"nothing is counted as {kind!r}"
        losses = {reason: count for reason, count in (dropped or {}).items() if count}
        mergers = {reason: count for reason, count in (merged or {}).items() if count}
        if read == kept == 0 and not losses and not mergers:
            return
        entry = Entry(kind, body, read, kept, losses, mergers)
        before = self._entries.get((kind, body))
        self._entries[kind, body] = before.joined(entry) if before else entry

    def __iter__(self) -> Iterator[Entry]:
        return iter(self._entries.values())

    def sentences(self) -> list[str]:
        """Sentences on dropped and merged items; bodies with equal losses share a sentence."""
        bodies_of: dict[str, list[str]] = {}
        for entry in self:
            texts = [entry.loss] if entry.dropped else []
            if entry.merged:
                texts.append(entry.merger)
            for text in texts:
                bodies_of.setdefault(text, []).append(entry.body)
        return [": ".join(filter(None, [", ".join(filter(None, bodies)), text])) for text, bodies in bodies_of.items()]

    def large_losses(self) -> list[Entry]:
        """The accounts of which more than 1 % was dropped."""
        return [entry for entry in self if entry.is_large_loss]

    def as_text(self) -> str:
        """JSON, as a file's metadata hold it."""
        rows = [[entry.kind, entry.body, entry.read, entry.kept, entry.dropped, entry.merged] for entry in self]
        return json.dumps(rows, ensure_ascii=False, separators=(",", ":"))


def ledger_of(facts: Mapping[str, str]) -> Ledger | None:
    """The ledger among the facts of a session; ``None`` where none is there or what is there does not add up."""
    try:
        rows = json.loads(facts.get(FACT, ""))
        return Ledger(facts.get("source_file", ""), [_entry(*row) for row in rows[:MOST_ENTRIES]])
    except (ValueError, TypeError, AttributeError, AssertionError, RecursionError):
        return None


def _entry(kind: Any, body: Any, read: Any, kept: Any, dropped: Any, merged: Any) -> Entry:
    """An account as JSON holds it; ValueError where it is none."""
    reasons = [*dropped.items(), *merged.items()]
    texts, counts = [kind, body, *(reason for reason, _ in reasons)], [read, kept, *(count for _, count in reasons)]
    if kind not in KINDS or not all(isinstance(text, str) for text in texts):
        raise ValueError("no account of an import")
    if not all(type(count) is int for count in counts):
        raise ValueError("no counts of an import")
    return Entry(kind, body, read, kept, dropped, merged)


def is_large_loss(lost: int, rows: int) -> bool:
    """Whether so many rows may not be lost without a word."""
    return lost > LARGEST_UNREPORTED_LOSS * rows


def increasing_rows(
    name: str, stamps: Stamps, values: Sequence[Numbers], ledger: Ledger, *, kind: str = "samples"
) -> Rows:
    """Mask (n,) of the kept samples: the longest subsequence whose stamps increase, of equal stamps the first.

    The account of this ``kind`` and name says what became of the others. ``values``: what the samples hold, arrays
    (n,) or (n, k); they tell a sample that is there twice from two samples of one stamp.

    Raises ``ImportFileError``: the clock starts again, or most samples are out of order.
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
        _refuse_disorder(name, int((~keep & ~repeated).sum()), len(stamps), ledger)
    lost = {REPEATED: int((repeated & ~same).sum()), OUT_OF_ORDER: int((~keep & ~repeated).sum())}
    ledger.book(kind, name, read=len(stamps), kept=int(keep.sum()), dropped=lost, merged={SAME_SAMPLE: int(same.sum())})
    return keep


def last_of_each_stamp(name: str, stamps: Stamps, ledger: Ledger) -> NDArray[np.intp]:
    """The rows in order of time, of equal stamps the last, (k,): for states that hold until the next one."""
    order = np.argsort(stamps, kind="stable")
    ends = np.ones(len(stamps), dtype=np.bool_)
    ends[:-1] = np.diff(stamps[order]) > 0
    rows: NDArray[np.intp] = order[ends]
    ledger.book("samples", name, read=len(stamps), kept=len(rows), dropped={REPEATED: len(stamps) - len(rows)})
    return rows


def rows_lost(stamps: Stamps, groups: Iterable[Rows]) -> int:
    """How many rows an import would drop because stamps repeat or go back, where each group is a body."""
    return sum(int((~longest_increasing(stamps[rows])).sum()) for rows in groups)


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


def _refuse_disorder(name: str, unordered: int, count: int, ledger: Ledger) -> None:
    """Refuse a series of which most samples are out of order: nothing is wrong with them but their order."""
    if unordered > LARGEST_DISORDER * count:
        raise ImportFileError(
            f"{ledger.source}: the samples of {name!r} are in no order of time, {unordered:,} of {count:,} of them out "
            "of order; sort the rows of the file by their stamps"
        )


def stamps_of(times: Numbers, unit_ns: float, where: str) -> Stamps:
    """Times in a unit of so many nanoseconds as int64 nanoseconds, (n,); an error where one is missing or too large."""
    wrong = np.flatnonzero(~(np.abs(times) < LARGEST_SECONDS * 1e9 / unit_ns))
    if len(wrong):
        raise ImportFileError(f"{where}: row {int(wrong[0]) + 1} has no time; remove it or repair the file")
    return np.rint(times * unit_ns).astype(np.int64)
