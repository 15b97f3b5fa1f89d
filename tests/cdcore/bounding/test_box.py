"""Boxes hold every used vertex, with axes that are orthonormal."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.shapes import ball_mesh, box_mesh, moved, random_rotations, rod_mesh

from cdcore import TriangleMesh
from cdcore.bounding.box import box_best, box_by_body_axes, box_by_principal_axes

BUILDERS = [box_by_body_axes, box_by_principal_axes, box_best]


def slack(box, mesh):
    """How far inside the box the outermost used vertex lies, in metres; negative: outside."""
    along = np.abs((mesh.referenced_vertices - box.centre) @ box.axes)
    return (box.half - along).min()


meshes = st.lists(st.tuples(*[st.floats(-1e3, 1e3)] * 3), min_size=3, max_size=12).map(
    lambda points: TriangleMesh(points, np.arange(len(points) // 3 * 3).reshape(-1, 3))
)


@given(meshes)
@settings(max_examples=150)
def test_every_used_vertex_lies_in_the_box(mesh):
    for build in BUILDERS:
        assert slack(build(mesh), mesh) >= 0


@pytest.mark.parametrize("build", BUILDERS)
@pytest.mark.parametrize(
    "mesh", [box_mesh(), ball_mesh(), moved(rod_mesh(), [1e3, 0, 0]), TriangleMesh(np.ones((3, 3)), [[0, 1, 2]])]
)
def test_axes_are_orthonormal_and_half_extents_not_negative(build, mesh):
    box = build(mesh)
    assert np.abs(box.axes.T @ box.axes - np.eye(3)).max() < 1e-14
    assert (box.half >= 0).all()
    assert slack(box, mesh) >= 0


def test_the_box_of_a_box_is_that_box():
    box = box_by_body_axes(box_mesh((1, 2, 3), (5, 6, 7)))
    assert np.allclose(box.half, [0.5, 1, 1.5])
    assert np.allclose(box.centre, [5, 6, 7])
    assert box.surface == pytest.approx(22)


def test_principal_axes_fit_a_slanted_rod_and_best_takes_them():
    rod = rod_mesh(0.003, 0.3)
    slanted = TriangleMesh(rod.vertices @ random_rotations(np.random.default_rng(3)).T, rod.faces)
    assert box_by_principal_axes(slanted).surface < 0.5 * box_by_body_axes(slanted).surface
    assert box_best(slanted).surface == box_by_principal_axes(slanted).surface


def test_body_axes_win_where_both_fit_alike():
    assert np.array_equal(box_best(box_mesh((1, 2, 3))).axes, np.eye(3))


def test_corners_span_the_box():
    box = box_by_principal_axes(rod_mesh())
    along = (box.corners - box.centre) @ box.axes
    assert np.allclose(np.abs(along), box.half)
    assert len(np.unique(np.sign(along), axis=0)) == 8


def test_a_far_vertex_that_no_face_uses_does_not_inflate_it():
    stray = TriangleMesh([*box_mesh().vertices.tolist(), [1e6, 0, 0]], box_mesh().faces)
    assert box_best(stray).surface == box_best(box_mesh()).surface
