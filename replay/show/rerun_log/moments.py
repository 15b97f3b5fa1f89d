"""Moments of a run in one list, of all its detectors: what each missed, what it said falsely, and one contact of each
other pair. A click on the time of a moment moves the cursor there.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from math import isnan
from operator import itemgetter
from pathlib import Path
from typing import Any, Final, get_type_hints

import numpy as np
import rerun as rr

from cdcore.protocol import counts_as_contact
from replay import words
from replay.auditing.fault import Cause, Fault, worst_first
from replay.auditing.outcome import Episode
from replay.document.run_result import RunResult
from replay.document.scores import MOST_LISTED_MOMENTS
from replay.effects.output import Vector, vector_of
from replay.errors import RunFolderError
from replay.show.palette import REFERENCE, Rgba, fault_colour
from replay.show.rerun_log.recording_file import RecordingWriter, entity, require_complete_file
from replay.show.rerun_log.recording_reader import RecordingDamagedError, read_texts
from replay.words import length, plural

MISS, FALSE, CONTACT = "miss", "false", "contact"
"""Kinds of moments."""

READING_ERRORS: Final = (OSError, ValueError, RuntimeError, TypeError, RecursionError, RecordingDamagedError)
"""What reading a damaged recording raises: Rerun's reader, and the list of moments in it."""

CAUSE_WIDTH: Final = max(map(len, Cause))
"""Letters of the longest cause."""

LISTS_ENTITY: Final = "moments/list"
TABLE_ENTITY: Final = "moments/table"


FrameTime = tuple[int, int]
"""A frame, and nanoseconds after it."""

Moments = Mapping[FrameTime, Fault | Episode]
"""Where the cursor meets each fault, and a contact of each pair without one; in order of time."""


def key_moments(result: RunResult) -> dict[FrameTime, Fault | Episode]:
    """Return all moments, in order of time; of those in one frame the worst comes last, by a nanosecond."""
    faults = [*_faults(result)]
    timed_moments: list[tuple[FrameTime, bool, float, Fault | Episode]] = [
        (fault.moment, fault.kind.is_miss, fault.metres, fault) for fault in faults
    ]
    columns = result.assembly.contact_columns
    for contact in _contacts(result, {int(columns[fault.pair]) for fault in faults}):
        timed_moments.append((((contact.first + contact.last) // 2, 0), False, 0.0, contact))
    moments: dict[FrameTime, Fault | Episode] = {}
    frame, later_ns = -1, 0
    for (moment_frame, fault_ns), _, _, fault in sorted(timed_moments, key=itemgetter(0, 1, 2)):
        later_ns = max(fault_ns, later_ns + 1) if moment_frame == frame else fault_ns
        frame = moment_frame
        moments[frame, later_ns] = fault
    return moments


def _faults(result: RunResult) -> Iterator[Fault]:
    for label, misses in result.misses.items():
        yield from worst_first(misses)
        yield from worst_first(result.false.get(label, ()))[:MOST_LISTED_MOMENTS]


def _contacts(result: RunResult, faulty_pairs: set[int]) -> Iterator[Episode]:
    """The longest contact of each pair without a fault, the reference's before anybody else's."""
    longest_contacts: dict[int, Episode] = {}
    for label in (result.oracle, *result.comparisons):
        for contact in sorted(result.episodes[label], key=lambda contact: contact.first - contact.last):
            longest_contacts.setdefault(contact.pair, contact)
    yield from (
        _contact_of_member(result, contact) for pair, contact in longest_contacts.items() if pair not in faulty_pairs
    )


def _contact_of_member(result: RunResult, contact: Episode) -> Episode:
    """A contact of a group as that of the member that touches in its middle."""
    reference = result.detections[result.oracle]
    member_columns = result.assembly.columns_of_contact(contact.pair)
    is_touching = counts_as_contact(reference.verdict[(contact.first + contact.last) // 2, member_columns])
    return replace(contact, pair=member_columns[int(is_touching.argmax())])


def point_of(result: RunResult, time: FrameTime, moment: Fault | Episode) -> Vector:
    """Return where a moment is in the world: at the fault, or between the bodies of a contact."""
    if isinstance(moment, Fault):
        return moment.point
    motion, pairs = result.assembly.motion, result.assembly.pairs
    return vector_of(motion.translations[time[0], pairs[moment.pair]].mean(axis=0))


def nearest_moments(times: Iterable[FrameTime]) -> list[tuple[int, int, FrameTime]]:
    """Frame, nanoseconds after it, and the moment that is nearest from there on: it changes half-way between two."""
    ordered_times = [*times]
    frame_steps = [(0, 0, time) for time in ordered_times[:1]]
    for previous_time, time in pairwise(ordered_times):
        if previous_time[0] == time[0]:
            frame_steps.append((*time, time))
        else:
            frame_steps.append(((previous_time[0] + time[0] + 1) // 2, 0, time))
    return frame_steps


def leading_moment(result: RunResult, moments: Moments) -> FrameTime:
    """The moment that comes first: that of the answer; where nothing is wrong the longest contact."""
    answer = result.answers[0]
    if answer.moment is None:
        return max(moments, key=lambda time: moments[time].last - moments[time].first)
    answer_key = (answer.label, answer.moment.kind, answer.moment.number)
    return next((time for time, fault in moments.items() if _moment_key(fault) == answer_key), next(iter(moments)))


def _moment_key(moment: Fault | Episode) -> tuple[str, str, int]:
    """Label of the detector, kind and number of a moment; no detector is at fault about a contact."""
    if isinstance(moment, Fault):
        return moment.detector, moment.kind.category.value, moment.number
    return "", CONTACT, 0


def list_path(label: str) -> str:
    """Entity of the list of the moments of one detector; ``""``: of contacts without a fault."""
    return f"{LISTS_ENTITY}/{entity(label or CONTACT)}"


def log_moment_lists(writer: RecordingWriter, result: RunResult, moments: Moments) -> None:
    """Send one line per moment, for each detector below ``LISTS_ENTITY``."""
    pair_names = [result.assembly.pair_name(moment.pair) for moment in moments.values()]
    widths = (
        max(len(_moment_key(moment)[0]) for moment in moments.values()),
        max(len(_number_text(moment)) for moment in moments.values()),
        max(map(len, pair_names)),
    )
    lines_of_label: dict[str, list[tuple[int, tuple[str, str, Rgba]]]] = {}
    for (time, moment), name in zip(moments.items(), pair_names, strict=True):
        label, kind, _ = _moment_key(moment)
        colour = fault_colour(moment.kind) if isinstance(moment, Fault) else REFERENCE
        line = (_list_line(moment, writer.session_ns(time) / 1e9, name, widths), kind, colour)
        lines_of_label.setdefault(label, []).append((writer.session_ns(time), line))
    for label, rows in lines_of_label.items():
        times, texts = zip(*rows, strict=True)
        writer.log_lines(list_path(label), np.array(times), texts)


def _number_text(moment: Fault | Episode) -> str:
    """``late 3``: what a moment is, in one word, and its number; late contacts and missed ones share their numbers."""
    return f"{moment.name.split()[0]} {moment.number}" if isinstance(moment, Fault) else CONTACT


def _list_line(moment: Fault | Episode, seconds: float, pair_name: str, widths: tuple[int, int, int]) -> str:
    """Return a line of the list: time, detector, number, cause, pair and size of a moment.

    ``widths``: letters of a label, of a numbered word and of the name of a pair.
    """
    label = _moment_key(moment)[0]
    # The viewer cuts its own column of times, and in a narrow view the end of a line: time and cause come first.
    line = f"{words.moment(seconds):>10}  {label:<{widths[0]}} {_number_text(moment):<{widths[1]}} "
    if isinstance(moment, Episode):
        return f"{line} {plural(moment.last - moment.first + 1, 'frame'):<{CAUSE_WIDTH}} {pair_name}"
    metres, length_word = moment.metres, "curve" if moment.kind.is_miss else "apart"
    if moment.kind.is_miss and not isnan(moment.depth):
        metres, length_word = moment.depth, "deep"
    length_text = f"{length(metres)} {length_word}" if metres > 0 else ""
    return f"{line} {moment.cause:<{CAUSE_WIDTH}} {pair_name:<{widths[2]}} {length_text:>14}"


@dataclass(frozen=True)
class Bookmark:
    """A position of the cursor, as the recording holds it.

    Parameters
    ----------
    label : of the detector; ``""``: no detector is at fault.
    kind : ``miss``, ``false``, ``contact`` or ``event``.
    number : of the fault or the event.
    session_ns : nanoseconds on the session timeline.
    leads : whether the picture opens there.
    """

    label: str
    kind: str
    number: int
    session_ns: int
    leads: bool


_BOOKMARK_TYPES: Final = get_type_hints(Bookmark)


def bookmarks(writer: RecordingWriter, result: RunResult, moments: Moments) -> list[Bookmark]:
    """Return the position of each moment: of a number that several detectors have, that of the first comes first."""
    leading_time, label_order = leading_moment(result, moments), [*result.comparisons, ""]
    bookmark_rows = [
        Bookmark(*_moment_key(moment), session_ns=writer.session_ns(time), leads=time == leading_time)
        for time, moment in moments.items()
    ]
    return sorted(bookmark_rows, key=lambda bookmark: label_order.index(bookmark.label))


def log_bookmarks(writer: RecordingWriter, bookmark_rows: Iterable[Bookmark]) -> None:
    """Send the positions of the cursor, for ``read_bookmarks``."""
    writer.static(TABLE_ENTITY, rr.AnyValues(moments=json.dumps([asdict(bookmark) for bookmark in bookmark_rows])))


def read_bookmarks(recording: Path) -> list[Bookmark]:
    """Return the positions of the cursor that a recording holds; none if it compares nothing.

    Raises ``RunFolderError``: the file is no recording, is damaged, or was written by an earlier version.
    """
    try:
        require_complete_file(recording)
        has_rows, texts = read_texts(recording, f"/{TABLE_ENTITY}", "moments")
        rows = [_checked_bookmark(fields) for text in texts for fields in json.loads(text)]
    except READING_ERRORS as error:
        raise RunFolderError.unreadable(recording, error) from error
    if has_rows and not texts:
        raise RunFolderError(f"{recording} is a picture of an earlier version; run its session again")
    return rows


def _checked_bookmark(bookmark_fields: Any) -> Bookmark:
    """Return the bookmark with these fields; ``TypeError`` where a run writes no such fields."""
    bookmark = Bookmark(**bookmark_fields)
    for field, kind in _BOOKMARK_TYPES.items():
        if type(getattr(bookmark, field)) is not kind:
            raise TypeError(f"{field} of a moment is not {kind.__name__}")
    return bookmark
