"""Meshes of files in the canonical axes of their bodies, by what a recording was taken to be."""

from collections.abc import Mapping

import numpy as np

from sessions.mesh_data import MeshData
from sessions.meshes.conventions import CONVENTIONS, Convention, convention
from sessions.meshes.mesh_axes import default_mesh_axes, mesh_axes_matrix
from sessions.model.assumption import Subject, assumptions_of
from sessions.model.scene import Scene


def pose_convention(facts: Mapping[str, str]) -> Convention:
    """Returns the convention that the poses of a recording had in their source; the canonical one if none is kept."""
    for row in assumptions_of(facts) or ():
        if row.subject is Subject.POSE_AXES:
            return convention(row.value)
    return CONVENTIONS["canonical"]


def in_body_axes(mesh: MeshData, axes: str, poses: Convention) -> MeshData:
    """Returns the mesh of a file with these axes in the canonical axes of its body; exact to the last bit.

    ``axes`` as `mesh_axes_matrix` takes them. Raises SessionError: an unknown name.
    """
    matrix = np.eye(4)
    matrix[:3, :3] = mesh_axes_matrix(axes, poses)
    return mesh if np.array_equal(matrix, np.eye(4)) else mesh.transformed(matrix)


def from_body_axes(mesh: MeshData, axes: str, poses: Convention) -> MeshData:
    """Returns a mesh in the canonical axes of its body as a file with these axes holds it: undoes `in_body_axes`."""
    matrix = np.eye(4)
    matrix[:3, :3] = mesh_axes_matrix(axes, poses).T
    return mesh if np.array_equal(matrix, np.eye(4)) else mesh.transformed(matrix)


def file_type_of(file: str) -> str:
    """Returns the ending of a file's name in small letters, without the point."""
    return file.rpartition(".")[2].lower()


def scene_meshes_in_body_axes(
    scene: Scene, meshes: Mapping[str, MeshData], facts: Mapping[str, str]
) -> dict[str, MeshData]:
    """Returns the meshes of a scene; those of files are turned as their body, or by default their type, says."""
    poses = pose_convention(facts)
    turned = dict(meshes)
    for body in scene.bodies:
        if body.mesh and body.id in turned:
            axes = body.mesh_axes or default_mesh_axes(file_type_of(body.mesh), poses)
            turned[body.id] = in_body_axes(turned[body.id], axes, poses)
    return turned
