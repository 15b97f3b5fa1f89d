"""The solids are closed, and an icosphere has the six faces at its pole that a kiss of 36 pairs needs."""

import numpy as np
import pytest

from replay.studies.stress.solids import ball_mesh, beaker_mesh, box_mesh, icosphere_mesh, merged, moved, rod_mesh


def volume(mesh):
    a, b, c = (mesh.triangles[:, k] for k in range(3))
    return np.einsum("nk,nk->n", a, np.cross(b, c)).sum() / 6


@pytest.mark.parametrize(
    "mesh", [box_mesh(), ball_mesh(), beaker_mesh(), rod_mesh(), icosphere_mesh(), merged(box_mesh(), box_mesh())]
)
def test_every_edge_is_run_once_each_way(mesh):
    edges = np.concatenate([mesh.faces[:, [k, (k + 1) % 3]] for k in range(3)]).tolist()
    assert sorted(edges) == sorted([b, a] for a, b in edges)


def test_volumes_are_those_of_the_shapes():
    assert volume(box_mesh((1, 2, 3))) == pytest.approx(6)
    assert volume(moved(box_mesh((1, 2, 3)), [9, 8, 7])) == pytest.approx(6)
    assert volume(ball_mesh(1.0, 64, 64)) == pytest.approx(4 / 3 * np.pi, rel=5e-3)
    assert volume(icosphere_mesh(4)) == pytest.approx(4 / 3 * np.pi, rel=5e-3)
    assert volume(rod_mesh(1.0, 2.0, 400)) == pytest.approx(2 * np.pi, rel=1e-3)


def test_an_icosphere_has_six_faces_at_a_vertex_exactly_on_each_half_axis():
    mesh = icosphere_mesh(1)
    assert len(mesh.faces) == 80
    for axis in (*np.eye(3), *-np.eye(3)):
        (vertex,) = np.flatnonzero((mesh.vertices == axis).all(axis=1))
        assert (mesh.faces == vertex).sum() == 6
