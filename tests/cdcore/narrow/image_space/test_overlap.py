"""At 32 pixels the volume is that of an independent Boolean to 1 %, and no overlap is seen where there is none."""

import numpy as np
import pytest
from manifold3d import Manifold, Mesh64
from support.shapes import ball_mesh, box_mesh, random_rotations, revolved_mesh

from cdcore import TriangleMesh
from cdcore.kernels.compiling import kernel
from cdcore.narrow.image_space import layers as rays
from cdcore.narrow.image_space.layers import Layers, Window, layers_of, overlap_along
from cdcore.narrow.image_space.overlap import overlap_of_placed, turn_of_normals
from cdcore.numerics import place_points


def overlap_volume(a, b, pose_a=None, pose_b=None, resolution=32):
    poses = [np.eye(4) if pose is None else pose for pose in (pose_a, pose_b)]
    world = [place_points(m.triangles, pose[:3, :3], pose[:3, 3]) for m, pose in zip((a, b), poses, strict=True)]
    return overlap_of_placed(world[0], turn_of_normals(a), world[1], turn_of_normals(b), resolution)


def ring_mesh(large=0.05, small=0.02, sides=40):
    angle = 2 * np.pi * np.arange(21) / 20
    profile = np.column_stack([large + small * np.cos(angle), small * np.sin(angle)])
    profile[-1] = profile[0]
    return revolved_mesh(profile[::-1], sides)


def outward(mesh):
    return mesh if turn_of_normals(mesh) > 0 else TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def boolean_volume(meshes, poses):
    solids = []
    for mesh, pose in zip(meshes, poses, strict=True):
        _, first, merged = np.unique(mesh.vertices, axis=0, return_index=True, return_inverse=True)
        points = mesh.vertices[first] @ pose[:3, :3].T + pose[:3, 3]
        solids.append(Manifold(Mesh64(vert_properties=points, tri_verts=merged[mesh.faces].astype(np.uint64))))
        assert solids[-1].volume() > 0
    return (solids[0] ^ solids[1]).volume()


def poses_of(rng, spread):
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[:, :3, :3] = random_rotations(rng, 2)
    poses[1, :3, 3] = rng.normal(size=3) * spread
    return poses


PAIRS = {
    "ring and ball": (outward(ring_mesh()), outward(ball_mesh(0.035, 16, 24)), 0.03),
    "box and ball": (outward(box_mesh((0.1, 0.06, 0.03))), outward(ball_mesh(0.04, 16, 24)), 0.03),
    "boxes": (outward(box_mesh((0.1, 0.06, 0.03))), outward(box_mesh((0.05, 0.05, 0.05))), 0.02),
}


@pytest.mark.parametrize("name", PAIRS)
def test_the_volume_is_that_of_a_boolean_within_a_percent_at_32_pixels(name):
    a, b, spread = PAIRS[name]
    rng = np.random.default_rng(len(name))
    checked = 0
    for _ in range(12):
        poses = poses_of(rng, spread)
        want = boolean_volume((a, b), poses)
        found = overlap_volume(a, b, *poses, resolution=32)
        assert found.unbalanced == 0
        if want > 1e-6:  # a cubic centimetre: below, the overlap is a sliver of few rays
            assert found.volume == pytest.approx(want, rel=0.01)
            checked += 1
    assert checked >= 4


def test_a_window_thinner_than_a_pixel_is_still_looked_through():
    plate, lift = outward(box_mesh((1, 1, 1e-4))), np.eye(4)
    lift[2, 3] = 0.5
    found = overlap_volume(plate, outward(box_mesh()), pose_b=lift)
    assert found.volume == pytest.approx(0.5e-4, rel=1e-6)


def test_touching_bodies_share_nothing():
    lift = np.eye(4)
    for turn in [np.eye(3), *random_rotations(np.random.default_rng(1), 5)]:
        base = np.eye(4)
        base[:3, :3] = lift[:3, :3] = turn
        base[:3, 3] = [0.1, 0.2, 0.3]
        lift[:3, 3] = base[:3, 3] + turn @ [0, 0, 1.0]
        assert overlap_volume(outward(box_mesh()), outward(box_mesh()), base, lift).volume == 0.0


CRATE = outward(box_mesh((4, 4, 4)))
CAVITY = outward(box_mesh((2, 2, 2)))
HOLLOW = TriangleMesh(
    np.concatenate([CRATE.vertices, CAVITY.vertices]),
    np.concatenate([CRATE.faces, CAVITY.faces[:, ::-1] + len(CRATE.vertices)]),
)


@pytest.mark.parametrize(
    ("outer", "size", "place", "inside"),
    [
        (CRATE, 1, (0, 0, 0), True), (CRATE, 1, (1.5, 0, 0), False), (CRATE, 4, (0, 0, 0), False),
        (HOLLOW, 0.5, (1.5, 0, 0), True), (HOLLOW, 1, (1, 0, 0), False),
    ],
)  # fmt: skip
def test_a_body_is_inside_where_its_box_is_and_all_of_it_is_shared(outer, size, place, inside):
    box = outward(box_mesh((size,) * 3, centre=place))
    assert overlap_volume(box, outer).inside == (0 if inside else -1)
    assert overlap_volume(outer, box).inside == (1 if inside else -1)


NO_SHIFT = np.zeros(2)


def window(world, pixels):
    low, high = world.min(axis=(0, 1)), world.max(axis=(0, 1))
    return low, (high - low) / pixels, np.full(3, pixels, dtype=np.int64)


def test_rays_that_run_through_edges_and_corners_of_a_box_meet_it_twice():
    """A pixel of 1 from -0.5: centres on integers, where the diagonals of the box's faces and its corners lie."""
    world = box_mesh((2, 2, 2)).triangles
    low, size, count = np.full(3, -1.5), np.ones(3), np.full(3, 3, dtype=np.int64)
    for axis in range(3):
        start, depths, turns = layers_of(world, axis, Window(low, size, count, NO_SHIFT))
        middle = slice(start[4], start[5])
        assert depths[middle].tolist() == [-1, 1] and turns[middle].tolist() == [-1, 1]
        assert (np.diff(start) % 2 == 0).all()


@kernel
def shared_length(a, flip_a, b, flip_b, least, lengths):
    return rays.shared_length(a, flip_a, b, flip_b, 0, least, lengths)


def lengths_of(a, b, least=0.0, flips=(1, 1)):
    lengths = np.zeros(3)
    turns = [np.tile([-1, 1], len(one) // 2 + 1)[: len(one)] * flip for one, flip in zip((a, b), flips, strict=True)]
    first, second = (
        Layers(np.array([0, len(one)]), np.array(one, dtype=float), turn)
        for one, turn in zip((a, b), turns, strict=True)
    )
    sane = shared_length(first, flips[0], second, flips[1], least, lengths)
    return sane, lengths.tolist()


def test_a_ray_adds_what_both_bodies_hold_of_it():
    assert lengths_of([0, 4], [1, 2]) == (True, [4, 1, 1])
    assert lengths_of([0, 2, 3, 5], [1, 4]) == (True, [4, 3, 2])
    assert lengths_of([0, 1], [1, 2]) == (True, [1, 1, 0])
    assert lengths_of([0, 4], [1, 2], least=1.5) == (True, [4, 1, 0])
    assert lengths_of([0, 4], [1, 2], flips=(-1, 1)) == (True, [4, 1, 1])
    assert lengths_of([0, 4], [1, 2], flips=(1, -1)) == (True, [4, 1, 1])


def test_a_ray_that_does_not_leave_again_is_told():
    assert not lengths_of([0, 1, 2], [])[0]


def test_an_open_mesh_leaves_rays_unbalanced():
    world, whole = ball_mesh(1.0).triangles[:-20], ball_mesh(1.0).triangles
    looked_through = Window(*window(whole, 16), NO_SHIFT + 1e-4)
    bad, layers = overlap_along(world, 1, whole, 1, 2, looked_through, 0.0, np.zeros(3))
    assert bad > 0 and layers > 100
