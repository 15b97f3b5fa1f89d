"""What the page of a run reads: a run in memory and one read from its folder look the same to it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from replay.comparison.false_contacts import FalseContact
from replay.comparison.misses import NEVER_FOUND
from replay.comparison.outcome import Episode, Miss
from replay.outputs.report.charts import Span
from replay.outputs.words import address
from replay.pipeline.answer import Answer
from replay.pipeline.diagnosis import why
from replay.pipeline.ranking import Rank
from replay.pipeline.run_result import RunResult

Fault = Miss | FalseContact


@dataclass(frozen=True, eq=False)
class RunView:
    """A run as far as its page tells of it; mappings are by the label of a detector."""

    summary: Mapping[str, Any]  # what ``summary.json`` holds
    oracle: str  # label of the reference, or ``""``
    ranking: tuple[Rank, ...]  # the audited detectors, the worst first, and the reference last
    answers: tuple[Answer, ...]  # what is said first of each audited detector, in the order of the ranking
    misses: Mapping[str, tuple[Miss, ...]]
    false: Mapping[str, tuple[FalseContact, ...]]
    episodes: Mapping[str, tuple[Episode, ...]]  # contacts of every detector, in order of time
    holdings: tuple[Episode, ...]  # contacts of the reference that are a hand and what it holds
    why: Callable[[str, Fault], str]  # the sentence about a fault of a detector
    folder: str = ""  # the run folder, as a command names it

    def faults(self, label: str) -> list[Fault]:
        """False contacts and misses of a detector."""
        return [*self.false.get(label, ()), *self.misses.get(label, ())]


def with_noise(words: str, holds: str | None) -> str:
    """A sentence about a miss, and whether its contact holds in spite of tracker noise, where that was asked."""
    return f"{words} With tracker noise: {holds}." if holds else words


def view_of(result: RunResult) -> RunView:
    """A run in memory."""

    def reason(label: str, fault: Fault) -> str:
        words = why(result, label, result.summary["detectors"][label], fault)
        holds = result.noise.words[fault.episode - 1] if result.noise and isinstance(fault, Miss) else None
        return with_noise(words, holds)

    return RunView(
        result.summary, result.oracle, result.ranking, result.answers, result.misses, result.false, result.episodes,
        result.holdings, reason, str(result.out or "RUN"),
    )  # fmt: skip


@dataclass(frozen=True)
class FaultsOfPair:
    """Faults of one detector between two bodies, the longest first."""

    pair: tuple[str, str]
    faults: tuple[Fault, ...]


def faults_by_pair(view: RunView, label: str) -> list[FaultsOfPair]:
    """The pair with the largest fault first; what the answer is about comes before all else."""
    answer = next(answer for answer in view.answers if answer.label == label)
    first = None if answer.moment is None else (answer.moment.kind, answer.moment.number)

    def weight(fault: Fault) -> tuple[bool, bool, int, int]:
        same_kind = first is not None and kind_of(fault) == first[0]
        return (kind_of(fault), fault.number) == first, same_kind, fault.frames, -fault.number

    groups: dict[tuple[str, str], list[Fault]] = {}
    for fault in sorted(view.faults(label), key=weight, reverse=True):
        groups.setdefault((fault.body_a, fault.body_b), []).append(fault)
    return [FaultsOfPair(pair, tuple(found)) for pair, found in groups.items()]


def kind_of(fault: Fault) -> str:
    """``miss`` or ``false``, as its option and its address are called."""
    return "miss" if isinstance(fault, Miss) else "false"


def key_fault(view: RunView, answer: Answer) -> Fault | None:
    """The fault that an answer is about."""
    if answer.moment is None:
        return None
    found: Sequence[Fault] = (view.misses if answer.moment.kind == "miss" else view.false)[answer.label]
    return next((fault for fault in found if fault.number == answer.moment.number), None)


def fault_address(view: RunView, label: str, fault: Fault) -> str:
    """Where a page has a fault; the detector that was asked first needs no name."""
    first = next(iter(view.summary["audit"]))
    return address(kind_of(fault), fault.number, "" if label == first else label)


def spans(view: RunView, label: str, pair: int | None = None) -> dict[str, list[Span]]:
    """Stretches of a detector's lane by kind, or of the reference's; of one pair or of all."""

    def of_pair(found: Sequence[Any]) -> Iterator[Any]:
        return (stretch for stretch in found if pair is None or stretch.pair == pair)

    held = set(view.holdings)
    reference = [contact for contact in of_pair(view.episodes.get(view.oracle, ())) if contact not in held]
    if not view.oracle:
        return {"contact": [(contact.start, contact.end) for contact in of_pair(view.episodes[label])]}
    if label == view.oracle:
        return {"reference": [(contact.start, contact.end) for contact in reference]}
    missed = [*of_pair(view.misses[label])]
    return {
        "right": [*_shared(reference, [*of_pair(view.episodes[label])])],
        "missed": [(miss.start, miss.end) for miss in missed if miss.kind == NEVER_FOUND],
        "late": [(miss.start, miss.end) for miss in missed if miss.kind != NEVER_FOUND],
        "false": [(false.start, false.end) for false in of_pair(view.false.get(label, ()))],
    }


def _shared(reference: Sequence[Episode], found: Sequence[Episode]) -> Iterator[Span]:
    """When both report contact of a pair."""
    of_pair: dict[int, list[Episode]] = {}
    for contact in found:
        of_pair.setdefault(contact.pair, []).append(contact)
    for contact in reference:
        for other in of_pair.get(contact.pair, ()):
            if other.start >= contact.end:
                break
            if other.end > contact.start:
                yield max(contact.start, other.start), min(contact.end, other.end)
