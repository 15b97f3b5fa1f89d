"""Several recordings of one clock as one session, a file per body or device."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sessions.errors import ImportFileError
from sessions.importers.finish import Imported
from sessions.model.session import Session


def joined(parts: Mapping[Path, Session]) -> Imported:
    """Several sessions as one; what two files name alike is named ``FILE/NAME``.

    Raises ``ImportFileError``: a file that lies apart from the first in time.
    """
    (reference, first), *others = parts.items()
    for path, part in others:
        one, other = first.frames.stamp_ns, part.frames.stamp_ns
        if one[0] > other[-1] or other[0] > one[-1]:
            raise ImportFileError(f"{path} and {reference.name} lie apart in time; give files of one clock")
    facts = {key: _said(parts, key) for key in first.facts if key not in ("source_file", "conversions")}
    return Imported(
        tracks=_named(parts, "tracks"),
        conversions=(_said(parts, "conversions"),),
        facts={**facts, "source_file": ", ".join(path.name for path in parts)},
        events=sorted((event for part in parts.values() for event in part.events), key=lambda event: event.time_ns),
        hands={side: hand for part in parts.values() for side, hand in part.hands.items()},
        live_contacts=sorted(
            (contact for part in parts.values() for contact in part.live_contacts),
            key=lambda contact: contact.time_ns,
        ),
        intervals=[interval for part in parts.values() for interval in part.intervals],
        gaze=_named(parts, "gaze"),
        scalars=_named(parts, "scalars"),
        meshes=_named(parts, "meshes"),
    )


def _named(parts: Mapping[Path, Session], what: str) -> dict[str, Any]:
    """Everything of a kind by its name, with its file's name before it where several files have that name."""
    every: dict[Path, Mapping[str, Any]] = {path: getattr(part, what) for path, part in parts.items()}
    names = Counter(name for named in every.values() for name in named)
    if what == "meshes":  # called as the bodies that they belong to
        names = Counter(name for part in parts.values() for name in part.names)
    found: dict[str, Any] = {}
    for path, named in every.items():
        for name, value in named.items():
            new = name if names[name] < 2 else f"{path.stem}/{name}"
            if new in found:
                raise ImportFileError(f"{path}: another file of that name has {name!r} too; rename the file")
            found[new] = value
    return found


def _said(parts: Mapping[Path, Session], key: str) -> str:
    """What every file says of itself: once where all say the same."""
    said = {path: part.facts.get(key, "") for path, part in parts.items()}
    if len(set(said.values())) == 1:
        return next(iter(said.values()))
    return "; ".join(f"{path.name}: {text}" for path, text in said.items() if text)
