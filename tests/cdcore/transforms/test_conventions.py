"""Every convention comes back from the canonical frame as it went in, and its rotations turn what its points are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shapes import beaker_mesh, random_rotations

from cdcore.errors import InvalidPoseError, InvalidSettingError
from cdcore.transforms.conventions import (
    CONVENTIONS,
    MESH_FRAMES,
    convention_named,
    mesh_poses,
    reversed_winding,
    signed_volume,
)

RNG = np.random.default_rng(0)
POINTS, ROTATIONS = RNG.normal(size=(1000, 3)), random_rotations(RNG, 1000)
QUATERNIONS = Rotation.from_matrix(ROTATIONS).as_quat()


def poses():
    square = np.tile(np.eye(4), (1000, 1, 1))
    square[:, :3, :3], square[:, :3, 3] = ROTATIONS, POINTS
    return square


@pytest.mark.parametrize("name", CONVENTIONS)
def test_a_thousand_poses_come_back_as_they_went_in(name):
    source = CONVENTIONS[name]
    back = source.inverse()
    assert np.abs(back.points(source.points(POINTS)) - POINTS).max() < 1e-15
    assert np.abs(back.rotations(source.rotations(ROTATIONS)) - ROTATIONS).max() < 1e-15
    assert np.abs(back.poses(source.poses(poses())) - poses()).max() < 1e-15


@pytest.mark.parametrize("name", CONVENTIONS)
def test_rotating_then_converting_is_converting_then_rotating(name):
    source = CONVENTIONS[name]
    turned = np.einsum("kij,kj->ki", ROTATIONS, POINTS)
    converted = np.einsum("kij,kj->ki", source.rotations(ROTATIONS), source.points(POINTS))
    assert np.abs(source.points(turned) - converted).max() < 1e-14
    assert np.abs(np.linalg.det(source.rotations(ROTATIONS)) - 1).max() < 1e-14


@pytest.mark.parametrize("name", CONVENTIONS)
def test_a_pose_carries_the_rotation_and_the_point(name):
    source = CONVENTIONS[name]
    converted = source.poses(poses())
    assert np.abs(converted[:, :3, :3] - source.rotations(ROTATIONS)).max() < 1e-15
    assert np.abs(converted[:, :3, 3] - source.points(POINTS)).max() < 1e-15
    assert (converted[:, 3] == [0, 0, 0, 1]).all()


@pytest.mark.parametrize(
    ("name", "point", "quaternion"),
    [
        ("unity", lambda x, y, z: (x, y, -z), lambda x, y, z, w: (-x, -y, z, w)),
        ("openvr", lambda x, y, z: (x, y, z), lambda x, y, z, w: (x, y, z, w)),
        ("openxr", lambda x, y, z: (x, y, z), lambda x, y, z, w: (x, y, z, w)),
        ("gltf", lambda x, y, z: (x, y, z), lambda x, y, z, w: (x, y, z, w)),
        ("z-up", lambda x, y, z: (x, z, -y), lambda x, y, z, w: (x, z, -y, w)),
    ],
)
def test_the_printed_component_forms_hold(name, point, quaternion):
    source = CONVENTIONS[name]
    assert np.array_equal(source.points(POINTS), np.stack(point(*POINTS.T), axis=1))
    expected = Rotation.from_quat(np.stack(quaternion(*QUATERNIONS.T), axis=1)).as_matrix()
    assert np.abs(source.rotations(ROTATIONS) - expected).max() < 1e-14


def test_from_canonical_to_ros_and_from_unity_directly():
    to_ros = CONVENTIONS["ros"].inverse()
    x, y, z = POINTS.T
    qx, qy, qz, qw = QUATERNIONS.T
    assert np.array_equal(to_ros.points(POINTS), np.stack([-z, -x, y], axis=1))
    expected = Rotation.from_quat(np.stack([-qz, -qx, qy, qw], axis=1)).as_matrix()
    assert np.abs(to_ros.rotations(ROTATIONS) - expected).max() < 1e-14
    unity = CONVENTIONS["unity"]
    assert np.array_equal(to_ros.points(unity.points(POINTS)), np.stack([z, -x, y], axis=1))
    expected = Rotation.from_quat(np.stack([-qz, qx, -qy, qw], axis=1)).as_matrix()
    assert np.abs(to_ros.rotations(unity.rotations(ROTATIONS)) - expected).max() < 1e-14


def test_only_unity_mirrors():
    assert [name for name, row in CONVENTIONS.items() if row.mirrors] == ["unity"]


def test_forward_and_up_of_every_source_become_minus_z_and_y():
    forward = {"unity": [0, 0, 1], "openvr": [0, 0, -1], "openxr": [0, 0, -1], "ros": [1, 0, 0]}
    up = {"ros": [0, 0, 1], "z-up": [0, 0, 1]}
    for name, source in CONVENTIONS.items():
        assert source.points(up.get(name, [0, 1, 0])).tolist() == [0, 1, 0]
        if name in forward:
            assert source.points(forward[name]).tolist() == [0, 0, -1]


def test_a_gltf_x_mesh_and_a_raw_z_mesh_of_one_object_land_on_the_same_world_points():
    unity = CONVENTIONS["unity"]
    own = RNG.normal(size=(50, 3))
    world = np.einsum("kij,vj->kvi", ROTATIONS[:20], own) + POINTS[:20, None]
    expected = unity.points(world)
    for frame in MESH_FRAMES.values():
        stored = own @ frame.T
        converted = mesh_poses(unity, poses()[:20], frame)
        landed = np.einsum("kij,vj->kvi", converted[:, :3, :3], stored) + converted[:, None, :3, 3]
        assert np.abs(landed - expected).max() < 1e-14
        assert (np.linalg.det(converted[:, :3, :3]) > 0).all()


def test_forgetting_the_exporters_flip_turns_the_mesh_by_half_a_turn_about_y():
    half_turn = MESH_FRAMES["raw-z"] @ MESH_FRAMES["gltf-x"]
    assert np.allclose(half_turn, Rotation.from_euler("y", np.pi).as_matrix())


def test_a_frame_that_would_mirror_the_mesh_is_refused():
    with pytest.raises(InvalidPoseError, match="mirror the mesh; mirror its vertices once, reverse its winding"):
        mesh_poses(CONVENTIONS["unity"], poses(), np.eye(3))
    with pytest.raises(InvalidPoseError, match="from ros"):
        mesh_poses(CONVENTIONS["ros"], poses(), MESH_FRAMES["raw-z"])
    assert mesh_poses(CONVENTIONS["unity"], poses()[:0], np.eye(3)).shape == (0, 4, 4)


def test_a_mirrored_mesh_is_inside_out_until_its_winding_is_reversed_once():
    glass = beaker_mesh()
    flipped = glass.vertices @ MESH_FRAMES["raw-z"].T
    volume = signed_volume(glass.vertices, glass.faces)
    assert abs(volume) > 1e-5
    assert signed_volume(flipped, glass.faces) == pytest.approx(-volume)
    assert signed_volume(flipped, reversed_winding(glass.faces)) == pytest.approx(volume)


def test_the_volume_of_a_mesh_far_from_its_origin_keeps_its_digits():
    glass = beaker_mesh()
    far = signed_volume(glass.vertices + 1e4, glass.faces)
    assert far == pytest.approx(signed_volume(glass.vertices, glass.faces), rel=1e-6)


def test_an_unknown_convention_is_answered_with_the_known_ones():
    assert convention_named("unity") is CONVENTIONS["unity"]
    with pytest.raises(InvalidSettingError, match="no convention 'unreal'; there are: unity, openvr"):
        convention_named("unreal")
