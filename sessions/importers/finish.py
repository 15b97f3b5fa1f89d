"""Makes an imported session complete: adds meshes and stand-ins, and records which file it is of."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from operator import attrgetter
from pathlib import Path

import numpy as np

from sessions.errors import ImportFileError
from sessions.mesh_data import MeshData
from sessions.model.frames import Status
from sessions.model.scene import Scene, SceneBody
from sessions.model.session import Session
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

MESH_AXES = ("same", "x-flipped")

HALF_TURN = np.diag([-1.0, 1.0, -1.0, 1.0])
"""From a glTF that Unity wrote to the frame of its poses: F_z F_m^-1 with F_m = diag(-1, 1, 1)."""


def finished(
    session: Session,
    source: Path,
    *,
    meshes: Mapping[str, MeshSource] | None = None,
    scene: Scene | None = None,
    scene_folder: str | Path = ".",
    mesh_axes: str = "same",
    stand_ins: bool = False,
) -> Session:
    """The session of a source with its meshes; all keywords but ``stand_ins`` are options of every importer.

    Parameters
    ----------
    meshes : body name -> mesh file or mesh; they win over the scene's.
    scene : declared bodies, pairs and effects; its mesh paths are relative to ``scene_folder``.
    mesh_axes : ``same``, or ``x-flipped`` for meshes that a glTF exporter of Unity wrote (it flips X, the poses flip Z:
        without this every mesh is turned by 180 degrees about Y).
    stand_ins : whether headset and controllers get a mesh where none is given at all.

    Raises ``ImportFileError``: no pose that is not lost, a mesh for a body that is not there, an unknown ``mesh_axes``.
    """
    from sessions.meshes.mesh_files import load_mesh

    _check_poses(session, source)
    if mesh_axes not in MESH_AXES:
        raise ImportFileError(f"no mesh_axes {mesh_axes!r}; there are: {', '.join(MESH_AXES)}")
    declared = scene or session.scene
    given = {**session.meshes, **(scene_meshes(scene, scene_folder) if scene else {})}
    known = [*session.names, *(body.id for body in declared.bodies)]
    for name, mesh in (meshes or {}).items():
        if name not in known:
            raise ImportFileError(f"{source}: there is no body {name!r} to put a mesh on{nearest(name, known)}")
        given[name] = mesh if isinstance(mesh, MeshData) else load_mesh(mesh)
    facts = {"source_file": source.name, "conversions": "none", **session.facts}
    if mesh_axes != "same":
        files = {*(meshes or ()), *(body.id for body in declared.bodies if body.mesh)}
        given |= {name: given[name].transformed(HALF_TURN) for name in files}
        words = "mesh files were exported from Unity as glTF, which flips X instead of Z: turned by 180 degrees"
        facts["conversions"] = f"{facts['conversions']}; {words}".removeprefix("none; ")
    if stand_ins and not given:
        declared = _with_proxies(declared, session.names, given)
    complete = replace(
        session,
        meshes=given,
        scene=declared,
        facts=facts,
        events=tuple(sorted(session.events, key=attrgetter("time_ns"))),
        live_contacts=tuple(sorted(session.live_contacts, key=attrgetter("time_ns"))),
    )
    return with_colliders(complete, scene_folder)


def _check_poses(session: Session, source: Path) -> None:
    """Refuse a recording without a pose, or with none that is not lost."""
    status = session.frames.status
    if (status == Status.ABSENT).all():
        raise ImportFileError(f"{source}: there is no pose in it; check that this is the recording")
    if np.isin(status, (Status.ABSENT, Status.LOST)).all():
        conversions = session.facts.get("conversions", "").split("; ")
        why = "; ".join(words for words in conversions if "lost" in words) or "the source flags them"
        raise ImportFileError(f"{source}: every pose in it is lost ({why}); record it again, or choose other columns")


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


def _with_proxies(scene: Scene, names: Iterable[str], given: dict[str, MeshData]) -> Scene:
    from sessions.glassware.catalogue import make_instrument

    bodies = {body.id: body for body in scene.bodies}
    for name in names:
        row = proxy_for(name)
        if row:
            given[name] = make_instrument(row, PROXY_FACES).mesh
            body = bodies.get(name, SceneBody(id=name))
            bodies[name] = replace(body, instrument=row, proxy=True, extra={**body.extra, "faces": PROXY_FACES})
    marked = replace(scene, bodies=tuple(bodies.values()))
    return replace(marked, text=scene_to_toml(marked))
