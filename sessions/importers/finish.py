"""Makes a session of converted samples: adds meshes and stand-ins, and records what was converted."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sessions.errors import ImportFileError
from sessions.mesh_data import MeshData
from sessions.model.event import Event, Interval, LiveContact
from sessions.model.scene import Scene, SceneBody
from sessions.model.session import Session
from sessions.model.track import GazeTrack, HandTrack, ScalarTrack, Track
from sessions.scene_files.scene_meshes import scene_meshes, with_colliders
from sessions.scene_files.scene_toml import scene_to_toml
from sessions.scene_files.toml_table import nearest

MeshSource = str | Path | MeshData

PROXIES = {
    "proxy_headset": re.compile("camera|head|hmd|headset"),
    "proxy_wand": re.compile("(l|r|left|right)?(hand|controller|wand)"),
}
"""Stand-in mesh -> a word in the name of a body that it can stand for."""
SIDES = ("left", "right")
"""A body of this name alone is a controller; ``left_wheel`` is none."""

PROXY_FACES = 2000


@dataclass(frozen=True)
class Imported:
    """What an importer read, already in the canonical frame and in metres; ``finished`` makes a session of it.

    ``conversions``: sentences about what was done to the numbers.
    ``mesh_turn``: (4, 4), what mesh files are turned by before they are in the frame of the poses.
    """

    tracks: Mapping[str, Track]
    conversions: tuple[str, ...]
    facts: Mapping[str, str] = field(default_factory=dict)
    events: Sequence[Event] = ()
    hands: Mapping[str, HandTrack] = field(default_factory=dict)
    live_contacts: Sequence[LiveContact] = ()
    intervals: Sequence[Interval] = ()
    gaze: Mapping[str, GazeTrack] = field(default_factory=dict)
    scalars: Mapping[str, ScalarTrack] = field(default_factory=dict)
    mesh_turn: NDArray[np.float64] | None = None
    of_people: bool = True
    """Whether names like ``head`` and ``left`` mean a headset and controllers; of a robot they do not."""


def check_poses(samples: Imported, source: Path) -> None:
    """Refuse a recording without a pose, or with none that is not lost."""
    if not any(len(track) for track in samples.tracks.values()):
        raise ImportFileError(f"{source}: there is no pose in it; check that this is the recording")
    if not any(track.valid.any() for track in samples.tracks.values()):
        why = "; ".join(words for words in together(samples.conversions) if "lost" in words) or "the source flags them"
        raise ImportFileError(f"{source}: every pose in it is lost ({why}); record it again, or choose other columns")


def finished(
    samples: Imported,
    source: Path,
    *,
    meshes: Mapping[str, MeshSource] | None = None,
    scene: Scene | None = None,
    scene_folder: str | Path = ".",
    proxies: bool | None = None,
) -> Session:
    """A session from samples; these keywords are options of every importer.

    Parameters
    ----------
    meshes : body name -> mesh file or mesh; they win over the scene's.
    scene : declared bodies, pairs and effects; its mesh paths are relative to ``scene_folder``.
    proxies : whether headset and controllers without a mesh get a stand-in; ``None``: only if no mesh is given at all,
        and not in recordings of robots.

    Raises ``ImportFileError``: a mesh for a body that is not there.
    """
    from sessions.meshes.mesh_files import load_mesh

    declared = scene or Scene()
    ids = [body.id for body in declared.bodies]
    given = scene_meshes(declared, scene_folder)
    known = [*samples.tracks, *ids]
    for name, mesh in (meshes or {}).items():
        if name not in known:
            raise ImportFileError(f"{source}: there is no body {name!r} to put a mesh on{nearest(name, known)}")
        given[name] = mesh if isinstance(mesh, MeshData) else load_mesh(mesh)
    if samples.mesh_turn is not None:
        files = {*(meshes or ()), *(body.id for body in declared.bodies if body.mesh)}
        given |= {name: given[name].transformed(samples.mesh_turn) for name in files}
    if proxies or (proxies is None and not given and samples.of_people):
        declared = _with_proxies(declared, samples.tracks, given)
    conversions = "; ".join(together(samples.conversions)) or "none"
    session = Session.from_tracks(
        samples.tracks,
        given,
        declared,
        events=samples.events,
        intervals=samples.intervals,
        facts={"source_file": source.name, "conversions": conversions, **samples.facts},
    )
    held = replace(
        session,
        live_contacts=tuple(samples.live_contacts),
        hands=dict(samples.hands),
        gaze=dict(samples.gaze),
        scalars=dict(samples.scalars),
    )
    return with_colliders(held, scene_folder)


def together(notes: Iterable[str]) -> list[str]:
    """Notes of the same words about several things as one: ``a, b: 3 rows dropped``."""
    about: dict[str, list[str]] = {}
    for note in notes:
        what, colon, words = note.partition(": ")
        about.setdefault(colon + words or note, []).append(what if colon else "")
    return [", ".join(filter(None, dict.fromkeys(names))) + words for words, names in about.items()]


def name_words(name: str) -> list[str]:
    """The words of a name in small letters: ``LeftHand_2`` is ``left`` and ``hand``."""
    return [word.lower() for word in re.findall("[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)]


def proxy_for(name: str) -> str:
    """The instrument that can stand in for a body of this name, or ``""``."""
    words = name_words(name)
    if len(words) == 1 and words[0] in SIDES:
        return "proxy_wand"
    return next((proxy for proxy, known in PROXIES.items() if any(map(known.fullmatch, words))), "")


def side_of(name: str) -> str:
    """``left`` or ``right`` where a word of the name begins with it, else the name itself."""
    words = name_words(name)
    return next((side for side in SIDES if any(word.startswith(side) for word in words)), name)


def _with_proxies(scene: Scene, names: Mapping[str, Track], given: dict[str, MeshData]) -> Scene:
    from sessions.glassware.catalogue import make_instrument

    bodies = {body.id: body for body in scene.bodies}
    for name in names:
        row = proxy_for(name)
        if row and name not in given:
            given[name] = make_instrument(row, PROXY_FACES).mesh
            body = bodies.get(name, SceneBody(id=name))
            bodies[name] = replace(body, instrument=row, proxy=True, extra={**body.extra, "faces": PROXY_FACES})
    marked = replace(scene, bodies=tuple(bodies.values()))
    return replace(marked, text=scene_to_toml(marked))
