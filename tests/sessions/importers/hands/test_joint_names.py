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
    """Names of joints as eight exporters write them (EXPORTERS), alone and with a side before or behind them."""
    for names in EXPORTERS.values():
        for joint, written in names.items():
            known = joint_of(tokens_of(pattern.format(written)))
            assert known is not None, written
            assert (known.side, known.joint) == (side, joint), written


def test_exporters_above_have_all_their_joints():
    """MediaPipe and MANO have 21 landmarks, OpenXR 26 joints, WebXR, MRTK and Apple these without the palm."""
    counts = {exporter: len(names) for exporter, names in EXPORTERS.items()}
    assert counts == {
        **dict.fromkeys(("openxr", "unity", "quest"), 26),
        **dict.fromkeys(("webxr", "mrtk", "apple"), 25),
        **dict.fromkeys(("mediapipe", "mano"), 21),
    }


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
    """Each name has the word for a finger, a segment, a side or the palm, and is no joint."""
    assert joint_of(tokens_of(name)) is None


@pytest.mark.parametrize("name", ["Hand_Thumb0", "ForearmStub", "left_elbow"])
def test_joints_that_no_capsule_needs_are_known(name):
    """Hands of some programs have these three, in which no capsule ends: a joint "" is known and left out."""
    assert joint_of(tokens_of(name)).joint == ""


def test_bones_connect_every_finger_up_to_its_tip():
    """Bones of a hand have names of their own, and each finger has one that ends in its tip.

    OpenXR's thumb has 3 bones and its four fingers 4 each; two more lie between the wrist and the metacarpals of the
    middle finger and of the thumb. Of MediaPipe's 21 landmarks each but the wrist ends a bone.
    """
    palm, wrist, *fingers_alone = JOINTS
    assert (palm, wrist) == ("palm", "wrist")
    for joints, count in ((JOINTS, 3 + 4 * 4 + 2), (LANDMARKS, 21 - 1), (fingers_alone, 3 + 4 * 4)):
        bones = bones_of(joints)
        assert len(bones) == len({bone.name for bone in bones}) == count
        names_at_tips = {bone.name for bone in bones if bone.child.endswith("tip")}
        assert names_at_tips == {f"{finger} tip" for finger in FINGERS}


def test_fingers_of_landmarks_begin_at_the_wrist():
    """MediaPipe has no metacarpals but the thumb's: its four fingers have a bone from the wrist in their place."""
    metacarpals = [bone for bone in bones_of(LANDMARKS) if bone.name.endswith("metacarpal")]
    assert {bone.parent for bone in metacarpals} == {"wrist", "thumb metacarpal"}


def test_no_bone_joins_joints_that_are_not_neighbours():
    """Between the first joint of the index finger and its tip are two more, which are missing."""
    assert not bones_of(["index proximal", "index tip"])


def test_numbered_joints_are_those_of_openxr_or_mediapipe():
    """A file may number joints: OpenXR's 26 from 0, MediaPipe's 21 from 0, Unity's 26 from 1, its wrist first.

    NUMBERED is (first number, last number) -> joints in order.
    """
    assert {numbers: len(joints) for numbers, joints in NUMBERED.items()} == {(0, 25): 26, (0, 20): 21, (1, 26): 26}
    assert {*NUMBERED[1, 26]} == {*JOINTS}
    assert NUMBERED[1, 26][0] == "wrist"


def test_every_joint_has_a_radius_of_a_finger():
    """Radii are for files that have none: of 5 to 22 mm."""
    assert {*RADII_M} == {*JOINTS}
    assert min(RADII_M.values()) > 0.005
    assert max(RADII_M.values()) < 0.022
