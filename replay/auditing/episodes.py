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
    tables = [np.insert(runs(mask), 0, column, axis=1) for column, mask in enumerate(columns)]
    table = np.concatenate([np.zeros((0, 3), dtype=np.int64), *tables])
    return table[np.lexsort((table[:, 0], table[:, 1]))]


def episodes(
    detection: Detection, valid: BoolArray | None = None, contact_columns: IntArray | None = None
) -> tuple[Episode, ...]:
    """Every contact of a detection, in order of time, then pair.

    ``valid`` (T, N): where the motion has poses. A detector of intervals says NO_POSE after a jump too, where both
    poses are known and the bodies may be apart; ``None``: poses are lost wherever the detection says NO_POSE.
    ``contact_columns`` (P,): the column under which contacts of a pair are counted, as the assembly has it; what the
    members of a group touch together is one contact.

    A single frame without contact ends an episode; lost poses do not: what is in contact before and after them is one
    contact, which they cut. Flicker of a resting contact is a finding about the recording or the detector, and
    hysteresis belongs to effects.
    """
    ends = frame_ends(detection.times)
    contacts = []
    # Column by column: a table of flags for hours of frames would double the memory that the verdicts take.
    columns = np.arange(len(detection.pairs)) if contact_columns is None else contact_columns
    for column in np.unique(columns).tolist():
        contact, no_pose = np.zeros(len(detection.times), dtype=np.bool_), np.ones(len(detection.times), dtype=np.bool_)
        for member in np.flatnonzero(columns == column).tolist():
            verdicts, (first, second) = detection.verdict[:, member], detection.pairs[member]
            contact |= counts_as_contact(verdicts)
            no_pose &= verdicts == Verdict.NO_POSE if valid is None else ~(valid[:, first] & valid[:, second])
        for span, lost, cuts in _across_lost_poses(contact, no_pose):
            start, end = float(detection.times[span[0]]), float(ends[span[1]])
            contacts.append(Episode(column, *span, start, end, lost, cuts))
    return tuple(sorted(contacts, key=lambda episode: (episode.first, episode.pair)))


Stretch = tuple[int, int]
"""First and last frame, both included."""


def _across_lost_poses(contact: BoolArray, lost: BoolArray) -> Iterator[tuple[Stretch, tuple[Stretch, ...], int]]:
    """Contacts of one pair, the stretches of lost poses within each, and how many such stretches cut it."""
    posed = np.cumsum(~lost)
    segments = runs(contact)
    # No frame with a pose lies between the last of one part and the first of the next.
    same = posed[segments[1:, 0] - 1] == posed[segments[:-1, 1]]
    for group in np.split(segments, np.flatnonzero(~same) + 1) if len(segments) else ():
        first, last = int(group[0, 0]), int(group[-1, 1])
        gaps = tuple(zip((group[:-1, 1] + 1).tolist(), (group[1:, 0] - 1).tolist(), strict=True))
        before, after = first > 0 and lost[first - 1], last + 1 < len(lost) and lost[last + 1]
        yield (first, last), gaps, len(gaps) + int(before) + int(after)
