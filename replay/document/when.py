"""When a detector was wrong: the pair of bodies that its answer is about, and its faults of the other category."""

from collections.abc import Sequence
from typing import Final

from replay import words
from replay.auditing.fault import Fault, FaultKind
from replay.document.ranking import Rank
from replay.document.run_document import RunDocument
from replay.document.run_result import RunResult
from replay.words import plural

LONG: Final = 10.0
"""Seconds; moments of a shorter session need milliseconds."""

MOST_MOMENTS: Final = 2
"""Faults of the other category that are named one by one."""


def when_text(result: RunResult, document: RunDocument, rank: Rank, fault: Fault) -> str:
    """Return when the faults of the pair of ``fault`` happened, and which the detector has of the other category."""
    misses, false = result.misses.get(rank.label, ()), result.false.get(rank.label, ())
    every, others = (misses, false) if fault.kind.is_miss else (false, misses)
    sentences = [_of_pair(every, fault, digits=1 if document.session.duration >= LONG else 3)]
    never = [other for other in others if not other.kind.is_miss or other.kind is FaultKind.NEVER_REPORTED]
    if never:
        sentences.append(_moments(never))
    return " ".join(sentences)


def _of_pair(every: Sequence[Fault], fault: Fault, digits: int) -> str:
    """``From 3.6 to 22.1 s, 9 of 20 false contacts: beaker and rod.``"""
    alike = [other for other in every if other.bodies == fault.bodies]
    start, end = min(other.start for other in alike), max(other.end for other in alike)
    first, last = (words.fixed(second, digits) for second in (start, end))
    name, pair = fault.name, " and ".join(fault.bodies)
    if len(every) == 1:
        return f"At {first} s, the only {name}: {pair}."
    total = f"{len(every)} missed, late or cut short" if fault.kind.is_miss else plural(len(every), name)
    span = f"At {first} s" if first == last else f"From {first} to {last} s"
    return f"{span}, {len(alike)} of {total}: {pair}."


def _moments(faults: Sequence[Fault]) -> str:
    """``Missed at 5.067 s: beaker and rod.``; of many the number and the first."""
    first = faults[0]
    missed = first.kind.is_miss
    if len(faults) > MOST_MOMENTS:
        count = f"{len(faults)} contacts missed" if missed else plural(len(faults), first.name)
        return f"{count}, the first at {words.moment(first.start)}: {' and '.join(first.bodies)}."
    name = "missed" if missed else first.name
    moments = [f"at {words.moment(fault.start)}: {' and '.join(fault.bodies)}" for fault in faults]
    return f"{name.capitalize()} {'; '.join(moments)}."
