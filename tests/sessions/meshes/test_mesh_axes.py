import pytest

from sessions.errors import SessionError
from sessions.meshes.conventions import CONVENTIONS, convention
from sessions.meshes.mesh_axes import (
    BODY,
    MESH_ROTATIONS,
    default_mesh_axes,
    mesh_axes_alternatives,
    mesh_axes_description,
    mesh_axes_matrix,
)

POINTS = {
    ("body", "unity"): (1, 2, -3), ("body", "unreal"): (2, 3, -1), ("body", "ros"): (-2, 3, -1),
    ("body", "z-up"): (1, 3, -2), ("gltf", "unity"): (1, 2, 3), ("z-flipped", "unity"): (1, 2, 3),
    ("x-flipped", "unity"): (-1, 2, -3), ("x-flipped", "openxr"): (-1, 2, -3),
    ("yz-swapped", "unreal"): (3, 2, -1), ("y-up", "ros"): (3, 2, -1), ("y-up", "z-up"): (1, 2, 3),
    ("ros", "unity"): (-2, 3, -1), ("z up, left-handed", "ros"): (1, 3, 2),
}  # fmt: skip
"""Axes of a mesh and convention of its poses -> where its vertex (1, 2, 3) is in canonical axes of the body, by hand:
Unity's exporter writes (-x, y, z), Unreal's (x, z, y), Blender's (x, z, -y)."""


@pytest.mark.parametrize(("axes", "poses"), POINTS)
def test_mesh_vertex_is_rotated_into_the_axes_of_poses(axes, poses):
    """POINTS has, for axes of a mesh and of poses, where the vertex (1, 2, 3) belongs, written by hand."""
    assert (mesh_axes_matrix(axes, CONVENTIONS[poses]) @ [1, 2, 3]).tolist() == list(POINTS[axes, poses])


@pytest.mark.parametrize("file_type", ["glb", "obj", "stl", "ply"])
def test_alternatives_rotate_meshes_differently_and_include_the_default(file_type):
    """Axes of a mesh file that says none are guessed, and alternatives are offered, for poses of each convention.

    The guess, "body" (the axes of the poses) but for GLB, is the first alternative; no two rotate alike, and those of
    the poses and of glTF are among them. Where these are the same, in a session's own axes, one alternative is left.
    """
    for source in map(convention, (*CONVENTIONS, "x forward, y up", "z up, left-handed")):
        default = default_mesh_axes(file_type, source)
        assert file_type == "glb" or default == BODY, source
        names = mesh_axes_alternatives(default, source)
        first_name, *_others = names
        assert first_name == default, source
        matrices = {mesh_axes_matrix(name, source).tobytes() for name in names}
        assert len(matrices) == len(names), source
        assert {mesh_axes_matrix(name, source).tobytes() for name in (BODY, "gltf")} <= matrices, source
        assert (len(names) == 1) == source.is_canonical, source


def test_unknown_axes_of_meshes_are_refused_with_all_names():
    """The axes "sideways" are neither a mesh's nor a convention."""
    with pytest.raises(SessionError, match=f"body, {', '.join(MESH_ROTATIONS)}, or no convention 'sideways'"):
        mesh_axes_matrix("sideways", CONVENTIONS["unity"])


def test_axes_of_a_mesh_are_described_by_their_source():
    """Axes of a mesh with poses in Unity's may be those of its poses, an exporter's, a convention's, or any by name.

    The text has Unity's name, the exporter's description, the convention's name and description, or the axes in full.
    """
    unity, unreal = CONVENTIONS["unity"], CONVENTIONS["unreal"]
    assert unity.name in mesh_axes_description(BODY, unity)
    assert mesh_axes_description("x-flipped", unity) == MESH_ROTATIONS["x-flipped"].description
    assert mesh_axes_description("unreal", unity) == f"unreal ({unreal.description})"
    axes_in_full = convention("x forward, z up").name
    assert mesh_axes_description("x forward, z up", unity) == axes_in_full
