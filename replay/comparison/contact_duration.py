"""How long contacts lasted, and which step rates would have missed them, counted as the headline counts."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Final

import numpy as np

from cdcore import Detection, Motion, Verdict, create_detector
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import counts_as_contact, is_undecided
from cdcore.protocol.blocks import looks_of
from replay.comparison.compare import Within
from replay.comparison.contact_counts import frames_of
from replay.comparison.first_touch import poses_between
from replay.comparison.look_phases import sampling_offsets
from replay.comparison.outcome import Episode
from replay.prepare.assembly import Assembly
from sessions.doctor.runs import runs

RATES_HZ: Final = (10.0, 20.0, 22.5, 30.0, 45.0, 50.0, 60.0, 72.0, 80.0, 90.0, 120.0, 144.0, 240.0)
"""Step rates reported: physics steps of engines and refresh rates of headsets."""

SURELY_SEEN: Final = 1.01
"""Steps that a contact is in view beyond which no phase misses it; the hundredth is for rounded stamps."""

HALVINGS: Final = 20
"""Of the step in which a contact begins or ends: a millionth of it remains, ten nanoseconds at 90 Hz."""

REFINED: Final = 20_000
"""Contacts whose ends are located between frames; with more (flicker), the ends stay at frames."""


class StepRates:
    """Contacts that looks at fixed steps miss, as ``discrete`` does: at frames, each answer held until the next look.

    Parameters
    ----------
    seen : what a look at each frame sees.
    contacts : the oracle's episodes.
    within : which of K pair-frames (frames, columns) are within tolerance; what is nowhere else missed is not missed.
    reach : frames before its first in which a contact is found too: 1 where the oracle speaks of intervals.
    """

    def __init__(self, seen: Detection, contacts: Sequence[Episode], within: Within, reach: int) -> None:
        self.contacts = contacts
        self._seen, self._reach = seen, reach
        self._counts = cache(lambda one: _counts(one, within))
        self._shown = np.array([_longest_shown(seen, self._frames(one), one.pair) for one in contacts])

    def missed(self, rate_hz: float) -> tuple[int, float]:
        """How many this run's phase misses, whose ticks count from second 0, and how many in the mean over phases."""
        brief = [one for one, shown in zip(self.contacts, self._shown, strict=True) if shown * rate_hz < SURELY_SEEN]
        asked = [one for one in brief if self._counts(one)]
        if not asked:
            return 0, 0.0
        spans = [self._frames(one) for one in asked]
        sizes = [len(span) for span in spans]
        frames, columns = np.concatenate(spans), np.repeat([one.pair for one in asked], sizes)
        phases = [0.0, *sampling_offsets(rate_hz)]
        found = [self._found(looks_of(self._seen.times - phase, rate_hz)[0], frames, columns) for phase in phases]
        counts = [int((~np.logical_or.reduceat(one, np.cumsum([0, *sizes[:-1]]))).sum()) for one in found]
        return counts[0], float(np.mean(counts[1:]))

    def table(self) -> dict[str, Any]:
        """As plain data: what each rate misses, and the rate from which on none is missed at any phase."""
        missed = [self.missed(rate) for rate in RATES_HZ]
        by_time = (k for k in np.argsort(self._shown).tolist() if self._counts(self.contacts[k]))
        shortest = next((float(self._shown[k]) for k in by_time), np.inf)
        return {
            "rates_hz": list(RATES_HZ), "missed_at_this_phase": [one for one, _ in missed],
            "expected_misses": [mean for _, mean in missed],
            "none_missed_from_hz": None if shortest <= 0.0 else 1.0 / shortest,
        }  # fmt: skip

    def _frames(self, one: Episode) -> IntArray:
        return np.arange(max(one.first - self._reach, 0), one.last + 1)

    def _found(self, looked: BoolArray, frames: IntArray, columns: IntArray) -> BoolArray:
        """Whether contact is believed in K pair-frames, (K,), by looks at the frames ``looked`` (T,)."""
        looks = np.flatnonzero(looked)
        last = np.searchsorted(looks, frames, side="right") - 1
        # A look without a pose keeps the answer before.
        while len(blind := np.flatnonzero((self._seen.verdict[looks[last], columns] == Verdict.NO_POSE) & (last > 0))):
            last[blind] -= 1
        return counts_as_contact(self._seen.verdict[looks[last], columns])


def _counts(one: Episode, within: Within) -> bool:
    """Whether it is missed where no look sees it: not where it is within tolerance all the time."""
    frames = frames_of(one)
    return not within(frames, np.full(len(frames), one.pair)).all()


def _longest_shown(seen: Detection, frames: IntArray, pair: int) -> float:
    """Seconds of the longest stretch of ticks whose look, at the first frame from each on, sees the contact."""
    times, shown = seen.times, runs(counts_as_contact(seen.verdict[frames, pair])) + frames[0]
    return max((np.inf if a == 0 else float(times[b] - times[a - 1]) for a, b in shown.tolist()), default=0.0)


@dataclass(frozen=True, eq=False)
class ContactDurations:
    """How long each contact of the oracle lasted."""

    # begin, end: (E,) seconds, between frames where they could be located
    begin: FloatArray
    end: FloatArray
    open: BoolArray  # (E,) bool: it began before the recording or a gap, or ended after; it lasted at least this long
    refined: bool  # whether the ends were located between frames
    rates: StepRates | None = field(default=None, repr=False)  # which step rates would have missed them

    @property
    def seconds(self) -> FloatArray:
        """(E,) seconds that each lasted."""
        return self.end - self.begin

    def table(self) -> dict[str, Any]:
        """As plain data, with what each step rate misses."""
        seconds = self.seconds
        return {
            "contacts": len(seconds), "cut_off": int(self.open.sum()), "between_frames": self.refined,
            "shortest": float(seconds.min()) if len(seconds) else None,
            "median": float(np.median(seconds)) if len(seconds) else None,
            **({} if self.rates is None else self.rates.table()),
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


def _edges(motion: Motion, pairs: IntArray, oracle: Detection, contact: Episode) -> tuple[Edge | None, Edge | None]:
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
    inside = float(times[max(contact.last - 1, 0)]) if contact.last > contact.first or impact is None else impact[1]
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
