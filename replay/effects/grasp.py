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

SNAP_TIME_S: Final = 0.3
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
    limits_of_thing: dict[str, dict[str, Declaration]] = {}
    for declared in inputs.declared:
        for hand, thing in declared["between"]:
            limits_of_thing.setdefault(hand, {}).setdefault(thing, declared)
    return limits_of_thing


def press_spans(inputs: EffectInputs, track: HandTrack, limits: Declaration) -> list[FrameRange]:
    """Frames in which trigger or grip is pressed, with hysteresis on the hand's own samples."""
    presses, stamps = [], inputs.assembly.stamp_ns
    for first, stop in hysteresis_spans(np.maximum(track.trigger, track.grip), limits["press"], limits["release"]):
        first_frame = int(np.searchsorted(stamps, track.times_ns[first]))
        end = len(inputs) if stop >= len(track) else int(np.searchsorted(stamps, track.times_ns[stop]))
        if end > first_frame:
            presses.append((first_frame, end))
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
    hold_of_thing = {
        thing: hold for thing, limits in things.items() if (hold := _longest_hold(inputs, hand, thing, press, limits))
    }
    if hold_of_thing:
        name, (moved, seconds) = max(hold_of_thing.items(), key=lambda hold: hold[1])
        findings.add_lane(hand, LaneSpan(start, last, name))
        event_values = {"held_s": seconds, "moved_m": moved, "touching": name in touched_things}
        grasp_event = EffectEvent(start, "grasp", (hand, name), end, event_values, f"{hand} takes {name}")
        release_event = EffectEvent(last, "release", (hand, name), message=f"{hand} lets go of {name}")
        return [grasp_event] if end is None else [grasp_event, release_event]
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
    press_times = inputs.times[frames]
    # Frames without a pose do not end a stretch of riding.
    rides_together = spans_of(is_riding_along | ~(hand_poses.valid & thing_poses.valid))
    riding_spans = [span for span in rides_together if press_times[span[0]] - press_times[0] <= SNAP_TIME_S]
    if not riding_spans:
        return None
    first, stop = max(riding_spans, key=lambda span: span[1] - span[0])
    has_pose = thing_poses.valid[first:stop]
    points = thing_poses.translation[first:stop][has_pose]
    if not len(points):
        return None
    hand_displacements = points - points[0]
    seconds, moved = (
        float(press_times[stop - 1] - press_times[first]),
        float(np.linalg.norm(hand_displacements, axis=1).max()),
    )
    return (moved, seconds) if seconds > limits["held_s"] and moved > limits["moved_m"] else None


def is_riding(relative: BodyPoses, limits: Declaration) -> BoolArray:
    """(T,) whether the pose relative to the hand stays within its bounds over the window that begins there.

    Compared are means over a window, not single poses: the largest of many noisy differences grows with the number of
    samples, so that a tracker's noise would end more grasps at 250 Hz than at 30 Hz.
    """
    times, valid = relative.times, relative.valid
    means, has_pose = _window_means(relative, limits["window_s"])
    window = limits["window_s"] + ROUNDING_S
    window_stops = np.searchsorted(times, times + window, side="right")
    is_steady = valid.copy()
    most_spread_squared = limits["spread_m"] ** 2
    # Rotations of length sqrt(3) that differ by an angle: |A - B|^2 = 6 - 2 trace(A^T B) = 4 - 4 cos.
    most_rotation_spread = 4.0 - 4.0 * np.cos(limits["spread_rad"])
    for step in range(1, int((window_stops - np.arange(len(times))).max(initial=0))):
        earlier_frames, later_frames = slice(None, -step), slice(step, None)
        is_in_window = (
            (times[later_frames] - times[earlier_frames] <= window) & has_pose[earlier_frames] & has_pose[later_frames]
        )
        mean_change = means[:, later_frames] - means[:, earlier_frames]
        mean_change *= mean_change
        is_too_far = (mean_change[:3].sum(axis=0) > most_spread_squared) | (
            mean_change[3:].sum(axis=0) > most_rotation_spread
        )
        is_steady[earlier_frames] &= ~(is_in_window & is_too_far)
    return is_steady


def _window_means(relative: BodyPoses, window: float) -> tuple[FloatArray, BoolArray]:
    """Mean translation and rotation (12, T) over the window about each frame, and whether it has a pose.

    At the ends the window is shortened evenly on both sides, so that a steady motion keeps its mean.
    """
    times, valid = relative.times, relative.valid
    half = np.minimum(window / 2.0, np.minimum(times - times[0], times[-1] - times))
    window_starts = np.searchsorted(times, times - half - ROUNDING_S, side="left")
    window_stops = np.searchsorted(times, times + half + ROUNDING_S, side="right")
    poses = np.concatenate([relative.translation, relative.rotation.reshape(-1, 9)], axis=1)
    pose_sums = np.concatenate([np.zeros((1, 12)), np.cumsum(np.where(valid[:, None], poses, 0.0), axis=0)])
    valid_counts = np.concatenate([[0], np.cumsum(valid)])
    frames_in_window = valid_counts[window_stops] - valid_counts[window_starts]
    means = np.ascontiguousarray(
        ((pose_sums[window_stops] - pose_sums[window_starts]) / np.maximum(frames_in_window, 1)[:, None]).T
    )
    # A mean of nearly equal rotations is a shorter rotation; brought to its length it compares as one.
    length = np.sqrt((means[3:] ** 2).sum(axis=0) / 3.0)
    means[3:] /= np.where(length > 0.0, length, 1.0)
    return means, frames_in_window > 0


SPEC = spec_of("grasp", compute)
