"""A grasp is a pressed trigger and a thing that rides on the hand: held a while and moved, or it failed."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray, FloatArray
from replay.effects.contact import touches_of
from replay.effects.declaring import Declaration
from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, LaneSpan
from replay.effects.protocol import spec_of
from replay.effects.spans import FrameRange, hysteresis_spans, spans_of
from sessions.model.session import HandTrack

CATCH_S: Final = 0.3
"""A thing may take this long after the press to snap to the hand."""

ROUNDING_S: Final = 1e-9
"""Stamps this close to the end of a window are in it."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``grasp`` (with their end), ``release`` and ``failed``; a lane per hand with the name of what it holds."""
    findings = Findings(len(inputs))
    for hand, things in _things_by_hand(inputs).items():
        track = inputs.hand_of(hand)
        if track is None:
            inputs.count(f"no buttons recorded: {hand}")
            continue
        for press in press_spans(inputs, track, next(iter(things.values()))):
            findings.ran[slice(*press)] = True
            findings.events += _grasp_events(inputs, hand, things, press, findings)
    return findings.output()


def _things_by_hand(inputs: EffectInputs) -> dict[str, dict[str, Declaration]]:
    """Hand -> what it may take, each with the table of its limits; the first sets the levels of the trigger."""
    reach: dict[str, dict[str, Declaration]] = {}
    for declared in inputs.declared:
        for hand, thing in declared["between"]:
            reach.setdefault(hand, {}).setdefault(thing, declared)
    return reach


def press_spans(inputs: EffectInputs, track: HandTrack, limits: Declaration) -> list[FrameRange]:
    """Frames in which trigger or grip is pressed, with hysteresis on the hand's own samples."""
    presses, stamps = [], inputs.assembly.stamp_ns
    for first, stop in hysteresis_spans(np.maximum(track.trigger, track.grip), limits["press"], limits["release"]):
        begin = int(np.searchsorted(stamps, track.times_ns[first]))
        end = len(inputs) if stop >= len(track) else int(np.searchsorted(stamps, track.times_ns[stop]))
        if end > begin:
            presses.append((begin, end))
    return presses


def _grasp_events(
    inputs: EffectInputs, hand: str, things: Mapping[str, Declaration], press: FrameRange, findings: Findings
) -> list[EffectEvent]:
    (start, last), end = inputs.span_times(press), inputs.end(press[1])
    touched_things = [
        thing
        for thing in things
        if any(touch.first < press[1] and touch.stop > press[0] for touch in touches_of(inputs, (hand, thing)))
    ]
    holds = {
        thing: hold for thing, limits in things.items() if (hold := _longest_hold(inputs, hand, thing, press, limits))
    }
    if holds:
        name, (moved, seconds) = max(holds.items(), key=lambda hold: hold[1])
        findings.add_lane(hand, LaneSpan(start, last, name))
        values = {"held_s": seconds, "moved_m": moved, "touching": name in touched_things}
        grasp = EffectEvent(start, "grasp", (hand, name), end, values, f"{hand} takes {name}")
        release = EffectEvent(last, "release", (hand, name), message=f"{hand} lets go of {name}")
        return [grasp] if end is None else [grasp, release]
    return [
        EffectEvent(start, "failed", (hand, thing), None, {}, f"{hand} fails to take {thing}", "warning")
        for thing in touched_things
    ]


def _longest_hold(
    inputs: EffectInputs, hand: str, thing: str, press: FrameRange, limits: Declaration
) -> tuple[float, float] | None:
    """Metres and seconds of the longest stretch in which the thing rides on the hand, if it began soon after the press.

    ``None`` too where that was not long enough, or not far enough, for a grasp.
    """
    frames = slice(*press)
    hand_poses, thing_poses = (inputs.poses(name).take(frames) for name in (hand, thing))
    is_riding_along = is_riding(thing_poses.relative_to(hand_poses), limits)
    times = inputs.times[frames]
    # Frames without a pose do not end a stretch of riding.
    rides_together = spans_of(is_riding_along | ~(hand_poses.valid & thing_poses.valid))
    spans = [span for span in rides_together if times[span[0]] - times[0] <= CATCH_S]
    if not spans:
        return None
    first, stop = max(spans, key=lambda span: span[1] - span[0])
    has_pose = thing_poses.valid[first:stop]
    points = thing_poses.translation[first:stop][has_pose]
    if not len(points):
        return None
    displacements = points - points[0]
    seconds, moved = float(times[stop - 1] - times[first]), float(np.linalg.norm(displacements, axis=1).max())
    return (moved, seconds) if seconds > limits["held_s"] and moved > limits["moved_m"] else None


def is_riding(relative: BodyPoses, limits: Declaration) -> BoolArray:
    """(T,) whether the pose relative to the hand stays within its bounds over the window that begins there.

    Compared are means over a window, not single poses: the largest of many noisy differences grows with the number of
    samples, so that a tracker's noise would end more grasps at 250 Hz than at 30 Hz.
    """
    window = limits["window_s"]
    times, valid = relative.times, relative.valid
    means, has_pose = _window_means(relative, window)
    stops = np.searchsorted(times, times + window, side="right")
    is_steady = valid.copy()
    farthest = limits["spread_m"] ** 2
    # Rotations of length sqrt(3) that differ by an angle: |A - B|^2 = 6 - 2 trace(A^T B) = 4 - 4 cos.
    widest = 4.0 - 4.0 * np.cos(limits["spread_rad"])
    for step in range(1, int((stops - np.arange(len(times))).max(initial=0))):
        early, late = slice(None, -step), slice(step, None)
        is_in_window = (times[late] - times[early] <= window) & has_pose[early] & has_pose[late]
        change = means[:, late] - means[:, early]
        change *= change
        is_too_far = (change[:3].sum(axis=0) > farthest) | (change[3:].sum(axis=0) > widest)
        is_steady[early] &= ~(is_in_window & is_too_far)
    return is_steady


def _window_means(relative: BodyPoses, window: float) -> tuple[FloatArray, BoolArray]:
    """Mean translation and rotation (12, T) over the window about each frame, and whether it has a pose.

    At the ends the window is shortened evenly on both sides, so that a steady motion keeps its mean.
    """
    times, valid = relative.times, relative.valid
    half = np.minimum(window / 2.0, np.minimum(times - times[0], times[-1] - times))
    starts = np.searchsorted(times, times - half - ROUNDING_S, side="left")
    stops = np.searchsorted(times, times + half + ROUNDING_S, side="right")
    poses = np.concatenate([relative.translation, relative.rotation.reshape(-1, 9)], axis=1)
    sums = np.concatenate([np.zeros((1, 12)), np.cumsum(np.where(valid[:, None], poses, 0.0), axis=0)])
    counts = np.concatenate([[0], np.cumsum(valid)])
    number = counts[stops] - counts[starts]
    means = np.ascontiguousarray(((sums[stops] - sums[starts]) / np.maximum(number, 1)[:, None]).T)
    # A mean of nearly equal rotations is a shorter rotation; brought to its length it compares as one.
    length = np.sqrt((means[3:] ** 2).sum(axis=0) / 3.0)
    means[3:] /= np.where(length > 0.0, length, 1.0)
    return means, number > 0


SPEC = spec_of("grasp", compute)
