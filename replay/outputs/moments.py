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
    outcome: Outcome  # ``MISSED``, ``INVENTED`` or ``BOTH``
    of: Miss | FalseContact | Episode
    number: int = 0  # of the fault
    size: float = 0.0  # metres of the longest cut, or of the gap between the meshes; nan: not measured

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
    def colour(self) -> Rgba:
        """Red is missed, yellow invented, blue found."""
        return OUTCOMES[self.outcome][1]


def key_moments(result: RunResult) -> list[FocusMoment]:
    """All moments, in order of time; of those in one frame the worst comes last, by a nanosecond."""
    faults = [*_faults(result)]
    faulty = {moment.pair for moment in faults}
    contacts = [_contact(result, longest) for pair, longest in _longest(result).items() if pair not in faulty]
    moments: list[FocusMoment] = []
    for moment in sorted([*faults, *contacts], key=_place):
        later = moment.later
        if moments and moments[-1].frame == moment.frame:
            later = max(later, moments[-1].later + 1)
        moments.append(replace(moment, later=later))
    return moments


def _place(moment: FocusMoment) -> tuple[int, int, bool, float]:
    return moment.frame, moment.later, moment.outcome == Outcome.MISSED, moment.size


def focus_rows(moments: Sequence[FocusMoment]) -> list[tuple[int, int, FocusMoment]]:
    """Frame, nanoseconds after it, and the moment in focus from there on: it changes half-way between moments."""
    rows = [(0, 0, moment) for moment in moments[:1]]
    for before, moment in pairwise(moments):
        if before.frame == moment.frame:
            rows.append((moment.frame, moment.later, moment))
        else:
            rows.append(((before.frame + moment.frame + 1) // 2, 0, moment))
    return rows


def _faults(result: RunResult) -> Iterator[FocusMoment]:
    for label, misses in result.misses.items():
        for miss in by_depth(misses):
            yield FocusMoment(
                *miss.shown, miss.point, label, Outcome.MISSED, miss, number=miss.number, size=miss.cut_length
            )
        for false in sorted(result.false.get(label, ()), key=lambda false: -false.frames)[:LISTED]:
            yield FocusMoment(
                false.widest, 0, false.point, label, Outcome.INVENTED, false, number=false.number, size=false.gap
            )


def _longest(result: RunResult) -> dict[int, Episode]:
    """Pair -> its longest contact, the oracle's before anybody else's."""
    longest: dict[int, Episode] = {}
    for label in (result.oracle, *result.comparisons):
        by_length = sorted(result.episodes[label], key=lambda contact: contact.last - contact.first)
        longest = {contact.pair: contact for contact in by_length} | longest
    return longest


def _contact(result: RunResult, contact: Episode) -> FocusMoment:
    frame = (contact.first + contact.last) // 2
    point = result.assembly.motion.translations[frame, result.assembly.pairs[contact.pair]].mean(axis=0)
    return FocusMoment(frame, 0, vector_of(point), "", Outcome.BOTH, contact)


def moment_line(moment: FocusMoment, name: str, widths: tuple[int, int]) -> str:
    """One line of the list; ``name``: of the pair; ``widths``: of label and name."""
    what = "curve" if moment.outcome == Outcome.MISSED else "apart"
    size = f"{moment.size * 1e3:.1f} mm {what}" if moment.label and moment.size > 0 else ""
    fault = f"{KINDS[moment.outcome]} {moment.number or ''}"
    line = f"{moment.label:<{widths[0]}} {fault:<8}  {name:<{widths[1]}} {size:>14}"
    if isinstance(moment.of, Episode):
        return f"{line}  {counted(moment.last - moment.first + 1, 'frame')}"
    # In a narrow view the end is cut: what tells moments apart comes first.
    late = f"{moment.of.kind}: " if moment.outcome == Outcome.MISSED else ""
    return f"{line}  {late}{moment.of.cause}"


def worst_first(result: RunResult) -> list[str]:
    """Audited detectors, the one with the largest fault first."""
    return [rank.label for rank in result.ranking[:-1]]


def leading(result: RunResult, moments: Sequence[FocusMoment]) -> FocusMoment:
    """The moment that comes first: that of the answer; where nothing is wrong the longest contact."""
    answer = result.answers[0] if result.answers else None
    if answer is None or answer.moment is None:
        return max(moments, key=lambda moment: moment.last - moment.first)
    wanted = (answer.label, answer.moment.kind, answer.moment.number)
    return next(
        (moment for moment in moments if (moment.label, KINDS[moment.outcome], moment.number) == wanted), moments[0]
    )
