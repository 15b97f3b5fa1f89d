"""The search over many legs of one pair, each independent of all others."""

from __future__ import annotations

from typing import Final

import numpy as np

from cdcore.kernels.compiling import kernel
from cdcore.narrow.continuous.legs import HALF_TURN_SLACK, LEG_WIDTH, fill_leg, leg_bounds, leg_pad
from cdcore.narrow.continuous.search import HIT, Bounds, Room, first_contact
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.numerics import ByteArray, FloatArray, IntArray

HALF_TURN: Final = 4
"""A body turns by half a turn: which way round, rounding would decide."""
TOO_LARGE: Final = 5
"""Coordinates or rotations beyond the bounds of rounding."""


@kernel
def decide_legs(
    tree_a: BoxTree, body_a: int, tree_b: BoxTree, body_b: int, rotations: FloatArray, places: FloatArray,
    frames: IntArray, steps: FloatArray, settings: FloatArray, effort: int, room: Room, states: ByteArray,
    shares: FloatArray, faces: IntArray,
) -> None:  # fmt: skip
    """Fill ``states`` (K,), ``shares`` (K, 2), ``faces`` (K, 2, leaf order) for legs from ``frames - 1`` to ``frames``.

    ``steps`` (K,) are the seconds they last, ``settings`` the tolerance and the shortest part in seconds. Each leg is
    seen from the body that turns less.
    """
    leg_a, leg_b = np.empty(LEG_WIDTH), np.empty(LEG_WIDTH)
    for k in range(len(frames)):
        t = frames[k]
        fill_leg(rotations[t - 1, body_a], places[t - 1, body_a], rotations[t, body_a], places[t, body_a], leg_a)
        fill_leg(rotations[t - 1, body_b], places[t - 1, body_b], rotations[t, body_b], places[t, body_b], leg_b)
        pad = leg_pad(leg_a, tree_a.reach, leg_b, tree_b.reach)
        shares[k, 0], shares[k, 1] = 0.0, 1.0
        if not np.isfinite(pad):
            states[k] = TOO_LARGE
            continue
        if max(leg_a[27], leg_b[27]) > np.pi - HALF_TURN_SLACK:
            states[k] = HALF_TURN
            continue
        shortest = min(1.0, settings[1] / steps[k])
        if leg_b[27] > leg_a[27]:
            speed, acceleration = leg_bounds(leg_b, tree_b.reach, leg_a)
            bounds = Bounds(speed, acceleration, pad, settings[0], shortest, effort)
            state = first_contact(tree_b, leg_b, tree_a, leg_a, bounds, room)
            first, second = int(room.found[3]), int(room.found[2])
        else:
            speed, acceleration = leg_bounds(leg_a, tree_a.reach, leg_b)
            bounds = Bounds(speed, acceleration, pad, settings[0], shortest, effort)
            state = first_contact(tree_a, leg_a, tree_b, leg_b, bounds, room)
            first, second = int(room.found[2]), int(room.found[3])
        states[k] = state
        if state == HIT:
            faces[k, 0], faces[k, 1] = first, second
        if state != 0:
            shares[k, 0], shares[k, 1] = room.found[0], room.found[1]
