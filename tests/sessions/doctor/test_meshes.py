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
    """Code -> count of what the doctor, which examines meshes for damage, reports of a mesh."""
    return {item.code: item.count for item in mesh_findings("m", mesh)}


@pytest.mark.parametrize("name", ["beaker_250", "erlenmeyer_flask", "hand_left"])
def test_the_glass_of_the_bench_has_nothing_above_a_note(name):
    """Instruments of the product's catalogue, of 500 faces, give no warning and no error."""
    findings = [*mesh_findings(name, made_instrument(name, 500).mesh)]
    assert [finding for finding in findings if finding.severity > Severity.NOTE] == []


VERTICES, FACES = cube().vertices, cube().faces
"""A closed cube of 1 m with 12 faces."""


@pytest.mark.parametrize(
    ("vertices", "faces", "counts"),
    [
        pytest.param(VERTICES, FACES[1:], {"mesh-open": 3}, id="a face is lost"),
        pytest.param(VERTICES, [*FACES, FACES[0]], {"mesh-duplicate": 1, "mesh-non-manifold": 3}, id="a face twice"),
        pytest.param(
            VERTICES,
            [*FACES, FACES[0, [2, 0, 1]]],
            {"mesh-duplicate": 1, "mesh-non-manifold": 3},
            id="a face twice, from another corner",
        ),
        pytest.param(VERTICES, [*FACES, [0, 0, 1]], {"mesh-degenerate": 1}, id="a face of two corners"),
        pytest.param(VERTICES, [*FACES[:-1], FACES[-1][::-1]], {"mesh-winding": 3}, id="a face is reversed"),
        pytest.param(VERTICES * [1, 1, -1], FACES, {"mesh-mirrored": 12}, id="all faces look inwards"),
        pytest.param(VERTICES * 1000, FACES, {"mesh-units": 1}, id="a cube of 1 km"),
    ],
)
def test_each_fault_of_a_mesh_is_counted(vertices, faces, counts):
    """A good cube gets a fault, whose findings are counted: code -> number.

    Open, non-manifold and wrongly wound are edges, three of a face; repeated, without area and inwards are faces. A
    mesh that is likely in another unit counts as 1.
    """
    assert count_by_code(MeshData(vertices, faces)) == counts


def test_vertices_that_an_exporter_split_are_merged():
    """A cube of 12 faces whose 36 corners are vertices of their own has no open edges, nor any other fault."""
    mesh = cube()
    split = MeshData(mesh.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert count_by_code(split) == {}


def test_only_faces_with_collinear_corners_are_degenerate():
    """Two needles 1 m long and 1 nm high have an area; the face between them, of corners on a line, has none."""
    vertices = [[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0], [0.5, 0, 0]]
    mesh = MeshData(vertices, [[0, 1, 2], [0, 1, 3], [1, 0, 2]])
    assert degenerate_faces(mesh).tolist() == [False, True, False]


def test_mesh_that_cannot_be_loaded_is_reported_by_the_doctor():
    """A session's meshes are read when somebody asks for them; that of the body "cup" raises an error then."""

    class UnreadableMeshes(dict):
        def __getitem__(self, name):
            raise MeshFileError("the mesh is gone; find it")

    (finding,) = all_mesh_findings(UnreadableMeshes(cup=None))
    assert (finding.code, finding.body, finding.severity) == ("mesh-unreadable", "cup", Severity.ERROR)


@given(st.lists(st.tuples(*[st.sampled_from([-1.0, -0.0, 0.0, 2.0])] * 3), max_size=30))
def test_equal_rows_alone_have_equal_numbers(rows):
    """Up to 30 rows of three coordinates get numbers: equal rows, as numpy's unique counts them, get the same.

    -0.0 is 0.0; numbers go from 0 on without a gap.
    """
    array = np.array(rows, dtype=np.float64).reshape(-1, 3)
    numbers = row_numbers(array)
    different_rows, expected = np.unique(array + 0.0, axis=0, return_inverse=True)
    expected = expected.reshape(-1)
    assert np.array_equal(numbers[:, None] == numbers, expected[:, None] == expected)
    assert {*numbers.tolist()} == {*range(len(different_rows))}
