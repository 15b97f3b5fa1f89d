"""A hole in a surface is an opening, such as a beaker's, or a lost face; its area and its rim decide which."""

import numpy as np
import pytest
import trimesh

from replay.advice.mesh_interior import surface_component


def tube(height, sides=24):
    """A closed prism around z with a radius of 1."""
    return trimesh.creation.cylinder(radius=1.0, height=height, sections=sides)


def without_top(solid):
    """The vertices and faces of a solid without those that look upwards."""
    return solid.vertices, solid.faces[solid.face_normals[:, 2] < 0.9]


@pytest.mark.parametrize(
    ("height", "sides", "is_opening"),
    [
        (1.0, 4, True),  # four edges, and a fifth of the area
        (10.0, 24, True),  # 24 edges, and 1/22 of the area
        (10.0, 4, False),  # four edges, and 1/30 of the area: as a face that was lost
        (2_000.0, 24, False),  # 24 edges, and 1/4,000 of the area: a crack
    ],
)
def test_area_and_rim_tell_an_opening_from_lost_faces(height, sides, is_opening):
    """A prism of radius 1 without its top: edges of the rim, and the top's part of the whole area, decide."""
    component = surface_component(*without_top(tube(height, sides)))
    assert component.has_opening == is_opening
    assert not component.is_closed


def test_closed_surface_has_no_opening():
    solid = tube(height=1.0)
    component = surface_component(solid.vertices, solid.faces)
    assert component.is_closed and not component.has_opening


def test_rims_that_touch_are_no_opening():
    """Two opposite quarters of the top are missing: their rims meet in its middle."""
    solid = tube(height=1.0, sides=4)
    is_top = solid.face_normals[:, 2] > 0.9
    kept = np.ones(len(solid.faces), dtype=bool)
    kept[np.flatnonzero(is_top)[[0, 2]]] = False
    assert is_top.sum() == 4 and not surface_component(solid.vertices, solid.faces[kept]).has_opening
