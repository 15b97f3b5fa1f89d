"""Every ray through a closed mesh leaves it as often as it enters, also through shared edges and corners."""

import numpy as np
from support.shapes import ball_mesh, beaker_mesh, box_mesh, random_rotations

from cdcore.narrow.image_space.layers import layers_of, overlap_along, shared_length

NO_SHIFT = np.zeros(2)


def window(world, pixels):
    low, high = world.min(axis=(0, 1)), world.max(axis=(0, 1))
    return low, (high - low) / pixels, np.full(3, pixels, dtype=np.int64)


def test_rays_that_run_through_edges_and_corners_of_a_box_meet_it_twice():
    """A pixel of 1 from -0.5: centres on integers, where the diagonals of the box's faces and its corners lie."""
    world = box_mesh((2, 2, 2)).triangles
    low, size, count = np.full(3, -1.5), np.ones(3), np.full(3, 3, dtype=np.int64)
    for axis in range(3):
        start, depths, turns = layers_of(world, axis, low, size, count, NO_SHIFT)
        middle = slice(start[4], start[5])
        assert depths[middle].tolist() == [-1, 1] and turns[middle].tolist() == [-1, 1]
        assert (np.diff(start) % 2 == 0).all()


def test_each_ray_balances_and_depths_ascend_on_turned_thin_meshes():
    rng = np.random.default_rng(0)
    for mesh in (beaker_mesh(sides=30), ball_mesh(0.1, 9, 14)):
        world = mesh.triangles @ random_rotations(rng).T
        for axis in range(3):
            start, depths, turns = layers_of(world, axis, *window(world, 40), np.array([1e-4, 2e-4]))
            for pixel in range(len(start) - 1):
                one = slice(start[pixel], start[pixel + 1])
                assert (np.diff(depths[one]) >= 0).all() and turns[one].sum() == 0
            assert len(depths) > 400


def lengths_of(a, b, least=0.0, flips=(1, 1)):
    lengths = np.zeros(3)
    depths = [np.array(one, dtype=float) for one in (a, b)]
    turns = [np.tile([-1, 1], len(one) // 2 + 1)[: len(one)] * flip for one, flip in zip((a, b), flips, strict=True)]
    sane = shared_length(
        depths[0], turns[0], 0, len(a), flips[0], depths[1], turns[1], 0, len(b), flips[1], least, lengths
    )
    return sane, lengths.tolist()


def test_a_ray_adds_what_both_bodies_hold_of_it():
    assert lengths_of([0, 4], [1, 2]) == (True, [4, 1, 1])
    assert lengths_of([0, 2, 3, 5], [1, 4]) == (True, [4, 3, 2])
    assert lengths_of([0, 1], [1, 2]) == (True, [1, 1, 0])
    assert lengths_of([0, 4], [1, 2], least=1.5) == (True, [4, 1, 0])
    assert lengths_of([0, 4], [1, 2], flips=(-1, 1)) == (True, [4, 1, 1])


def test_a_ray_that_does_not_leave_again_is_told():
    assert not lengths_of([0, 1, 2], [])[0]


def test_an_open_mesh_leaves_rays_unbalanced():
    world, whole = ball_mesh(1.0).triangles[:-20], ball_mesh(1.0).triangles
    low, size, count = window(whole, 16)
    bad, layers = overlap_along(world, 1, whole, 1, 2, low, size, count, NO_SHIFT + 1e-4, 0.0, np.zeros(3))
    assert bad > 0 and layers > 100
