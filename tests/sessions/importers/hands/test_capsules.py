"""Capsules between joints: their surface by the closed form of a rounded cone, and their poses by the two joints."""

import numpy as np
import pytest

from sessions.errors import SceneError
from sessions.geometry.rotations import quaternion_inverse, quaternion_product, rotated_vectors
from sessions.importers.hands.capsules import bone_motion, capsule_mesh
from sessions.mesh_data import has_consistent_winding


def rounded_cone_distance(points, length, radius, parent_radius):
    """Signed distance to the hull of a sphere about the origin and one ``length`` below it.

    Source: Quilez, "Distance functions", round cone: the lower sphere is its first one.
    """
    across = np.hypot(points[:, 0], points[:, 2])
    along = points[:, 1] + length
    if abs(parent_radius - radius) >= length:
        largest, height = max((radius, length), (parent_radius, 0.0))
        return np.hypot(across, along - height) - largest
    slope = (parent_radius - radius) / length
    rise = np.sqrt(1.0 - slope**2)
    position = -slope * across + rise * along
    below, above = np.hypot(across, along) - parent_radius, np.hypot(across, along - length) - radius
    side = rise * across + slope * along - parent_radius
    return np.where(position < 0.0, below, np.where(position > rise * length, above, side))


@pytest.mark.parametrize(
    ("length", "radius", "parent_radius"),
    [
        (0.04, 0.01, 0.01),
        (0.06, 0.01, 0.021),
        (0.025, 0.012, 0.007),
        (0.01, 0.005, 0.02),
        (0.0, 0.01, 0.008),
        (0.03, 0.02, 0.05),
    ],
)
def test_capsules_are_inscribed_in_the_hull_of_two_spheres(length, radius, parent_radius):
    """A capsule is the hull of a sphere at a joint and a sphere ``length`` away, at the joint's parent; in metres.

    Its vertices lie on that hull; middles of faces lie within it, by at most 0.53 % of the larger radius. Faces look
    outwards, and are 1,000 to 3,000.
    """
    mesh = capsule_mesh(length, radius, parent_radius)
    at_vertices = rounded_cone_distance(mesh.vertices, length, radius, parent_radius)
    at_middles = rounded_cone_distance(mesh.triangles.mean(axis=1), length, radius, parent_radius)
    rounding = 1e-15
    assert np.abs(at_vertices).max() < rounding
    assert at_middles.max() < rounding
    assert at_middles.min() > -0.0053 * max(radius, parent_radius)
    assert has_consistent_winding(mesh)
    assert mesh.volume > 0.0
    assert 1000 < len(mesh.faces) < 3000


def test_capsule_without_radius_is_refused():
    """The sphere at the joint has a radius of 0, that at its parent 1 cm."""
    with pytest.raises(SceneError, match="give radii above 0"):
        capsule_mesh(length=0.03, radius=0.0, parent_radius=0.01)


def wandering_directions(count=400, seed=0):
    """Unit vectors (count, 3) that wander over the whole sphere in small steps, through -Y too; any seed."""
    angles = 0.2 + np.cumsum(np.random.default_rng(seed).normal(0.0, 0.05, (count, 2)), axis=0)
    angles[:, 0] = np.linspace(-1.0, 5.5, count)
    directions = np.stack(
        [np.sin(angles[:, 0]) * np.cos(angles[:, 1]), np.cos(angles[:, 0]), np.sin(angles[:, 0]) * np.sin(angles[:, 1])]
    )
    return directions.T


def test_capsules_lie_between_their_joints_without_twisting():
    """A bone of 3 cm moves by 1 mm along each axis a frame while it wanders over all directions, in 400 frames.

    The capsule's origin is at the child joint, its -Y points to the parent. From frame to frame it turns by the angle
    between the directions of the bone and no further, so that it does not spin about itself.
    """
    directions = wandering_directions(count=400)
    parent = np.cumsum(np.full_like(directions, 0.001), axis=0)
    child = parent + 0.03 * directions
    motion = bone_motion(times_ns=np.arange(400), parent=parent, child=child, valid=np.ones(400, dtype=bool))
    positions, quaternions = motion.track.positions, motion.track.quaternions_xyzw
    np.testing.assert_allclose(positions, child, atol=1e-15)
    to_parent = rotated_vectors(quaternions, [0.0, -motion.length, 0.0])
    np.testing.assert_allclose(to_parent, parent - child, atol=1e-12)

    steps = quaternion_product(quaternions[1:], quaternion_inverse(quaternions[:-1]))
    rotation_angles = 2.0 * np.arccos(np.clip(steps[:, 3], -1.0, 1.0))
    angles_between_directions = np.arccos(np.clip((directions[1:] * directions[:-1]).sum(axis=1), -1.0, 1.0))
    np.testing.assert_allclose(rotation_angles, angles_between_directions, atol=1e-6)


def test_bone_motion_follows_bones_that_point_opposite_ways():
    """A bone 3 cm long, along +Y, -Y, +X and -X: the capsule's +Y is rotated onto it."""
    parent = np.zeros((4, 3))
    child = 0.03 * np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    track = bone_motion(times_ns=np.arange(4), parent=parent, child=child, valid=np.ones(4, dtype=bool)).track
    np.testing.assert_allclose(rotated_vectors(track.quaternions_xyzw, [0.0, 0.03, 0.0]), child, atol=1e-12)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 0.0, 1e9, 1e300])
def test_samples_with_impossible_joints_are_lost(wrong):
    """A bone is 3 cm long; in samples 10 to 13 of 50 all coordinates of its joint are ``wrong``, and those are lost.

    They change neither its length nor how much that varies (``change``). ``lost`` counts samples of a wrong length: not
    those whose length is no finite number, as that of 1e300, whose square overflows.
    """
    count = 50
    parent = np.zeros((count, 3))
    child = np.tile([0.0, 0.0, 0.03], (count, 1))
    child[10:14] = wrong
    motion = bone_motion(times_ns=np.arange(count), parent=parent, child=child, valid=np.ones(count, dtype=bool))
    assert motion.length == pytest.approx(0.03)
    assert motion.change == pytest.approx(0.0, abs=1e-12)
    assert [*np.flatnonzero(~motion.track.valid)] == [10, 11, 12, 13]
    assert np.isfinite(motion.track.positions).all()
    assert np.isfinite(motion.track.quaternions_xyzw).all()
    has_finite_length = wrong in (0.0, 1e9)
    assert motion.lost == (4 if has_finite_length else 0)


def test_untracked_samples_are_lost_and_do_not_count():
    """A bone is 3 cm long in the last four of ten samples; in the first six, not tracked, both joints are at 0."""
    parent, child = np.zeros((10, 3)), np.tile([0.03, 0.0, 0.0], (10, 1))
    child[:6] = 0.0
    is_tracked = np.arange(10) >= 6
    motion = bone_motion(times_ns=np.arange(10), parent=parent, child=child, valid=is_tracked)
    assert motion.length == pytest.approx(0.03)
    assert motion.track.valid.tolist() == is_tracked.tolist()
    assert motion.lost == 0


def test_bone_without_length_is_none():
    """Both joints are at the origin in all ten samples: there is no capsule between them (None)."""
    origin = np.zeros((10, 3))
    valid = np.ones(10, dtype=bool)
    assert bone_motion(times_ns=np.arange(10), parent=origin, child=origin, valid=valid) is None
