"""Moments of a run in one list, of all its detectors: what each missed, what it said falsely, and one contact of each
other pair. A click on the time of a moment moves the cursor there.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, get_type_hints

import numpy as np
import rerun as rr

from replay.base.shown import plural
from replay.comparison.fault import Fault, longest_curve_first
from replay.comparison.outcome import Episode
from replay.effects.output import Vector, vector_of
from replay.errors import RunFolderError
from replay.outputs.palette import FOUND, INVENTED, MISSED
from replay.outputs.rerun_log.recording_file import RecordingWriter, entity, require_complete_file
from replay.outputs.rerun_log.recording_reader import RecordingDamagedError, read_texts
from replay.pipeline.run_result import RunResult
from replay.pipeline.scores import LISTED

MISS, FALSE, CONTACT = "miss", "false", "contact"
"""Kinds of moments."""

COLOURS: Final = {MISS: MISSED, FALSE: INVENTED, CONTACT: FOUND}
UNREADABLE: Final = (OSError, ValueError, RuntimeError, TypeError, RecursionError, RecordingDamagedError)
"""What reading a damaged recording raises: Rerun's reader, and the list of moments in it."""

LISTS: Final = "moments/list"
TABLE: Final = "moments/table"


@dataclass(frozen=True, eq=False)
class Moment:
    """Where the cursor meets a fault, or a contact."""

    frame: int  # no two moments have the same frame and the same nanoseconds ``later``
    later: int
    point: Vector  # where in the world
    label: str  # the detector; ``""`` where nobody is at fault
    kind: str  # ``MISS``, ``FALSE`` or ``CONTACT``
    stretch: Fault | Episode
    number: int = 0  # of the fault
    size: float = 0.0  # metres of the longest cut, or of the gap between the meshes; nan: not measured

    @property
    def pair(self) -> int:
        """Column of the pair."""
        return self.stretch.pair

    @property
    def first(self) -> int:
        """First frame of the stretch."""
        return self.stretch.first

    @property
    def last(self) -> int:
        """Last frame of the stretch."""
        return self.stretch.last


def key_moments(result: RunResult) -> list[Moment]:
    """All moments, in order of time; of those in one frame the worst comes last, by a nanosecond."""
    faults = [*_faults(result)]
    contacts = _contacts(result, {moment.pair for moment in faults})
    moments: list[Moment] = []
    for moment in sorted([*faults, *contacts], key=_place):
        if moments and moments[-1].frame == moment.frame:
            moment = replace(moment, later=max(moment.later, moments[-1].later + 1))
        moments.append(moment)
    return moments


def _place(moment: Moment) -> tuple[int, int, bool, float]:
    return moment.frame, moment.later, moment.kind == MISS, moment.size


def _faults(result: RunResult) -> Iterator[Moment]:
    for label, misses in result.misses.items():
        for miss in longest_curve_first(misses):
            yield Moment(*miss.moment, miss.evidence.point, label, MISS, miss, miss.number, miss.metres)
        for false in sorted(result.false.get(label, ()), key=lambda false: -false.frames)[:LISTED]:
            yield Moment(*false.moment, false.evidence.point, label, FALSE, false, false.number, false.metres)


def _contacts(result: RunResult, faulty: set[int]) -> Iterator[Moment]:
    """The longest contact of each pair without a fault, the reference's before anybody else's."""
    longest: dict[int, Episode] = {}
    for label in (result.oracle, *result.comparisons):
        for contact in sorted(result.episodes[label], key=lambda contact: contact.first - contact.last):
            longest.setdefault(contact.pair, contact)
    for pair, contact in longest.items():
        if pair not in faulty:
            frame = (contact.first + contact.last) // 2
            point = result.assembly.motion.translations[frame, result.assembly.pairs[pair]].mean(axis=0)
            yield Moment(frame, 0, vector_of(point), "", CONTACT, contact)


def nearest_moments(moments: Sequence[Moment]) -> list[tuple[int, int, Moment]]:
    """Frame, nanoseconds after it, and the moment that is nearest from there on: it changes half-way between two."""
    rows = [(0, 0, moment) for moment in moments[:1]]
    for before, moment in pairwise(moments):
        if before.frame == moment.frame:
            rows.append((moment.frame, moment.later, moment))
        else:
            rows.append(((before.frame + moment.frame + 1) // 2, 0, moment))
    return rows


def leading(result: RunResult, moments: Sequence[Moment]) -> Moment:
    """The moment that comes first: that of the answer; where nothing is wrong the longest contact."""
    answer = result.answers[0]
    if answer.moment is None:
        return max(moments, key=lambda moment: moment.last - moment.first)
    wanted = (answer.label, answer.moment.kind, answer.moment.number)
    return next((moment for moment in moments if (moment.label, moment.kind, moment.number) == wanted), moments[0])


def list_path(label: str) -> str:
    """Entity of the list of the moments of one detector; ``""``: of contacts without a fault."""
    return f"{LISTS}/{entity(label or CONTACT)}"


def log_moment_lists(writer: RecordingWriter, result: RunResult, moments: Sequence[Moment]) -> None:
    """Send one line per moment, for each detector below ``LISTS``."""
    names = {moment: result.assembly.pair_name(moment.pair) for moment in moments}
    wide = max(len(moment.label) for moment in moments), max(map(len, names.values()))
    for label in dict.fromkeys(moment.label for moment in moments):
        listed = [moment for moment in moments if moment.label == label]
        lines = [(_line(moment, names[moment], wide), moment.kind, COLOURS[moment.kind]) for moment in listed]
        writer.log_lines(list_path(label), np.array([session_ns(writer, moment) for moment in listed]), lines)


def session_ns(writer: RecordingWriter, moment: Moment) -> int:
    """Where the cursor meets it on the session timeline."""
    return int(writer.clock.ns[moment.frame]) + moment.later


def _line(moment: Moment, name: str, wide: tuple[int, int]) -> str:
    """One line of the list; ``wide``: letters of a label and of the name of a pair."""
    what = f"{moment.kind} {moment.number or ''}"
    line = f"{moment.label:<{wide[0]}} {what:<8}  {name:<{wide[1]}}"
    if isinstance(moment.stretch, Episode):
        return f"{line} {'':14}  {plural(moment.last - moment.first + 1, 'frame')}"
    late, what = (f"{moment.stretch.kind}: ", "curve") if moment.stretch.is_miss else ("", "apart")
    size = f"{moment.size * 1e3:.1f} mm {what}" if moment.size > 0 else ""
    # In a narrow view the end is cut: what tells moments apart comes first.
    return f"{line} {size:>14}  {late}{moment.stretch.cause}"


@dataclass(frozen=True)
class MomentPlace:
    """Where the cursor meets a moment; ``kind``: as of ``Moment``, or "event"; ``leads``: the picture opens there."""

    label: str
    kind: str
    number: int
    session_ns: int
    leads: bool


_PLACE_TYPES: Final = get_type_hints(MomentPlace)


def moment_places(writer: RecordingWriter, result: RunResult, moments: Sequence[Moment]) -> list[MomentPlace]:
    """Where to find each moment: of a number that several detectors have, that of the first of them comes first."""
    lead, order = leading(result, moments), [*result.comparisons, ""]
    return [
        MomentPlace(moment.label, moment.kind, moment.number, session_ns(writer, moment), moment is lead)
        for moment in sorted(moments, key=lambda moment: order.index(moment.label))
    ]


def log_moment_table(writer: RecordingWriter, places: Iterable[MomentPlace]) -> None:
    """Send where to find the moments, for ``read_moments``."""
    writer.static(TABLE, rr.AnyValues(moments=json.dumps([asdict(place) for place in places])))


def read_moments(recording: Path) -> list[MomentPlace]:
    """Return the moments that a recording holds; none if it compares nothing.

    Raises ``RunFolderError``: the file is no recording, is damaged, or was written by an earlier version.
    """
    try:
        require_complete_file(recording)
        has_rows, texts = read_texts(recording, f"/{TABLE}", "moments")
        places = [_checked_place(place) for text in texts for place in json.loads(text)]
    except UNREADABLE as error:
        raise RunFolderError.unreadable(recording, error) from error
    if has_rows and not texts:
        raise RunFolderError(f"{recording} is a picture of an earlier version; run its session again")
    return places


def _checked_place(fields: Any) -> MomentPlace:
    """Return the place with these fields; ``TypeError`` where a run writes no such fields."""
    place = MomentPlace(**fields)
    for field, kind in _PLACE_TYPES.items():
        if type(getattr(place, field)) is not kind:
            raise TypeError(f"{field} of a moment is not {kind.__name__}")
    return place
