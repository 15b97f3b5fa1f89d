"""The glossary of verdicts: one word for each thing a detector can say about a pair in a frame."""

from enum import IntEnum

import numpy as np

from cdcore.numerics import BoolArray, ByteArray


class Verdict(IntEnum):
    """What a detector says of one pair in one frame (stored as uint8)."""

    CLEAR = 0
    """Surfaces disjoint, decided; neither inside the other where containment is decided."""
    CONTACT = 1
    """Surfaces meet (touching counts), confirmed on triangles."""
    CONTAINED = 2
    """One wholly inside a closed other, surfaces disjoint."""
    CANDIDATE = 3
    """Only bounding volumes overlap: counts as contact, the excess is printed as unconfirmed."""
    NOT_FOUND = 4
    """A sampled or budgeted search ended without a hit: counts as no contact."""
    UNRESOLVED = 5
    """Undecided, with a reason: left out of an audit, in its own column."""
    INVALID = 6
    """The question does not apply (an open mesh in ``image-space``): left out, in its own column."""
    NO_POSE = 7
    """Pose missing or flagged: left out, in its own column."""


CONTACT_VERDICTS = (Verdict.CONTACT, Verdict.CONTAINED, Verdict.CANDIDATE)
"""Verdicts that an audit counts as contact."""

UNDECIDED_VERDICTS = (Verdict.UNRESOLVED, Verdict.INVALID, Verdict.NO_POSE)
"""Verdicts that an audit leaves out and counts in columns of their own."""


def counts_as_contact(verdict: ByteArray) -> BoolArray:
    """Whether each verdict is contact in an audit, same shape."""
    return np.isin(verdict, np.array(CONTACT_VERDICTS, dtype=np.uint8))


def is_undecided(verdict: ByteArray) -> BoolArray:
    """Whether each verdict is left out of an audit, same shape."""
    return np.isin(verdict, np.array(UNDECIDED_VERDICTS, dtype=np.uint8))
