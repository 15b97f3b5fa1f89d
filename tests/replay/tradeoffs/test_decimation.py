import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdcore import TriangleMesh
from replay.errors import TradeoffError
from replay.tradeoffs.decimation import clustered


def ball(rings=12):
    """A closed ball of radius 1 m."""
    import trimesh

    made = trimesh.creation.uv_sphere(radius=1.0, count=[rings, 2 * rings])
    return TriangleMesh(made.vertices, made.faces)


@settings(deadline=None)
@given(st.floats(0.05, 0.8))
def test_no_vertex_leaves_its_cell_and_no_face_is_added(cell):
    mesh = ball()
    coarse = clustered(mesh, cell)
    assert len(coarse.faces) <= len(mesh.faces)
    moved = np.linalg.norm(mesh.vertices[:, None] - coarse.vertices[None], axis=2).min(axis=1)
    assert moved.max() <= cell * np.sqrt(3) + 1e-12
    assert len(np.unique(np.floor(coarse.vertices / cell), axis=0)) == len(coarse.vertices)


def test_a_coarser_grid_leaves_fewer_faces_and_no_face_twice():
    mesh = ball()
    counts = [len(clustered(mesh, cell).faces) for cell in (0.01, 0.2, 0.4, 0.8)]
    assert counts == sorted(counts, reverse=True) and counts[0] == len(mesh.faces) > counts[-1] >= 4
    faces = np.sort(clustered(mesh, 0.4).faces, axis=1)
    assert len(np.unique(faces, axis=0)) == len(faces) and (np.diff(faces, axis=1) > 0).all()


def test_a_mesh_that_the_grid_would_swallow_stays_as_it_was():
    mesh = TriangleMesh(ball().vertices + 2.0, ball().faces)
    assert clustered(mesh, 100.0) is mesh


@pytest.mark.parametrize("cell", [0.0, -1.0, float("nan"), float("inf")])
def test_a_cell_that_is_no_length_is_refused(cell):
    with pytest.raises(TradeoffError, match="no length"):
        clustered(ball(), cell)
