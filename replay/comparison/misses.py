"""Every stretch of an oracle's contact that a detector did not report gets one fixed number, in order of time."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import ByteArray, FloatArray
from replay.comparison.episodes import column_runs
from replay.comparison.evidence import Cut, Place
from replay.comparison.outcome import Comparison, Episode, Miss, Outcome
from replay.prepare.frame_times import frame_ends

NEVER_FOUND: Final = "never found"
FOUND_LATE: Final = "found late"
LOST_EARLY: Final = "lost early"
INTERRUPTED: Final = "interrupted"
MISS_KINDS: Final = (NEVER_FOUND, FOUND_LATE, LOST_EARLY, INTERRUPTED)
"""By whether the contact was found after the stretch, and (two places on) before it."""


MANY: Final = 40
"""Lines up to which a list is read line by line."""


@dataclass(frozen=True, slots=True)
class MissedStretch:
    """Where a miss is; its geometry is not yet known."""

    # pair, first, last: column and frames, both included
    pair: int
    first: int
    last: int
    kind: str  # one of ``MISS_KINDS``
    episode: int  # number of the oracle's episode, from 1


def stretches(comparison: Comparison, contacts: Sequence[Episode]) -> tuple[MissedStretch, ...]:
    """The missed stretches of a comparison, in order of time, then pair; ``contacts`` are the oracle's episodes."""
    outcome, found = comparison.outcome, list[MissedStretch]()
    begins = np.array([one.pair * len(outcome) + one.first for one in contacts], dtype=np.int64)
    order = np.argsort(begins)
    for pair, first, last in column_runs(column == Outcome.MISSED for column in outcome.T).tolist():
        at = np.searchsorted(begins, pair * len(outcome) + first, side="right", sorter=order) - 1
        contact = contacts[order[at]]
        kind = kind_within(MISS_KINDS, outcome[:, pair], (contact.first, contact.last), first, last)
        found.append(MissedStretch(pair, first, last, kind, int(order[at]) + 1))
    return tuple(found)


def kind_within(kinds: Sequence[str], outcome: ByteArray, contact: tuple[int, int], first: int, last: int) -> str:
    """Of four ``kinds`` that of a stretch: by whether both report the contact that holds it after and before it.

    ``outcome`` (T,) of its pair; ``contact``: first and last frame.
    """
    parts = outcome[contact[0] : first], outcome[last + 1 : contact[1] + 1]
    before, after = (int((part == Outcome.BOTH).any()) for part in parts)
    return kinds[2 * before + after]


def misses(
    places: Sequence[MissedStretch], names: Sequence[tuple[str, str]], times: FloatArray, cuts: Mapping[Place, Cut]
) -> tuple[Miss, ...]:
    """Number the stretches from 1 and describe each where the surfaces cut longest.

    Parameters
    ----------
    places : in order of time.
    names : the two bodies of every pair.
    times : (T,) seconds.
    cuts : where the surfaces cut longest in each stretch.
    """
    found, ends = [], frame_ends(times)
    for number, place in enumerate(places, 1):
        cut = cuts[place.pair, place.first, place.last]
        start, end = float(times[place.first]), float(ends[place.last])
        found.append(
            Miss(
                number, place.pair, *names[place.pair], place.first, place.last, start, end, place.kind, place.episode,
                cut.frame, cut.point, cut.normal, cut.face_pairs, cut.length, touch=cut.touch, faces=cut.faces,
            )
        )  # fmt: skip
    return tuple(found)


def by_depth(found: Iterable[Miss]) -> list[Miss]:
    """Misses with the longest cut first; those that no frame shows come last, in order of time."""
    return sorted(found, key=lambda miss: (-miss.cut_length, miss.number))
