"""At 32 pixels the volume is that of an independent Boolean to 1 %, and no overlap is seen where there is none."""

import numpy as np
import pytest
from manifold3d import Manifold, Mesh64
from support.random_worlds import ball as octahedron
from support.shapes import ball_mesh, box_mesh, merge_meshes, random_rotations, revolved_mesh

from cdcore import TriangleMesh
from cdcore.image_space.layers import Window, layers_of
from cdcore.image_space.overlap import overlap_of_placed
from cdcore.poses import place_points


def rotated(mesh):
    """The same surface with its normals the other way."""
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def overlap_volume(a, b, pose_a=None, pose_b=None):
    """The overlap of two bodies at poses (4, 4), measured at 32 pixels."""
    poses = [np.eye(4) if pose is None else pose for pose in (pose_a, pose_b)]
    world = [place_points(m.triangles, pose[:3, :3], pose[:3, 3]) for m, pose in zip((a, b), poses, strict=True)]
    return overlap_of_placed(*world, 32)


def ring_mesh(large=0.05, small=0.02, sides=40):
    """A torus about z."""
    angle = 2 * np.pi * np.arange(21) / 20
    profile = np.column_stack([large + small * np.cos(angle), small * np.sin(angle)])
    profile[-1] = profile[0]
    return revolved_mesh(profile[::-1], sides)


def solid_of(mesh, pose):
    """The posed mesh as a solid of the library manifold3d, faces outwards."""
    _, first, merged_to = np.unique(mesh.vertices, axis=0, return_index=True, return_inverse=True)
    points = mesh.vertices[first] @ pose[:3, :3].T + pose[:3, 3]
    solids = [
        Manifold(Mesh64(vert_properties=points, tri_verts=merged_to[faces].astype(np.uint64)))
        for faces in (mesh.faces, mesh.faces[:, ::-1])
    ]
    return max(solids, key=Manifold.volume)


def mesh_of(solid):
    """The mesh of a solid of manifold3d."""
    mesh = solid.to_mesh64()
    return TriangleMesh(mesh.vert_properties[:, :3], mesh.tri_verts)


PAIRS = {
    "ring and ball": (ring_mesh(), ball_mesh(0.035, rings=16, sides=24), 0.03),
    "box and ball, whatever way their faces look": (
        rotated(box_mesh((0.1, 0.06, 0.03))),
        ball_mesh(0.04, rings=16, sides=24),
        0.03,
    ),
    "boxes": (box_mesh((0.1, 0.06, 0.03)), box_mesh((0.05, 0.05, 0.05)), 0.02),
}


@pytest.mark.parametrize("name", PAIRS)
def test_overlap_volume_is_within_a_percent_of_the_boolean(name):
    """Solids in random poses; manifold3d intersects them."""
    a, b, spread = PAIRS[name]
    rng = np.random.default_rng(5)
    checked = 0
    for _ in range(6):
        poses = np.tile(np.eye(4), (2, 1, 1))
        poses[:, :3, :3], poses[1, :3, 3] = random_rotations(rng, 2), rng.normal(size=3) * spread
        want = (solid_of(a, poses[0]) ^ solid_of(b, poses[1])).volume()
        answer = overlap_volume(a, b, *poses)
        if want > 1e-6:  # a cubic centimetre: below, the overlap is a sliver of few rays
            assert answer.volume == pytest.approx(want, rel=0.01)
            checked += 1
    assert checked >= 2


def test_window_thinner_than_a_pixel_is_still_sampled():
    """Half of a plate of 0.1 mm is in a unit cube; 32 x 32 rays one way, 2 x 32 the other two ways.

    Each ray has four layers: it enters and leaves both bodies.
    """
    lift = np.eye(4)
    lift[2, 3] = 0.5
    answer = overlap_volume(box_mesh((1, 1, 1e-4)), box_mesh(), pose_b=lift)
    assert answer.volume == pytest.approx(0.5e-4, rel=1e-6)
    assert (answer.rays, answer.layers) == (32 * 32 + 2 * 32, 4 * (32 * 32 + 2 * 32))


def test_touching_bodies_have_no_common_volume():
    """A unit cube upon another, at random orientations."""
    lift = np.eye(4)
    for rotation in [np.eye(3), *random_rotations(np.random.default_rng(1), 5)]:
        base = np.eye(4)
        base[:3, :3] = lift[:3, :3] = rotation
        base[:3, 3] = [0.1, 0.2, 0.3]
        lift[:3, 3] = base[:3, 3] + rotation @ [0, 0, 1.0]
        assert overlap_volume(box_mesh(), box_mesh(), base, lift).volume == 0.0


CRATE = box_mesh((4, 4, 4))
HOLLOW = merge_meshes(CRATE, box_mesh((2, 2, 2)))
CORNER = mesh_of(Manifold.cube((1, 4, 4)).translate((-2, -2, -2)) + Manifold.cube((4, 1, 4)).translate((-2, -2, -2)))
"""Two walls: a body that sticks out of one ends behind it on every ray, and its box is within that of both."""


@pytest.mark.parametrize(
    ("outer", "size", "position", "inside"),
    [
        (CRATE, 1, (0, 0, 0), True),
        (CRATE, 1, (1.5, 0, 0), False),
        (CRATE, 4, (0, 0, 0), False),
        (HOLLOW, 0.5, (1.5, 0, 0), True),
        (HOLLOW, 1, (1, 0, 0), False),
        (CORNER, 1, (-1, 0.5, 0), False),
    ],
)
def test_body_is_inside_when_its_box_and_volume_are(outer, size, position, inside):
    """Crates have edges of 4 m and the hollow one of 2 m; ``inside`` is the number of the inner body, -1 for none."""
    box = box_mesh((size,) * 3, centre=position)
    assert overlap_volume(box, outer).inside == (0 if inside else -1)
    assert overlap_volume(outer, box).inside == (1 if inside else -1)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("world", [box_mesh((2, 2, 2)).triangles, octahedron(None)], ids=["box", "ball"])
def test_rays_through_edges_and_corners_cross_twice(world):
    """Rays on integers, where diagonals of the box's faces, meridians of the ball and corners of both lie.

    Of 3 x 3 rays number 4 is the middle one: it enters and leaves at the ends of the body.
    """
    layers_in_python = layers_of.__wrapped__  # to compile it alone takes a second
    window = Window(np.full(3, -1.0), np.ones(3), np.full(3, 3))
    for faces in (world, world[::-1]):  # layers are sorted whatever order faces stand in
        for axis in range(3):
            start, depths = layers_in_python(faces, axis, window)
            assert depths[start[4] : start[5]].tolist() == [-world.max(), world.max()]
            assert (np.diff(start) % 2 == 0).all()
