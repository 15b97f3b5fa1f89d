"""The sentence about a detector before and after a Fix: false, missed and late contacts, and the time of a frame."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from replay import words
from replay.auditing.loss import fraction_of
from replay.document.ranking import Range, Rank


@dataclass(frozen=True)
class Count:
    """A number of contacts over the sampling offsets: ``smallest`` and ``largest``, and the ``mean``."""

    smallest: int
    largest: int
    mean: float

    @property
    def range(self) -> Range:
        """Smallest and largest."""
        return self.smallest, self.largest

    def change(self, after: "Count", of: str = "") -> str:
        """``up to 1 -> up to 2``; ``up to 1 as before``; with means where the ranges are equal and the means not."""
        count, count_after = words.count_words(self.range), words.count_words(after.range)
        if count != count_after:
            return f"{count} -> {count_after}{of}"
        if self.equals(after):
            return f"{count}{of} as before"
        return f"{count}{of} ({words.mean_count(self.mean)} -> {words.mean_count(after.mean)} on average)"

    def equals(self, other: "Count") -> bool:
        """Whether both read the same."""
        return self.range == other.range and words.mean_count(self.mean) == words.mean_count(other.mean)

    def is_worse(self, after: "Count") -> bool:
        """Whether more contacts are counted after, in the mean."""
        return after.mean > self.mean and not self.equals(after)


@dataclass(frozen=True)
class Errors:
    """Errors of a detector in a session, and the time of a frame.

    Parameters
    ----------
    contacts : that happened.
    false : fraction of the reported contact time that is false.
    missed : contacts that were never reported.
    late : contacts that were reported late or cut short.
    seconds : a frame; ``None``: not measured, or measured on a busy machine.
    """

    contacts: int
    false: float
    missed: Count
    late: Count
    seconds: float | None = None


def errors_of_row(row: Mapping[str, Any], contacts: int, seconds: float | None) -> Errors:
    """Errors of a row as ``replay.advice.scoring.wrong_counts`` has it."""
    missed, late = (
        Count(round(row[f"{name}_smallest"]), round(row[f"{name}_largest"]), row[name]) for name in ("missed", "late")
    )
    return Errors(contacts, row["false"] or 0.0, missed, late, seconds)


def errors_of_rank(rank: Rank, seconds: float | None) -> Errors:
    """Errors of a detector of the ranking."""
    missed = Count(*(rank.missed_counts or (0, 0)), rank.contacts * fraction_of(rank.missed))
    late = Count(*(rank.late_counts or (0, 0)), rank.contacts * fraction_of(rank.late_or_cut_short))
    return Errors(rank.contacts, fraction_of(rank.false), missed, late, seconds)


def change_text(before: Errors, after: Errors, pieces: str = "") -> str:
    """``False 86 % -> 19 %, but missed up to 1 -> up to 2 and late or cut short 1 to 3 -> 5 of 18; 28 pieces``

    Kinds of error that become more stand behind the others, after *but*; one that neither has is left out. ``pieces``
    are those after, in words; ``""``: no pieces.
    """
    false, false_after = words.as_percentage(before.false), words.as_percentage(after.false)
    text = f"false {false} as before" if false == false_after else f"false {false} -> {false_after}"
    clauses = [(text, false != false_after and after.false > before.false)]
    kinds = ("missed", before.missed, after.missed), ("late or cut short", before.late, after.late)
    counted = [count for count in kinds if count[1].largest or count[2].largest]
    counted.sort(key=lambda count: count[1].is_worse(count[2]))
    for number, (kind, was, now) in enumerate(counted, 1):
        of = f" of {before.contacts:,}" if number == len(counted) else ""
        clauses.append((f"{kind} {was.change(now, of)}", was.is_worse(now)))
    if len(clauses) == 1:
        clauses.append(("none missed or late" if before.contacts else "no contact to miss", False))
    better, worse = ([text for text, more in clauses if more is kind] for kind in (False, True))
    changes = ", but ".join(filter(None, [", ".join(better), " and ".join(worse)]))
    sentences = [f"{changes[:1].upper()}{changes[1:]}"]
    if pieces:
        sentences.append(pieces)
    if before.seconds is not None and after.seconds is not None:
        difference = after.seconds - before.seconds
        sentences.append(f"{words.frame_time(abs(difference))} a frame {'more' if difference >= 0.0 else 'less'}")
    return "; ".join(sentences)


def worse_text(before: Errors, after: Errors) -> str:
    """A sentence that says which kinds of error become more; ``""``: none does."""
    missed, late = before.missed.is_worse(after.missed), before.late.is_worse(after.late)
    reads_worse = words.as_percentage(before.false) != words.as_percentage(after.false)
    clauses = []
    if missed:
        clauses.append("more contacts are missed")
    if late:
        clauses.append(f"more{'' if missed else ' contacts'} are late or cut short")
    if after.false > before.false and reads_worse:
        clauses.append("more contact time is false")
    if not clauses:
        return ""
    text = ", and ".join(clauses)
    return f"{text[0].upper()}{text[1:]}{',' if len(clauses) > 1 else ''} than before."
