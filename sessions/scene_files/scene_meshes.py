"""The meshes a scene declares: files beside it, plain shapes, instruments of the bench."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from sessions.errors import SceneError, SessionError
from sessions.geometry.shapes import DEFAULT_FACES, make_shape
from sessions.mesh_data import MeshData
from sessions.model.scene import Scene, SceneBody
from sessions.model.session import Session
from sessions.scene_files.scene_toml import read_scene

INSTRUMENT_FACES = 5000

SCENE_FACT = "scene_file"
"""The fact that names the file of a scene which stands in place of the recording's own."""


def with_scene(session: Session, path: str | Path) -> Session:
    """The session with the scene of a TOML file in place of its own: nothing of that one is kept.

    A mesh that the scene declares stands in place of the recorded one; a body that declares none keeps it. The fact
    ``scene_file`` names the file. Raises SceneError: as `read_scene` and `scene_meshes`.
    """
    scene = read_scene(path)
    meshes = {**session.meshes, **scene_meshes(scene, Path(path).parent)}
    replaced = replace(session, scene=scene, meshes=meshes, facts={**session.facts, SCENE_FACT: Path(path).name})
    return with_colliders(replaced, Path(path).parent)


def with_colliders(session: Session, folder: str | Path, file: str | Path = "") -> Session:
    """The session with the colliders of a GLB: the one given, else that which its scene names, else its own ones.

    Raises MeshFileError: as `read_colliders`.
    """
    named = file or session.scene.colliders
    if not named:
        return session
    from sessions.meshes.collider_files import read_colliders

    bodies = [*session.names, *(body.id for body in session.scene.bodies if body.id not in session.names)]
    found, words = read_colliders(Path(folder) / named, bodies)
    return replace(session, colliders=found, facts=_converted(session, [words]))


def scene_meshes(scene: Scene, folder: str | Path = ".") -> dict[str, MeshData]:
    """Name -> mesh of every body that declares one; paths are relative to ``folder``.

    A SceneError names each body with a faulty mesh, and what is wrong with it.
    """
    meshes, faults = {}, []
    for body in scene.bodies:
        try:
            mesh = _mesh(body, Path(folder))
        except (SessionError, TypeError, ValueError) as error:  # the latter two from options of the wrong type
            faults.append(f"{scene.name or 'scene'}: body {body.id!r}: {error}")
            continue
        if mesh is not None:
            meshes[body.id] = mesh
    if faults:
        raise SceneError(*faults)
    return meshes


def _mesh(body: SceneBody, folder: Path) -> MeshData | None:
    if body.mesh:
        from sessions.meshes.mesh_files import load_mesh

        return load_mesh(folder / body.mesh, body.scale, body.node)
    if body.shape:
        return make_shape(body.shape, body.size, int(body.extra.get("faces", DEFAULT_FACES)))
    if body.instrument:
        from sessions.glassware.catalogue import make_instrument

        faces = int(body.extra.get("faces", INSTRUMENT_FACES))
        return make_instrument(body.instrument, faces, **body.extra.get("options", {})).mesh
    return None


def with_meshes(session: Session, meshes: Mapping[str, MeshData], said: Sequence[str]) -> Session:
    """The session with these meshes; a body that has one is no stand-in any more. ``said`` joins its conversions."""
    bodies = tuple(_bare(body) if body.id in meshes else body for body in session.scene.bodies)
    scene = session.scene if bodies == session.scene.bodies else replace(session.scene, bodies=bodies, text="")
    return replace(session, meshes={**session.meshes, **meshes}, scene=scene, facts=_converted(session, said))


def _converted(session: Session, said: Sequence[str]) -> dict[str, str]:
    before = session.facts.get("conversions", "none")
    return {**session.facts, "conversions": "; ".join([*([before] if before != "none" else []), *said]) or "none"}


def _bare(body: SceneBody) -> SceneBody:
    """The body without a word on its mesh."""
    extra = {key: value for key, value in body.extra.items() if key not in ("faces", "options")}
    return replace(body, mesh="", node="", shape="", instrument="", size={}, scale=1.0, proxy=False, extra=extra)
