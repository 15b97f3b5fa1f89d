"""Several recordings of one clock as one session: a file per body, or per device."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sessions.errors import ImportFileError
from sessions.importers.finish import Imported
from sessions.model.session import Session


def joined(parts: Mapping[Path, Session]) -> Imported:
    """Several sessions as one, whose stamps must share one clock; what two files name alike is named ``FILE/NAME``.

    Raises ``ImportFileError``: the times of two files do not overlap.
    """
    _check_clocks(parts)
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


def _check_clocks(parts: Mapping[Path, Session]) -> None:
    spans = sorted((int(part.frames.stamp_ns[0]), int(part.frames.stamp_ns[-1]), path) for path, part in parts.items())
    _, end, last = spans[0]
    for start, stop, path in spans[1:]:
        if start > end:
            raise ImportFileError(
                f"{path} begins {(start - end) / 1e9:g} s after {last} ends; give files of one clock and one recording"
            )
        if stop > end:
            end, last = stop, path


def _said(parts: Mapping[Path, Session], key: str) -> str:
    """What every file says of itself: once where all say the same."""
    said = {path: part.facts.get(key, "") for path, part in parts.items()}
    if len(set(said.values())) == 1:
        return next(iter(said.values()))
    return "; ".join(f"{path.name}: {text}" for path, text in said.items() if text)
