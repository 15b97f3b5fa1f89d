"""Words about a depth: how far one body is in the other, and whether the noise of a tracker could have made that."""

from math import isnan, sqrt
from typing import Final

from replay import words
from sessions.synthetic.tracker import VIVE

NOISE_SIGMA_M: Final = sqrt(2.0) * VIVE.position_rms_m / sqrt(3.0)
"""Metres: standard deviation of the distance between two bodies with VIVE trackers along any direction, 0.24 mm."""

NOISE_DEPTH_M: Final = 3.0 * NOISE_SIGMA_M
"""Metres of a contact so shallow that noise can make it: three standard deviations, 0.73 mm."""


def tracker_noise_could_make(depth: float) -> bool:
    """Whether a contact is so shallow that the noise of two trackers could have made it; not of 0 or an unknown depth.

    Bodies that meet only between two frames are not in each other at any frame.
    """
    return 0.0 < depth <= NOISE_DEPTH_M


def depth_text(depth: float | None, *, at_least: bool = False) -> str:
    """``2.4 mm deep``, or ``0.4 mm deep, as tracker noise could make``; ``""``: the depth is unknown."""
    if depth is None or isnan(depth):
        return ""
    text = f"{'at least ' if at_least else ''}{words.length(depth)} deep"
    return f"{text}, as tracker noise could make" if not at_least and tracker_noise_could_make(depth) else text
