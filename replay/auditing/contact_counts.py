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

REPORTED_OUTCOMES: Final = (Outcome.BOTH, Outcome.FALSE_CONTACT, Outcome.WITHIN_TOLERANCE)
"""Outcomes of a contact that a detector reports."""


def missed_whole(outcome_counts: IntArray) -> BoolArray:
    """(..., C) contacts never reported, and missed in a frame, of their ``outcome_counts`` (..., C, outcomes)."""
    return (outcome_counts[..., Outcome.MISSED] > 0) & (outcome_counts[..., Outcome.BOTH] == 0)


def missed_partly(outcome_counts: IntArray) -> BoolArray:
    """(..., C) which contacts are reported in some frames and missed in others."""
    return (outcome_counts[..., Outcome.MISSED] > 0) & (outcome_counts[..., Outcome.BOTH] > 0)


@dataclass(frozen=True, eq=False)
class ContactCounts:
    """The oracle's contacts, each in one class: found, missed in part, missed, undecided, or within tolerance.

    Those of a hand with what it holds are not among them: ``grasped_counts`` has them.

    Contacts are counted, not the stretches in which they were lost: a contact that was lost twice is one contact
    missed in part.

    ``numbers``: (C,) of the contacts, from 1; ``pairs``: (C,) column of the pair of each; ``frames_by_outcome``: (C,
    outcomes) frames of each by ``Outcome``.
    """

    numbers: IntArray
    pairs: IntArray
    frames_by_outcome: IntArray

    def selected(self, is_kept: BoolArray) -> "ContactCounts":
        """The contacts for which ``is_kept`` (C,) is true."""
        return ContactCounts(self.numbers[is_kept], self.pairs[is_kept], self.frames_by_outcome[is_kept])

    @property
    def contacts(self) -> int:
        """Contacts of the oracle."""
        return len(self.pairs)

    @property
    def late_or_cut_short(self) -> int:
        """Contacts reported in some frames and missed in others."""
        return int(missed_partly(self.frames_by_outcome).sum())

    @property
    def missed(self) -> int:
        """Contacts never reported, and missed in at least one frame."""
        return len(self.missed_numbers)

    @property
    def missed_numbers(self) -> list[int]:
        """Numbers, from 1, of the contacts that were never found."""
        return self.numbers[missed_whole(self.frames_by_outcome)].tolist()

    @property
    def undecided(self) -> int:
        """Contacts that were neither reported nor missed in any frame, because frames were left out."""
        is_decided = (self.frames_by_outcome[:, [Outcome.BOTH, Outcome.MISSED]] > 0).any(axis=1)
        return int(np.count_nonzero(self.frames_by_outcome[~is_decided, Outcome.LEFT_OUT]))

    @property
    def with_undecided_frames(self) -> int:
        """Contacts of which frames were left out; those of which others were decided count in that class too."""
        return int(np.count_nonzero(self.frames_by_outcome[:, Outcome.LEFT_OUT]))

    @property
    def frames_undecided(self) -> int:
        """Pair-frames of the oracle's contacts that were left out."""
        return int(self.frames_by_outcome[:, Outcome.LEFT_OUT].sum())

    def of_pair(self, pair: int) -> "ContactCounts":
        """The contacts of one pair."""
        return self.selected(self.pairs == pair)

    def proportion(self, outcome: Outcome) -> Proportion:
        """Pair-frames that ended so, of these and of those found; the interval is over contacts."""
        frames_of_outcome = self.frames_by_outcome[:, outcome]
        return proportion_of_clusters(frames_of_outcome, frames_of_outcome + self.frames_by_outcome[:, Outcome.BOTH])


def count_contacts(comparison: Comparison, contacts: Sequence[Episode]) -> ContactCounts:
    """Count the outcomes of ``contacts``, the oracle's, frame by frame."""
    return _count_by_outcome(comparison.by_contact, contacts)


def _count_by_outcome(outcome: ByteArray, contacts: Sequence[Episode]) -> ContactCounts:
    frames_by_outcome = np.zeros((len(contacts), len(Outcome)), dtype=np.int64)
    for outcome_counts, episode in zip(frames_by_outcome, contacts, strict=True):
        outcome_counts[:] = np.bincount(outcome[episode.first : episode.last + 1, episode.pair], minlength=len(Outcome))
        # Frames without a pose within a contact are no frames of contact that somebody left undecided.
        outcome_counts[Outcome.LEFT_OUT] -= episode.frames_lost
    pairs = np.array([episode.pair for episode in contacts], dtype=np.int64)
    all_counts = ContactCounts(np.arange(1, len(contacts) + 1), pairs, frames_by_outcome)
    return all_counts.selected(frames_by_outcome[:, Outcome.GRASPED] == 0)


def grasped_counts(
    comparison: Comparison, verdicts: tuple[ByteArray, ByteArray], contacts: Sequence[Episode], pairs: Sequence[int]
) -> dict[str, int]:
    """Count the answers of a detector while a hand holds the body; they stand in no other count.

    Contacts, those missed and missed in part, and pair-frames. ``verdicts`` (T, P) of oracle and detector; ``contacts``
    are the oracle's that are held, and ``pairs`` the columns asked about.
    """
    columns = list(pairs)
    is_grasped = comparison.outcome[:, columns] == Outcome.GRASPED
    reference_contact, subject_contact = (counts_as_contact(verdict[:, columns]) for verdict in verdicts)
    pair_contacts = [contact for contact in contacts if contact.pair in columns]
    # No detector says contact in a frame without a pose.
    reported_frames = [
        int(subject_contact[episode.first : episode.last + 1, columns.index(episode.pair)].sum())
        for episode in pair_contacts
    ]
    masks = {
        "both": reference_contact & subject_contact,
        "missed": reference_contact & ~subject_contact,
        "invented": subject_contact & ~reference_contact,
    }
    return {
        "contacts": len(pair_contacts),
        "contacts_missed": reported_frames.count(0),
        "contacts_in_part": sum(
            0 < reported_count < episode.frames
            for reported_count, episode in zip(reported_frames, pair_contacts, strict=True)
        ),
        **{mask_name: int((is_grasped & mask).sum()) for mask_name, mask in masks.items()},
    }


def count_reports(comparison: Comparison) -> ContactCounts:
    """Count the contacts that a detector reports: true, false, or within tolerance."""
    reported_frames = column_runs(is_one_of(column, REPORTED_OUTCOMES) for column in comparison.outcome.T)
    report_episodes = [Episode(pair, first, last, 0.0, 0.0) for pair, first, last in reported_frames.tolist()]
    return _count_by_outcome(comparison.outcome, report_episodes)
