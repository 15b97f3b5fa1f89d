"""The meshes a scene declares: files beside it, plain shapes, instruments of the bench; and every fault of a scene."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sessions.errors import MeshFileError, SceneError, SceneSourceError, SessionError
from sessions.geometry.shapes import DEFAULT_FACES, make_shape
from sessions.input_files import read_text
from sessions.mesh_data import MeshData
from sessions.meshes.mesh_axes import BODY, mesh_axes_matrix
from sessions.meshes.mesh_match import ColliderFile, read_colliders
from sessions.model.assumption import ASSUMPTIONS_FACT, Subject, assumptions_fact, pose_convention
from sessions.model.constants import SCENE_FACT
from sessions.model.scene import Scene, SceneBody
from sessions.model.session import Session
from sessions.scene_files.answers import recording_assumptions
from sessions.scene_files.body_axes import in_body_axes, scene_meshes_in_body_axes
from sessions.scene_files.scene_toml import (
    added_scene,
    declares_bodies,
    named_source,
    parse_scene,
    recorded_bodies,
    scene_and_faults,
    with_recorded_groups,
)
from sessions.scene_formats.scene_source import (
    Y_UP_OF_Z_UP,
    SceneSource,
    Surface,
    read_scene_source,
    surface_assumptions,
)

INSTRUMENT_FACES = 5000
Z_UP = (2, 1)
"""The axis that points up in the world of MJCF and URDF, and its sign."""
COLLIDER_AXES = "canonical"
"""Axes of a file of colliders where nobody says: those of the recording, in which ``VrLabColliders.cs`` writes them."""


def with_scene(session: Session, path: str | Path) -> Session:
    """The session with the scene of a TOML file in place of its own: of that one groups are kept, if the file has none.

    A scene that declares no body adds to the recording's own (`added_scene`). ``from`` in it names a scene of another
    program, whose bodies, surfaces, colliders and excluded pairs are taken.

    A mesh that the scene declares stands in place of the recorded one; a body that declares none keeps it. The fact
    ``scene_file`` names the file. Raises SceneError: as `read_scene` and `scene_meshes`.
    """
    text, file = read_text(path, "scene", SceneError), Path(path).name
    source = scene_source(text, Path(path).parent, file)
    if source is not None:
        return with_source(session, source, text, Path(path))
    recorded = recorded_bodies(session.scene, session.names)
    if declares_bodies(text, file):
        scene = with_recorded_groups(parse_scene(text, file, recorded), recorded)
    else:
        more = parse_scene(text, file, recorded)
        # Meshes that the recording's own scene names lie beside nobody's file: they are in the recording.
        facts = {**session.facts, SCENE_FACT: file}
        extended = replace(session, scene=added_scene(recorded, more), facts=facts)
        return with_colliders(extended, Path(path).parent)
    declared, facts = scene_meshes_in_body_axes(scene, scene_meshes(scene, Path(path).parent), session.facts)
    meshes = {**session.meshes, **declared}
    replaced = replace(session, scene=scene, meshes=meshes, facts={**facts, SCENE_FACT: file})
    return with_colliders(replaced, Path(path).parent)


def scene_source(text: str, folder: Path, file: str) -> SceneSource | None:
    """The scene of another program that a scene names by ``from``; ``None``: it names none.

    All its files lie in the scene's folder, or in that which it names by ``root``.

    SceneError: it cannot be taken.
    """
    named = named_source(text, file)
    if not named["from"]:
        return None
    try:
        surface = Surface(named["surface"] or Surface.AUTO)
    except ValueError:
        kinds = ", ".join(Surface)
        raise SceneError(f"{file}: [scene]: surface is {named['surface']!r}; give one of: {kinds}") from None
    try:
        return read_scene_source(folder / named["from"], folder / named["root"], surface)
    except SceneSourceError as error:
        raise SceneError(f"{file}: [scene]: from: {error}") from error


def with_source(session: Session, source: SceneSource, text: str, path: Path) -> Session:
    """The session with the bodies of a scene of another program, and with what a scene's text says besides."""
    poses = pose_convention(session.facts)
    axes = mesh_axes_matrix(BODY, poses)
    if np.linalg.det(axes) < 0.0:
        raise SceneError(
            f"{path.name}: [scene]: from: the poses of the recording are left-handed ({poses.name}), and "
            f"{source.format} is right-handed; export the recording in a right-handed frame"
        )
    if poses.up == Z_UP and np.array_equal(source.rotation, Y_UP_OF_Z_UP):
        # Both worlds have +Z up: what stands still in the scene is where the recording's axes say, X forward too.
        source = replace(source, rotation=poses.matrix)
    scene = parse_scene(text, path.name, source_bodies(source, session.names, axes))
    excluded = tuple(pair for pair in source.excluded if all(scene.body(name) for name in pair))
    scene = replace(scene, ignore=tuple(dict.fromkeys([*scene.ignore, *excluded])), text="")
    own, facts = scene_meshes_in_body_axes(scene, scene_meshes(scene, path.parent), session.facts)
    taken = {name: in_body_axes(body.mesh, BODY, poses) for name, body in source.bodies.items()}
    solids = {
        name: tuple(in_body_axes(solid, BODY, poses) for solid in body.colliders)
        for name, body in source.bodies.items()
        if body.colliders
    }
    complete = replace(
        session,
        scene=scene,
        meshes={**session.meshes, **taken, **own},
        colliders={**session.colliders, **solids},
        facts={**facts, SCENE_FACT: path.name},
    )
    requested = Surface(named_source(text, path.name)["surface"] or Surface.AUTO)
    kept = [row for row in recording_assumptions(replace(session, facts=facts)) if row.subject is not Subject.SURFACE]
    assumed = [*kept, *surface_assumptions(source, requested)]
    complete = replace(complete, facts={**complete.facts, ASSUMPTIONS_FACT: assumptions_fact(assumed)})
    notes = [f"scene of {source.format}: {sentence}" for sentence in source.notes]
    notes += [f"scene of {source.format}: not taken: {sentence}" for sentence in dict.fromkeys(source.left_out)]
    complete = replace(complete, facts=_converted_meshes(complete, notes))
    return with_colliders(complete, path.parent)


def source_bodies(source: SceneSource, tracked: Sequence[str], axes: NDArray[np.float64] | None = None) -> Scene:
    """The bodies of a scene of another program as declared; one that is tracked is not fixed where it stood there.

    ``axes``: what the bodies' own axes are rotated by, as those of the recording are.
    """
    bodies = (body.declared(source.rotation, axes) for body in source.bodies.values())
    return Scene(bodies=tuple(replace(body, fixed=None) if body.id in tracked else body for body in bodies))


def with_colliders(session: Session, folder: str | Path, file: str | Path = "", axes: str = COLLIDER_AXES) -> Session:
    """The session with the colliders of a GLB: the one given, else that which its scene names, else its own ones.

    ``axes`` of the file, as ``--mesh-axes`` takes them.

    Raises MeshFileError: as `read_colliders`.
    """
    colliders = session_colliders(session, folder, file)
    return session if colliders is None else with_collider_file(session, colliders, axes)


def session_colliders(session: Session, folder: str | Path, file: str | Path = "") -> ColliderFile | None:
    """Returns the colliders of a GLB for the bodies of a session: of the file given, else of that its scene names."""
    named = file or session.scene.colliders
    if not named:
        return None
    bodies = [*session.names, *(body.id for body in session.scene.bodies if body.id not in session.names)]
    return read_colliders(Path(folder) / named, bodies)


def with_collider_file(session: Session, colliders: ColliderFile, axes: str = COLLIDER_AXES) -> Session:
    """Returns the session with these colliders, turned from the axes of their file."""
    poses = pose_convention(session.facts)
    rotated = {
        name: tuple(in_body_axes(solid, axes, poses) for solid in solids) for name, solids in colliders.solids.items()
    }
    return replace(session, colliders=rotated, facts=_converted_meshes(session, [colliders.sentence]))


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


def with_meshes(session: Session, meshes: Mapping[str, MeshData], notes: Sequence[str]) -> Session:
    """The session with these meshes; a body that has one is no stand-in any more. ``notes`` joins its conversions."""
    bodies = tuple(_bare(body) if body.id in meshes else body for body in session.scene.bodies)
    scene = session.scene if bodies == session.scene.bodies else replace(session.scene, bodies=bodies, text="")
    return replace(session, meshes={**session.meshes, **meshes}, scene=scene, facts=_converted_meshes(session, notes))


def _converted_meshes(session: Session, notes: Sequence[str]) -> dict[str, str]:
    before = session.facts.get("conversions", "none")
    return {**session.facts, "conversions": "; ".join([*([before] if before != "none" else []), *notes]) or "none"}


def _bare(body: SceneBody) -> SceneBody:
    """The body without a word on its mesh."""
    extra = {key: value for key, value in body.extra.items() if key not in ("faces", "options")}
    return replace(
        body, mesh="", node="", shape="", instrument="", size={}, scale=1.0, mesh_axes="", proxy=False, extra=extra
    )


Planned = Callable[[Scene], Sequence[str]]
"""A scene and its file's name -> what is wrong with what it declares for effects, a sentence each."""


def checked_scene(
    text: str, file: str, planned: Planned, folder: Path | None = None, recorded: Scene | None = None
) -> tuple[Scene, dict[str, MeshData], list[str]]:
    """Reads as much of a scene's text as possible, the meshes it declares, and lists every problem of both.

    ``file`` is the name used in messages. ``folder``: where its mesh files lie; ``None``: no mesh is looked at.
    ``recorded``: what a scene that declares no body adds to.
    """
    try:
        source = None if folder is None else scene_source(text, folder, file)
        if source is not None:
            recorded = source_bodies(source, ())
        scene, faults = scene_and_faults(text, file, recorded)
        if recorded is not None and source is None:
            adds = not declares_bodies(text, file)
            scene = added_scene(recorded, scene) if adds else with_recorded_groups(scene, recorded)
    except SceneError as error:  # no TOML at all
        return Scene(), {}, [*error.faults]
    meshes: dict[str, MeshData] = {}
    faulty = tuple(f"({body.id!r})" for body in scene.bodies if any(f"({body.id!r})" in fault for fault in faults))
    if folder is not None:
        for body in scene.bodies:
            try:
                meshes |= scene_meshes(replace(scene, name=file, bodies=(body,)), folder)
            except SceneError as error:
                # A shape that cannot be made of wrong numbers is no second fault; a file that is not there is one.
                faults += error.faults if body.mesh or f"({body.id!r})" not in faulty else ()
        if scene.colliders:
            try:
                read_colliders(folder / scene.colliders, None)
            except MeshFileError as error:
                faults.append(f"{file}: [scene]: {error}")
    # What an effect names is looked up twice, in other words, and so is an instrument that is also a vessel.
    refused = tuple(f"{file}: body {body} has a cavity that cannot be made" for body in (name[1:-1] for name in faulty))
    faults += [
        fault
        for fault in planned(scene)
        if fault.replace("between: no body", "no body") not in faults and not fault.startswith(refused)
    ]
    return scene, meshes, faults
