"""Contacts and events of a run, a typed record for each row of the tables that the document names."""

from collections.abc import Iterable, Mapping
from typing import Any, Final

import msgspec
from msgspec import Struct, field

from replay.auditing.record import Count


class ContactRecord(Struct, frozen=True, kw_only=True):
    """A contact that a detector reports, with what became of it beside the reference.

    Parameters
    ----------
    detector : label.
    number : 1, 2, ... in order of time, of one detector.
    body_a, body_b : names of the bodies.
    grasped : whether a hand holds the body, or a body its parent; such contacts are counted apart.
    first, last : first and last frame, both included.
    frames : frames in contact.
    frames_lost, cuts : frames within it without a pose, and intervals of lost poses that cut it.
    start, end : seconds at which the first frame begins and the last one is over.
    missed_by : of the reference: labels of the detectors that never reported it, with commas.
    members : members of a group that touch in its first frame, with commas: ``right index tip``; ``None``: no group.
    flag : what was in doubt about a pose in it; ``None``: nothing.
    status : of an audited detector: ``matched``, ``piece``, ``invented``, ``excused`` or ``held``.
    truth, overlap_frames : number of the contact of the reference that it matches, and frames in common.
    onset_error, duration_error : seconds by which it begins later and lasts longer than that one.
    depth, common_volume, deepest : of the reference: metres and cubic metres that the bodies are in each other at the
        deepest frame, and that frame; ``depth_at_least``: frames were left out of the search for it;
        ``depth_unknown`` says why they are not known.
    noise, noise_fraction : whether it holds in spite of tracker noise, and the fraction of noisy copies that have it.
    """

    detector: str
    number: int
    body_a: str
    body_b: str
    grasped: bool = field(name="held")
    first: Count
    last: Count
    frames: Count
    start: float
    end: float
    frames_lost: Count | None = None
    cuts: Count | None = None
    missed_by: str | None = None
    members: str | None = None
    flag: str | None = None
    status: str | None = None
    truth: int | None = None
    overlap_frames: Count | None = None
    onset_error: float | None = None
    duration_error: float | None = None
    noise: str | None = None
    noise_fraction: float | None = field(default=None, name="noise_share")
    depth: float | None = None
    common_volume: float | None = None
    deepest: Count | None = None
    depth_at_least: bool | None = None
    depth_unknown: str | None = None

    @property
    def bodies(self) -> tuple[str, str]:
        """Names of both bodies."""
        return self.body_a, self.body_b


EFFECT_PREFIX: Final = "effect/"
"""``source`` of an event that an effect reports: this and its kind."""


class EventRecord(Struct, frozen=True, kw_only=True):
    """An event of the recording or of an effect: a moment, or an interval with an end.

    Parameters
    ----------
    stamp_ns, end_stamp_ns : on the clock of the recording; ``None``: it is a moment.
    source : ``event``, the kind of an interval, or ``effect/`` and a kind of effect.
    name, body, level, message : what happened, to which body, how it is to be taken, and the sentence about it.
    values : numbers of an effect, as JSON.
    time, end_time : seconds of the session.
    """

    stamp_ns: int
    source: str
    name: str
    message: str
    time: float
    end_stamp_ns: int | None = None
    body: str | None = ""
    level: str | None = "info"
    values: str | None = ""
    end_time: float | None = None

    @property
    def effect(self) -> str:
        """Kind of the effect that reports it; ``""``: it was recorded."""
        return self.source.removeprefix(EFFECT_PREFIX) if self.source.startswith(EFFECT_PREFIX) else ""


def contacts_by_detector(rows: Iterable[Mapping[str, Any]], labels: Iterable[str]) -> dict[str, list[ContactRecord]]:
    """Return the contacts of every detector in order of time, from the rows of their table."""
    contacts: dict[str, list[ContactRecord]] = {label: [] for label in labels}
    for row in rows:
        contact = msgspec.convert(row, ContactRecord)
        contacts[contact.detector].append(contact)
    return contacts


def events_of(rows: Iterable[Mapping[str, Any]]) -> tuple[EventRecord, ...]:
    """Return the events in order of time, from the rows of their table."""
    return tuple(msgspec.convert(row, EventRecord) for row in rows)
