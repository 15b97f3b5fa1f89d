"""Rotations written in another way than they are read, of sessions whose true motion is known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sessions import Session
from sessions.doctor.pose_pass import run_pose_pass
from sessions.doctor.rotation_evidence import rotation_findings
from sessions.model.scene import Scene

COUNT = 120
STAMPS = np.arange(COUNT) * 90_000_000


def codes_of(poses):
    """The codes of findings about the rotations of these bodies."""
    frames = Session.from_arrays(STAMPS, poses).frames
    return [finding.code for finding in rotation_findings(run_pose_pass([frames]), Scene())]


@pytest.mark.parametrize(("order", "codes"), [("xyzw", []), ("wxyz", ["rotation-order"])])
@pytest.mark.parametrize("height", [1.6, 0.1])
def test_head_upside_down_at_its_height_is_reported(order, codes, height):
    """A head that turns about and nods; on the floor it may be a headset that lies there."""
    angles = np.column_stack([np.linspace(0, 300, COUNT), 20 * np.sin(np.arange(COUNT))])
    quaternions = Rotation.from_euler("YX", angles, degrees=True).as_quat()
    if order == "wxyz":
        quaternions = np.roll(quaternions, 1, axis=1)
    head = np.tile([0.0, height, 0.0], (COUNT, 1)), quaternions
    assert codes_of({"head": head}) == (codes if height > 1 else [])


@pytest.mark.parametrize("is_inverse", [False, True])
@pytest.mark.parametrize("is_carried", [False, True])
def test_carried_body_shows_inverse_rotations(is_inverse, is_carried):
    """A cup 10 cm from the hand that rotates by 40 degrees a second, carried or left on the table."""
    random = np.random.default_rng(0)
    rotation = Rotation.from_rotvec(np.outer(np.arange(COUNT) * 0.09 * np.radians(40), [0.6, 0.0, 0.8]))
    hand = np.column_stack([0.1 * np.sin(np.arange(COUNT) / 9), np.ones((COUNT, 2))])
    cup = hand + rotation.apply([0.0, 0.1, 0.0]) if is_carried else np.tile([0.3, 1.0, 1.0], (COUNT, 1))
    cup = cup + random.normal(0.0, 3e-4, cup.shape)
    written = (rotation.inv() if is_inverse else rotation).as_quat()
    poses = {"hand": (hand, written), "cup": (cup, written)}
    codes = codes_of(poses)
    assert ("rotation-inverse" in codes) == (is_inverse and is_carried)
