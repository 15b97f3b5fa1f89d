"""Hands and what they took: from the trigger's press and from what then moved along."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Motion
from replay.effects.spans import switched
from replay.prepare.assembly import Assembly, PoseOrigin
from sessions import Session

PRESSED: Final = 0.6
RELEASED: Final = 0.4
"""A trigger is pressed above the one and let go below the other, so that a resting finger does not grasp."""

LEAST_HELD_S: Final = 0.3
LEAST_MOVED_M: Final = 0.020
"""A grasp succeeded when something was held this long and moved this far."""

SETTLED_S: Final = 0.1
"""Time after the press in which a thing snaps into the hand."""

RIGID_M: Final = 0.010
"""A held thing keeps its place in the hand to within this: five times the jitter of a tracked controller."""

HAND_WORDS: Final = ("hand", "controller", "wand")


@dataclass(frozen=True)
class Grasp:
    """A press of the trigger."""

    hand: int  # number of the hand's body
    # start, end: seconds
    start: float
    end: float
    thing: int  # number of the body that moved along, or -1: nothing was taken


def hand_bodies(assembly: Assembly, session: Session) -> dict[int, str]:
    """Bodies that are hands -> ``left``, ``right`` or ``""``: tagged ``hand``, or else named like one."""
    tagged = {body.id for body in session.scene.bodies if "hand" in body.tags}
    names = dict(enumerate(assembly.names))
    hands = {k for k, name in names.items() if name in tagged}
    hands = hands or {k for k, name in names.items() if any(word in name.lower() for word in HAND_WORDS)}
    return {k: next((side for side in ("left", "right") if side in names[k].lower()), "") for k in sorted(hands)}


def grasps(assembly: Assembly, session: Session) -> tuple[Grasp, ...] | None:
    """Every press of a trigger and what it took, in order of time; ``None`` when no trigger was recorded."""
    if not session.hands:
        return None
    motion = assembly.motion
    zero = int(assembly.stamp_ns[0]) - round(float(motion.times[0]) * 1e9)
    window = (float(motion.times[0]), float(motion.times[-1]))
    hands = hand_bodies(assembly, session)
    moved = np.ptp(motion.translations, axis=0).max(axis=1) > LEAST_MOVED_M
    movable = [k for k in range(len(assembly.bodies)) if k not in hands and moved[k]]
    found = []
    for body, side in hands.items():
        for key, track in session.hands.items():
            if side and key.rpartition("/")[2] == side:
                times = (track.times_ns - zero) / 1e9
                for first, stop in switched(track.trigger.astype(np.float64), PRESSED, RELEASED):
                    start, end = float(times[first]), float(times[min(stop, len(times) - 1)])
                    if start <= window[1] and end >= window[0]:
                        found.append(Grasp(body, start, end, _taken(motion, body, movable, start, end)))
    return tuple(sorted(found, key=lambda one: (one.start, one.hand)))


def _taken(motion: Motion, hand: int, movable: list[int], start: float, end: float) -> int:
    """The body that kept its place in the hand while it moved, nearest first."""
    if end - start <= LEAST_HELD_S:
        return -1
    first, last = np.searchsorted(motion.times, [start + SETTLED_S, end])
    if last - first < 3:
        return -1
    rows = slice(int(first), int(last))
    place, turn = motion.translations[rows, hand], motion.rotations[rows, hand]
    best, nearest = -1, np.inf
    for body in movable:
        known = motion.valid[rows, hand] & motion.valid[rows, body]
        if known.sum() < 3:
            continue
        there = motion.translations[rows, body][known]
        own = np.einsum("tji,tj->ti", turn[known], there - place[known])
        moved = float(np.linalg.norm(np.ptp(there, axis=0)))
        if moved > LEAST_MOVED_M and float(np.ptp(own, axis=0).max()) < RIGID_M:
            away = float(np.linalg.norm(own.mean(axis=0)))
            best, nearest = (body, away) if away < nearest else (best, nearest)
    return best


STEP_S: Final = 0.1
"""Paths are measured ten times a second: at 90 Hz a tracker's noise of 0.3 mm alone would add 1.6 m to every minute."""

IDLE_M_S: Final = 0.05
"""A hand slower than this rests; tremor and noise stay below it."""

LONGEST_STEP_S: Final = 0.25
"""A step over a longer gap belongs to no path: what happened in it is not known."""


@dataclass(frozen=True)
class Moving:
    """How the hands of a session moved."""

    valid_minutes: float  # time in which every hand has a pose; with no hand, every tracked body
    path_m: float  # way of all hands together, metres
    idle_share: float  # share of the valid time in which every hand rests
    flagged_share: float  # share of the poses of tracked bodies that were not recorded but lost, held or interpolated


def moving(assembly: Assembly, hands: list[int]) -> Moving:
    """Measure the hands, given by body number."""
    motion, origin = assembly.motion, assembly.origin
    tracked = sorted(set(range(len(assembly.bodies))) - fixed_bodies(assembly))
    flagged = float(np.mean(origin[:, tracked] != PoseOrigin.RECORDED)) if tracked else 0.0
    watched = hands or tracked
    rows = frames_at(motion.times, STEP_S, float(motion.times[-1]) + 0.5 * STEP_S)
    seconds = np.diff(motion.times[rows])
    known = np.asarray(motion.valid[rows][:, watched].all(axis=1))
    usable = known[1:] & known[:-1] & (seconds <= LONGEST_STEP_S)
    steps = np.linalg.norm(np.diff(motion.translations[rows][:, watched], axis=0), axis=2)[usable]
    valid = float(seconds[usable].sum())
    resting = (steps < IDLE_M_S * seconds[usable, None]).all(axis=1)
    idle = float(seconds[usable][resting].sum())
    return Moving(valid / 60.0, float(steps.sum()), idle / valid if valid else 0.0, flagged)


def frames_at(times: NDArray[np.float64], step: float, end: float) -> NDArray[np.int64]:
    """The first frame at or after each tick; ticks come every ``step`` seconds from the first frame until ``end``.

    Only ticks next to a frame are made: one stamp in Unix time makes the span half a century, 18 billion ticks.
    """
    first = float(times[0])
    near = np.unique(np.floor((times - first) / step))
    ticks = first + step * np.unique(np.concatenate([near - 1.0, near, near + 1.0]))
    ticks = ticks[(ticks >= first) & (ticks < end)]
    return np.unique(np.minimum(np.searchsorted(times, ticks), len(times) - 1))


def fixed_bodies(assembly: Assembly) -> set[int]:
    """Bodies that the scene declares fixed."""
    return set(np.flatnonzero((assembly.origin == PoseOrigin.FIXED).all(axis=0)).tolist())


def task_seconds(session: Session) -> dict[str, float]:
    """Task -> seconds spent on it, all its spans together, as the recording says."""
    seconds: dict[str, float] = {}
    for span in session.intervals:
        if span.kind == "task":
            seconds[span.name] = seconds.get(span.name, 0.0) + (span.end_ns - span.start_ns) / 1e9
    return seconds
