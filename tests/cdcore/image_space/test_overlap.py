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


def inside_out(mesh):
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
        inside_out(box_mesh((0.1, 0.06, 0.03))),
        ball_mesh(0.04, rings=16, sides=24),
        0.03,
    ),
    "boxes": (box_mesh((0.1, 0.06, 0.03)), box_mesh((0.05, 0.05, 0.05)), 0.02),
}
"""Name -> two meshes, and about how many metres they are from each other."""


@pytest.mark.parametrize("name", PAIRS)
def test_overlap_volume_is_within_a_percent_of_the_boolean(name):
    """Two solids in six random poses; the library manifold3d intersects them.

    Overlaps below a cubic centimetre, a sliver of few rays, are left out.
    """
    a, b, spread = PAIRS[name]
    rng = np.random.default_rng(5)
    compared = 0
    for _ in range(6):
        poses = np.tile(np.eye(4), (2, 1, 1))
        poses[:, :3, :3], poses[1, :3, 3] = random_rotations(rng, 2), rng.normal(size=3) * spread
        expected = (solid_of(a, poses[0]) ^ solid_of(b, poses[1])).volume()
        volume = overlap_volume(a, b, *poses).volume
        if expected > 1e-6:
            assert volume == pytest.approx(expected, rel=0.01)
            compared += 1
    assert compared >= 2


def test_window_thinner_than_a_pixel_is_still_sampled():
    """A plate of 1 x 1 m x 0.1 mm, whose lower half is above the cube's underside: 0.05 mm of it are in a cube of 1 m.

    The window, what both boxes have in common, is 32 x 32 x 1 pixels: 32 x 32 rays along z and 32 along x and y each.
    Each ray has four layers: it enters and leaves both bodies.
    """
    lift = np.eye(4)
    lift[2, 3] = 0.5
    answer = overlap_volume(box_mesh((1, 1, 1e-4)), box_mesh(), pose_b=lift)
    rays = 32 * 32 + 2 * 32
    assert answer.volume == pytest.approx(0.5e-4, rel=1e-6)
    assert answer.rays == rays
    assert answer.layers == 4 * rays


def test_touching_bodies_have_no_common_volume():
    """A cube of 1 m stands on another, in five random orientations of both and upright."""
    base, lift = np.eye(4), np.eye(4)
    base[:3, 3] = [0.1, 0.2, 0.3]
    for rotation in [np.eye(3), *random_rotations(np.random.default_rng(1), 5)]:
        base[:3, :3] = lift[:3, :3] = rotation
        lift[:3, 3] = base[:3, 3] + rotation @ [0, 0, 1.0]
        assert overlap_volume(box_mesh(), box_mesh(), base, lift).volume == 0.0


CRATE = box_mesh((4, 4, 4))
HOLLOW = merge_meshes(CRATE, box_mesh((2, 2, 2)))
CORNER = mesh_of(Manifold.cube((1, 4, 4)).translate((-2, -2, -2)) + Manifold.cube((4, 1, 4)).translate((-2, -2, -2)))
"""Two walls: a body that sticks out of one ends behind it on every ray, and its box is within that of both."""


@pytest.mark.parametrize(
    ("outer", "size", "position", "is_inside"),
    [
        pytest.param(CRATE, 1, (0, 0, 0), True, id="in the middle of a crate"),
        pytest.param(CRATE, 1, (1.5, 0, 0), False, id="touches the crate's side"),
        pytest.param(CRATE, 4, (0, 0, 0), False, id="as large as the crate"),
        pytest.param(HOLLOW, 0.5, (1.5, 0, 0), True, id="in the wall of a hollow crate"),
        pytest.param(HOLLOW, 1, (1, 0, 0), False, id="half in the hollow"),
        pytest.param(CORNER, 1, (-1, 0.5, 0), False, id="sticks out of a corner of two walls"),
    ],
)
def test_body_is_inside_when_its_box_and_volume_are(outer, size, position, is_inside):
    """A cube of this size at a position, and a crate with edges of 4 m, its hollow of 2 m, or walls 1 m thick.

    ``inside`` is the number of the body that is inside the other, 0 or 1, or -1.
    """
    cube = box_mesh((size,) * 3, centre=position)
    assert overlap_volume(cube, outer).inside == (0 if is_inside else -1)
    assert overlap_volume(outer, cube).inside == (1 if is_inside else -1)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("world", [box_mesh((2, 2, 2)).triangles, octahedron(None)], ids=["box", "ball"])
def test_rays_through_edges_and_corners_cross_twice(world):
    """Rays at -1, 0 and 1 m, where diagonals of a box's sides, meridians of a ball and corners of both lie.

    Depths of ray k are those from ``start[k]`` to ``start[k + 1]``; the middle one of 3 x 3 enters and leaves at both
    ends of the body, and all cross surfaces an even number of times. The order of the faces does not matter.
    """
    layers_in_python = layers_of.__wrapped__  # to compile it alone takes a second
    window = Window(np.full(3, -1.0), np.ones(3), np.full(3, 3))
    middle_ray, end = 4, world.max()
    for faces in (world, world[::-1]):
        for axis in range(3):
            start, depths = layers_in_python(faces, axis, window)
            assert depths[start[middle_ray] : start[middle_ray + 1]].tolist() == [-end, end], axis
            assert (np.diff(start) % 2 == 0).all(), axis
