"""Meshes of files in the canonical axes of their bodies, by what a recording was taken to be."""

from collections.abc import Container, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sessions.mesh_data import MeshData
from sessions.meshes.conventions import Convention
from sessions.meshes.mesh_axes import (
    BODY,
    GLTF,
    default_mesh_axes,
    mesh_axes_alternatives,
    mesh_axes_description,
    mesh_axes_matrix,
)
from sessions.model.assumption import (
    ASSUMPTIONS_FACT,
    Assumption,
    Confidence,
    Origin,
    Subject,
    assumptions_fact,
    assumptions_of,
    grouped_assumptions,
    pose_convention,
)
from sessions.model.scene import Scene
from sessions.scene_files.mesh_units import file_type_of, scene_mesh_unit, units_beside_others


def in_body_axes(mesh: MeshData, axes: str, poses: Convention) -> MeshData:
    """Returns the mesh of a file with these axes in the canonical axes of its body; exact to the last bit.

    ``axes`` as `mesh_axes_matrix` takes them. Raises SessionError: an unknown name.
    """
    matrix = np.eye(4)
    matrix[:3, :3] = mesh_axes_matrix(axes, poses)
    return mesh if np.array_equal(matrix, np.eye(4)) else mesh.transformed(matrix)


def axes_change(before: str, old: Convention, after: str, new: Convention) -> NDArray[np.float64]:
    """Returns the matrix (4, 4) from a mesh by one reading of its file's axes to the mesh by another.

    ``old`` and ``new`` are the conventions of the poses beside which the file is read.
    """
    matrix = np.eye(4)
    # The inverse of a signed permutation is its transpose.
    matrix[:3, :3] = mesh_axes_matrix(after, new) @ mesh_axes_matrix(before, old).T
    return matrix


def from_body_axes(mesh: MeshData, axes: str, poses: Convention) -> MeshData:
    """Returns a mesh in the canonical axes of its body as a file with these axes holds it: undoes `in_body_axes`."""
    matrix = np.eye(4)
    matrix[:3, :3] = mesh_axes_matrix(axes, poses).T
    return mesh if np.array_equal(matrix, np.eye(4)) else mesh.transformed(matrix)


def scene_meshes_in_body_axes(
    scene: Scene, meshes: Mapping[str, MeshData], facts: Mapping[str, str]
) -> tuple[dict[str, MeshData], dict[str, str]]:
    """Returns the meshes of a scene, and the facts of the recording with what was assumed of their files.

    A mesh of a file is turned as its body, or by default its type, says. What was assumed of a mesh that it replaces is
    dropped.
    """
    poses = pose_convention(facts)
    rotated, rows, units = dict(meshes), list[Assumption](), dict[str, Assumption]()
    for body in scene.bodies:
        if body.mesh and body.id in rotated:
            units[body.id] = scene_mesh_unit(body, rotated[body.id])
            row = axes_assumption(body.id, body.mesh, body.mesh_axes, poses)
            rotated[body.id] = in_body_axes(rotated[body.id], row.value, poses)
            rows.append(row)
    kept = assumptions_of(facts)
    if kept is None:
        # Of a recording that was never imported, or by an earlier release: there all meshes are canonical.
        return rotated, dict(facts)
    before = [row for row in map(partial(_without_bodies, names={*meshes}), kept) if row is not None]
    now = [*before, *grouped_assumptions(units_beside_others(units, meshes)), *grouped_assumptions(rows)]
    return rotated, {**facts, ASSUMPTIONS_FACT: assumptions_fact(now)}


def _without_bodies(row: Assumption, names: Container[str]) -> Assumption | None:
    """An assumption on meshes without these bodies; ``None``: it was about no other."""
    if row.subject not in (Subject.MESH_AXES, Subject.MESH_UNIT) or not any(name in names for name in row.bodies):
        return row
    bodies = tuple(name for name in row.bodies if name not in names)
    return replace(row, bodies=bodies, files=bodies) if bodies else None


def axes_assumption(body: str, file: str, stated: str, poses: Convention) -> Assumption:
    """Returns the axes of a mesh file: as stated, else as its type and the convention of the poses suggest."""
    file_type = file_type_of(file)
    axes = stated or default_mesh_axes(file_type, poses)
    alternatives = mesh_axes_alternatives(axes, poses)
    origin, reason = Origin.USER, ""
    if not stated and len(alternatives) == 1:
        origin, reason = Origin.FORMAT, "all axes it may have are those of the recording"
    elif not stated:
        origin = Origin.GUESS
        reason = _reason(axes, file_type, poses)
    return Assumption(
        subject=Subject.MESH_AXES,
        value=axes,
        origin=origin,
        confidence=Confidence.SURE if stated or len(alternatives) == 1 else Confidence.OPEN,
        bodies=(body,),
        files=(Path(file).name,),
        description=mesh_axes_description(axes, poses),
        reason=reason,
        alternatives=alternatives,
    )


def _reason(axes: str, file_type: str, poses: Convention) -> str:
    """Why a file that does not say its axes was taken to have these."""
    if axes == GLTF:
        return "glTF is Y up by its standard"
    if axes == BODY:
        return f"{file_type.upper()} files say no axes"
    return f"usual for {file_type.upper()} files beside poses of {poses.name}"
