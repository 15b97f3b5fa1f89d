"""Decides what happens between frames: a segment is clear by proof, has a time of impact, or a reason why neither."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.narrow.bvh.box_tree import BoxTree
from cdcore.narrow.continuous.interval_search import (
    BOX_TESTS,
    FACE_TESTS,
    FREE,
    HIT,
    INTERVALS,
    MEETING_TESTS,
    TOO_CLOSE,
    TOO_LONG,
    make_room,
    search_legs,
)
from cdcore.narrow.continuous.motion_segments import ANGLE, STRAIGHT_ANGLE_SLACK, leg_bounds, leg_pads, legs_of
from cdcore.narrow.pair_frames import rows_of_columns
from cdcore.numerics import ByteArray, FloatArray, IntArray

DEFAULT_TOLERANCE: Final = 1e-4
"""Metres. A tracker's noise from frame to frame is 0.14 mm; what comes no closer than this is always decided."""

DEFAULT_EFFORT: Final = 50_000
"""Tests spent on one leg below the tolerance, some 20 ms: a sliding graze within micrometres needs a few thousand."""

SHORTEST: Final = 2.5e-7
"""Seconds. A hit lies at most this far from what is proven clear: a quarter of the microsecond that is promised. Where
rounding, kilometres from the origin, hides the last micrometre of a slow approach, it lies further, and says so."""

FRACTION_SLACK: Final = 2.0**-51
"""Added to the share of a leg at which a contact was seen: poses and the reference vertices are rounded there."""

STRAIGHT_ANGLE: Final = 4
"""A body turns by half a turn: only rounding would decide in which direction."""
TOO_LARGE: Final = 5
"""Coordinates or rotations beyond the bounds of rounding."""

REASONS: Final = {
    TOO_CLOSE: "closer than parts of {shortest:.3g} s can tell apart",
    TOO_LONG: "within the tolerance of {tolerance:g} m, effort of {effort} tests spent",
    STRAIGHT_ANGLE: "half a turn between two frames: which way round is not known",
    TOO_LARGE: "coordinates too large, or a rotation too far off, for the bounds of rounding",
}
"""Why a leg is neither clear nor a contact; part of what a detection says beside UNRESOLVED."""

COUNTERS: Final = {"box_tests": BOX_TESTS, "face_tests": FACE_TESTS, "meeting_tests": MEETING_TESTS, "parts": INTERVALS}


@dataclass(frozen=True, eq=False)
class SegmentAnswer:
    """Answers for K legs.

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
        self, times: FloatArray, rotations: FloatArray, translations: FloatArray, frames: IntArray, columns: IntArray
    ) -> SegmentAnswer:
        """Answer for K legs from ``frames - 1`` to ``frames``; contact at their very start is the caller's to know."""
        states = np.full(len(frames), FREE, dtype=np.uint8)
        fractions, faces = np.tile([0.0, 1.0], (len(frames), 1)), np.full((len(frames), 2), -1, dtype=np.int64)
        work = dict.fromkeys(COUNTERS, 0)
        start, steps = times[frames - 1], times[frames] - times[frames - 1]
        for column, rows in rows_of_columns(columns):
            bodies = self._pairs[column]
            trees = [self._trees[body] for body in bodies]
            legs = [legs_of(rotations[:, body], translations[:, body], frames[rows]) for body in bodies]
            angles = np.stack([leg[ANGLE] for leg in legs])
            pads = leg_pads(legs[0], trees[0].reach, legs[1], trees[1].reach)
            states[rows[angles.max(axis=0) > np.pi - STRAIGHT_ANGLE_SLACK]] = STRAIGHT_ANGLE
            states[rows[np.isinf(pads)]] = TOO_LARGE
            # Each leg is seen from the body that turns less.
            a_moves, searched, room = angles[0] >= angles[1], states[rows] == FREE, make_room(*trees)
            for a, b, chosen in ((0, 1, searched & a_moves), (1, 0, searched & ~a_moves)):
                if not chosen.any():
                    continue
                chosen_rows, legs_a, legs_b = rows[chosen], legs[a][:, chosen], legs[b][:, chosen]
                shortest = np.minimum(1.0, SHORTEST / steps[chosen_rows])
                bounds = np.column_stack([*leg_bounds(legs_a, trees[a].reach, legs_b), pads[chosen], shortest])
                answers, impacts = states[chosen_rows], np.tile([0.0, 1.0, 0.0, 0.0], (len(chosen_rows), 1))
                rows_a, rows_b = np.ascontiguousarray(legs_a.T), np.ascontiguousarray(legs_b.T)
                row = room.search_row(trees[a], trees[b])
                search_legs(row, rows_a, rows_b, bounds, self._tolerance, self._effort, answers, impacts)
                states[chosen_rows], fractions[chosen_rows], hit = answers, impacts[:, :2], answers == HIT
                for side, meeting in ((a, impacts[hit, 2]), (b, impacts[hit, 3])):
                    faces[chosen_rows[hit], side] = trees[side].faces[meeting.astype(np.int64)]
            for name, which in COUNTERS.items():
                work[name] += int(room.work[which])
        return SegmentAnswer(states, _seconds(start, steps, times[frames], fractions), faces, work)

    def reason(self, state: int) -> str:
        """The sentence behind a state that is neither FREE nor HIT."""
        return REASONS[state].format(tolerance=self._tolerance, effort=self._effort, shortest=SHORTEST)


def _seconds(start: FloatArray, steps: FloatArray, stop: FloatArray, fractions: FloatArray) -> FloatArray:
    """Shares of legs as seconds, rounded outwards, (K, 2)."""
    # Relative to the frame, and rounded once: in Unix time a double steps by a quarter of a microsecond.
    before, after = (
        fractions[:, 0] * steps * (1 - FRACTION_SLACK),
        (fractions[:, 1] + FRACTION_SLACK) * steps * (1 + FRACTION_SLACK),
    )
    lower, upper = start + before, start + after
    lower = np.where(lower - start > before, np.nextafter(lower, -np.inf), lower)
    upper = np.where(upper - start < after, np.nextafter(upper, np.inf), upper)
    lower = np.where(fractions[:, 0] == 0.0, start, np.maximum(start, lower))
    return np.stack([lower, np.where(fractions[:, 1] == 1.0, stop, np.minimum(stop, upper))], axis=1)
