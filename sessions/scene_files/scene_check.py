"""Every fault of a scene, not the first alone: what its text says, the meshes it names, the effects it declares."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from sessions.errors import MeshFileError, SceneError
from sessions.mesh_data import MeshData
from sessions.meshes.collider_files import read_colliders
from sessions.model.scene import Scene
from sessions.scene_files.scene_meshes import scene_meshes
from sessions.scene_files.scene_toml import scene_and_faults

Planned = Callable[[Scene, str], Sequence[str]]
"""A scene and its file's name -> what is wrong with what it declares for effects, a sentence each."""


def checked_scene(
    text: str, file: str, planned: Planned, folder: Path | None = None
) -> tuple[Scene, dict[str, MeshData], list[str]]:
    """What can be read of a scene's text, the meshes it declares, and everything that is wrong with both.

    ``file`` is the name used in messages. ``folder``: where its mesh files lie; ``None``: no mesh is looked at.
    """
    try:
        scene, faults = scene_and_faults(text, file)
    except SceneError as error:  # no TOML at all
        return Scene(), {}, [*error.faults]
    meshes: dict[str, MeshData] = {}
    faulty = tuple(f"({body.id!r})" for body in scene.bodies if any(f"({body.id!r})" in fault for fault in faults))
    for body in () if folder is None else scene.bodies:
        try:
            meshes |= scene_meshes(replace(scene, name=file, bodies=(body,)), folder or ".")
        except SceneError as error:
            # A shape that cannot be made of wrong numbers is no second fault; a file that is not there is one.
            faults += error.faults if body.mesh or f"({body.id!r})" not in faulty else ()
    if scene.colliders and folder is not None:
        try:
            read_colliders(folder / scene.colliders, None)
        except MeshFileError as error:
            faults.append(f"{file}: [scene]: {error}")
    # What an effect names is looked up twice, in other words.
    faults += [fault for fault in planned(scene, file) if fault.replace("between: no body", "no body") not in faults]
    return scene, meshes, faults
