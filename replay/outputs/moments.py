"""Moments of a run in one list, of all its detectors: what each missed, what it invented, and one contact of each
other pair. The pair of a moment is the pair in focus."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

from replay.comparison.false_contacts import FalseContact
from replay.comparison.misses import by_depth
from replay.comparison.outcome import Episode, Miss, Outcome
from replay.effects.output import Vector, vector_of
from replay.outputs.palette import OUTCOMES, Rgba
from replay.outputs.words import counted
from replay.pipeline.run_result import RunResult
from replay.pipeline.scores import LISTED

KINDS: Final = {Outcome.MISSED: "miss", Outcome.INVENTED: "false", Outcome.BOTH: "contact"}


@dataclass(frozen=True, eq=False)
class FocusMoment:
    """Where the cursor meets a fault, or a contact."""

    frame: int  # no two moments have the same frame and the same nanoseconds ``later``
    later: int
    point: Vector  # where in the world
    label: str  # the detector; ``""`` where nobody is at fault
    of: Miss | FalseContact | Episode

    @property
    def pair(self) -> int:
        """Column of the pair in focus."""
        return self.of.pair

    @property
    def first(self) -> int:
        """First frame of the stretch."""
        return self.of.first

    @property
    def last(self) -> int:
        """Last frame of the stretch."""
        return self.of.last

    @property
    def number(self) -> int:
        """The number of the fault, or 0."""
        return 0 if isinstance(self.of, Episode) else self.of.number

    @property
    def outcome(self) -> Outcome:
        """``MISSED``, ``INVENTED`` or ``BOTH``."""
        if isinstance(self.of, Miss):
            return Outcome.MISSED
        return Outcome.INVENTED if isinstance(self.of, FalseContact) else Outcome.BOTH

    @property
    def size(self) -> float:
        """Metres of the longest cut, or of the gap between the meshes; nan: not measured."""
        if isinstance(self.of, Miss):
            return self.of.cut_length
        return self.of.gap if isinstance(self.of, FalseContact) else 0.0

    @property
    def colour(self) -> Rgba:
        """Red is missed, yellow invented, blue found."""
        return OUTCOMES[self.outcome][1]

    @property
    def words(self) -> str:
        """What it is: for a flag and a line."""
        return f"{KINDS[self.outcome]} {self.number or ''}".rstrip()


def key_moments(result: RunResult) -> list[FocusMoment]:
    """All moments, in order of time; of those in one frame the worst comes last, by a nanosecond."""
    found = [*_faults(result)]
    seen = {one.pair for one in found}
    found += [_contact(result, one) for pair, one in _longest(result).items() if pair not in seen]
    found.sort(key=lambda one: (one.frame, one.later, one.outcome == Outcome.MISSED, one.size))
    made: list[FocusMoment] = []
    for one in found:
        before = made[-1] if made and made[-1].frame == one.frame else None
        made.append(replace(one, later=max(one.later, before.later + 1) if before else one.later))
    return made


def focus_rows(moments: Sequence[FocusMoment]) -> list[tuple[int, int, FocusMoment]]:
    """Frame, nanoseconds after it, and the moment in focus from there on: it changes half-way between moments."""
    rows = [(0, 0, moments[0])] if moments else []
    for before, one in pairwise(moments):
        same = before.frame == one.frame
        rows.append((one.frame, one.later, one) if same else ((before.frame + one.frame + 1) // 2, 0, one))
    return rows


def _faults(result: RunResult) -> Iterator[FocusMoment]:
    for label, misses in result.misses.items():
        for miss in by_depth(misses):
            yield FocusMoment(*miss.shown, miss.point, label, miss)
        for false in sorted(result.false.get(label, ()), key=lambda one: -one.frames)[:LISTED]:
            yield FocusMoment(false.widest, 0, false.point, label, false)


def _longest(result: RunResult) -> dict[int, Episode]:
    """Pair -> its longest contact, the oracle's before anybody else's."""
    found: dict[int, Episode] = {}
    for label in (result.oracle, *result.comparisons):
        own: dict[int, Episode] = {}
        for one in result.episodes[label]:
            if one.last - one.first >= (own[one.pair].last - own[one.pair].first if one.pair in own else 0):
                own[one.pair] = one
        found = own | found
    return found


def _contact(result: RunResult, contact: Episode) -> FocusMoment:
    frame = (contact.first + contact.last) // 2
    point = result.assembly.motion.translations[frame, result.assembly.pairs[contact.pair]].mean(axis=0)
    return FocusMoment(frame, 0, vector_of(point), "", contact)


def moment_line(moment: FocusMoment, name: str, widths: tuple[int, int]) -> str:
    """One line of the list; ``name``: of the pair; ``widths``: of label and name."""
    what = "curve" if moment.outcome == Outcome.MISSED else "apart"
    size = f"{moment.size * 1e3:.1f} mm {what}" if moment.label and moment.size > 0 else ""
    line = f"{moment.label:<{widths[0]}} {moment.words:<8}  {name:<{widths[1]}} {size:>14}"
    if isinstance(moment.of, Episode):
        return f"{line}  {counted(moment.last - moment.first + 1, 'frame')}"
    # In a narrow view the end is cut: what tells moments apart comes first.
    late = f"{moment.of.kind}: " if moment.outcome == Outcome.MISSED else ""
    return f"{line}  {late}{moment.of.cause}"


def worst_first(result: RunResult) -> list[str]:
    """Audited detectors, the one with the largest fault first."""
    return [one.label for one in result.ranking[:-1]]


def leading(result: RunResult, moments: Sequence[FocusMoment]) -> int:
    """Which moment comes first: that of the answer; where nothing is wrong the longest contact."""
    key = result.answers[0].moment if result.answers else None
    if key is None:
        return max(range(len(moments)), key=lambda k: moments[k].last - moments[k].first)
    kind = Outcome.INVENTED if key.kind == "false" else Outcome.MISSED
    wanted = (result.answers[0].label, kind, key.number)
    found = (k for k, one in enumerate(moments) if (one.label, one.outcome, one.number) == wanted)
    return next(found, 0)
