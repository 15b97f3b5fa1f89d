"""Joints of a hand are known by the names of every exporter, and other names are none."""

import pytest
from support.made_hands import MEDIAPIPE, WEBXR, camel

from sessions.importers.hands.joint_names import (
    FINGERS,
    JOINTS,
    LANDMARKS,
    NUMBERED,
    RADII_M,
    bones_of,
    joint_of,
    tokens_of,
)


def name_by_pattern(joint, *, finger, segments, root="Wrist"):
    """A name by a pattern of finger and segment."""
    if joint == "wrist":
        return root
    digit, segment = joint.split()
    return finger.format(digit.capitalize() if digit != "little" else "Pinky") + segments[digit == "thumb"][segment]


SEGMENTS = ("metacarpal", "proximal", "intermediate", "distal", "tip")
THUMB_SEGMENTS = ("metacarpal", "proximal", "distal", "tip")


def segment_names(fingers, thumb):
    """Words for the segments of fingers, and of the thumb."""
    return dict(zip(SEGMENTS, fingers.split(), strict=True)), dict(zip(THUMB_SEGMENTS, thumb.split(), strict=True))


MRTK = segment_names("Metacarpal Knuckle MiddleJoint DistalJoint Tip", "MetacarpalJoint ProximalJoint DistalJoint Tip")
APPLE = segment_names(
    "Metacarpal Knuckle IntermediateBase IntermediateTip Tip", "Knuckle IntermediateBase IntermediateTip Tip"
)
MANO = segment_names("0 1 2 3 _tip", "1 2 3 _tip")
PALMLESS = [joint for joint in JOINTS if joint != "palm"]
EXPORTERS = {
    "openxr": {joint: f"XR_HAND_JOINT_{joint.upper().replace(' ', '_')}_EXT" for joint in JOINTS},
    "unity": {joint: camel(joint) for joint in JOINTS},
    "quest": {joint: f"XRHand_{camel(joint)}" for joint in JOINTS},
    "webxr": WEBXR,
    "mediapipe": MEDIAPIPE,
    "mrtk": {joint: name_by_pattern(joint, finger="{}", segments=MRTK) for joint in PALMLESS},
    "apple": {joint: name_by_pattern(joint, finger="{}Finger", segments=APPLE) for joint in PALMLESS},
    "mano": {joint: name_by_pattern(joint, finger="{}", segments=MANO).lower() for joint in LANDMARKS},
}


@pytest.mark.parametrize(
    ("pattern", "side"),
    [("{}", ""), ("left_{}", "left"), ("R_{}", "right"), ("{}_L", "left"), ("RightHand_{}", "right")],
)
def test_every_joint_of_every_exporter_is_known(pattern, side):
    """Eight exporters' names (EXPORTERS), alone and with a side before or behind them."""
    assert len(EXPORTERS["mano"]) == len(EXPORTERS["mediapipe"]) == 21 == min(map(len, EXPORTERS.values()))
    for joint, written in (row for names in EXPORTERS.values() for row in names.items()):
        known = joint_of(tokens_of(pattern.format(written)))
        assert known is not None and (known.side, known.joint) == (side, joint), written


@pytest.mark.parametrize(
    "name",
    [
        "index card",
        "ring_stand",
        "middle_glass",
        "cup",
        "left",
        "head",
        "thumb",
        "palm tree",
        "cup_proximal_start",
        "index_cup_start",
        "left_index_start",
    ],
)
def test_names_of_objects_are_not_read_as_hand_joints(name):
    """Names that hold a finger's or a segment's word, and no joint."""
    assert joint_of(tokens_of(name)) is None


@pytest.mark.parametrize("name", ["Hand_Thumb0", "ForearmStub", "left_elbow"])
def test_joints_that_no_capsule_needs_are_known(name):
    """A joint "" is one that is known and left out."""
    assert joint_of(tokens_of(name)).joint == ""


def test_bones_connect_every_finger_up_to_its_tip():
    """OpenXR's thumb has 3 bones and its fingers 4; of MediaPipe's 21 landmarks each but the wrist ends a bone.

    Two more of OpenXR's lie between the wrist and the metacarpals of the middle finger and of the thumb.
    """
    fingers_alone = JOINTS[2:]  # without palm and wrist
    for joints, count in ((JOINTS, 3 + 4 * 4 + 2), (LANDMARKS, 21 - 1), (fingers_alone, 3 + 4 * 4)):
        bones = bones_of(joints)
        assert len(bones) == len({bone.name for bone in bones}) == count
        assert {f"{finger} tip" for finger in FINGERS} <= {bone.name for bone in bones if bone.child.endswith("tip")}
    assert {bone.parent for bone in bones_of(LANDMARKS) if bone.name.endswith("metacarpal")} == {
        "wrist",
        "thumb metacarpal",
    }
    assert not bones_of(["index proximal", "index tip"]), "joints between them are unknown"


def test_numbers_and_radii_cover_all_joints():
    """OpenXR has 26 joints and MediaPipe 21; numbers count from 0 or from 1; radii of 5 to 22 mm."""
    assert [len(order) for order in NUMBERED.values()] == [26, 21, 26] and {*RADII_M} == {*JOINTS}
    assert {*NUMBERED[1, 26]} == {*JOINTS} and NUMBERED[1, 26][0] == "wrist"
    assert all(0.005 < radius < 0.022 for radius in RADII_M.values())
