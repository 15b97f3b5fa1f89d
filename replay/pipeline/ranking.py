"""The detectors of a run in one order, the worst first: the rows that terminal, page and picture show."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from replay.base.constants import BUDGET_MS
from replay.base.wilson import share
from replay.comparison.contact_duration import PHASES
from replay.pipeline.gates import figure

Share = Mapping[str, Any]
"""``count``, ``of``, ``share`` (null of nothing), ``low`` and ``high``, as ``replay.base.wilson.share`` makes it."""


@dataclass(frozen=True)
class Rank:
    """What one detector made of the oracle's contacts, without those that a hand has with what it holds.

    The oracle itself has no shares.
    """

    label: str  # what the run calls it
    setting: str  # the detector with its settings: ``discrete[rate_hz=50]``
    contacts: int  # of the oracle
    missed: Share | None  # of the contacts, never found
    in_part: Share | None  # of the contacts, found in part
    false: Share | None  # of the pair-frames it reports as contact, those that are none
    unconfirmed: bool  # whether all of these are candidates: only bounding volumes overlap there
    undecided: int  # contacts that it left undecided
    held: tuple[int, int]  # false pair-frames, and contacts missed, between a hand and what it holds: counted apart
    mean: float  # seconds a frame, over all frames
    p99: float | None  # seconds in which 99 of 100 frames were decided; ``None`` where it was not timed frame by frame
    phases: int  # look phases that the shares are a mean over, where a rate is audited; 1: this run's

    @property
    def lost(self) -> bool:
        """Whether any contact is missed, or a part of one."""
        return _part(self.missed) + _part(self.in_part) > 0.0

    @property
    def leads_false(self) -> bool:
        """Whether what it says falsely is the larger fault."""
        return _part(self.false) > _part(self.missed)

    @property
    def fault(self) -> float:
        """The larger of what it misses or leaves undecided, and of what it says falsely, 0 to 1."""
        return max(_part(self.missed) + self.undecided / max(1, self.contacts), _part(self.false))

    @property
    def of_frame(self) -> float | None:
        """The 99th percentile as a share of a frame at the headset's rate."""
        return None if self.p99 is None else 1e3 * self.p99 / BUDGET_MS

    def count(self, part: Share | None) -> int | str:
        """Contacts of a share, for people: a whole number at one phase, two decimals in the mean over phases."""
        number = _part(part) * self.contacts
        return "" if part is None else f"{number:.2f}" if number and self.phases > 1 else round(number)


def ranking(summary: Mapping[str, Any]) -> tuple[Rank, ...]:
    """The audited detectors of a run's summary, the one with the largest fault first, and the oracle last."""
    found = [_rank(summary, label) for label in summary["audit"]]
    found.sort(key=lambda one: (-one.fault, -_part(one.in_part)))
    if not found:
        return ()
    return (*found, replace(_rank(summary, summary["oracle"]), contacts=found[0].contacts))


def _rank(summary: Mapping[str, Any], label: str) -> Rank:
    made, audit = summary["detectors"][label], summary["audit"].get(label)
    setting = made.get("asked", made["name"])
    mean_seconds, p99 = made["seconds"]["per_frame_mean"], made["seconds"].get("per_frame", {}).get("p99")
    if audit is None:
        return Rank(label, setting, made["contacts"], None, None, None, False, 0, (0, 0), mean_seconds, p99, 1)
    contacts, held, mean = audit["contacts"], audit.get("held", {}), audit.get("phases")
    missed, in_part, false = (
        mean[name] if mean else share(audit[name], contacts) if name != "invented" else audit[name]
        for name in ("contacts_missed", "contacts_in_part", "invented")
    )
    apart = held.get("invented", 0), held.get("contacts_missed", 0)
    return Rank(
        label, setting, contacts, missed, in_part, false, all_unconfirmed(audit), audit["contacts_undecided"], apart,
        mean_seconds, p99, PHASES if mean else 1,
    )  # fmt: skip


def all_unconfirmed(audit: Mapping[str, Any]) -> bool:
    """Whether every false pair-frame of an audited detector is a candidate, which nobody confirmed on triangles."""
    count = audit.get("unconfirmed", 0)
    return count > 0 and count == audit["pair_frames"]["INVENTED"]


def false_words(share: Share | None, unconfirmed: bool) -> str:
    """How much of what a detector reports is false, or ``unconfirmed``; ``""``: nothing.

    Every pair-frame counts alike: it is a share of time as far as frames are evenly spaced.
    """
    false = _part(share)
    if not false:
        return ""
    what = "unconfirmed: only bounding volumes overlap" if unconfirmed else "false"
    return f"{figure(100 * false)} % of the contact time it reports is {what}"


def fault_words(rank: Rank) -> str:
    """What is wrong with a detector, its larger fault first; follows its label, fit for a title."""
    lost, false = _part(rank.missed), _part(rank.false)
    things = f"of {rank.contacts} contact{'s' * (rank.contacts != 1)}"
    misses = f"misses {rank.count(rank.missed)} {things}, {rank.count(rank.in_part)} in part"
    none = "finds the one contact" if rank.contacts == 1 else f"misses none {things}"
    none = "" if rank.undecided or not rank.contacts else none
    words = [
        (2.0, f"leaves {rank.undecided} {things} undecided" if rank.undecided else ""),
        (lost, misses if rank.lost else none if false else ""),
        (false, false_words(rank.false, rank.unconfirmed)),
    ]
    told = "; ".join(text for _, text in sorted(words, key=lambda one: -one[0]) if text)
    mean = f" (mean over {rank.phases} look phases)" if rank.phases > 1 else ""
    return (told or f"{none or 'has no contact to miss'} and says nothing false") + mean


def _part(share: Share | None) -> float:
    return 0.0 if share is None or share["share"] is None else float(share["share"])
