"""The words of an audit: one detector's verdict beside an oracle's. BOTH is a true positive, MISSED a false negative,
FALSE_CONTACT a false positive, NEITHER a true negative.
"""

from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np

from cdcore.numerics import ByteArray, IntArray
from replay.effects.output import Vector


class Outcome(IntEnum):
    """The result of comparing two verdicts on one pair-frame (stored as uint8)."""

    NEITHER = 0
    """No contact, and the detector says so."""
    BOTH = 1
    """Contact, and the detector says so."""
    MISSED = 2
    """Contact that the detector does not report: a false negative."""
    FALSE_CONTACT = 3
    """A contact reported where there is none: a false positive."""
    WITHIN_TOLERANCE = 4
    """They disagree about less than tau: ill-posed, so no error of either."""
    BETWEEN_FRAMES = 5
    """An interval detector's contact that no instant shows."""
    LEFT_OUT = 6
    """One of them did not decide (no pose, unresolved, invalid)."""
    GRASPED = 7
    """Contact, by one of them or both, of a hand with what it holds: counted apart."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """One detector beside the oracle, by label: (T, P) uint8 values of ``Outcome``.

    ``contact_columns`` are those of the assembly; ``None``: every pair has contacts of its own.
    """

    subject: str
    oracle: str
    outcome: ByteArray
    contact_columns: IntArray | None = None

    @cached_property
    def by_contact(self) -> ByteArray:
        """(T, P) outcomes of contacts: pairs of a group count as one, in the first of their columns.

        A frame in which both report contact of any member is BOTH, whichever member each means.
        """
        if self.contact_columns is None:
            return self.outcome
        columns, member_counts = np.unique(self.contact_columns, return_counts=True)
        group_columns = columns[member_counts > 1].tolist()
        if not group_columns:
            return self.outcome
        outcome_by_contact = self.outcome.copy()
        for column in group_columns:
            member_columns = np.flatnonzero(self.contact_columns == column)
            outcome_by_contact[:, member_columns] = Outcome.NEITHER
            outcome_by_contact[:, column] = joined_outcome(self.outcome[:, member_columns])
        return outcome_by_contact

    @cached_property
    def by_pair(self) -> IntArray:
        """How many frames of every pair ended in each outcome, (P, outcomes)."""
        return counts_by_pair(self.outcome, len(Outcome))

    def pair_frames_of(self, outcome: Outcome) -> int:
        """How many pair-frames ended so."""
        return int(self.by_pair[:, outcome].sum())


def joined_outcome(member_outcomes: ByteArray) -> ByteArray:
    """Outcome of a contact of a group in each frame, (T,), of the outcomes of its members (T, M)."""
    has_outcome = {outcome: (member_outcomes == outcome).any(axis=1) for outcome in Outcome}
    outcome_of_contact = np.full(len(member_outcomes), Outcome.NEITHER, dtype=np.uint8)
    # The later line wins.
    for outcome in (Outcome.BETWEEN_FRAMES, Outcome.WITHIN_TOLERANCE, Outcome.FALSE_CONTACT):
        outcome_of_contact[has_outcome[outcome]] = outcome
    outcome_of_contact[has_outcome[Outcome.LEFT_OUT]] = Outcome.LEFT_OUT
    outcome_of_contact[has_outcome[Outcome.MISSED]] = Outcome.MISSED
    outcome_of_contact[has_outcome[Outcome.GRASPED]] = Outcome.GRASPED
    outcome_of_contact[
        has_outcome[Outcome.BOTH] | (has_outcome[Outcome.MISSED] & has_outcome[Outcome.FALSE_CONTACT])
    ] = Outcome.BOTH
    return outcome_of_contact


def counts_by_pair(codes: ByteArray, code_count: int) -> IntArray:
    """How often each code below ``code_count`` stands in every column of a table (T, P), (P, most).

    Column by column: numpy counts in eight bytes an entry, and of hours a whole table of flags is as large as it is.
    """
    counts = np.zeros((codes.shape[1], code_count), dtype=np.int64)
    for pair_counts, column in zip(counts, codes.T, strict=True):
        pair_counts += np.bincount(column, minlength=code_count)
    return counts


@dataclass(frozen=True, slots=True)
class Episode:
    """A contact of one pair in one detection: a maximal stretch of frames in contact, across frames without a pose.

    Parameters
    ----------
    pair : column of the pair.
    first, last : first and last frame in contact (both included).
    start, end : seconds on the session timeline: of the first frame, and when the last one is over.
    lost : stretches of frames, both ends included, within it in which a pose is lost.
    cuts : how many stretches of lost poses cut it: those within it, one before it, and one after it.
    """

    pair: int
    first: int
    last: int
    start: float
    end: float
    lost: tuple[tuple[int, int], ...] = ()
    cuts: int = 0

    @property
    def frames_lost(self) -> int:
        """Frames within it without a pose."""
        return self.lost_within(self.first, self.last)

    @property
    def frames(self) -> int:
        """Frames in contact."""
        return self.last - self.first + 1 - self.frames_lost

    def lost_within(self, first: int, last: int) -> int:
        """Frames without a pose from a frame of it to another, both included."""
        return sum(max(0, min(last, b) - max(first, a) + 1) for a, b in self.lost)


@dataclass(frozen=True, slots=True)
class FirstTouch:
    """Point and moment at which two bodies first meet between one frame and the next.

    Parameters
    ----------
    frame : the way begins at this frame and ends at the next.
    free, moment : seconds; nothing touches before ``free``, at ``moment`` the faces meet.
    later_ns : nanoseconds from the frame to the moment.
    faces : a face of the first body and one of the second that meet.
    point : where, world metres; ``normal`` is the unit direction from the first body to the second there.
    """

    frame: int
    free: float
    moment: float
    later_ns: int
    faces: tuple[int, int]
    point: Vector
    normal: Vector
