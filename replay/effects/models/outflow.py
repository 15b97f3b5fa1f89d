"""How liquid leaves, falls and arrives: through a stopcock, over a rim, as a parabola, in streams between vessels."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray

GRAVITY_M_S2: Final = 9.80665
"""m/s2. Source: standard gravity, 3rd CGPM 1901."""


def entry_times(
    start: FloatArray, velocity: FloatArray, centre: FloatArray, normal: FloatArray, radius: float
) -> FloatArray:
    """Seconds (n,) until liquid let go at ``start`` with ``velocity`` (n, 3) enters an opening; infinite: it does not.

    World Y is up; ``normal`` is the unit direction out of the vessel. An opening that faces down or sideways is not
    entered, nor one that the liquid starts below.
    """
    opens_upward = normal[:, 1] > 0.0
    heights_above = ((start - centre) * normal).sum(axis=1)
    entry_time = _fall_times(
        heights_above, -(velocity * normal).sum(axis=1), 0.5 * GRAVITY_M_S2 * np.where(opens_upward, normal[:, 1], 1.0)
    )
    offset_from_centre = points(start, velocity, np.where(np.isfinite(entry_time), entry_time, 0.0)) - centre
    offset_from_centre -= (offset_from_centre * normal).sum(axis=1)[:, None] * normal
    is_in_opening = (offset_from_centre * offset_from_centre).sum(axis=1) <= radius**2
    return np.where(opens_upward & is_in_opening, entry_time, np.inf)


def points_at_height(start: FloatArray, velocity: FloatArray, height: FloatArray) -> FloatArray:
    """Points (n, 3) at which it falls through a height (n,); ``start`` where it never gets so high."""
    fall_time = _fall_times(start[:, 1] - height, -velocity[:, 1], np.full(len(start), 0.5 * GRAVITY_M_S2))
    return points(start, velocity, np.where(np.isfinite(fall_time), fall_time, 0.0))


def points(start: FloatArray, velocity: FloatArray, seconds: FloatArray) -> FloatArray:
    """Points (n, 3) of falling liquid after some seconds (n,)."""
    points_at_time = start + seconds[:, None] * velocity
    points_at_time[:, 1] -= 0.5 * GRAVITY_M_S2 * seconds * seconds
    return points_at_time


def _fall_times(height_above: FloatArray, speed: FloatArray, pull: FloatArray) -> FloatArray:
    """Times (n,) at which ``above = speed t + pull t^2``, the last ones; infinite: never. ``pull`` is above 0."""
    root = speed * speed + 4.0 * pull * height_above
    is_never = (height_above < 0.0) & ((speed >= 0.0) | (root < 0.0))
    root = np.sqrt(np.maximum(0.0, root))
    # Of the two forms of the root the one that adds, so that a fast start or a small height costs no digits.
    later_root = np.where(speed + root > 0.0, 2.0 * height_above / np.where(speed + root > 0.0, speed + root, 1.0), 0.0)
    return np.where(is_never, np.inf, np.where(speed >= 0.0, later_root, (root - speed) / (2.0 * pull)))


JET_CONTRACTION: Final = math.pi / (math.pi + 2.0)
"""Of a free jet that leaves a sharp edge (Kirchhoff); without unit."""


def twist_angle(rotation: FloatArray, axis: FloatArray) -> FloatArray:
    """Angle (T,) in radians, -pi to pi, by which rotations (T, 3, 3) about the unit ``axis`` (3,) turn."""
    vee = np.stack(
        [
            rotation[:, 2, 1] - rotation[:, 1, 2],
            rotation[:, 0, 2] - rotation[:, 2, 0],
            rotation[:, 1, 0] - rotation[:, 0, 1],
        ],
        axis=1,
    )
    return np.arctan2(vee @ axis, np.trace(rotation, axis1=1, axis2=2) - 1.0)


def volume_run_out(
    times: FloatArray, area: FloatArray, *, discharge: float, section: float, head: float, available: float
) -> FloatArray:
    """Volume (n,) in m3 that has run out by each time; it never falls and never exceeds what is there.

    Torricelli: dV/dt = c A sqrt(2 g h) with dV = -S dh, so sqrt(h) falls by sqrt(g / 2) c / S times the integral of A.

    ``times``: (n,) seconds, not decreasing.
    ``area``: (n,) open area, m2, linear between the times.
    ``discharge``: c, without unit.
    ``section``, ``head``: S of the column, m2, and the level above the outlet at the first time, metres.
    ``available``: what may run out, m3.
    """
    area_seconds = np.concatenate([[0.0], np.cumsum(0.5 * (area[1:] + area[:-1]) * np.diff(times))])
    root_head = float(np.sqrt(max(0.0, head)))
    root_fall = np.minimum(np.sqrt(0.5 * GRAVITY_M_S2) * discharge / section * area_seconds, root_head)
    # S (h0 - (sqrt(h0) - fall)^2) without the difference of two nearly equal numbers.
    return np.minimum(section * root_fall * (2.0 * root_head - root_fall), max(0.0, available))


def weir_flow(head: FloatArray, width: float) -> FloatArray:
    """Flow (n,) in m3/s over a sharp edge ``width`` metres wide under a ``head`` (n,) in metres.

    Source: Poleni's (2/3) c b sqrt(2 g) h^1.5, with the contraction of a free jet for c.
    """
    return 2.0 / 3.0 * JET_CONTRACTION * width * np.sqrt(2.0 * GRAVITY_M_S2) * head**1.5


def run_out(
    times: FloatArray,
    area: FloatArray,
    inflow: FloatArray,
    *,
    discharge: float,
    section: float,
    foot: float,
    volume: float,
) -> FloatArray:
    """Volume (T,) in m3 that runs out in the step up to each frame, with ``inflow`` (T,) m3 that come in at each.

    ``foot``: height of the column's foot over the outlet, metres; ``volume``: what it holds at first, m3.
    In closed form from one refill to the next.
    """
    run_out_volume = np.zeros(len(times))
    inflow_frames = [0, *(np.flatnonzero(inflow[1:] > 0.0) + 1).tolist(), len(times) - 1]
    for first, last in pairwise(inflow_frames):
        segment = slice(first, last + 1)
        volume += float(inflow[first])
        segment_volume = volume_run_out(
            times[segment],
            area[segment],
            discharge=discharge,
            section=section,
            head=foot + volume / section,
            available=volume,
        )
        run_out_volume[first + 1 : last + 1] = np.diff(segment_volume)
        volume -= float(segment_volume[-1])
    return run_out_volume


LONGEST_PAUSE_S: Final = 0.7
"""A flow that stops for less is the same flow: a glass held at its greatest tilt goes on dribbling with the tremor of
the hand. With 0.5 s one pour of twelve came out as two."""


@dataclass(frozen=True, eq=False)
class Stream:
    """A flow from one vessel to one target, a row in each frame in which liquid left.

    ``source``, ``target``: vessels; target ``""``: it was spilled.
    ``over``: it ran over the brim.
    ``times``, ``frames``, ``volume_ml``: (n,), volumes above 0.
    ``points``: (n, 3) world metres, where it left the source, or where it landed if it was spilled.
    """

    source: str
    target: str
    over: bool
    times: FloatArray
    frames: IntArray
    volume_ml: FloatArray
    points: FloatArray

    @property
    def total_ml(self) -> float:
        """All of it."""
        return float(self.volume_ml.sum())

    def select(self, rows: IntArray | slice) -> "Stream":
        """Some rows of it."""
        return Stream(
            self.source,
            self.target,
            self.over,
            self.times[rows],
            self.frames[rows],
            self.volume_ml[rows],
            self.points[rows],
        )


def flows(streams: Sequence[Stream], least_ml: float) -> list[Stream]:
    """Streams parted at stops of more than `LONGEST_PAUSE_S`, in order of time; less than ``least_ml`` is no flow."""
    pieces = []
    for stream in streams:
        pause_rows = [0, *(np.flatnonzero(np.diff(stream.times) > LONGEST_PAUSE_S) + 1).tolist(), len(stream.times)]
        pieces += [stream.select(slice(first, stop)) for first, stop in pairwise(pause_rows) if stop > first]
    sufficient_streams = [stream for stream in pieces if stream.total_ml >= least_ml]
    return sorted(sufficient_streams, key=lambda flow: (flow.frames[0], flow.source, flow.target))
