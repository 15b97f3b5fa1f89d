"""Several recordings as one session, a file per body or device; those of other clocks are moved onto the first one's.

Two clocks meet in marks that both hold: events of the same words. Offset, drift and residual are said.
"""

from collections import Counter
from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.errors import ImportFileError
from sessions.importers.finish import Imported
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


@dataclass(frozen=True)
class ClockFit:
    """``offset`` seconds at the mean of the readings, ``drift`` seconds a second, ``residual`` the largest miss."""

    readings: int
    middle: float
    offset: float
    drift: float
    residual: float

    @classmethod
    def of(cls, at: ArrayLike, ahead: ArrayLike) -> "ClockFit":
        """By least squares: at seconds ``at`` (n,) of one clock the other shows ``ahead`` (n,) seconds more."""
        times, values = np.asarray(at, dtype=np.float64), np.asarray(ahead, dtype=np.float64)
        middle = float(times.mean())
        spread = bool(np.ptp(times) > 0.0)
        drift, offset = np.polyfit(times - middle, values, 1) if spread else (0.0, values.mean())
        residual = np.abs(values - offset - drift * (times - middle)).max()
        return cls(len(times), middle, float(offset), float(drift), float(residual))

    def ahead(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the other clock shows more, (n,) seconds."""
        return self.offset + self.drift * (at - self.middle)

    @property
    def words(self) -> str:
        """Offset, drift and residual for a reader."""
        return (
            f"{self.offset * 1e3:.3f} ms, drift {self.drift * 1e6:.1f} ppm, "
            f"at most {self.residual * 1e3:.3f} ms from a line"
        )
