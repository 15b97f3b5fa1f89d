"""Every stretch of an oracle's contact that a detector did not report gets one fixed number, in order of time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.comparison.episodes import column_runs
from replay.comparison.evidence import Evidence
from replay.comparison.outcome import Comparison, Episode, Miss, Outcome

NEVER_FOUND: Final = "never found"
FOUND_LATE: Final = "found late"
LOST_EARLY: Final = "lost early"
INTERRUPTED: Final = "interrupted"
MISS_KINDS: Final = (NEVER_FOUND, FOUND_LATE, LOST_EARLY, INTERRUPTED)
"""By whether the contact was found after the stretch, and (two places on) before it."""


@dataclass(frozen=True)
class MissedStretch:
    """Pair, frames and kind of a miss; its geometry is not yet known.

    Parameters
    ----------
    pair, first, last : column and frames, both included.
    kind : one of ``MISS_KINDS``.
    episode : number of the oracle's episode, from 1.
    """

    pair: int
    first: int
    last: int
    kind: str
    episode: int


def stretches(comparison: Comparison, contacts: Sequence[Episode]) -> tuple[MissedStretch, ...]:
    """The missed stretches of a comparison, in order of time, then pair; ``contacts`` are the oracle's episodes."""
    outcome = comparison.outcome
    missed = column_runs(outcome[:, p] == Outcome.MISSED for p in range(outcome.shape[1]))
    columns = _by_column(contacts)
    return tuple(_stretch(pair, first, last, columns[pair], outcome[:, pair]) for pair, first, last in missed.tolist())


def misses(
    places: Sequence[MissedStretch], names: Sequence[tuple[str, str]], times: NDArray[np.float64], evidence: Evidence
) -> tuple[Miss, ...]:
    """Number the stretches from 1 and describe each where the surfaces cut longest.

    Parameters
    ----------
    places : in order of time.
    names : the two bodies of every pair.
    times : (T,) seconds.
    evidence : the geometry of the frames concerned.
    """
    found = []
    for number, place in enumerate(places, 1):
        cut = evidence.deepest(place.pair, place.first, place.last)
        start, end = (float(times[frame]) for frame in (place.first, place.last))
        found.append(
            Miss(
                number, place.pair, *names[place.pair], place.first, place.last, start, end, place.kind, place.episode,
                cut.frame, cut.point, cut.normal, cut.face_pairs, cut.length, touch=cut.touch, faces=cut.faces,
            )
        )  # fmt: skip
    return tuple(found)


def _by_column(contacts: Sequence[Episode]) -> dict[int, tuple[NDArray[np.int64], list[tuple[int, Episode]]]]:
    """Per pair: first frames, increasing, and (number, episode)."""
    rows: dict[int, list[tuple[int, Episode]]] = {}
    for number, episode in enumerate(contacts, 1):
        rows.setdefault(episode.pair, []).append((number, episode))
    return {pair: (np.array([episode.first for _, episode in found]), found) for pair, found in rows.items()}


def _stretch(
    pair: int, first: int, last: int, column: tuple[NDArray[np.int64], list[tuple[int, Episode]]],
    outcome: NDArray[np.uint8],
) -> MissedStretch:  # fmt: skip
    starts, numbered = column
    number, episode = numbered[int(np.searchsorted(starts, first, side="right")) - 1]
    before = int((outcome[episode.first : first] == Outcome.BOTH).any())
    after = int((outcome[last + 1 : episode.last + 1] == Outcome.BOTH).any())
    return MissedStretch(pair, first, last, MISS_KINDS[2 * before + after], number)
