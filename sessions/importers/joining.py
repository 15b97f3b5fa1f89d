"""Several recordings of one clock as one session: a file per body, or per device."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from sessions.errors import ImportFileError
from sessions.importers.finish import Imported, MeshSource, finished
from sessions.model.live_contact import LiveContact
from sessions.model.scene import Scene
from sessions.model.session import Session
from sessions.model.track import Track


def joined(
    parts: Mapping[Path, Session],
    *,
    meshes: Mapping[str, MeshSource] | None = None,
    scene: Scene | None = None,
    scene_folder: str | Path = ".",
    proxies: bool | None = None,
) -> Session:
    """One session of several, whose stamps must share one clock; a body of two files is named ``FILE/BODY``.

    Raises ``ImportFileError``: the times of two files do not overlap.
    """
    _check_clocks(parts)
    names = [name for part in parts.values() for name in part.names]
    tracks: dict[str, Track] = {}
    given: dict[str, MeshSource] = {}
    contacts: list[LiveContact] = []
    for path, part in parts.items():
        new = {name: name if names.count(name) == 1 else f"{path.stem}/{name}" for name in part.names}
        for name, track in part.tracks.items():
            if new[name] in tracks:
                raise ImportFileError(f"{path}: another file of that name has a body {name!r} too; rename the file")
            tracks[new[name]] = track
        given |= {new[name]: mesh for name, mesh in part.meshes.items()}
        contacts += part.live_contacts
    first = next(iter(parts.values()))
    facts = {key: _said(parts, key) for key in first.facts if key not in ("source_file", "conversions")}
    samples = Imported(
        tracks,
        (_said(parts, "conversions"),),
        {**facts, "source_file": ", ".join(path.name for path in parts)},
        sorted((event for part in parts.values() for event in part.events), key=lambda event: event.time_ns),
        {side: hand for part in parts.values() for side, hand in part.hands.items()},
        sorted(contacts, key=lambda contact: contact.time_ns),
    )
    whole = finished(
        samples,
        next(iter(parts)),
        meshes=given | dict(meshes or {}),
        scene=scene,
        scene_folder=scene_folder,
        proxies=proxies,
    )
    return replace(whole, intervals=tuple(one for part in parts.values() for one in part.intervals))


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
