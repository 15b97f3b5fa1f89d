"""The sentence about a detector before and after a Fix: false, missed and late contacts, and the time of a frame."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from replay import words
from replay.auditing.loss import fraction_of
from replay.document.ranking import CountBounds, Rank


@dataclass(frozen=True)
class Count:
    """A number of contacts over the sampling offsets: ``smallest`` and ``largest``, and the ``mean``."""

    smallest: int
    largest: int
    mean: float

    @property
    def range(self) -> CountBounds:
        """Smallest and largest."""
        return self.smallest, self.largest

    def change(self, count_after_change: "Count", of: str = "") -> str:
        """``up to 1 -> up to 2``; ``up to 1 as before``; with means where the ranges are equal and the means not."""
        count, count_after = words.count_words(self.range), words.count_words(count_after_change.range)
        if count != count_after:
            return f"{count} -> {count_after}{of}"
        if self.equals(count_after_change):
            return f"{count}{of} as before"
        return f"{count}{of} ({words.mean_count(self.mean)} -> {words.mean_count(count_after_change.mean)} on average)"

    def equals(self, other_count: "Count") -> bool:
        """Whether both read the same."""
        return self.range == other_count.range and words.mean_count(self.mean) == words.mean_count(other_count.mean)

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


def errors_of_row(setting_row: Mapping[str, Any], contacts: int, seconds: float | None) -> Errors:
    """Errors of a row as ``replay.advice.scoring.wrong_counts`` has it."""
    missed_count, late_count = (
        Count(
            round(setting_row[f"{error_name}_smallest"]),
            round(setting_row[f"{error_name}_largest"]),
            setting_row[error_name],
        )
        for error_name in ("missed", "late")
    )
    return Errors(contacts, setting_row["false"] or 0.0, missed_count, late_count, seconds)


def errors_of_rank(rank: Rank, seconds: float | None) -> Errors:
    """Errors of a detector of the ranking."""
    missed_count = Count(*(rank.missed_counts or (0, 0)), rank.contacts * fraction_of(rank.missed))
    late_count = Count(*(rank.late_counts or (0, 0)), rank.contacts * fraction_of(rank.late_or_cut_short))
    return Errors(rank.contacts, fraction_of(rank.false), missed_count, late_count, seconds)


def change_text(errors_before: Errors, errors_after: Errors, pieces: str = "") -> str:
    """``False 86 % -> 19 %, but missed up to 1 -> up to 2 and late or cut short 1 to 3 -> 5 of 18; 28 pieces``

    Kinds of error that become more stand behind the others, after *but*; one that neither has is left out. ``pieces``
    are those after, in words; ``""``: no pieces.
    """
    false_before, false_after = words.as_percentage(errors_before.false), words.as_percentage(errors_after.false)
    false_clause = (
        f"false {false_before} as before" if false_before == false_after else f"false {false_before} -> {false_after}"
    )
    clauses_with_worse = [(false_clause, false_before != false_after and errors_after.false > errors_before.false)]
    count_kinds = (
        ("missed", errors_before.missed, errors_after.missed),
        ("late or cut short", errors_before.late, errors_after.late),
    )
    nonzero_counts = [count for count in count_kinds if count[1].largest or count[2].largest]
    nonzero_counts.sort(key=lambda count: count[1].is_worse(count[2]))
    for number, (kind, count_before, count_after) in enumerate(nonzero_counts, 1):
        of_contacts = f" of {errors_before.contacts:,}" if number == len(nonzero_counts) else ""
        clauses_with_worse.append(
            (f"{kind} {count_before.change(count_after, of_contacts)}", count_before.is_worse(count_after))
        )
    if len(clauses_with_worse) == 1:
        clauses_with_worse.append(("none missed or late" if errors_before.contacts else "no contact to miss", False))
    improved_clauses, worsened_clauses = (
        [text for text, is_worse in clauses_with_worse if is_worse is kind] for kind in (False, True)
    )
    changes = ", but ".join(filter(None, [", ".join(improved_clauses), " and ".join(worsened_clauses)]))
    sentences = [f"{changes[:1].upper()}{changes[1:]}"]
    if pieces:
        sentences.append(pieces)
    if errors_before.seconds is not None and errors_after.seconds is not None:
        difference = errors_after.seconds - errors_before.seconds
        sentences.append(f"{words.frame_time(abs(difference))} a frame {'more' if difference >= 0.0 else 'less'}")
    return "; ".join(sentences)


def worse_text(errors_before: Errors, errors_after: Errors) -> str:
    """A sentence that says which kinds of error become more; ``""``: none does."""
    more_missed, more_late = (
        errors_before.missed.is_worse(errors_after.missed),
        errors_before.late.is_worse(errors_after.late),
    )
    reads_worse = words.as_percentage(errors_before.false) != words.as_percentage(errors_after.false)
    worsened_clauses = []
    if more_missed:
        worsened_clauses.append("more contacts are missed")
    if more_late:
        worsened_clauses.append(f"more{'' if more_missed else ' contacts'} are late or cut short")
    if errors_after.false > errors_before.false and reads_worse:
        worsened_clauses.append("more contact time is false")
    if not worsened_clauses:
        return ""
    joined_clauses = ", and ".join(worsened_clauses)
    return f"{joined_clauses[0].upper()}{joined_clauses[1:]}{',' if len(worsened_clauses) > 1 else ''} than before."
