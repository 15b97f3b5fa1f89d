import numpy as np
import pytest

from cdcore import Motion, TriangleMesh
from replay.advice.overlap_depth import SampledSurface, overlap_depth
from sessions import make_shape


def box_mesh_of(x, y, z):
    """A box of these edges."""
    mesh = make_shape("box", {"x": x, "y": y, "z": z})
    return TriangleMesh(mesh.vertices, mesh.faces)


@pytest.mark.parametrize("depth", [0.0, 0.001, 0.01, 0.03])
def test_depth_of_rod_in_block_is_depth_of_its_end(depth):
    """Half the block is 0.1 m high and half the rod 0.15 m; sampled surfaces are right to 2 mm."""
    block, rod = SampledSurface(box_mesh_of(0.2, 0.2, 0.2)), SampledSurface(box_mesh_of(0.02, 0.3, 0.02))
    height = 0.1 + 0.15 - depth
    motion = Motion(np.array([0.0]), np.array([[[0, 0, 0], [0, height, 0]]]), np.tile(np.eye(3), (1, 2, 1, 1)))
    assert overlap_depth(block, rod, motion, 0, (0, 1)) == pytest.approx(depth, abs=0.002)


@pytest.mark.parametrize(("apart", "depth"), [(1.0, 0.0), (0.15, 0.05)])
def test_depth_of_two_blocks_is_their_overlap(apart, depth):
    """Blocks of 0.2 m: middles 0.15 m from each other overlap by 0.05 m."""
    block = SampledSurface(box_mesh_of(0.2, 0.2, 0.2))
    motion = Motion(np.array([0.0]), np.array([[[0.0, 0, 0], [apart, 0, 0]]]), np.tile(np.eye(3), (1, 2, 1, 1)))
    assert overlap_depth(block, block, motion, 0, (0, 1)) == pytest.approx(depth, abs=0.01)


def test_point_in_an_open_box_has_no_depth():
    """The middle of a box of 0.2 m is 0.1 m deep; a box that lacks a side has no inside."""
    block, centre = box_mesh_of(0.2, 0.2, 0.2), np.zeros((1, 3))
    open_box = SampledSurface(TriangleMesh(block.vertices, block.faces[:-2]))
    assert SampledSurface(block).depth_of(centre) > 0.09
    assert open_box.depth_of(centre) == 0.0
    assert not open_box.has_consistent_winding


def test_winding_does_not_swap_inside_and_outside():
    """The middle of a block of 0.2 m with inward faces is 0.1 m deep, a point outside not at all."""
    block = box_mesh_of(0.2, 0.2, 0.2)
    inward = SampledSurface(TriangleMesh(block.vertices, block.faces[:, ::-1]))
    assert inward.depth_of(np.zeros((1, 3))) == pytest.approx(0.1, abs=0.01)
    assert inward.depth_of(np.array([[0.3, 0, 0]])) == 0.0
