"""Every stretch of an oracle's contact that a detector did not report gets one number, in order of time, for ever."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.audit.episodes import column_runs
from replay.audit.evidence import Evidence
from replay.audit.outcome import Comparison, Episode, Miss, Outcome

NEVER_FOUND: Final = "never found"
FOUND_LATE: Final = "found late"
LOST_EARLY: Final = "lost early"
INTERRUPTED: Final = "interrupted"
MISS_KINDS: Final = (NEVER_FOUND, FOUND_LATE, LOST_EARLY, INTERRUPTED)


@dataclass(frozen=True)
class Stretch:
    """Where a miss is, before anybody looked at its geometry.

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


def stretches(comparison: Comparison, contacts: Sequence[Episode]) -> tuple[Stretch, ...]:
    """The missed stretches of a comparison, in order of time, then pair.

    Parameters
    ----------
    contacts : the oracle's episodes, in order.
    """
    outcome = comparison.outcome
    missed = column_runs(outcome[:, p] == Outcome.MISSED for p in range(outcome.shape[1]))
    columns = _by_column(contacts)
    return tuple(_stretch(pair, first, last, columns[pair], outcome[:, pair]) for pair, first, last in missed.tolist())


def misses(
    places: Sequence[Stretch], names: Sequence[tuple[str, str]], times: NDArray[np.float64], evidence: Evidence
) -> tuple[Miss, ...]:
    """Number the stretches from 1 and look at each where the surfaces cut longest.

    Parameters
    ----------
    places : in order of time.
    names : the two bodies of every pair.
    times : (T,) seconds.
    evidence : the geometry of the frames concerned.
    """
    return tuple(_miss(number, place, names[place.pair], times, evidence) for number, place in enumerate(places, 1))


def _miss(number: int, place: Stretch, names: tuple[str, str], times: NDArray[np.float64], evidence: Evidence) -> Miss:
    cut = evidence.deepest(place.pair, place.first, place.last)
    return Miss(
        number=number,
        pair=place.pair,
        body_a=names[0],
        body_b=names[1],
        first=place.first,
        last=place.last,
        start=float(times[place.first]),
        end=float(times[place.last]),
        kind=place.kind,
        episode=place.episode,
        deepest=cut.frame,
        point=cut.point,
        normal=cut.normal,
        face_pairs=cut.face_pairs,
        cut_length=cut.length,
        touch=cut.touch,
        faces=cut.faces,
    )


def _by_column(contacts: Sequence[Episode]) -> dict[int, tuple[NDArray[np.int64], list[tuple[int, Episode]]]]:
    """Per pair: first frames, increasing, and (number, episode)."""
    rows: dict[int, list[tuple[int, Episode]]] = {}
    for number, episode in enumerate(contacts, 1):
        rows.setdefault(episode.pair, []).append((number, episode))
    return {pair: (np.array([episode.first for _, episode in found]), found) for pair, found in rows.items()}


def _stretch(
    pair: int,
    first: int,
    last: int,
    column: tuple[NDArray[np.int64], list[tuple[int, Episode]]],
    outcome: NDArray[np.uint8],
) -> Stretch:
    starts, numbered = column
    number, episode = numbered[int(np.searchsorted(starts, first, side="right")) - 1]
    before = bool((outcome[episode.first : first] == Outcome.BOTH).any())
    after = bool((outcome[last + 1 : episode.last + 1] == Outcome.BOTH).any())
    kind = {
        (False, False): NEVER_FOUND,
        (False, True): FOUND_LATE,
        (True, False): LOST_EARLY,
        (True, True): INTERRUPTED,
    }
    return Stretch(pair, first, last, kind[before, after], number)
