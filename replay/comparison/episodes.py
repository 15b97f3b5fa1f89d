"""Contacts as episodes: maximal stretches of frames in which a pair is in contact."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from cdcore import Detection
from cdcore.protocol import counts_as_contact
from replay.comparison.outcome import Episode
from sessions.doctor.runs import runs


def column_runs(columns: Iterable[NDArray[np.bool_]]) -> NDArray[np.int64]:
    """Maximal stretches of True in masks (T,): rows (column, first, last), sorted by first, then column."""
    found = [np.insert(runs(mask), 0, column, axis=1) for column, mask in enumerate(columns)]
    table = np.concatenate([np.zeros((0, 3), dtype=np.int64), *found])
    return table[np.lexsort((table[:, 0], table[:, 1]))]


def episodes(detection: Detection) -> tuple[Episode, ...]:
    """Every contact of a detection, in order of time, then pair.

    Gaps are not bridged: a single frame without contact, or without a pose, ends an episode. Flicker of a resting
    contact is a finding about the recording or the detector, and hysteresis belongs to effects.
    """
    verdict, times = detection.verdict, detection.times
    # Column by column: a table of flags for hours of frames would double the memory that the verdicts take.
    found = column_runs(map(counts_as_contact, verdict.T))
    return tuple(
        Episode(pair, first, last, float(times[first]), float(times[last])) for pair, first, last in found.tolist()
    )
