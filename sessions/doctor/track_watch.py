"""Watches one body sample by sample for steps that cannot be motion; the result does not depend on the block size.

A teleport is a step faster than 20 m/s, or a step whose velocity differs from the median of the two steps before and
after by more than 2.5 m/s plus four times their spread. At 90 Hz the second rule sees a jump of 28 mm of a body at
rest and accepts a shaken hand.
"""

from collections.abc import Mapping
from enum import IntFlag
from typing import Final

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

SPEED_BOUND: Final = 20.0
"""Metres per second above which a pose did not get there by moving: a thrown ball reaches 20 m/s, a hand half of it."""

ODD_SPEED: Final = 2.5
"""Metres per second by which one step may differ from those around it: a blow of 100 m/s2 changes 1.1 m/s at 90 Hz."""

SPREADS: Final = 4.0
"""... or so many times the spread of the steps around it, so that a shaken hand is not taken for a broken tracker."""

ROTATION_RATE_BOUND: Final = 50.0
"""Radians per second above which a turn that is undone in the next step is none: 32 degrees in a step at 90 Hz. A wrist
is flicked at 20 to 40."""

AHEAD: Final = 2
KEPT: Final = 4


class Mark(IntFlag):
    """Flags of one sample (stored as uint32)."""

    NOT_FINITE = 1
    ZERO_QUATERNION = 2
    NON_UNIT = 4
    OFF_UNIT = 8
    IDENTITY = 16
    TELEPORT = 32
    LOST = 64
    SAME_POSITION = 128
    SAME_ROTATION = 256
    SAMPLE_SKEWED = 4096
    PRESENT = 8192
    OUT_OF_SPACE = 1 << 14
    NO_POSE = LOST | NOT_FINITE | OUT_OF_SPACE
    ROTATION_OUTLIER = 1 << 16


def is_marked(marks: NDArray[np.uint32], mark: Mark) -> NDArray[np.bool_]:
    """Mask of samples with any of these marks, in the shape of ``marks``."""
    return np.asarray((marks & np.uint32(mark)) != 0)


def with_marks(masks: Mapping[Mark, NDArray[np.bool_]]) -> NDArray[np.uint32]:
    """The union of the marks that each place has, in the shape of the masks."""
    marks = np.zeros(next(iter(masks.values())).shape, np.uint32)
    for mark, mask in masks.items():
        marks[mask] |= np.uint32(mark)
    return marks


SAMPLE: Final = np.dtype(
    [
        ("row", np.int64),
        ("time", np.float64),
        ("position", np.float64, 3),
        ("quaternion", np.float64, 4),
    ]
)
"""A sample of one body that may be a pose: its frame number, seconds, and the pose."""


class TrackWatch:
    """Takes the samples of one body, arrays of `SAMPLE`, block by block.

    A step shorter than ``least_step`` seconds is taken to be this long, because stamps jitter more than bodies move.
    """

    def __init__(self, least_step: float) -> None:
        self._least_step = least_step
        self._window = np.zeros(0, SAMPLE)

    def add(
        self, samples: NDArray[np.void], marks: NDArray[np.uint32], steps: NDArray[np.float32], *, last: bool = False
    ) -> None:
        """Enter marks and step lengths (metres) of all samples whose neighbours are known, (T,) by frame number."""
        window = np.concatenate([self._window, samples])
        done = max(0, len(self._window) - AHEAD)
        stop = len(window) if last else max(0, len(window) - AHEAD)
        self._window = window[max(0, stop - KEPT) :]
        if stop <= done or len(window) < 2:
            return
        displacement = np.diff(window["position"], axis=0)
        distance = np.sqrt((displacement * displacement).sum(axis=1))
        step = np.maximum(np.diff(window["time"]), self._least_step)
        quaternion = window["quaternion"]
        with np.errstate(divide="ignore", invalid="ignore"):  # a clock that only runs backwards has no least step
            velocity = displacement / step[:, None]
        step_marks = with_marks(
            {
                Mark.TELEPORT: _no_motion(velocity),
                Mark.SAME_POSITION: (displacement == 0).all(axis=1),
                Mark.SAME_ROTATION: (quaternion[1:] == quaternion[:-1]).all(axis=1),
                Mark.ROTATION_OUTLIER: undone_rotations(quaternion, step),
            }
        )
        begin = max(done, 1)
        rows = window["row"][begin:stop]
        marks[rows] |= step_marks[begin - 1 : stop - 1]
        steps[rows] = distance[begin - 1 : stop - 1]


def _no_motion(velocity: FloatArray) -> NDArray[np.bool_]:
    """Mask of consecutive velocities (n, 3) that are no motion."""
    speed = np.sqrt((velocity * velocity).sum(axis=1))
    if len(velocity) < 3:
        return np.asarray(speed > SPEED_BOUND)
    padded = np.concatenate([velocity[1::-1], velocity, velocity[:-3:-1]])
    count = len(velocity)
    around = np.stack([padded[shift : shift + count] for shift in (0, 1, 3, 4)])
    usual = _middle(around)
    deviation = around - usual
    spread = _middle(np.sqrt((deviation * deviation).sum(axis=2)))
    off = velocity - usual
    odd: NDArray[np.bool_] = np.sqrt((off * off).sum(axis=1)) > ODD_SPEED + SPREADS * spread
    odd |= speed > SPEED_BOUND
    return odd


def undone_rotations(quaternions: FloatArray, steps: FloatArray) -> NDArray[np.bool_]:
    """Mask (n - 1,) of steps between rotations (n, 4) faster than `ROTATION_RATE_BOUND` and undone in the next step.

    There are at least two rotations.

    ``steps``: (n - 1,) seconds. Undone is what the step after takes back by more than half.
    """
    unit = quaternions / np.maximum(np.sqrt((quaternions * quaternions).sum(axis=1, keepdims=True)), 1e-300)
    angle, both = (
        2.0 * np.arccos(np.minimum(1.0, np.abs(np.einsum("ij,ij->i", unit[lag:], unit[:-lag])))) for lag in (1, 2)
    )
    fast = angle > ROTATION_RATE_BOUND * steps
    return np.append(fast[1:] & fast[:-1] & (both < 0.5 * np.minimum(angle[1:], angle[:-1])), False)


def _middle(four: FloatArray) -> FloatArray:
    """Median of four arrays (4, ...): the mean of the two in the middle."""
    return (four.sum(axis=0) - four.max(axis=0) - four.min(axis=0)) / 2.0
