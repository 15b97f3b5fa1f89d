"""A session in the form that detectors take: bodies, one motion, pairs, and the origin of each pose."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from cdcore import Body, Motion
from cdcore.numerics import BoolArray, ByteArray, IntArray
from sessions.model.event import LiveContact


class PoseOrigin(IntEnum):
    """Origin of the pose of a body in a frame (stored as uint8)."""

    NONE = 0
    """There is none: lost, or no sample near enough."""
    RECORDED = 1
    """The frame holds a valid sample."""
    HELD = 2
    """Repeated from an earlier sample (by the source, or at most 50 ms by the assembly)."""
    INTERPOLATED = 3
    """Computed between two samples (by the source or by the assembly)."""
    FIXED = 4
    """The scene declares the body fixed."""


@dataclass(frozen=True, eq=False)
class Assembly:
    """A session, or a block of it, ready for detection.

    Parameters
    ----------
    bodies : N bodies; tracked ones first, then fixed ones. Bodies without a mesh are not here.
    motion : T frames of the N bodies; ``motion.times`` are seconds since the first frame of the session.
    pairs : (P, 2) int64 body numbers.
    held : (P,) bool: a body and its parent, or a hand and a thing of its group, throughout; counted apart.
    stamp_ns : (T,) int64, the frames' own stamps.
    origin : (T, N) uint8, values of ``PoseOrigin``.
    proxies : names of bodies whose mesh only stands in for the real one.
    left_out : names of tracked bodies without a mesh.
    live_contacts : what an engine reported, on the frames' clock; ``live_residual`` seconds it may be off.
    notes : sentences about frames that are left out and bodies that are not there.
    """

    bodies: tuple[Body, ...]
    motion: Motion
    pairs: IntArray
    held: BoolArray
    stamp_ns: IntArray
    origin: ByteArray
    proxies: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    live_contacts: Sequence[LiveContact] = ()
    live_residual: float = 0.0

    @property
    def first_ns(self) -> int:
        """The stamp of second 0 of ``motion.times``."""
        return int(self.stamp_ns[0]) - round(float(self.motion.times[0]) * 1e9)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies."""
        return tuple(body.name for body in self.bodies)

    def pair_name(self, pair: int) -> str:
        """``a-b`` for a column of the detections."""
        return "-".join(self.bodies_of(pair))

    def bodies_of(self, pair: int) -> tuple[str, str]:
        """Names of the two bodies of a column of the detections."""
        first, second = self.pairs[pair].tolist()
        return self.bodies[first].name, self.bodies[second].name
