"""Decides what happens between frames: a segment is clear by proof, has a time of impact, or a reason why neither."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.kernels.compiling import kernel
from cdcore.narrow.continuous.motion_segments import (
    HALF_TURN_SLACK,
    LEG_WIDTH,
    fill_segment,
    segment_bounds,
    segment_pad,
)
from cdcore.narrow.continuous.search import (
    BOX_TESTS,
    FACE_TESTS,
    FREE,
    HIT,
    MEETING_TESTS,
    PARTS,
    TOO_CLOSE,
    TOO_LONG,
    Bounds,
    Room,
    first_contact,
    make_room,
)
from cdcore.narrow.pair_frames import rows_of_columns
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.numerics import ByteArray, FloatArray, IntArray

DEFAULT_TOLERANCE: Final = 1e-4
"""Metres. A tracker's noise from frame to frame is 0.14 mm; what comes no closer than this is always decided."""

DEFAULT_EFFORT: Final = 50_000
"""Tests spent on one leg below the tolerance, some 20 ms: a sliding graze within micrometres needs a few thousand."""

SHORTEST: Final = 2.5e-7
"""Seconds. A hit lies at most this far from what is proven clear: a quarter of the microsecond that is promised. Where
rounding, kilometres from the origin, hides the last micrometre of a slow approach, it lies further, and says so."""

SHARE_SLACK: Final = 2.0**-51
"""Added to the share of a leg at which a contact was seen: poses and the reference vertices are rounded there."""

HALF_TURN: Final = 4
"""A body turns by half a turn: only rounding would decide in which direction."""
TOO_LARGE: Final = 5
"""Coordinates or rotations beyond the bounds of rounding."""

REASONS: Final = {
    TOO_CLOSE: "closer than parts of {shortest:.3g} s can tell apart",
    TOO_LONG: "within the tolerance of {tolerance:g} m, effort of {effort} tests spent",
    HALF_TURN: "half a turn between two frames: which way round is not known",
    TOO_LARGE: "coordinates too large, or a rotation too far off, for the bounds of rounding",
}
"""Why a leg is neither clear nor a contact; part of what a detection says beside UNRESOLVED."""

COUNTERS: Final = {"box_tests": BOX_TESTS, "face_tests": FACE_TESTS, "meeting_tests": MEETING_TESTS, "parts": PARTS}


@dataclass(frozen=True, eq=False)
class SegmentAnswer:
    """What was found on K legs.

    ``states`` (K,): FREE, HIT, or a key of ``REASONS``. ``impact`` (K, 2) seconds: before the first nothing touches, at
    the second a contact was seen; else what is undecided. ``faces`` (K, 2): meet where HIT, in the pair's order.
    """

    states: ByteArray
    impact: FloatArray
    faces: IntArray
    work: dict[str, int]


class SegmentStage:
    """Searches legs for their first contact.

    Parts of a leg in which something moves further than ``tolerance``, metres, are always divided further; ``effort``
    bounds the tests per leg spent on the others. A pair and its turned form give one answer if the caller orders them.
    """

    def __init__(self, trees: Sequence[BoxTree], pairs: IntArray, *, tolerance: float, effort: int) -> None:
        self._trees = trees
        self._pairs = pairs.tolist()
        self._tolerance, self._effort = tolerance, effort

    def decide(
        self, times: FloatArray, rotations: FloatArray, places: FloatArray, frames: IntArray, columns: IntArray
    ) -> SegmentAnswer:
        """Answer for K legs from ``frames - 1`` to ``frames``; contact at their very start is the caller's to know."""
        count = len(frames)
        states, shares = np.zeros(count, dtype=np.uint8), np.zeros((count, 2))
        faces = np.full((count, 2), -1, dtype=np.int64)
        work = dict.fromkeys(COUNTERS, 0)
        start, steps = times[frames - 1], times[frames] - times[frames - 1]
        settings = np.array([self._tolerance, SHORTEST])
        for column, rows in rows_of_columns(columns):
            a, b = self._pairs[column]
            room = make_room(self._trees[a], self._trees[b])
            found = np.zeros(len(rows), dtype=np.uint8), np.zeros((len(rows), 2)), faces[rows]
            decide_segments(
                self._trees[a], a, self._trees[b], b, rotations, places, frames[rows], steps[rows], settings,
                self._effort, room, *found,
            )  # fmt: skip
            states[rows], shares[rows] = found[:2]
            hit = rows[found[0] == HIT]
            for side, body in enumerate((a, b)):
                faces[hit, side] = self._trees[body].faces[found[2][found[0] == HIT, side]]
            for name, which in COUNTERS.items():
                work[name] += int(room.work[which])
        return SegmentAnswer(states, _seconds(start, steps, times[frames], shares), faces, work)

    def reason(self, state: int) -> str:
        """The sentence behind a state that is neither FREE nor HIT."""
        return REASONS[state].format(tolerance=self._tolerance, effort=self._effort, shortest=SHORTEST)


def _seconds(start: FloatArray, steps: FloatArray, stop: FloatArray, shares: FloatArray) -> FloatArray:
    """Shares of legs as seconds, rounded outwards, (K, 2)."""
    # Relative to the frame, and rounded once: in Unix time a double steps by a quarter of a microsecond.
    before, after = shares[:, 0] * steps * (1 - SHARE_SLACK), (shares[:, 1] + SHARE_SLACK) * steps * (1 + SHARE_SLACK)
    low, high = start + before, start + after
    low = np.where(low - start > before, np.nextafter(low, -np.inf), low)
    high = np.where(high - start < after, np.nextafter(high, np.inf), high)
    low = np.where(shares[:, 0] == 0.0, start, np.maximum(start, low))
    return np.stack([low, np.where(shares[:, 1] == 1.0, stop, np.minimum(stop, high))], axis=1)


@kernel
def decide_segments(
    tree_a: BoxTree, body_a: int, tree_b: BoxTree, body_b: int, rotations: FloatArray, places: FloatArray,
    frames: IntArray, steps: FloatArray, settings: FloatArray, effort: int, room: Room, states: ByteArray,
    shares: FloatArray, faces: IntArray,
) -> None:  # fmt: skip
    """Fill ``states`` (K,), ``shares`` (K, 2), ``faces`` (K, 2, leaf order) for legs from ``frames - 1`` to ``frames``.

    ``steps`` (K,) are the seconds they last, ``settings`` the tolerance and the shortest part in seconds. Each leg is
    seen from the body that turns less.
    """
    segment_a, segment_b = np.empty(LEG_WIDTH), np.empty(LEG_WIDTH)
    for k in range(len(frames)):
        t = frames[k]
        fill_segment(
            rotations[t - 1, body_a], places[t - 1, body_a], rotations[t, body_a], places[t, body_a], segment_a
        )
        fill_segment(
            rotations[t - 1, body_b], places[t - 1, body_b], rotations[t, body_b], places[t, body_b], segment_b
        )
        pad = segment_pad(segment_a, tree_a.reach, segment_b, tree_b.reach)
        shares[k, 0], shares[k, 1] = 0.0, 1.0
        if not np.isfinite(pad):
            states[k] = TOO_LARGE
            continue
        if max(segment_a[27], segment_b[27]) > np.pi - HALF_TURN_SLACK:
            states[k] = HALF_TURN
            continue
        shortest = min(1.0, settings[1] / steps[k])
        turned = segment_b[27] > segment_a[27]
        if turned:
            speed, acceleration = segment_bounds(segment_b, tree_b.reach, segment_a)
            bounds = Bounds(speed, acceleration, pad, settings[0], shortest, effort)
            state = first_contact(tree_b, segment_b, tree_a, segment_a, bounds, room)
        else:
            speed, acceleration = segment_bounds(segment_a, tree_a.reach, segment_b)
            bounds = Bounds(speed, acceleration, pad, settings[0], shortest, effort)
            state = first_contact(tree_a, segment_a, tree_b, segment_b, bounds, room)
        states[k] = state
        if state == HIT:
            faces[k, 0], faces[k, 1] = int(room.found[3 if turned else 2]), int(room.found[2 if turned else 3])
        if state != FREE:
            shares[k, 0], shares[k, 1] = room.found[0], room.found[1]
