"""The glossary of verdicts: one word for each thing a detector can say about a pair in a frame."""

from collections.abc import Sequence
from enum import IntEnum

from cdcore.numerics import BoolArray, ByteArray


class Verdict(IntEnum):
    """Answer of a detector about one pair in one frame (stored as uint8)."""

    CLEAR = 0
    """Surfaces disjoint, decided; no part of one inside the other where containment is decided."""
    CONTACT = 1
    """Surfaces meet (touching counts), confirmed on triangles."""
    CONTAINED = 2
    """A connected part of one, or all of it, inside the other, surfaces disjoint: the solids overlap."""
    CANDIDATE = 3
    """Only bounding volumes overlap: counts as contact, the excess is printed as unconfirmed."""
    NOT_FOUND = 4
    """A search ended without a hit, or a sampled detector has no answer yet: counts as no contact."""
    UNRESOLVED = 5
    """Undecided, with a reason, as what is inside a mesh with holes: left out of an audit, in its own column."""
    INVALID = 6
    """The question does not apply (a mesh without inside in ``image-space``): left out, in its own column."""
    NO_POSE = 7
    """Pose missing or flagged: left out, in its own column."""


CONTACT_VERDICTS = (Verdict.CONTACT, Verdict.CONTAINED, Verdict.CANDIDATE)
"""Verdicts that an audit counts as contact."""

UNDECIDED_VERDICTS = (Verdict.UNRESOLVED, Verdict.INVALID, Verdict.NO_POSE)
"""Verdicts that an audit leaves out and counts in columns of their own."""


def counts_as_contact(verdict: ByteArray) -> BoolArray:
    """Whether each verdict is contact in an audit, same shape."""
    return is_one_of(verdict, CONTACT_VERDICTS)


def is_undecided(verdict: ByteArray) -> BoolArray:
    """Whether each verdict is left out of an audit, same shape."""
    return is_one_of(verdict, UNDECIDED_VERDICTS)


def is_one_of(codes: ByteArray, members: Sequence[IntEnum]) -> BoolArray:
    """Whether each code is one of some words of its glossary, same shape."""
    # One comparison of bytes a word: ``np.isin`` takes 80 times as long (2026-11, 2.4 million codes).
    # A plain number: beside one of an enumeration NumPy widens all codes to 64 bits.
    matches: BoolArray = codes == int(members[0])
    for word in members[1:]:
        matches |= codes == int(word)
    return matches
