"""Several recordings as one session: a file per body, or per device."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sessions.errors import ImportFileError
from sessions.importers.finish import Imported
from sessions.importers.marks import on_one_clock
from sessions.model.session import Session


def joined(parts: Mapping[Path, Session]) -> Imported:
    """Several sessions as one, on the clock of the first; what two files name alike is named ``FILE/NAME``.

    Raises ``ImportFileError``: a file that lies apart from the first in time, and shares no mark with it.
    """
    parts = on_one_clock(parts)
    first = next(iter(parts.values()))
    facts = {key: _said(parts, key) for key in first.facts if key not in ("source_file", "conversions")}
    return Imported(
        _named(parts, "tracks"),
        (_said(parts, "conversions"),),
        {**facts, "source_file": ", ".join(path.name for path in parts)},
        sorted((event for part in parts.values() for event in part.events), key=lambda event: event.time_ns),
        {side: hand for part in parts.values() for side, hand in part.hands.items()},
        sorted((one for part in parts.values() for one in part.live_contacts), key=lambda one: one.time_ns),
        [one for part in parts.values() for one in part.intervals],
        _named(parts, "gaze"),
        _named(parts, "scalars"),
        _named(parts, "meshes"),
    )


def _named(parts: Mapping[Path, Session], what: str) -> dict[str, Any]:
    """Everything of a kind by its name, with its file's name before it where several files have that name."""
    every: dict[Path, Mapping[str, Any]] = {path: getattr(part, what) for path, part in parts.items()}
    names = Counter(name for named in every.values() for name in named)
    if what == "meshes":  # called as the bodies that they belong to
        names = Counter(name for part in parts.values() for name in part.names)
    found: dict[str, Any] = {}
    for path, named in every.items():
        for name, one in named.items():
            new = name if names[name] < 2 else f"{path.stem}/{name}"
            if new in found:
                raise ImportFileError(f"{path}: another file of that name has {name!r} too; rename the file")
            found[new] = one
    return found


def _said(parts: Mapping[Path, Session], key: str) -> str:
    """What every file says of itself: once where all say the same."""
    said = {path: part.facts.get(key, "") for path, part in parts.items()}
    if len(set(said.values())) == 1:
        return next(iter(said.values()))
    return "; ".join(f"{path.name}: {text}" for path, text in said.items() if text)
