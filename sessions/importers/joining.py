"""Several recordings of one clock as one, a file per body or device."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from sessions.errors import ImportFileError
from sessions.importers.finish import Imported, check_poses, together


def joined(parts: Mapping[Path, Imported]) -> Imported:
    """Several recordings as one; what two files name alike is named ``FILE/NAME``.

    Raises ``ImportFileError``: a file without a pose, or one that lies apart from the first in time.
    """
    for path, part in parts.items():
        check_poses(part, path)
    (reference, first), *others = parts.items()
    if not others:
        return first
    begin, end = _span(first)
    for path, part in others:
        first_ns, last_ns = _span(part)
        if begin > last_ns or first_ns > end:
            raise ImportFileError(f"{path} and {reference.name} lie apart in time; give files of one clock")
    every = parts.values()
    conversions = _said({path: "; ".join(together(part.conversions)) for path, part in parts.items()})
    facts = {key: _said({path: part.facts.get(key, "") for path, part in parts.items()}) for key in first.facts}
    return replace(
        first,
        tracks=_named(parts, "tracks"),
        conversions=(conversions,),
        facts={**facts, "source_file": ", ".join(path.name for path in parts)},
        events=sorted((event for part in every for event in part.events), key=lambda event: event.time_ns),
        hands={side: hand for part in every for side, hand in part.hands.items()},
        live_contacts=sorted(
            (contact for part in every for contact in part.live_contacts), key=lambda contact: contact.time_ns
        ),
        intervals=[interval for part in every for interval in part.intervals],
        gaze=_named(parts, "gaze"),
        scalars=_named(parts, "scalars"),
    )


def _span(part: Imported) -> tuple[int, int]:
    """First and last stamp of its poses."""
    stamps = [track.times_ns for track in part.tracks.values() if len(track)]
    return min(int(times[0]) for times in stamps), max(int(times[-1]) for times in stamps)


def _named(parts: Mapping[Path, Imported], what: str) -> dict[str, Any]:
    """Everything of a kind by its name, with its file's name before it where several files have that name."""
    every: dict[Path, Mapping[str, Any]] = {path: getattr(part, what) for path, part in parts.items()}
    names = Counter(name for named in every.values() for name in named)
    found: dict[str, Any] = {}
    for path, named in every.items():
        for name, value in named.items():
            new = name if names[name] < 2 else f"{path.stem}/{name}"
            if new in found:
                raise ImportFileError(f"{path}: another file of that name has {name!r} too; rename the file")
            found[new] = value
    return found


def _said(words: Mapping[Path, str]) -> str:
    """What every file says of itself: once where all say the same."""
    if len({*words.values()}) == 1:
        return next(iter(words.values()))
    return "; ".join(f"{path.name}: {text}" for path, text in words.items() if text)
