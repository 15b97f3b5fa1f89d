"""How hands moved, and the tasks they moved for."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import IntArray
from replay.prepare.assembly import Assembly, PoseOrigin
from sessions import Interval, Session

ACTIVITY_KINDS: Final = ("task", "stage")
"""Kinds of spans that say what a student was at."""

PATH_STEP_S: Final = 0.1
"""Paths are measured ten times a second: at 90 Hz a tracker's noise of 0.3 mm alone would add 1.6 m to every minute."""

IDLE_SPEED_M_S: Final = 0.05
"""A hand slower than this rests; tremor and noise stay below it."""

LONGEST_STEP_S: Final = 0.25
"""A step over a longer gap belongs to no path: what happened in it is not known."""


@dataclass(frozen=True)
class Moving:
    """How the hands of a session moved."""

    valid_minutes: float  # time in which every hand has a pose; with no hand, every tracked body
    path_m: float  # way of all hands together, metres
    idle_fraction: float  # share of the valid time in which every hand rests
    flagged_fraction: float  # share of the poses of tracked bodies that were lost, held or interpolated


def measure_hands(assembly: Assembly, hands: list[int]) -> Moving:
    """Measure the hands, given by body number."""
    motion, origin = assembly.motion, assembly.origin
    tracked_bodies = sorted(set(range(len(assembly.bodies))) - fixed_bodies(assembly))
    flagged_fraction = float(np.mean(origin[:, tracked_bodies] != PoseOrigin.RECORDED)) if tracked_bodies else 0.0
    watched_bodies = hands or tracked_bodies
    step_frames = frames_at(motion.times, PATH_STEP_S, float(motion.times[-1]) + 0.5 * PATH_STEP_S)
    seconds = np.diff(motion.times[step_frames])
    has_pose = np.asarray(motion.valid[step_frames][:, watched_bodies].all(axis=1))
    is_usable_step = has_pose[1:] & has_pose[:-1] & (seconds <= LONGEST_STEP_S)
    step_lengths = np.linalg.norm(np.diff(motion.translations[step_frames][:, watched_bodies], axis=0), axis=2)[
        is_usable_step
    ]
    valid_seconds = float(seconds[is_usable_step].sum())
    is_resting = (step_lengths < IDLE_SPEED_M_S * seconds[is_usable_step, None]).all(axis=1)
    idle_seconds = float(seconds[is_usable_step][is_resting].sum())
    return Moving(
        valid_seconds / 60.0,
        float(step_lengths.sum()),
        idle_seconds / valid_seconds if valid_seconds else 0.0,
        flagged_fraction,
    )


def frames_at(times: NDArray[np.float64], step_seconds: float, end_time: float) -> NDArray[np.int64]:
    """The first frame at or after each tick; ticks come every ``step_seconds`` from the first frame until ``end_time``.

    Only ticks next to a frame are made: one stamp in Unix time makes the span half a century, 18 billion ticks.
    """
    first_time = float(times[0])
    step_numbers = np.unique(np.floor((times - first_time) / step_seconds))
    ticks = first_time + step_seconds * np.unique(
        np.concatenate([step_numbers - 1.0, step_numbers, step_numbers + 1.0])
    )
    ticks = ticks[(ticks >= first_time) & (ticks < end_time)]
    return np.unique(np.minimum(np.searchsorted(times, ticks), len(times) - 1))


def fixed_bodies(assembly: Assembly) -> set[int]:
    """Bodies that the scene declares fixed."""
    return set(np.flatnonzero((assembly.origin == PoseOrigin.FIXED).all(axis=0)).tolist())


def activities_at(session: Session, interval_kind: str, stamps: IntArray) -> list[str | None]:
    """The span of a kind, ``task`` or ``stage``, that each stamp lies in: its name; of several, the one begun last."""
    names_at_stamps = np.full(len(stamps), None, dtype=object)
    for named_interval in _intervals_of_kind(session, interval_kind):
        names_at_stamps[(named_interval.start_ns <= stamps) & (stamps <= named_interval.end_ns)] = named_interval.name
    return names_at_stamps.tolist()


def span_names(session: Session, interval_kind: str) -> list[str]:
    """The names of all spans of a kind in order of time, each once."""
    return list(dict.fromkeys(span.name for span in _intervals_of_kind(session, interval_kind)))


def _intervals_of_kind(session: Session, interval_kind: str) -> list[Interval]:
    return sorted(
        (span for span in session.intervals if span.kind == interval_kind),
        key=lambda span: (span.start_ns, -span.end_ns),
    )


def task_seconds(session: Session) -> dict[str, float]:
    """Task -> seconds spent on it, all its spans together, as the recording says."""
    seconds: dict[str, float] = {}
    for span in _intervals_of_kind(session, "task"):
        seconds[span.name] = seconds.get(span.name, 0.0) + (span.end_ns - span.start_ns) / 1e9
    return seconds
