"""Axes of mesh files: how a mesh is turned so that it stands in the canonical axes of its body.

Poses are turned into the canonical frame by the convention of their source; a mesh in the axes of its body is turned
alike. A file may have other axes: glTF is Y up by its standard, and engines flip an axis on import and export.

Source: `mesh_axes.toml`, row by row; Khronos glTF 2.0, section 3.4.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from sessions.errors import SessionError
from sessions.geometry.rotations import Array
from sessions.meshes.conventions import CONVENTIONS, Convention, convention

BODY: Final = "body"
"""The axes of the body whose mesh it is, as the source of the poses has them."""
GLTF: Final = "gltf"


@dataclass(frozen=True)
class MeshRotation:
    """How a program turns a mesh between a file and the axes of its engine: ``matrix`` (3, 3) from file to engine."""

    name: str
    engine: Convention
    matrix: Array
    formats: tuple[str, ...]
    description: str


def _read_table() -> dict[str, MeshRotation]:
    rows = tomllib.loads(Path(__file__).with_name("mesh_axes.toml").read_text("utf-8"))
    return {name: _mesh_rotation(name, row) for name, row in rows.items()}


def _mesh_rotation(name: str, row: Mapping[str, Any]) -> MeshRotation:
    matrix = np.array(row["matrix"], dtype=np.float64)
    return MeshRotation(name, CONVENTIONS[row["engine"]], matrix, tuple(row["formats"]), row["description"])


MESH_ROTATIONS: Final = _read_table()
"""Name -> turn that programs give to mesh files."""


def mesh_axes_matrix(name: str, poses: Convention) -> Array:
    """Returns the matrix (3, 3) from the axes of a mesh file to the canonical axes of its body.

    Parameters
    ----------
    name : ``body``, a name in ``MESH_ROTATIONS``, a convention's name, or axes as text.
    poses : the convention of the poses that the mesh is for.

    Raises SessionError: an unknown name; it lists those there are.
    """
    if name == BODY:
        return poses.matrix
    if name in MESH_ROTATIONS:
        row = MESH_ROTATIONS[name]
        engine = poses if _is_alike(row.engine, poses) else row.engine
        return engine.matrix @ row.matrix
    try:
        return convention(name).matrix
    except SessionError as error:
        raise SessionError(f"no axes of meshes {name!r}: {BODY}, {', '.join(MESH_ROTATIONS)}, or {error}") from None


def mesh_axes_description(name: str, poses: Convention) -> str:
    """Returns words for the axes of a mesh file: ``as the poses (unity)``."""
    if name == BODY:
        return f"as the poses ({poses.name})"
    if name in MESH_ROTATIONS:
        return MESH_ROTATIONS[name].description
    row = convention(name)
    return row.name if row.name == row.description else f"{row.name} ({row.description})"


def default_mesh_axes(file_type: str, poses: Convention) -> str:
    """Returns the axes that a mesh file is taken to have where nobody says.

    A GLB has those that the tools of the engine give it, else Y up as its standard says; another file those of its
    body.
    """
    if file_type != "glb":
        return BODY
    for row in MESH_ROTATIONS.values():
        if file_type in row.formats and _is_alike(row.engine, poses):
            return row.name
    return GLTF


def mesh_axes_alternatives(default: str, poses: Convention) -> tuple[str, ...]:
    """Returns the axes that a mesh file may have, the default first; names that turn it alike are given once."""
    names = [row.name for row in MESH_ROTATIONS.values() if _is_alike(row.engine, poses)]
    different: dict[bytes, str] = {}
    for name in (default, BODY, *names, GLTF):
        different.setdefault(mesh_axes_matrix(name, poses).tobytes(), name)
    return tuple(different.values())


def _is_alike(first: Convention, second: Convention) -> bool:
    """Whether two conventions have one axis up and one handedness, so that tools turn their meshes alike."""
    return first.handedness == second.handedness and first.up == second.up
