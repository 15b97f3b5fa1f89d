"""Flags of verdicts with a doubtful pose: a mark per frame and body, and per pair through its bodies."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.prepare.assembly import Assembly
from sessions import Scene

FLAG_KINDS: Final = (
    "not-finite",
    "zero-quaternion",
    "non-unit-quaternion",
    "identity-while-lost",
    "tracking-lost",
    "frozen",
    "teleport",
    "gap",
    "out-of-space",
)
"""Kinds that flag single frames; the n-th is bit n."""

POSE_DOUBT_BITS: Final = np.uint16(0xFFFF ^ 1 << FLAG_KINDS.index("gap"))
"""Bits that doubt the pose itself; after a gap only the path to it is unknown."""


@dataclass(frozen=True)
class FlagSpan:
    """Consecutive frames of one body with one kind of fault, and what was done about it.

    Parameters
    ----------
    kind : of `FLAG_KINDS`.
    body : the body, or ``""`` for all (a gap).
    start_ns, end_ns : stamps of the first and last frame.
    start, end : the same in seconds after the session's first frame.
    samples : recorded samples in it.
    action : what the policy says.
    dropped, held, interpolated : samples that became this.
    """

    kind: str
    body: str
    start_ns: int
    end_ns: int
    start: float
    end: float
    samples: int
    action: str
    dropped: int = 0
    held: int = 0
    interpolated: int = 0


@dataclass(frozen=True, eq=False)
class Flags:
    """Flags of an assembly: (T, N) uint16, bits of `FLAG_KINDS`; a child carries its parents' flags."""

    bodies: NDArray[np.uint16]

    @classmethod
    def of(cls, spans: Sequence[FlagSpan], assembly: Assembly, scene: Scene) -> "Flags":
        """Flag the frames of an assembly that spans cover."""
        flag_bits = np.zeros((len(assembly.stamp_ns), len(assembly.names)), dtype=np.uint16)
        columns: dict[str, list[int]] = {}
        for column, name in enumerate(assembly.names):
            for source in chain_of(name, scene):
                columns.setdefault(source, []).append(column)
        for span in spans:
            first, last = np.searchsorted(assembly.stamp_ns, [span.start_ns, span.end_ns + 1])
            flag_bit = np.uint16(1 << FLAG_KINDS.index(span.kind))
            flagged_columns = columns.get(span.body, []) if span.body else range(flag_bits.shape[1])
            for column in flagged_columns:
                flag_bits[first:last, column] |= flag_bit
        return cls(flag_bits)

    def of_pairs(self, pairs: NDArray[np.int64], start: int = 0, stop: int | None = None) -> NDArray[np.uint16]:
        """(n, P) flags of pairs in some frames: those of either body."""
        flags = self.bodies[start:stop]
        return flags[:, pairs[:, 0]] | flags[:, pairs[:, 1]]


def flag_word(flag_bits: int) -> str:
    """A flag in words: ``frozen+gap``; an empty text for 0."""
    return "+".join(kind for k, kind in enumerate(FLAG_KINDS) if flag_bits >> k & 1)


def chain_of(name: str, scene: Scene) -> list[str]:
    """A body, its parent, the parent's parent and so on."""
    names_in_chain = [name]
    while (
        (scene_body := scene.body(names_in_chain[-1])) is not None
        and scene_body.parent
        and scene_body.parent not in names_in_chain
    ):
        names_in_chain.append(scene_body.parent)
    return names_in_chain
