"""Contacts as episodes: maximal stretches of frames in which a pair is in contact, lost poses apart."""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from cdcore import Detection, Verdict
from cdcore.numerics import BoolArray, IntArray
from cdcore.protocol import counts_as_contact
from replay.auditing.outcome import Episode
from replay.prepare.frame_times import frame_ends
from sessions.doctor.runs import runs


def column_runs(columns: Iterable[NDArray[np.bool_]]) -> NDArray[np.int64]:
    """Maximal stretches of True in masks (T,): rows (column, first, last), sorted by first, then column."""
    runs_of_columns = [np.insert(runs(mask), 0, column, axis=1) for column, mask in enumerate(columns)]
    all_runs = np.concatenate([np.zeros((0, 3), dtype=np.int64), *runs_of_columns])
    return all_runs[np.lexsort((all_runs[:, 0], all_runs[:, 1]))]


def episodes(
    detection: Detection, has_pose_mask: BoolArray | None = None, contact_columns: IntArray | None = None
) -> tuple[Episode, ...]:
    """Every contact of a detection, in order of time, then pair.

    ``has_pose_mask`` (T, N): where the motion has poses. A detector of intervals says NO_POSE after a jump too, where
    both poses are known and the bodies may be apart; ``None``: poses are lost wherever the detection says NO_POSE.
    ``contact_columns`` (P,): the column under which contacts of a pair are counted, as the assembly has it; what the
    members of a group touch together is one contact.

    A single frame without contact ends an episode; lost poses do not: what is in contact before and after them is one
    contact, which they cut. Flicker of a resting contact is a finding about the recording or the detector, and
    hysteresis belongs to effects.
    """
    frame_end_times = frame_ends(detection.times)
    contacts = []
    # Column by column: a table of flags for hours of frames would double the memory that the verdicts take.
    columns = np.arange(len(detection.pairs)) if contact_columns is None else contact_columns
    for column in np.unique(columns).tolist():
        contact, no_pose = np.zeros(len(detection.times), dtype=np.bool_), np.ones(len(detection.times), dtype=np.bool_)
        for member_column in np.flatnonzero(columns == column).tolist():
            pair_verdicts, (first, second) = detection.verdict[:, member_column], detection.pairs[member_column]
            contact |= counts_as_contact(pair_verdicts)
            no_pose &= (
                pair_verdicts == Verdict.NO_POSE
                if has_pose_mask is None
                else ~(has_pose_mask[:, first] & has_pose_mask[:, second])
            )
        for frame_range, lost_ranges, cuts in _segments_across_lost_poses(contact, no_pose):
            start, end = float(detection.times[frame_range[0]]), float(frame_end_times[frame_range[1]])
            contacts.append(Episode(column, *frame_range, start, end, lost_ranges, cuts))
    return tuple(sorted(contacts, key=lambda episode: (episode.first, episode.pair)))


FrameRange = tuple[int, int]
"""First and last frame, both included."""


def _segments_across_lost_poses(
    contact: BoolArray, pose_lost: BoolArray
) -> Iterator[tuple[FrameRange, tuple[FrameRange, ...], int]]:
    """Contacts of one pair, the stretches of lost poses within each, and how many such stretches cut it."""
    posed_counts = np.cumsum(~pose_lost)
    segments = runs(contact)
    # No frame with a pose lies between the last of one part and the first of the next.
    is_continued = posed_counts[segments[1:, 0] - 1] == posed_counts[segments[:-1, 1]]
    for joined_segments in np.split(segments, np.flatnonzero(~is_continued) + 1) if len(segments) else ():
        first, last = int(joined_segments[0, 0]), int(joined_segments[-1, 1])
        gaps = tuple(zip((joined_segments[:-1, 1] + 1).tolist(), (joined_segments[1:, 0] - 1).tolist(), strict=True))
        is_cut_before, is_cut_after = (
            first > 0 and pose_lost[first - 1],
            last + 1 < len(pose_lost) and pose_lost[last + 1],
        )
        yield (first, last), gaps, len(gaps) + int(is_cut_before) + int(is_cut_after)
