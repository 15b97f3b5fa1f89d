"""Grasps: the body in a hand, and when; as declared, or while its trigger is pressed and something moves along with it.

Contact between a hand and what it holds is the rule, not news: it is counted apart.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cdcore import Motion
from cdcore.numerics import BoolArray, IntArray
from replay.auditing.outcome import Episode
from replay.effects.spans import hysteresis_spans
from replay.prepare.assembly import Assembly
from sessions import Session
from sessions.names import is_hand, side_of

PRESS_THRESHOLD: Final = 0.6
RELEASE_THRESHOLD: Final = 0.4
"""A trigger is pressed above the one and let go below the other, so that a resting finger does not grasp."""

LEAST_GRASP_S: Final = 0.3
LEAST_MOVED_M: Final = 0.020
"""A grasp succeeded when something was held this long and moved this far."""

SNAP_TIME_S: Final = 0.1
"""Time after the press in which a thing snaps into the hand."""

RIGID_GRASP_M: Final = 0.010
"""A held thing keeps its place in the hand to within this: five times the jitter of a tracked controller."""


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
    tagged_names = {body.id for body in session.scene.bodies if "hand" in body.tags}
    name_of_body = dict(enumerate(assembly.names))
    hand_numbers = {k for k, name in name_of_body.items() if name in tagged_names}
    hand_numbers = hand_numbers or {k for k, name in name_of_body.items() if is_hand(name)}
    return {k: side_of(name_of_body[k]) for k in sorted(hand_numbers)}


def grasps(assembly: Assembly, session: Session | None) -> tuple[Grasp, ...] | None:
    """Every press of a trigger and what it took, in order of time; ``None`` when no trigger was recorded."""
    if session is None or not session.hands:
        return None
    motion = assembly.motion
    window = (float(motion.times[0]), float(motion.times[-1]))
    hands = hand_bodies(assembly, session)
    has_moved = np.ptp(motion.translations, axis=0).max(axis=1) > LEAST_MOVED_M
    movable_bodies = [k for k in range(len(assembly.bodies)) if k not in hands and has_moved[k]]
    holding_episodes = []
    for body, side in hands.items():
        for key, track in session.hands.items():
            if side and key.rpartition("/")[2] == side:
                trigger_times = (track.times_ns - assembly.first_ns) / 1e9
                for first, stop in hysteresis_spans(
                    track.trigger.astype(np.float64), PRESS_THRESHOLD, RELEASE_THRESHOLD
                ):
                    start, end = float(trigger_times[first]), float(trigger_times[min(stop, len(trigger_times) - 1)])
                    if start <= window[1] and end >= window[0]:
                        holding_episodes.append(
                            Grasp(body, start, end, _grasped_body(motion, body, movable_bodies, start, end))
                        )
    return tuple(sorted(holding_episodes, key=lambda grasp: (grasp.start, grasp.hand)))


def _grasped_body(motion: Motion, hand: int, movable_bodies: list[int], start: float, end: float) -> int:
    """The body that kept its place in the hand while it moved, nearest first."""
    if end - start <= LEAST_GRASP_S:
        return -1
    first, last = np.searchsorted(motion.times, [start + SNAP_TIME_S, end])
    frame_slice = slice(int(first), int(last))
    position, rotation = motion.translations[frame_slice, hand], motion.rotations[frame_slice, hand]
    nearest_body, nearest_distance = -1, np.inf
    for body in movable_bodies:
        has_pose = motion.valid[frame_slice, hand] & motion.valid[frame_slice, body]
        if has_pose.sum() < 3:
            continue
        positions = motion.translations[frame_slice, body][has_pose]
        local_positions = np.einsum("tji,tj->ti", rotation[has_pose], positions - position[has_pose])
        moved_distance = float(np.linalg.norm(np.ptp(positions, axis=0)))
        if moved_distance > LEAST_MOVED_M and float(np.ptp(local_positions, axis=0).max()) < RIGID_GRASP_M:
            hand_distance = float(np.linalg.norm(local_positions.mean(axis=0)))
            nearest_body, nearest_distance = (
                (body, hand_distance) if hand_distance < nearest_distance else (nearest_body, nearest_distance)
            )
    return nearest_body


def holdings(assembly: Assembly, session: Session | None, contacts: Iterable[Episode] = ()) -> tuple[Episode, ...]:
    """When a pair is a hand and what it holds, or a body and its parent; the contacts that lead to it or from it too.

    ``contacts`` are the oracle's. Stretches of one pair may overlap.
    """
    times, columns = assembly.motion.times, {tuple(pair): k for k, pair in enumerate(assembly.pairs.tolist())}
    holding_segments = [(pair, 0, len(times) - 1) for pair in np.flatnonzero(assembly.grasped).tolist()]
    for grasp in grasps(assembly, session) or ():
        pair = columns.get((min(grasp.hand, grasp.thing), max(grasp.hand, grasp.thing)))
        if pair is not None:
            first, stop = np.searchsorted(times, [grasp.start, grasp.end]).tolist()
            holding_segments += [(pair, first, stop - 1)] if stop > first else []
    holding_segments = [
        (member, a, b) for pair, a, b in holding_segments for member in assembly.columns_of_contact(pair)
    ]
    holding_episodes = tuple(Episode(pair, a, b, float(times[a]), float(times[b])) for pair, a, b in holding_segments)
    linked_contacts = tuple(contacts)
    segments = np.array(
        [(contact.pair, contact.first, contact.last) for contact in linked_contacts], dtype=np.int64
    ).reshape(-1, 3)
    is_contact_grasped = overlaps_holding(holding_episodes, *segments.T)
    grasped_contacts = (
        contact for contact, is_grasped in zip(linked_contacts, is_contact_grasped, strict=True) if is_grasped
    )
    return holding_episodes + tuple(
        replace(contact, pair=member)
        for contact in grasped_contacts
        for member in assembly.columns_of_contact(contact.pair)
    )


def are_grasped(
    assembly: Assembly, holdings: Sequence[Episode], segments: Sequence[tuple[int, int, int]]
) -> list[bool]:
    """Return of each (pair, first frame, last frame) whether a hand holds the body, or a parent carries it."""
    segment_array = np.array(segments, dtype=np.int64).reshape(-1, 3)
    is_grasped: list[bool] = (
        assembly.grasped[segment_array[:, 0]] | overlaps_holding(holdings, *segment_array.T)
    ).tolist()
    return is_grasped


def overlaps_holding(holdings: Sequence[Episode], pairs: IntArray, first: IntArray, last: IntArray) -> BoolArray:
    """Return which of K segments of frames (both ends included) of ``pairs`` share a frame with a holding, (K,)."""
    is_shared = np.zeros(len(pairs), dtype=np.bool_)
    for holding in holdings:
        is_shared |= (pairs == holding.pair) & (first <= holding.last) & (last >= holding.first)
    return is_shared
