"""Near misses: stretches in which two things came close without touching."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore import Verdict, create_detector
from cdcore.numerics import FloatArray, IntArray
from replay.document.metrics.hands import frames_at
from replay.prepare.assembly import Assembly

CLOSE_GAP_M: Final = 0.010
"""Closer than this is close: a hand or a glass covers it in a tenth of a second."""

SAMPLES_HZ: Final = 10.0
"""A near miss of a tenth of a second is seen."""

SAMPLES_AT_ONCE: Final = 4096
"""Looks whose poses are held together: of hours all would take 200 MB."""

LONGEST_BREAK_S: Final = 0.5
"""Stretches less than this apart are one."""


@dataclass(frozen=True)
class NearMiss:
    """One near miss: the pair (column of ``assembly.pairs``), and when; of a group the column of its contacts."""

    pair: int
    start: float
    end: float


def close_intervals(assembly: Assembly, pairs: IntArray) -> tuple[NearMiss, ...]:
    """Stretches in which the surfaces of a pair were within ``CLOSE_GAP_M``, touching or not, in order of time.

    Members of a group that are close to a body are so as one thing.

    ``pairs``: columns of ``assembly.pairs`` to look at.
    """
    if not len(pairs):  # No detector is loaded where nothing is looked at
        return ()
    motion = assembly.motion
    samples = frames_at(motion.times, 1.0 / SAMPLES_HZ, float(motion.times[-1]))
    detector = create_detector(
        "collider", assembly.bodies, pairs=assembly.pairs[pairs], shape="mesh", skin_m=CLOSE_GAP_M / 2
    )
    blocks = np.array_split(samples, -(-len(samples) // SAMPLES_AT_ONCE))
    is_close = np.concatenate([block.verdict == Verdict.CONTACT for block in detector.stream(map(motion.take, blocks))])
    near_misses = []
    columns = assembly.contact_columns[pairs]
    for pair in np.unique(columns).tolist():
        close_times = motion.times[samples[is_close[:, columns == pair].any(axis=1)]]
        intervals = np.split(close_times, np.flatnonzero(np.diff(close_times) > LONGEST_BREAK_S) + 1)
        near_misses += [NearMiss(pair, float(block[0]), float(block[-1])) for block in intervals if len(block)]
    return tuple(sorted(near_misses, key=lambda near_miss: (near_miss.start, near_miss.pair)))


def without_contact(near_misses: Sequence[NearMiss], contact_intervals: FloatArray) -> tuple[NearMiss, ...]:
    """Those with no contact of their pair within half a second.

    ``near_misses``: stretches in which a pair was close.
    ``contact_intervals``: (k, 3) column, start and end in seconds of every contact.
    """
    pair, start, end = contact_intervals.T
    return tuple(
        near_miss
        for near_miss in near_misses
        if not (
            (pair == near_miss.pair)
            & (start <= near_miss.end + LONGEST_BREAK_S)
            & (end >= near_miss.start - LONGEST_BREAK_S)
        ).any()
    )
