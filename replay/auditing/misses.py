"""Missed contacts of a comparison as faults, numbered in order of time."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cdcore.numerics import ByteArray, FloatArray
from replay.auditing.episodes import column_runs
from replay.auditing.fault import Fault, FaultKind
from replay.auditing.outcome import Comparison, Episode, Outcome
from replay.prepare.frame_times import frame_ends

FEWEST_LISTED_SHORT: Final = 40
"""Lines up to which a list is read line by line."""


def missed_faults(
    comparison: Comparison, contacts: Sequence[Episode], names: Sequence[tuple[str, str]], times: FloatArray
) -> tuple[Fault, ...]:
    """Return the missed frames of a comparison as faults, in order of time, then pair; not yet measured.

    Parameters
    ----------
    comparison : of the detector with the reference.
    contacts : episodes of the reference.
    names : the two bodies of every pair, members of a group by its name.
    times : (T,) seconds.
    """
    outcome, frame_end_times = comparison.outcome, frame_ends(times)
    columns = np.arange(outcome.shape[1]) if comparison.contact_columns is None else comparison.contact_columns
    contact_keys = np.array([contact.pair * len(outcome) + contact.first for contact in contacts], dtype=np.int64)
    order = np.argsort(contact_keys)
    faults = []
    missed_segments = column_runs(column == Outcome.MISSED for column in outcome.T)
    for number, (pair, first, last) in enumerate(missed_segments.tolist(), start=1):
        column = int(columns[pair])
        position = np.searchsorted(contact_keys, column * len(outcome) + first, side="right", sorter=order) - 1
        index = int(order[position])
        contact_before, contact_after = reported_around(
            outcome[:, pair], contacts[index].first, contacts[index].last, first, last
        )
        faults.append(
            Fault(
                number=number,
                detector=comparison.subject,
                pair=pair,
                bodies=names[pair],
                labels=names[pair],
                kind=_miss_kind(contact_before=contact_before, contact_after=contact_after),
                first=first,
                last=last,
                start=float(times[first]),
                end=float(frame_end_times[last]),
                frame=first,
                contact=index + 1,
            )
        )
    return tuple(faults)


def reported_around(outcome: ByteArray, begin: int, end: int, first: int, last: int) -> tuple[bool, bool]:
    """Return whether both detections have contact before and after some frames, within frames ``begin`` to ``end``.

    ``outcome`` (T,) is that of the pair; all frames are included.
    """
    contact_before = bool((outcome[begin:first] == Outcome.BOTH).any())
    contact_after = bool((outcome[last + 1 : end + 1] == Outcome.BOTH).any())
    return contact_before, contact_after


def _miss_kind(*, contact_before: bool, contact_after: bool) -> FaultKind:
    if contact_before and contact_after:
        return FaultKind.INTERRUPTED
    if contact_before:
        return FaultKind.LOST_EARLY
    return FaultKind.REPORTED_LATE if contact_after else FaultKind.NEVER_REPORTED
