"""A hole in a surface is an opening, such as a beaker's, or a lost face; its area and its rim decide which."""

import numpy as np
import pytest
import trimesh

from replay.advice.mesh_interior import surface_component


def tube(height, sides=24):
    """A closed prism around z with a radius of 1."""
    return trimesh.creation.cylinder(radius=1.0, height=height, sections=sides)


def without_top(solid):
    """The surface of a solid without the faces that look upwards."""
    return surface_component(solid.vertices, solid.faces[solid.face_normals[:, 2] < 0.9])


@pytest.mark.parametrize(
    ("height", "sides", "is_opening"),
    [
        pytest.param(1.0, 4, True, id="4 edges, 1/5 of the area: an opening"),
        pytest.param(10.0, 24, True, id="24 edges, 1/22 of the area: an opening"),
        pytest.param(10.0, 4, False, id="4 edges, 1/30 of the area: a lost face"),
        pytest.param(2_000.0, 24, False, id="24 edges, 1/4,000 of the area: a crack"),
    ],
)
def test_area_and_rim_tell_an_opening_from_lost_faces(height, sides, is_opening):
    """A prism of radius 1 without its top. Edges of the rim, and the top's part of the whole area, decide (``id``).

    A beaker's opening has a rim of many edges or is large; a file that lost a face has a small hole of few edges.
    """
    component = without_top(tube(height, sides))
    assert component.has_opening == is_opening
    assert not component.is_closed


def test_closed_surface_has_no_opening():
    """A whole prism of 24 sides, with top and bottom."""
    solid = tube(height=1.0)
    component = surface_component(solid.vertices, solid.faces)
    assert component.is_closed
    assert not component.has_opening


def test_rims_that_touch_are_no_opening():
    """The top of a prism of four sides is four triangles about its middle; two opposite ones are missing.

    The rims of both holes meet in the middle of the top, so that neither is a rim of its own.
    """
    solid = tube(height=1.0, sides=4)
    top_faces = np.flatnonzero(solid.face_normals[:, 2] > 0.9)
    assert len(top_faces) == 4
    with_two_holes = np.delete(solid.faces, top_faces[[0, 2]], axis=0)
    assert not surface_component(solid.vertices, with_two_holes).has_opening
