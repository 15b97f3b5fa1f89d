"""Checks that every detector makes of a motion: poses of its bodies, and blocks in order of time."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from cdcore.errors import InvalidPoseError
from cdcore.numerics import BoolArray, ByteArray, IntArray
from cdcore.protocol.body import Body
from cdcore.protocol.motion import Motion
from cdcore.protocol.verdict import Verdict


def require_bodies(motion: Motion, bodies: Sequence[Body]) -> None:
    """Refuse what is no motion, or one of another number of bodies than the detector has, with an InvalidPoseError."""
    if not isinstance(motion, Motion):
        raise InvalidPoseError(
            f"a detector takes a Motion, not {type(motion).__name__}; make one: "
            "cdcore.Motion(times, translations, rotations)"
        )
    if motion.body_count != len(bodies):
        names = ", ".join(body.name for body in bodies)
        raise InvalidPoseError(
            f"the motion has poses of {motion.body_count} bodies, the detector has {len(bodies)}; "
            f"give one column for each of: {names}"
        )


def blocks_in_order(motions: Iterable[Motion]) -> Iterator[Motion]:
    """The blocks of a stream; InvalidPoseError where one starts before the end of the block before it."""
    last: float | None = None
    for number, motion in enumerate(motions):
        if len(motion):
            first = float(motion.times[0])
            if last is not None and not first > last:
                raise InvalidPoseError(
                    f"block {number} starts at {first!r} s, not after {last!r} s where the block before ends; "
                    "stream the blocks in order of time"
                )
            last = float(motion.times[-1])
        yield motion


def pair_has_pose(motion: Motion, pairs: IntArray) -> BoolArray:
    """Whether both bodies of a pair have a pose, (T, P)."""
    return motion.valid[:, pairs[:, 0]] & motion.valid[:, pairs[:, 1]]


def contact_or_clear(hits: BoolArray, motion: Motion, pairs: IntArray) -> ByteArray:
    """Verdicts (T, P): CONTACT where a pair was hit, NO_POSE where a body has no pose, else CLEAR."""
    verdict: ByteArray = hits * np.uint8(Verdict.CONTACT)
    if not motion.valid.all():
        verdict[~pair_has_pose(motion, pairs)] = Verdict.NO_POSE
    return verdict


def ordered_by_name(bodies: Sequence[Body], pairs: IntArray) -> tuple[IntArray, BoolArray]:
    """Each pair with the body first whose name sorts first, (P, 2), and which rows that turned round, (P,).

    Asked in this order, an engine whose answer depends on the order of its operands gives one answer for a pair,
    however the pair was written down.
    """
    rank = np.empty(len(bodies), dtype=np.int64)
    rank[sorted(range(len(bodies)), key=lambda k: bodies[k].name)] = np.arange(len(bodies))
    swapped = rank[pairs[:, 0]] > rank[pairs[:, 1]]
    ordered = pairs.copy()
    ordered[swapped] = pairs[swapped][:, ::-1]
    return ordered, swapped
