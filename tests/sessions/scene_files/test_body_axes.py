import numpy as np
import pytest
import trimesh

from sessions.mesh_data import MeshData
from sessions.meshes.conventions import CONVENTIONS
from sessions.meshes.mesh_axes import MESH_ROTATIONS
from sessions.scene_files.body_axes import (
    axes_assumption,
    axes_change,
    from_body_axes,
    grouped_assumptions,
    in_body_axes,
)

NAMES = ("body", "gltf", *MESH_ROTATIONS, *CONVENTIONS)


def mesh(*size):
    box = trimesh.creation.box(size)
    return MeshData(np.asarray(box.vertices), np.asarray(box.faces))


@pytest.mark.parametrize("poses", CONVENTIONS.values(), ids=str)
def test_a_mesh_comes_back_from_body_axes_bit_by_bit(poses):
    tool = mesh(0.1, 0.2, 0.3)
    for name in NAMES:
        other = in_body_axes(tool, name, poses)
        assert np.array_equal(from_body_axes(other, name, poses).vertices, tool.vertices), name
        assert abs(other.volume) == pytest.approx(tool.volume) and other.volume > 0


@pytest.mark.parametrize("before", NAMES)
def test_a_change_of_axes_is_the_mesh_read_again(before):
    tool, old, new = mesh(0.1, 0.2, 0.3), CONVENTIONS["unity"], CONVENTIONS["ros"]
    for after in NAMES:
        changed = in_body_axes(tool, before, old).transformed(axes_change(before, old, after, new))
        assert np.array_equal(changed.vertices, in_body_axes(tool, after, new).vertices), after


def test_files_that_differ_in_axes_alone_have_a_common_row():
    poses = CONVENTIONS["ros"]
    rows = [axes_assumption(name, f"{name}.obj", "", poses) for name in ("cup", "rod")]
    rows.append(axes_assumption("jar", "jar.glb", "", poses))
    grouped = grouped_assumptions(rows)
    assert [(row.bodies, row.files) for row in grouped] == [
        (("cup", "rod"), ("cup.obj", "rod.obj")),
        (("jar",), ("jar.glb",)),
    ]
