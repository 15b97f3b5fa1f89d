"""Brings recordings of other clocks onto that of the first, by the marks that both hold: events of the same words."""

from collections import Counter
from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sessions.errors import ImportFileError
from sessions.importers.clocks import ClockFit
from sessions.model.session import Session


def on_one_clock(parts: Mapping[Path, Session]) -> dict[Path, Session]:
    """The recordings, each that does not overlap the first in time moved to it; what was done is in the metadata.

    Raises ``ImportFileError``: a recording that neither overlaps the first nor shares a mark with it, or that begins
    before its clock.
    """
    (reference, first), *others = parts.items()
    moved = {reference: first}
    for path, part in others:
        moved[path] = part if _overlap(first, part) else _moved(reference, first, path, part)
    return moved


def _overlap(first: Session, part: Session) -> bool:
    one, other = first.frames.stamp_ns, part.frames.stamp_ns
    return int(one[0]) <= int(other[-1]) and int(other[0]) <= int(one[-1])


def _moved(reference: Path, first: Session, path: Path, part: Session) -> Session:
    known, own = _marks(first), _marks(part)
    shared = [words for words in own if words in known]
    if not shared:
        raise ImportFileError(
            f"{path} and {reference.name} lie apart in time and share no mark; give files of one clock, "
            "or record an event of the same name in both"
        )
    # Whole nanoseconds first: seconds of the Unix epoch hold no microsecond exactly.
    zero, base = own[shared[0]], known[shared[0]] - own[shared[0]]
    ahead = [(known[words] - own[words] - base) / 1e9 for words in shared]
    fit = ClockFit.of([(own[words] - zero) / 1e9 for words in shared], ahead)

    def later(stamps: Any) -> Any:
        ns = np.asarray(stamps, dtype=np.int64)
        return ns + base + np.rint(fit.ahead((ns - zero) / 1e9) * 1e9).astype(np.int64)

    def stream(one: Any) -> Any:
        made = copy(one)
        object.__setattr__(made, "times_ns", later(one.times_ns))
        return made

    if later(part.frames.stamp_ns[0]) < 0:
        raise ImportFileError(f"{path} begins before second 0 of the clock of {reference.name}; name it first")
    events = [replace(one, time_ns=int(later(one.time_ns))) for one in part.events]
    spans = [replace(one, start_ns=int(later(one.start_ns)), end_ns=int(later(one.end_ns))) for one in part.intervals]
    said = f"clock moved by {base / 1e9:.3f} s onto that of {reference.name} by {len(shared)} marks: {fit.words}"
    facts = {**part.facts, "conversions": f"{part.facts.get('conversions', '')}; {said}"}
    tracks = {name: stream(one) for name, one in part.tracks.items()}
    session = Session.from_tracks(tracks, part.meshes, part.scene, events=events, intervals=spans, facts=facts)
    contacts = tuple(replace(one, time_ns=int(later(one.time_ns))) for one in part.live_contacts)
    hands, gaze, scalars = (
        {name: stream(one) for name, one in named.items()} for named in (part.hands, part.gaze, part.scalars)
    )
    return replace(session, live_contacts=contacts, hands=hands, gaze=gaze, scalars=scalars)


def _marks(part: Session) -> dict[tuple[str, str, str], int]:
    """Name, words and body of every event that happens once, and when."""
    found = [((one.name, one.message, one.body), one.time_ns) for one in part.events]
    count = Counter(what for what, _ in found)
    return {what: time_ns for what, time_ns in found if count[what] == 1}
