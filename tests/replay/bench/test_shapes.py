"""Meshes have nearly the faces asked for, none degenerate, and survive single precision."""

import numpy as np
import pytest

from replay.bench.shapes import MAKERS, bench_mesh


@pytest.mark.parametrize("faces", [500, 5_000])
@pytest.mark.parametrize("kind", MAKERS)
def test_a_mesh_has_nearly_the_faces_asked_for_and_each_has_an_area(kind, faces):
    vertices, triangles = bench_mesh(kind, faces)
    assert abs(len(triangles) / faces - 1) < 0.1
    assert np.array_equal(vertices, vertices.astype(np.float32))
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 0
    assert np.array_equal(np.unique(triangles), np.arange(len(vertices)))


def test_a_rod_goes_into_a_cup_and_a_tube_into_a_ring():
    rod, cup, tube, ring = (np.hypot(*bench_mesh(kind, 500)[0][:, :2].T) for kind in ("rod", "cup", "tube", "ring"))
    assert rod.max() < 0.1 * cup.max()
    assert tube.max() < 0.5 * ring.min()
