"""Several recordings of one clock as one, a file per body or device."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sessions.errors import ImportFileError
from sessions.model.frames import Status
from sessions.model.session import Session


def joined(parts: Mapping[Path, Session]) -> Session:
    """Several recordings as one; what two files name alike is named ``FILE/NAME``.

    Raises ``ImportFileError``: a file without a pose that is not lost, or one that lies apart from the first in time.
    """
    for path, part in parts.items():
        _check_poses(part, path)
    (reference, first), *others = parts.items()
    if not others:
        return first
    begin, end = first.frames.stamp_ns[[0, -1]]
    for path, part in others:
        first_ns, last_ns = part.frames.stamp_ns[[0, -1]]
        if begin > last_ns or first_ns > end:
            raise ImportFileError(f"{path} and {reference.name} lie apart in time; give files of one clock")
    every = parts.values()
    keys = dict.fromkeys(key for part in every for key in part.facts)
    facts = {key: _said({path: part.facts.get(key, "") for path, part in parts.items()}) for key in keys}
    return replace(
        first,
        source=Session.from_tracks(_named(parts, "tracks")).source,
        meshes=_named(parts, "meshes"),
        facts={**facts, "source_file": ", ".join(path.name for path in parts)},
        events=tuple(event for part in every for event in part.events),
        hands={side: hand for part in every for side, hand in part.hands.items()},
        live_contacts=tuple(contact for part in every for contact in part.live_contacts),
        intervals=tuple(interval for part in every for interval in part.intervals),
        gaze=_named(parts, "gaze"),
        scalars=_named(parts, "scalars"),
    )


def _check_poses(session: Session, source: Path) -> None:
    """Refuse a recording without a pose, or with none that is not lost."""
    status = session.frames.status
    if (status == Status.ABSENT).all():
        raise ImportFileError(f"{source}: there is no pose in it; check that this is the recording")
    if np.isin(status, (Status.ABSENT, Status.LOST)).all():
        conversions = session.facts.get("conversions", "").split("; ")
        why = "; ".join(words for words in conversions if "lost" in words) or "the source flags them"
        raise ImportFileError(f"{source}: every pose in it is lost ({why}); record it again, or choose other columns")


def _named(parts: Mapping[Path, Session], what: str) -> dict[str, Any]:
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
