"""The account of an import: items read, kept, dropped or merged, by kind, body and reason.

Every reader books here, and nothing is booked that does not add up: ``read = kept + dropped + merged``. Merged is what
says the same as something kept, such as a row that is there twice; dropped is lost. The session's fact ``ledger`` holds
the books, and with it the metadata of its file.
"""

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

FACT: Final = "ledger"
"""The key of the ledger among the facts of a session."""
LARGEST_UNREPORTED_LOSS: Final = 0.01
"""Fraction of what was read of a kind and body; what is dropped above it is a warning."""
KINDS: Final = (
    "rows",
    "samples",
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
"""What is counted; a stamp is counted as the sample that bears it."""
MOST_ENTRIES: Final = 100_000
"""Entries that are read back from a file: more than a kind each of as many bodies as a session may have."""


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
        return self.lost > LARGEST_UNREPORTED_LOSS * self.read

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
