import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.small_worlds import cube

from sessions import MeshData, Severity
from sessions.doctor.meshes import all_mesh_findings, degenerate_faces, mesh_findings, row_numbers
from sessions.errors import MeshFileError
from sessions.glassware.catalogue import made_instrument


def count_by_code(mesh):
    """Code -> count of what the doctor finds in a mesh."""
    return {item.code: item.count for item in mesh_findings("m", mesh)}


@pytest.mark.parametrize("name", ["beaker_250", "erlenmeyer_flask", "hand_left"])
def test_the_glass_of_the_bench_has_nothing_above_a_note(name):
    """Instruments as they are shipped, with 500 faces: no warning and no error."""
    result = [*mesh_findings(name, made_instrument(name, 500).mesh)]
    assert [item for item in result if item.severity > Severity.NOTE] == []


def test_each_fault_of_a_mesh_is_counted():
    """A cube of 12 faces: a lost one leaves three open edges, a repeated or reversed one spoils its three edges."""
    mesh = cube()
    assert count_by_code(MeshData(mesh.vertices, mesh.faces[1:])) == {"mesh-open": 3}
    assert count_by_code(MeshData(mesh.vertices, [*mesh.faces, mesh.faces[0, [2, 0, 1]]]))["mesh-duplicate"] == 1
    assert count_by_code(MeshData(mesh.vertices, [*mesh.faces, mesh.faces[0]]))["mesh-non-manifold"] == 3
    assert count_by_code(MeshData(mesh.vertices, [*mesh.faces, [0, 0, 1]])) == {"mesh-degenerate": 1}
    assert count_by_code(MeshData(mesh.vertices, [*mesh.faces[:-1], mesh.faces[-1][::-1]])) == {"mesh-winding": 3}
    assert count_by_code(MeshData(mesh.vertices * [1, 1, -1], mesh.faces)) == {"mesh-mirrored": 12}
    assert count_by_code(MeshData(mesh.vertices * 1e3, mesh.faces)) == {"mesh-units": 1}


def test_vertices_that_an_exporter_split_are_merged():
    """A cube of 12 faces whose 36 corners are vertices of their own has no finding."""
    mesh = cube()
    split = MeshData(mesh.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert count_by_code(split) == {}


def test_only_faces_with_collinear_corners_are_degenerate():
    """A needle 1 nm high has an area; corners on a line have none."""
    needle = MeshData([[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0], [0.5, 0, 0]], [[0, 1, 2], [0, 1, 3], [1, 0, 2]])
    assert degenerate_faces(needle).tolist() == [False, True, False]


def test_mesh_that_cannot_be_loaded_is_reported_by_the_doctor():
    """``Broken`` has the mesh of a body a, which raises an error when it is read."""

    class Broken(dict):
        def __getitem__(self, name):
            raise MeshFileError("the mesh is gone; find it")

    (item,) = all_mesh_findings(Broken(a=None))
    assert (item.code, item.body, item.severity) == ("mesh-unreadable", "a", Severity.ERROR)


@given(st.lists(st.tuples(*[st.sampled_from([-1.0, -0.0, 0.0, 2.0])] * 3), max_size=30))
def test_equal_rows_alone_have_equal_numbers(rows):
    """Rows are equal where numpy's unique counts them as one (-0.0 is 0.0); numbers go from 0 without a gap."""
    array = np.array(rows, dtype=np.float64).reshape(-1, 3)
    numbers = row_numbers(array)
    _, expected = np.unique(array + 0.0, axis=0, return_inverse=True)
    assert np.array_equal(numbers[:, None] == numbers, expected.reshape(-1)[:, None] == expected.reshape(-1))
    assert sorted(set(numbers.tolist())) == list(range(len(set(map(tuple, (array + 0.0).tolist())))))
