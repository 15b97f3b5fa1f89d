"""A session in the form that detectors take: bodies, one motion, pairs, and the origin of each pose."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property

import numpy as np

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
    group_of : member of a group of the scene -> the group's name.
    grasped : (P,) bool: a body and its parent, or a hand and a thing of its group, throughout; counted apart.
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
    grasped: BoolArray
    stamp_ns: IntArray
    origin: ByteArray
    proxies: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    live_contacts: Sequence[LiveContact] = ()
    live_residual: float = 0.0
    group_of: Mapping[str, str] = field(default_factory=dict)

    @property
    def first_ns(self) -> int:
        """The stamp of second 0 of ``motion.times``."""
        return int(self.stamp_ns[0]) - round(float(self.motion.times[0]) * 1e9)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies."""
        return tuple(body.name for body in self.bodies)

    @cached_property
    def contact_columns(self) -> IntArray:
        """(P,) the column under which contacts of each pair are counted.

        It is the pair's own, or the first of those that join the same two groups, or a group and the same body.
        """
        first_column: dict[frozenset[str], int] = {}
        columns = [first_column.setdefault(frozenset(self.things_of(pair)), pair) for pair in range(len(self.pairs))]
        return np.array(columns, dtype=np.int64)

    def columns_of_contact(self, pair: int) -> list[int]:
        """The columns whose contacts are counted with those of a pair, its own among them."""
        columns = self.contact_columns
        return np.flatnonzero(columns == columns[pair]).tolist()

    def things_of(self, pair: int) -> tuple[str, str]:
        """Names of both bodies of a column, a member of a group by the name of its group."""
        first, second = self.bodies_of(pair)
        things = self.group_of.get(first, first), self.group_of.get(second, second)
        return things if things[0] != things[1] else (first, second)

    def fault_names(self, pair: int) -> tuple[str, str]:
        """Names of both bodies of a column, a member of a group with the name of its group: ``hand (thumb)``."""
        bodies, things = self.bodies_of(pair), self.things_of(pair)
        first, second = (f"{t} ({b})" if t != b else b for b, t in zip(bodies, things, strict=True))
        return first, second

    def pair_name(self, pair: int) -> str:
        """``a-b`` for a column of the detections; a member of a group has the name of its group."""
        return "-".join(self.things_of(pair))

    def bodies_of(self, pair: int) -> tuple[str, str]:
        """Names of the two bodies of a column of the detections."""
        first, second = self.pairs[pair].tolist()
        return self.bodies[first].name, self.bodies[second].name
