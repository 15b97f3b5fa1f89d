"""Joints of a hand by the names of other programs: which finger, which joint of it, which side.

The joints are the 26 of OpenXR. The 21 of MANO-like sources and MediaPipe are those without a joint in the palm; bones
of Leap Motion have a start and an end, of which each is one of them.

Source: OpenXR 1.1, XrHandJointEXT; W3C, *WebXR Hand Input Module*; Unity, XRHandJointID; Meta,
OVRSkeleton.BoneId; Microsoft, MRTK TrackedHandJoint; Apple, HandSkeleton.JointName; Google, MediaPipe
HandLandmark; Romero et al., "Embodied Hands" (MANO), ACM Transactions on Graphics 36 (2017);
Ultraleap, LEAP_DIGIT.
"""

import re
import tomllib
from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, NamedTuple

TOKEN: Final = r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+"
WRIST, PALM = "wrist", "palm"
FINGERS: Final = ("thumb", "index", "middle", "ring", "little")
THUMB: Final = "thumb"
SEGMENTS: Final = ("metacarpal", "proximal", "intermediate", "distal", "tip")
"""The joints of a finger from the wrist on; a thumb has no intermediate one."""
_TABLE: Final[Mapping[str, Any]] = tomllib.loads(Path(__file__).with_name("joints.toml").read_text("utf-8"))


def _finger_joints(finger: str) -> list[str]:
    return [f"{finger} {segment}" for segment in SEGMENTS if finger != THUMB or segment != "intermediate"]


JOINTS: Final = (PALM, WRIST, *(joint for finger in FINGERS for joint in _finger_joints(finger)))
"""The 26 joints in the order of XrHandJointEXT."""

LANDMARKS: Final = (
    WRIST,
    *_finger_joints(THUMB),
    *(joint for finger in FINGERS[1:] for joint in _finger_joints(finger) if not joint.endswith("metacarpal")),
)
"""The 21 joints in the order of MediaPipe's HandLandmark."""

UNITY_JOINTS: Final = (WRIST, PALM, *JOINTS[2:])
"""The joints in the order of Unity's XRHandJointID, which begins with 1."""

NUMBERED: Final[Mapping[tuple[int, int], tuple[str, ...]]] = {
    (0, 25): JOINTS,
    (0, 20): LANDMARKS,
    (1, 26): UNITY_JOINTS,
}
"""First and last number of joints in a column -> the joints by number."""

RADII_M: Final[Mapping[str, float]] = {
    **{joint: 1e-3 * _TABLE[joint]["radius"] for joint in (WRIST, PALM)},
    **{
        joint: 1e-3 * _TABLE[finger][joint.split()[1]]["radius"]
        for finger in FINGERS
        for joint in _finger_joints(finger)
    },
}
"""Radius of each joint of an adult hand."""

RADII_SOURCE: Final = "the hand of Meta's WebXR emulator IWER (MIT)"


class Bone(NamedTuple):
    """A stretch of a hand between two neighbouring joints.

    Parameters
    ----------
    name : ``index tip`` of the last one of a finger, which ends in its tip.
    parent, child : the joints, that nearer the wrist first.
    length_m : of an adult hand.
    """

    name: str
    parent: str
    child: str
    length_m: float


def bones_of(joints: Collection[str]) -> list[Bone]:
    """Returns the bones whose two joints are among these; none leaves out a joint of a finger."""
    has_palm = any(f"{finger} metacarpal" in joints for finger in FINGERS[1:])
    bones = [
        Bone("wrist", WRIST, "middle metacarpal", _length("middle", "metacarpal")),
        Bone("thumb base", WRIST, "thumb metacarpal", _length(THUMB, "metacarpal")),
    ]
    for finger in FINGERS:
        chain = _finger_joints(finger)
        if finger != THUMB and not has_palm:
            # Joints in the palm are those of OpenXR alone: others go from the wrist to the knuckle.
            length = 1e-3 * _TABLE[finger]["proximal"]["direct"]
            bones.append(Bone(f"{finger} metacarpal", WRIST, f"{finger} proximal", length))
            chain = chain[1:]
        for parent, child in pairwise(chain):
            segment = child.split()[1]
            name = child if segment == "tip" else parent
            bones.append(Bone(name, parent, child, _length(finger, segment)))
    return [bone for bone in bones if bone.parent in joints and bone.child in joints]


def neighbours_of(joints: Collection[str]) -> list[Bone]:
    """Returns the bones between these joints, and the stretches from the wrist to every joint in the palm."""
    in_palm = [Bone(finger, WRIST, f"{finger} metacarpal", _length(finger, "metacarpal")) for finger in FINGERS]
    by_ends = {(bone.parent, bone.child): bone for bone in [*in_palm, *bones_of(joints)]}
    return [bone for ends, bone in by_ends.items() if {*ends} <= {*joints}]


def _length(finger: str, segment: str) -> float:
    return 1e-3 * float(_TABLE[finger][segment]["length"])


_NAMES: Final[Mapping[str, Any]] = _TABLE["names"]


def _by_alias(aliases: Mapping[str, list[str]]) -> dict[str, str]:
    """Alias -> what it stands for."""
    return {alias: meaning for meaning, names in aliases.items() for alias in names}


_SIDES: Final = _by_alias(_NAMES["sides"])
_FINGER_OF: Final = _by_alias(_NAMES["fingers"])
_SEGMENT_OF_FINGER: Final = _by_alias(_NAMES["segments_of_finger"])
_SEGMENT_OF_THUMB: Final = _by_alias(_NAMES["segments_of_thumb"])
_NOISE: Final = frozenset(_NAMES["without_meaning"])
UNUSED: Final = frozenset(_NAMES["unused"])
"""Joints of other programs that no capsule needs."""

STARTS, ENDS = frozenset({"start", "prev"}), frozenset({"end", "next"})
"""Words for the two ends of a bone of Leap Motion."""
_LEAP_BONES: Final = ("metacarpal", "proximal", "intermediate", "distal")
_LEAP_THUMB: Final = ("", "metacarpal", "proximal", "distal", "tip")
"""Leap's thumb has a metacarpal of length 0, so that its names lie one bone further out than those of others."""


class NamedJoint(NamedTuple):
    """A joint by its name in a file.

    Parameters
    ----------
    side : ``left``, ``right``, or ``""``: the name does not say it.
    joint : of ``JOINTS``; ``""``: no capsule needs it.
    """

    side: str
    joint: str


def tokens_of(name: str) -> list[str]:
    """Returns the words of a name in small letters: of "R_XRHand_IndexTip" r, xr, hand, index, tip."""
    return [token.lower() for token in re.findall(TOKEN, name)]


def side_in(text: str) -> str:
    """Returns ``left`` or ``right`` where a word of a text says it, else ``""``."""
    return next((_SIDES[token] for token in tokens_of(text) if token in _SIDES), "")


def joint_of(tokens: Sequence[str]) -> NamedJoint | None:
    """The joint that the words of a name say; ``None``: they name none."""
    side = next((_SIDES[token] for token in tokens if token in _SIDES), "")
    rest = [token for token in tokens if token not in _SIDES]
    rest = _separated_fingers([token for token in rest if token not in _NOISE])
    if len(rest) == 3 and rest[-1] in STARTS | ENDS:
        joint = _end_of_bone(*rest[:-1], is_start=rest[-1] in STARTS)
        return None if joint is None else NamedJoint(side, joint)
    whole = " ".join(rest)
    if whole in UNUSED:
        return NamedJoint(side, "")
    if whole in (WRIST, PALM, "wrist root", "palm center", "palm centre"):
        return NamedJoint(side, rest[0])
    if len(rest) < 2 or rest[0] not in _FINGER_OF:
        return None
    finger = _FINGER_OF[rest[0]]
    segment = (_SEGMENT_OF_THUMB if finger == THUMB else _SEGMENT_OF_FINGER).get(" ".join(rest[1:]))
    return None if segment is None else NamedJoint(side, f"{finger} {segment}")


def names_finger(tokens: Sequence[str]) -> bool:
    """Whether the words begin, after a side and words without meaning, with a finger."""
    rest = _separated_fingers([token for token in tokens if token not in _SIDES and token not in _NOISE])
    return bool(rest) and rest[0] in _FINGER_OF


def _separated_fingers(tokens: Sequence[str]) -> list[str]:
    """The words with "indexfinger" and "index1" in two."""
    separated = list[str]()
    for token in tokens:
        match = re.fullmatch(rf"({'|'.join(_FINGER_OF)})(?:finger)?(tip|mcp|pip|dip|\d)?", token)
        separated += [*filter(None, match.groups())] if match else [token]
    return separated


def _end_of_bone(word: str, bone: str, *, is_start: bool) -> str | None:
    """The joint at one end of a finger's bone of Leap Motion; ``""``: no capsule needs it."""
    if word not in _FINGER_OF or bone not in _LEAP_BONES:
        return None
    finger, joint = _FINGER_OF[word], _LEAP_BONES.index(bone) + (0 if is_start else 1)
    segment = (_LEAP_THUMB if finger == THUMB else SEGMENTS)[joint]
    return f"{finger} {segment}" if segment else ""
