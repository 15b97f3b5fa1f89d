"""The words of an audit: one detector's verdict beside an oracle's. BOTH is a true positive, MISSED a false negative,
INVENTED a false positive, NEITHER a true negative.
"""

from dataclasses import dataclass, field
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
    INVENTED = 3
    """A contact reported where there is none: a false positive."""
    WITHIN_TOLERANCE = 4
    """They disagree about less than tau: ill-posed, so no error of either."""
    BETWEEN_FRAMES = 5
    """An interval detector's contact that no instant shows."""
    LEFT_OUT = 6
    """One of them did not decide (no pose, unresolved, invalid)."""
    HELD = 7
    """Contact, by one of them or both, of a hand with what it holds: counted apart."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """One detector beside the oracle, by label: (T, P) uint8 values of ``Outcome``."""

    subject: str
    oracle: str
    outcome: ByteArray

    @cached_property
    def by_pair(self) -> IntArray:
        """How many frames of every pair ended in each outcome, (P, outcomes)."""
        return counts_by_pair(self.outcome, len(Outcome))

    def count(self, outcome: Outcome) -> int:
        """How many pair-frames ended so."""
        return int(self.by_pair[:, outcome].sum())


def counts_by_pair(codes: ByteArray, most: int) -> IntArray:
    """How often each code below ``most`` stands in every column of a table (T, P), (P, most).

    Column by column: numpy counts in eight bytes an entry, and of hours a whole table of flags is as large as it is.
    """
    counts = np.zeros((codes.shape[1], most), dtype=np.int64)
    for row, column in zip(counts, codes.T, strict=True):
        row += np.bincount(column, minlength=most)
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
    """Where two bodies first meet on their way from one frame to the next.

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


@dataclass(frozen=True, slots=True)
class Stretch:
    """Frames of one pair in which a detector and the oracle differ, numbered in order of time.

    Parameters
    ----------
    number : 1, 2, ... in order of time, of one detector.
    pair : column of the pair; ``body_a`` and ``body_b`` are its names.
    first, last : first and last frame (both included).
    start, end : seconds of its first frame, and when its last one is over.
    kind : how it lies to what the oracle sees.
    """

    number: int
    pair: int
    body_a: str
    body_b: str
    first: int
    last: int
    start: float
    end: float
    kind: str

    @property
    def frames(self) -> int:
        """How many frames it has."""
        return self.last - self.first + 1


@dataclass(frozen=True, slots=True)
class Miss(Stretch):
    """One numbered false negative: a stretch of an oracle's episode that the subject did not report.

    The number is the same in the lane, the list, the flag in 3D, the tables and the report.

    Parameters
    ----------
    kind : ``never found`` (the whole episode) or ``found late`` or ``lost early`` or ``interrupted``.
    episode : number of the oracle's episode it belongs to, from 1 in order of time.
    deepest : the frame where the cut is longest; ``point`` (world metres) and ``normal`` are taken there.
    face_pairs : number of face pairs there.
    cut_length : length of the intersection curve there, metres.
    cause : the stage that lost it, in the words of ``replay.comparison.causes``; ``why``: the sentence about it.
    agreeing : frames of it that have this cause, of those examined.
    touch : when and where the bodies first touch, if no frame shows the contact but the way to ``first`` does. Then
        ``point`` and ``normal`` are taken at that moment, ``face_pairs`` is 1 and the curve has no length yet.
    faces : (k, 2) face pairs at its deepest frame, or the pair that touches first, where the oracle lists none.
    """

    episode: int
    deepest: int
    point: Vector
    normal: Vector
    face_pairs: int
    cut_length: float
    cause: str = "not examined"
    why: str = ""
    agreeing: tuple[int, int] = (0, 0)
    touch: FirstTouch | None = None
    faces: IntArray | None = field(default=None, compare=False, repr=False)

    @property
    def shown(self) -> tuple[int, int]:
        """Where there is most to see: a frame, and nanoseconds after it."""
        return (self.deepest, 0) if self.touch is None else (self.touch.frame, self.touch.later_ns)

    @property
    def seconds(self) -> float:
        """When it begins: at its first frame, or between frames where it touches first."""
        return self.start if self.touch is None else self.touch.moment
