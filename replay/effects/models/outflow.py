"""How fast liquid leaves: out of a burette by Torricelli's law, refilled or not; over a rim as over a weir."""

import math
from itertools import pairwise
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.effects.models.ballistic import GRAVITY

CONTRACTION: Final = math.pi / (math.pi + 2.0)
"""Of a free jet that leaves a sharp edge (Kirchhoff); without unit."""


def twist(rotation: FloatArray, axis: FloatArray) -> FloatArray:
    """Angle (T,) in radians, -pi to pi, by which rotations (T, 3, 3) about the unit ``axis`` (3,) turn."""
    vee = np.stack(
        [rotation[:, 2, 1] - rotation[:, 1, 2], rotation[:, 0, 2] - rotation[:, 2, 0],
         rotation[:, 1, 0] - rotation[:, 0, 1]], axis=1,
    )  # fmt: skip
    return np.asarray(np.arctan2(vee @ axis, np.trace(rotation, axis1=1, axis2=2) - 1.0))


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
    if not len(times):
        return np.zeros(0)
    opened = np.concatenate([[0.0], np.cumsum(0.5 * (area[1:] + area[:-1]) * np.diff(times))])
    top = float(np.sqrt(max(0.0, head)))
    fall = np.minimum(np.sqrt(0.5 * GRAVITY) * discharge / section * opened, top)
    # S (h0 - (sqrt(h0) - fall)^2) without the difference of two nearly equal numbers.
    return np.asarray(np.minimum(section * fall * (2.0 * top - fall), max(0.0, available)))


def over_weir(head: FloatArray, width: float) -> FloatArray:
    """Flow (n,) in m3/s over a sharp edge ``width`` metres wide under a ``head`` (n,) in metres.

    Source: Poleni's (2/3) c b sqrt(2 g) h^1.5, with the contraction of a free jet for c.
    """
    return np.asarray(2.0 / 3.0 * CONTRACTION * width * np.sqrt(2.0 * GRAVITY) * head**1.5)


def run_out(
    times: FloatArray, area: FloatArray, coming: FloatArray, *, discharge: float, section: float, foot: float,
    volume: float,
) -> FloatArray:  # fmt: skip
    """Volume (T,) in m3 that runs out in the step up to each frame, with ``coming`` (T,) m3 that come in at each.

    ``foot``: height of the column's foot over the outlet, metres; ``volume``: what it holds at first, m3.
    In closed form from one refill to the next.
    """
    gone = np.zeros(len(times))
    cuts = [0, *(np.flatnonzero(coming[1:] > 0.0) + 1).tolist(), len(times) - 1]
    for first, last in pairwise(cuts):
        part = slice(first, last + 1)
        volume += float(coming[first])
        if last > first and area[part].any():
            out = volume_run_out(
                times[part], area[part], discharge=discharge, section=section, head=foot + volume / section,
                available=volume,
            )  # fmt: skip
            gone[first + 1 : last + 1] = np.diff(out)
            volume -= float(out[-1])
    return gone
