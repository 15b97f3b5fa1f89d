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
    """The codes of the doctor's findings about the rotations of these bodies: name -> (positions, quaternions)."""
    frames = Session.from_arrays(STAMPS, poses).frames
    return [finding.code for finding in rotation_findings(run_pose_pass([frames]), Scene())]


@pytest.mark.parametrize(
    ("height_m", "order", "codes"),
    [
        pytest.param(1.6, "xyzw", [], id="right order"),
        pytest.param(1.6, "wxyz", ["rotation-order"], id="wrong order"),
        pytest.param(0.1, "xyzw", [], id="on the floor, right order"),
        pytest.param(0.1, "wxyz", [], id="on the floor, wrong order"),
    ],
)
def test_head_upside_down_at_its_height_is_reported(height_m, order, codes):
    """A head rotates by 300 degrees about Y and nods by 20; quaternions are written in ``order``, and read as xyzw.

    Read in the wrong order the head is upside down; 0.1 m up, on the floor, it may be a headset that lies there.
    """
    yaw_and_pitch = np.column_stack([np.linspace(0, 300, COUNT), 20 * np.sin(np.arange(COUNT))])
    quaternions = Rotation.from_euler("YX", yaw_and_pitch, degrees=True).as_quat()
    if order == "wxyz":
        quaternions = np.roll(quaternions, 1, axis=1)
    positions = np.tile([0.0, height_m, 0.0], (COUNT, 1))
    assert codes_of({"head": (positions, quaternions)}) == codes


@pytest.mark.parametrize(
    ("is_inverse", "is_carried", "is_reported"),
    [
        pytest.param(True, True, True, id="inverse, carried"),
        pytest.param(True, False, False, id="inverse, on the table"),
        pytest.param(False, True, False, id="right, carried"),
        pytest.param(False, False, False, id="right, on the table"),
    ],
)
def test_carried_body_shows_inverse_rotations(is_inverse, is_carried, is_reported):
    """A hand rotates by 40 degrees a second; a cup is carried 10 cm from it, or stays on a table.

    Both rotations are written as they are or inverted. By an inverted rotation a carried cup would move in the hand;
    of a cup that is not carried nothing can be said. Positions have noise of 0.3 mm.
    """
    seconds = STAMPS / 1e9
    rotation = Rotation.from_rotvec(np.outer(seconds * np.radians(40), [0.6, 0.0, 0.8]))
    hand = np.column_stack([0.1 * np.sin(np.arange(COUNT) / 9), np.ones((COUNT, 2))])
    cup = hand + rotation.apply([0.0, 0.1, 0.0]) if is_carried else np.tile([0.3, 1.0, 1.0], (COUNT, 1))
    cup = cup + np.random.default_rng(0).normal(0.0, 0.0003, cup.shape)
    written = (rotation.inv() if is_inverse else rotation).as_quat()
    codes = codes_of({"hand": (hand, written), "cup": (cup, written)})
    assert ("rotation-inverse" in codes) == is_reported
