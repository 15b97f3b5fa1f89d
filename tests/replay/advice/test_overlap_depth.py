"""Depth of a body in another, from points of both surfaces, against boxes in closed form."""

import numpy as np
import pytest

from cdcore import Motion, TriangleMesh
from replay.advice.overlap_depth import SampledSurface, overlap_depth
from sessions import make_shape


def box_mesh_of(x, y, z):
    """A box of these edges about the origin."""
    mesh = make_shape("box", {"x": x, "y": y, "z": z})
    return TriangleMesh(mesh.vertices, mesh.faces)


def second_body_at(*position):
    """A motion of one frame: the first body at the origin, the second one there."""
    return Motion(np.array([0.0]), np.array([[[0.0, 0.0, 0.0], position]]), np.tile(np.eye(3), (1, 2, 1, 1)))


@pytest.mark.parametrize("depth", [0.0, 0.001, 0.01, 0.03])
def test_depth_of_rod_in_block_is_depth_of_its_end(depth):
    """The end of an upright rod, 0.3 m long, is so many metres within the top of a block 0.2 m high.

    Depths are taken at sampled points of both surfaces: right to 2 mm.
    """
    block, rod = SampledSurface(box_mesh_of(0.2, 0.2, 0.2)), SampledSurface(box_mesh_of(0.02, 0.3, 0.02))
    top_of_block, half_of_rod = 0.1, 0.15
    motion = second_body_at(0.0, top_of_block + half_of_rod - depth, 0.0)
    assert overlap_depth(block, rod, motion, frame=0, bodies=(0, 1)) == pytest.approx(depth, abs=0.002)


@pytest.mark.parametrize(
    ("distance", "depth"), [pytest.param(1.0, 0.0, id="apart"), pytest.param(0.15, 0.2 - 0.15, id="overlap")]
)
def test_depth_of_two_blocks_is_their_overlap(distance, depth):
    """Two blocks of 0.2 m beside each other, so many metres from middle to middle; samples are right to 1 cm here."""
    block = SampledSurface(box_mesh_of(0.2, 0.2, 0.2))
    positions = np.array([[[3.0, -2.0, 5.0], [3.0 + distance, -2.0, 5.0]]])
    motion = Motion(np.array([0.0]), positions, np.tile(np.eye(3), (1, 2, 1, 1)))
    assert overlap_depth(block, block, motion, frame=0, bodies=(0, 1)) == pytest.approx(depth, abs=0.01)


def test_point_in_an_open_box_has_no_depth():
    """The middle of a box of 0.2 m is 0.1 m deep, to 1 cm; a box that lacks a side (two triangles) has no inside.

    A surface with a hole does not say by its faces which side is inside.
    """
    block, centre = box_mesh_of(0.2, 0.2, 0.2), np.zeros((1, 3))
    open_box = SampledSurface(TriangleMesh(block.vertices, block.faces[:-2]))
    assert SampledSurface(block).depth_of(centre) == pytest.approx(0.1, abs=0.01)
    assert open_box.depth_of(centre) == 0.0
    assert not open_box.has_consistent_winding


def test_winding_does_not_swap_inside_and_outside():
    """All faces of a block of 0.2 m look inwards: its middle is 0.1 m deep all the same, a point outside not at all."""
    block = box_mesh_of(0.2, 0.2, 0.2)
    inward = SampledSurface(TriangleMesh(block.vertices, block.faces[:, ::-1]))
    middle, outside = np.zeros((1, 3)), np.array([[0.3, 0.0, 0.0]])
    assert inward.depth_of(middle) == pytest.approx(0.1, abs=0.01)
    assert inward.depth_of(outside) == 0.0
