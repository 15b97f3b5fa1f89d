"""Counts of the oracle's contacts by outcome: the only place where missed contacts are counted."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray, ByteArray, IntArray
from cdcore.protocol import counts_as_contact, is_one_of
from replay.auditing.episodes import column_runs
from replay.auditing.outcome import Comparison, Episode, Outcome
from replay.auditing.wilson import Proportion, proportion_of_clusters

REPORTED: Final = (Outcome.BOTH, Outcome.FALSE_CONTACT, Outcome.WITHIN_TOLERANCE)
"""Outcomes of a contact that a detector reports."""


def missed_whole(frames: IntArray) -> BoolArray:
    """(..., C) which contacts are never reported, and missed in a frame, of their ``frames`` (..., C, outcomes)."""
    return (frames[..., Outcome.MISSED] > 0) & (frames[..., Outcome.BOTH] == 0)


def missed_partly(frames: IntArray) -> BoolArray:
    """(..., C) which contacts are reported in some frames and missed in others."""
    return (frames[..., Outcome.MISSED] > 0) & (frames[..., Outcome.BOTH] > 0)


@dataclass(frozen=True, eq=False)
class ContactCounts:
    """The oracle's contacts, each in one class: found, missed in part, missed, undecided, or within tolerance.

    Those of a hand with what it holds are not among them: ``grasped_counts`` has them.

    Contacts are counted, not the stretches in which they were lost: a contact that was lost twice is one contact
    missed in part.

    ``numbers``: (C,) of the contacts, from 1; ``pairs``: (C,) column of the pair of each; ``frames``: (C, outcomes)
    frames of each by ``Outcome``.
    """

    numbers: IntArray
    pairs: IntArray
    frames: IntArray

    def only(self, kept: BoolArray) -> "ContactCounts":
        """The contacts for which ``kept`` (C,) is true."""
        return ContactCounts(self.numbers[kept], self.pairs[kept], self.frames[kept])

    @property
    def contacts(self) -> int:
        """Contacts of the oracle."""
        return len(self.pairs)

    @property
    def late_or_cut_short(self) -> int:
        """Contacts reported in some frames and missed in others."""
        return int(missed_partly(self.frames).sum())

    @property
    def missed(self) -> int:
        """Contacts never reported, and missed in at least one frame."""
        return len(self.missed_numbers)

    @property
    def missed_numbers(self) -> list[int]:
        """Numbers, from 1, of the contacts that were never found."""
        return self.numbers[missed_whole(self.frames)].tolist()

    @property
    def undecided(self) -> int:
        """Contacts that were neither reported nor missed in any frame, because frames were left out."""
        return self._left_out(decided=False)

    @property
    def partly_undecided(self) -> int:
        """Contacts of which some frames were left out and others decided; they count in their other class too."""
        return self._left_out(decided=True)

    @property
    def frames_undecided(self) -> int:
        """Pair-frames of the oracle's contacts that were left out."""
        return int(self.frames[:, Outcome.LEFT_OUT].sum())

    def of_pair(self, pair: int) -> "ContactCounts":
        """The contacts of one pair."""
        return self.only(self.pairs == pair)

    def proportion(self, outcome: Outcome) -> Proportion:
        """Pair-frames that ended so, of these and of those found; the interval is over contacts."""
        ended = self.frames[:, outcome]
        return proportion_of_clusters(ended, ended + self.frames[:, Outcome.BOTH])

    def _left_out(self, decided: bool) -> int:
        """Contacts with frames that were left out, and others that were decided or none."""
        has_frames = (self.frames[:, [Outcome.BOTH, Outcome.MISSED]] > 0).any(axis=1)
        return int(((self.frames[:, Outcome.LEFT_OUT] > 0) & (has_frames == decided)).sum())


def count_contacts(comparison: Comparison, contacts: Sequence[Episode]) -> ContactCounts:
    """Count the outcomes of ``contacts``, the oracle's, frame by frame."""
    return _count_by_outcome(comparison.by_contact, contacts)


def _count_by_outcome(outcome: ByteArray, contacts: Sequence[Episode]) -> ContactCounts:
    frames = np.zeros((len(contacts), len(Outcome)), dtype=np.int64)
    for row, episode in zip(frames, contacts, strict=True):
        row[:] = np.bincount(outcome[episode.first : episode.last + 1, episode.pair], minlength=len(Outcome))
        # Frames without a pose within a contact are no frames of contact that somebody left undecided.
        row[Outcome.LEFT_OUT] -= episode.frames_lost
    pairs = np.array([episode.pair for episode in contacts], dtype=np.int64)
    everything = ContactCounts(np.arange(1, len(contacts) + 1), pairs, frames)
    return everything.only(frames[:, Outcome.GRASPED] == 0)


def grasped_counts(
    comparison: Comparison, verdicts: tuple[ByteArray, ByteArray], contacts: Sequence[Episode], pairs: Sequence[int]
) -> dict[str, int]:
    """Count the answers of a detector while a hand holds the body; they stand in no other count.

    Contacts, those missed and missed in part, and pair-frames. ``verdicts`` (T, P) of oracle and detector; ``contacts``
    are the oracle's that are held, and ``pairs`` the columns asked about.
    """
    columns = list(pairs)
    grasped = comparison.outcome[:, columns] == Outcome.GRASPED
    truth, reported = (counts_as_contact(verdict[:, columns]) for verdict in verdicts)
    pair_contacts = [contact for contact in contacts if contact.pair in columns]
    # No detector says contact in a frame without a pose.
    reported_frames = [
        int(reported[episode.first : episode.last + 1, columns.index(episode.pair)].sum()) for episode in pair_contacts
    ]
    frames = {"both": truth & reported, "missed": truth & ~reported, "invented": reported & ~truth}
    return {
        "contacts": len(pair_contacts),
        "contacts_missed": reported_frames.count(0),
        "contacts_in_part": sum(
            0 < count < episode.frames for count, episode in zip(reported_frames, pair_contacts, strict=True)
        ),
        **{name: int((grasped & frames_of_kind).sum()) for name, frames_of_kind in frames.items()},
    }


def count_reports(comparison: Comparison) -> ContactCounts:
    """Count the contacts that a detector reports: true, false, or within tolerance."""
    reported_frames = column_runs(is_one_of(column, REPORTED) for column in comparison.outcome.T)
    reports = [Episode(pair, first, last, 0.0, 0.0) for pair, first, last in reported_frames.tolist()]
    return _count_by_outcome(comparison.outcome, reports)
