"""Bodies that move as one or rest beside each other: where a real scene has contact, whatever its meshes look like.

A hand that carries a body touches it, and a body that rests stands on something. Poses alone say when that is.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore import Motion
from cdcore.numerics import BoolArray, FloatArray, IntArray

WINDOW_S: Final = 0.1
"""Seconds over which a movement is measured."""

LEAST_MOVEMENT_M: Final = 0.005
"""Both bodies of a carried pair move at least so far in a window: farther than trackers err."""

MOST_SLIP: Final = 0.1
"""Movement against each other, of a pair that moves as one, as a fraction of its movement in the room."""

MOST_AT_REST_M: Final = 0.0005
"""Metres that a body at rest moves in a window."""


@dataclass(frozen=True)
class SharedMotion:
    """Frames in which pairs move as one, and those in which both bodies rest, (T, P) bool each."""

    carried: BoolArray
    at_rest: BoolArray

    def carried_contact(self, contact: BoolArray) -> float:
        """Returns the fraction of the carried frames with contact (T, P); 0 without any."""
        return float(contact[self.carried].mean()) if self.carried.any() else 0.0

    def supported(self, contact: BoolArray, pairs: IntArray) -> int:
        """Returns how many bodies touch another while both rest."""
        return len(np.unique(pairs[(contact & self.at_rest).any(axis=0)]))


def shared_motion(motion: Motion, pairs: IntArray) -> SharedMotion:
    """Returns when the bodies of each pair (P, 2) move as one, and when both rest."""
    count = len(motion)
    carried = np.zeros((count, len(pairs)), dtype=np.bool_)
    at_rest = np.zeros_like(carried)
    step = float(np.median(np.diff(motion.times))) if count > 1 else 0.0
    width = max(1, round(WINDOW_S / step)) if step > 0.0 else count
    if width >= count:
        return SharedMotion(carried, at_rest)
    moved = np.linalg.norm(motion.translations[width:] - motion.translations[:-width], axis=2)
    valid = motion.valid[width:] & motion.valid[:-width]
    for pair, (first, second) in enumerate(pairs.tolist()):
        both = valid[:, first] & valid[:, second]
        offset = _offset(motion, first, second)
        slip = np.linalg.norm(offset[width:] - offset[:-width], axis=1)
        least = np.minimum(moved[:, first], moved[:, second])
        carried[:-width, pair] = both & (least >= LEAST_MOVEMENT_M) & (slip <= MOST_SLIP * least)
        at_rest[:-width, pair] = both & (np.maximum(moved[:, first], moved[:, second]) <= MOST_AT_REST_M)
    return SharedMotion(carried, at_rest)


def _offset(motion: Motion, first: int, second: int) -> FloatArray:
    """Where the second body is in the axes of the first, (T, 3)."""
    between = motion.translations[:, second] - motion.translations[:, first]
    offset: FloatArray = np.einsum("tji,tj->ti", motion.rotations[:, first], between)
    return offset
