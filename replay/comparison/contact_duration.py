"""Which step rate would have missed a contact: a test every h seconds misses one of d seconds with probability
max(0, 1 - d/h).

Tests are at ``phase + k h``, and every phase is equally likely. A contact that lasts at least a step is never missed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdcore import Detection, Motion, create_detector
from cdcore.protocol import counts_as_contact, is_undecided
from replay.comparison.first_touch import poses_between
from replay.comparison.outcome import Episode
from replay.prepare.assembly import Assembly

FloatArray = NDArray[np.float64]

RATES_HZ: Final = (10.0, 20.0, 22.5, 30.0, 45.0, 50.0, 60.0, 72.0, 80.0, 90.0, 120.0, 144.0, 240.0)
"""Step rates reported: physics steps of engines and refresh rates of headsets."""

HALVINGS: Final = 20
"""Of the step in which a contact begins or ends: a millionth of it remains, ten nanoseconds at 90 Hz."""

REFINED: Final = 20_000
"""Contacts whose ends are located between frames; with more (flicker), the ends stay at frames."""


def miss_probability(dwell: ArrayLike, step: float) -> FloatArray:
    """Share of the phases at which a contact of ``dwell`` seconds is never examined at steps of ``step`` seconds."""
    return np.maximum(0.0, 1.0 - np.asarray(dwell, dtype=np.float64) / step)


def expected_misses(dwells: ArrayLike, rate_hz: float) -> float:
    """How many of the contacts are never examined, on average over the phase."""
    return float(miss_probability(dwells, 1.0 / rate_hz).sum())


def safe_rate(dwells: ArrayLike) -> float | None:
    """Looks per second from which on none is missed at any phase; ``None``: no rate, one of them lasts no time."""
    shortest = float(np.min(np.asarray(dwells, dtype=np.float64), initial=np.inf))
    return None if shortest <= 0.0 else 1.0 / shortest


@dataclass(frozen=True, eq=False)
class ContactDurations:
    """How long each contact of the oracle lasted.

    Parameters
    ----------
    begin, end : (E,) seconds, between frames where they could be located.
    open : (E,) bool: it began before the recording or a gap, or ended after; it lasted at least this long.
    refined : whether the ends were located between frames.
    """

    begin: FloatArray
    end: FloatArray
    open: NDArray[np.bool_]
    refined: bool

    @property
    def seconds(self) -> FloatArray:
        """(E,) seconds that each lasted."""
        return self.end - self.begin

    def table(self) -> dict[str, Any]:
        """As plain data: expected misses at each rate, and the rate from which on none is missed."""
        seconds = self.seconds
        return {
            "contacts": len(seconds), "cut_off": int(self.open.sum()), "between_frames": self.refined,
            "shortest": float(seconds.min()) if len(seconds) else None,
            "median": float(np.median(seconds)) if len(seconds) else None, "rates_hz": list(RATES_HZ),
            "expected_misses": [expected_misses(seconds, rate) for rate in RATES_HZ],
            "none_missed_from_hz": safe_rate(seconds) if len(seconds) else 0.0,
        }  # fmt: skip


def contact_durations(assembly: Assembly, oracle: Detection, contacts: Sequence[Episode]) -> ContactDurations:
    """How long each contact lasted, its ends found by halving the step in which they lie.

    Between frames bodies move as ``continuous`` moves them: origins along a line, rotations at constant speed. A
    contact is taken to begin and to end once in a step; where the oracle knows the time of impact, that is the begin.
    ``contacts`` are the oracle's episodes.
    """
    if not contacts:
        return ContactDurations(np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.bool_), True)
    begin, end = (np.array([getattr(one, name) for one in contacts]) for name in ("start", "end"))
    edges = [_edges(assembly.motion, assembly.pairs, oracle, one) for one in contacts]
    cut = np.array([first is None or last is None for first, last in edges])
    if len(contacts) > REFINED:
        return ContactDurations(begin, end, cut, False)
    for pair in sorted({one.pair for one in contacts}):
        numbers = [k for k, one in enumerate(contacts) if one.pair == pair]
        asked = [(k, side, edge) for k in numbers for side, edge in enumerate(edges[k]) if edge is not None]
        found = _halved(assembly, pair, np.array([edge for _, _, edge in asked]).reshape(-1, 2))
        for (k, side, _), moment in zip(asked, found.tolist(), strict=True):
            (begin, end)[side][k] = moment
    return ContactDurations(begin, np.maximum(begin, end), cut, True)


Edge = tuple[float, float]
"""A time in contact, and one without contact before or after it."""


def _edges(
    motion: Motion, pairs: NDArray[np.int64], oracle: Detection, contact: Episode
) -> tuple[Edge | None, Edge | None]:
    """Where a contact begins and ends; ``None``: at the end of what was recorded of the pair."""
    times, last, bodies = motion.times, len(motion) - 1, pairs[contact.pair]
    if oracle.covers == "intervals":
        return _interval_edges(times, oracle, contact)
    starts = contact.first > 0 and bool(motion.linked[contact.first][bodies].all())
    stops = contact.last < last and bool(motion.linked[contact.last + 1][bodies].all())
    return (
        (float(times[contact.first]), float(times[contact.first - 1])) if starts else None,
        (float(times[contact.last]), float(times[contact.last + 1])) if stops else None,
    )


def _interval_edges(times: FloatArray, oracle: Detection, contact: Episode) -> tuple[Edge | None, Edge | None]:
    """Of an oracle of intervals: the contact begins at its time of impact and is over at its last frame."""
    impact = oracle.toi.get((contact.first, contact.pair))
    begin = None if impact is None else (impact[1], impact[0])
    after = contact.last + 1
    if after == len(times) or bool(is_undecided(oracle.verdict[after, contact.pair])):
        return begin, None
    if contact.last > contact.first or impact is None:
        inside = float(times[max(contact.last - 1, 0)])
    else:
        inside = impact[1]
    return begin, (inside, float(times[contact.last]))


def _halved(assembly: Assembly, pair: int, edges: FloatArray) -> FloatArray:
    """The time between the two of each edge (n, 2) at which contact becomes no contact."""
    if not len(edges):
        return np.zeros(0)
    ends = assembly.pairs[pair]
    detector = create_detector("exact", [assembly.bodies[k] for k in ends.tolist()])
    touching, free = edges[:, 0].copy(), edges[:, 1].copy()
    for _ in range(HALVINGS):
        middle = (touching + free) / 2
        verdict = detector.detect(poses_between(assembly.motion, ends, middle)).verdict[:, 0]
        contact = counts_as_contact(verdict)
        touching, free = np.where(contact, middle, touching), np.where(contact, free, middle)
    return touching
