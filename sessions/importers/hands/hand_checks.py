"""Checks whether joints are those of hands: their size, their side, joints that are exchanged, bones that change.

Each answer comes from the positions alone: bones have one length, in the proportions of a hand, and
fingers bend towards the palm.
"""

from collections.abc import Mapping
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.importers.hands.joint_names import FINGERS, WRIST, Bone, bones_of, neighbours_of
from sessions.importers.ledger import Numbers

SAMPLES: Final = 64
"""Moments of a recording that are examined, evenly spread."""
SIZES: Final = (0.5, 1.6)
"""Sizes of a hand, as a multiple of an adult one's: of a child of two years and of the largest one."""
UNITS: Final[Mapping[str, float]] = {"m": 1.0, "cm": 0.01, "mm": 0.001}
LEAST_BEND: Final = 0.1
"""Fingers that bend by less, as a fraction of their length, do not say which side of the hand the palm is."""
LARGEST_CHANGE: Final = 0.25
"""Change of a bone's length, median of all bones, above which positions are not those of a hand in space."""
LEAST_GAIN: Final = 0.022
"""By which fraction of all bones exchanging two joints must mend their lengths, before these are called exchanged.

Of 300 hands whose bones are up to 20 % longer or shorter than those of the table, none comes to it; of 900 planted
exchanges 847 are named rightly, by this or by ``FOLDED`` (2026-11). The others exchange neighbours of two fingers.
"""
FOLDED: Final = -0.7
"""Cosine of the angle by which no finger bends at one joint: 135 degrees; the most that people do is 120."""
STEADY: Final = 5.0
"""Percent of the samples that may contradict."""

Joints = Mapping[str, Numbers]
"""Joint -> its positions (n, 3), NaN where there is none."""


def examined_samples(joints: Joints) -> Joints:
    """Some samples of each joint, of those in which all joints are there; none where there is no such sample."""
    stacked = np.stack([*joints.values()])
    with np.errstate(invalid="ignore", over="ignore"):
        # Joints that lie all in one point are those of a hand that was not tracked.
        spread = np.abs(stacked - stacked[0]).sum(axis=2).max(axis=0)
    rows = np.flatnonzero(np.isfinite(stacked).all(axis=(0, 2)) & np.isfinite(spread) & (spread > 0.0))
    chosen = rows[np.unique(np.linspace(0, len(rows) - 1, SAMPLES).round().astype(int))] if len(rows) else rows
    return {joint: positions[chosen] for joint, positions in joints.items()}


def _lengths(joints: Joints, bones: list[Bone]) -> Numbers:
    """Lengths (bones, n)."""
    return np.stack([np.linalg.norm(joints[bone.child] - joints[bone.parent], axis=1) for bone in bones])


def hand_size(joints: Joints) -> float:
    """The size of a hand in units of its positions, as a multiple of an adult one's in metres; NaN: not known."""
    bones = bones_of(joints)
    if not bones or not len(next(iter(joints.values()))):
        return float("nan")
    lengths = np.median(_lengths(joints, bones), axis=1)
    return float(lengths.sum() / sum(bone.length_m for bone in bones))


def unit_of_size(size: float) -> str:
    """The unit of lengths in which a hand has a human size, or ``""``."""
    return next((unit for unit, metres in UNITS.items() if SIZES[0] <= size * metres <= SIZES[1]), "")


def length_change(joints: Joints) -> float:
    """Median over the bones of the change of their length, as a fraction of it: between 5 and 95 % of the samples."""
    lengths = _lengths(joints, bones_of(joints))
    lower, middle, upper = np.percentile(lengths, [STEADY, 50.0, 100.0 - STEADY], axis=1)
    usable = middle > 0.0
    return float(np.median((upper - lower)[usable] / middle[usable])) if usable.any() else 0.0


def stuck_joint(joints: Joints) -> str:
    """A joint that never moves although the wrist does, such as one at the origin that was not tracked, or ``""``."""
    if WRIST not in joints or not np.ptp(joints[WRIST], axis=0).any():
        return ""
    return next((joint for joint, positions in joints.items() if not np.ptp(positions, axis=0).any()), "")


def exchanged_joints(joints: Joints) -> tuple[str, str] | None:
    """Two exchanged joints: the other way round, bones have the lengths of a hand's, or no finger folds back."""
    links = neighbours_of(joints)
    names = [*dict.fromkeys(joint for link in links for joint in (link.parent, link.child))]
    positions = np.stack([joints[name] for name in names])
    distances = np.linalg.norm(positions[:, None] - positions, axis=3)
    ends = np.array([(names.index(link.parent), names.index(link.child)) for link in links])
    lengths = np.array([link.length_m for link in links])
    expected = (lengths / lengths.sum())[:, None]
    pairs = [*combinations(range(len(names)), 2)]
    orders = np.tile(np.arange(len(names)), (len(pairs), 1))
    np.put_along_axis(orders, np.array(pairs), np.array(pairs)[:, ::-1], axis=1)
    gains = _misfit(distances, ends, expected) - _misfit(distances, orders[:, ends], expected)
    steady = np.percentile(gains, STEADY, axis=1)
    best = int(steady.argmax())
    if steady[best] <= LEAST_GAIN:
        return _folded_joints(joints)
    first, second = pairs[best]
    return names[first], names[second]


def _folded_joints(joints: Joints) -> tuple[str, str] | None:
    """The first joint at which a finger folds back upon itself in nearly every sample, and the one after it."""
    by_parent = {bone.parent: bone.child for bone in bones_of(joints) if bone.parent != WRIST}
    for joint, after in by_parent.items():
        before = next((parent for parent, child in by_parent.items() if child == joint), None)
        if before is None:
            continue
        toward, away = joints[joint] - joints[before], joints[after] - joints[joint]
        length = np.linalg.norm(toward, axis=1) * np.linalg.norm(away, axis=1)
        cosine = (toward * away).sum(axis=1) / np.maximum(length, 1e-30)
        if float(np.percentile(cosine, 100.0 - STEADY)) < FOLDED:
            return joint, after
    return None


def _misfit(distances: Numbers, ends: NDArray[np.intp], expected: Numbers) -> Numbers:
    """By how much lengths between joints differ from those of a hand of that size, as a fraction of their sum.

    The shape is (..., n) of ``distances`` (joints, joints, n) and ``ends`` (..., links, 2); ``expected`` (links, 1)
    are fractions of the sum of lengths.
    """
    lengths = distances[ends[..., 0], ends[..., 1]]
    total = np.maximum(lengths.sum(axis=-2, keepdims=True), 1e-30)
    misfit: Numbers = np.abs(lengths / total - expected).sum(axis=-2)
    return misfit


def side_by_bend(joints: Joints) -> str:
    """The side of a hand in right-handed axes, by the way its fingers bend; ``""``: they do not bend enough to say."""
    fingers = [finger for finger in FINGERS[1:] if f"{finger} proximal" in joints and f"{finger} tip" in joints]
    in_palm = [joint for finger in FINGERS[1:] if (joint := f"{finger} metacarpal") in joints]
    roots = [WRIST] if WRIST in joints else in_palm
    if len(fingers) < 2 or not roots:
        return ""
    root = np.mean([joints[joint] for joint in roots], axis=0)
    first, last = (joints[f"{finger} proximal"] for finger in (fingers[0], fingers[-1]))
    # Of a right hand this points out of its back, of a left hand out of its palm.
    normal = np.cross((first + last) / 2.0 - root, first - last)
    length = np.linalg.norm(normal, axis=1)
    bends = []
    for finger in fingers:
        along = joints[f"{finger} tip"] - joints[f"{finger} proximal"]
        bends.append((along * normal).sum(axis=1) / np.maximum(length * np.linalg.norm(along, axis=1), 1e-30))
    bend = float(np.mean(bends)) if len(length) else 0.0
    if abs(bend) < LEAST_BEND:
        return ""
    return "left" if bend > 0.0 else "right"
