"""A made hand touches a glass in a known frame with a known finger, and every verdict is that of python-fcl."""

from functools import cache

import numpy as np
import pytest
from support.made_hands import FINGERS, made_hand, write_wide

from cdcore.narrow.fcl_meshes import FclMeshes
from cdcore.protocol import counts_as_contact
from replay.engine import compute
from sessions import import_session
from sessions.importers.hands.joint_names import RADII_M, bones_of
from sessions.scene_files.scene_meshes import with_scene

GLASS_RADIUS_M, STEP_M = 0.03, 0.002
FRAMES, TOUCH = 12, 7
"""Frames of a recording, and the number of that in which the fingertip is in the glass first."""
SCENE = """
[[body]]
id = "glass"
shape = "cylinder"
radius = {radius}
length = 0.3
faces = 200
fixed = {{ position = [{x}, {y}, {z}] }}

[[pair]]
between = ["{side} hand", "glass"]
"""


def hand_that_comes_to_a_glass(folder, side, finger):
    """A hand that points with one finger and moves 2 mm a frame; its tip is 1 mm in the glass first in frame TOUCH."""
    stretched, bent = 0.02, 1.3  # radians of each joint
    curl = {name: stretched if name == finger else bent for name in FINGERS}
    path = np.stack([np.zeros(FRAMES), np.ones(FRAMES), -STEP_M * np.arange(FRAMES)], axis=1)
    joints = made_hand(curl, path, side)
    x, y, z = joints[f"{finger} tip"][TOUCH]
    glass_z = z - GLASS_RADIUS_M - RADII_M[f"{finger} tip"] * hand_size(joints) + STEP_M / 2.0
    session = import_session("hands", write_wide(folder / "take.csv", np.arange(FRAMES) / 90.0, {side: joints}))
    scene = folder / "glass.toml"
    scene.write_text(SCENE.format(radius=GLASS_RADIUS_M, x=x, y=y, z=glass_z, side=side))
    return with_scene(session, scene)


def hand_size(joints):
    """The lengths of the bones of a hand, as a multiple of those of the table that the radii of joints are from."""
    bones = bones_of(joints)
    lengths = [np.linalg.norm(joints[bone.child][0] - joints[bone.parent][0]) for bone in bones]
    return sum(lengths) / sum(bone.length_m for bone in bones)


@pytest.fixture(scope="module")
def run_of_finger(tmp_path_factory):
    """Returns the run of a hand that touches the glass with a finger; each is run once for all tests."""

    @cache
    def run(side, finger):
        session = hand_that_comes_to_a_glass(tmp_path_factory.mktemp("hand"), side, finger)
        return compute(session, detectors="exact", oracle="exact")

    return run


@pytest.mark.sampled(6)
@pytest.mark.parametrize(("side", "finger"), [*zip(["left", "right"] * 3, FINGERS, strict=False)])
def test_first_touch_is_of_the_planted_finger_in_its_frame(run_of_finger, side, finger):
    """The glass is placed so that the tip of this finger is in it first in frame TOUCH.

    The contact is the hand's, as one body, and the fingertip is its only member that touches.
    """
    result = run_of_finger(side, finger)
    contact = counts_as_contact(result.detections["exact"].verdict)
    first_frame = int(np.flatnonzero(contact.any(axis=1))[0])
    touching = [result.assembly.bodies_of(pair)[0] for pair in np.flatnonzero(contact[first_frame])]
    assert (first_frame, touching) == (TOUCH, [f"{side} {finger} tip"])
    (episode,) = result.tables["episodes"].plain()
    assert (episode["body_a"], episode["body_b"], episode["first"]) == (f"{side} hand", "glass", TOUCH)
    assert episode["members"] == f"{side} {finger} tip"


def test_python_fcl_agrees_on_every_capsule(run_of_finger):
    """A left hand touches a glass with its thumb; its bones are capsules.

    In every third of 12 frames the same pairs of meshes meet by exact and by python-fcl; some pairs do, some do not.
    """
    result = run_of_finger("left", "thumb")
    assembly, contact = result.assembly, counts_as_contact(result.detections["exact"].verdict)
    meshes, motion = FclMeshes([body.mesh for body in assembly.bodies]), assembly.motion
    compared_frames = range(0, FRAMES, 3)
    for frame in compared_frames:
        for body in range(len(assembly.bodies)):
            meshes.set_pose(body, motion.rotations[frame, body], motion.translations[frame, body])
        assert (contact[frame] == [meshes.touch(a, b) for a, b in assembly.pairs.tolist()]).all(), frame
    assert contact[compared_frames].any() and not contact[compared_frames].all()
