"""Hands made of joints: they open and close, move on a path, and are written as the CSV of several exporters.

Joints are placed by angles and the lengths of the table alone, in right-handed axes with +Y up; nothing of the
importer's is used but the names of joints.
"""

import csv

import numpy as np

FINGERS = ("thumb", "index", "middle", "ring", "little")
LENGTHS = {
    "thumb": (0.046, 0.032, 0.026),
    "index": (0.066, 0.040, 0.025, 0.022),
    "middle": (0.064, 0.044, 0.028, 0.023),
    "ring": (0.058, 0.041, 0.027, 0.023),
    "little": (0.054, 0.032, 0.020, 0.020),
}
ROOTS = {
    "thumb": (-0.022, -0.008, -0.028),
    "index": (-0.018, 0.0, -0.030),
    "middle": (-0.004, 0.002, -0.033),
    "ring": (0.010, 0.001, -0.031),
    "little": (0.022, -0.002, -0.028),
}
SPREAD = {"thumb": 0.75, "index": 0.12, "middle": 0.0, "ring": -0.10, "little": -0.22}
NAMES = ("metacarpal", "proximal", "intermediate", "distal", "tip")
THUMB_NAMES = ("metacarpal", "proximal", "distal", "tip")


def made_hand(curl, wrist=(0.0, 0.0, 0.0), side="right", size=1.0):
    """Joint -> (n, 3) of a hand in right-handed axes, palm down, fingers along -Z, whose fingers bend by ``curl`` (n,).

    ``curl`` is in radians at each joint of a finger, or of each finger by its name; ``wrist`` is (3,) or (n, 3).
    """
    curls = curl if isinstance(curl, dict) else dict.fromkeys(FINGERS, curl)
    curls = {finger: np.atleast_1d(np.asarray(angles, dtype=float)) for finger, angles in curls.items()}
    count = max(map(len, curls.values()))
    joints = {"wrist": np.zeros((count, 3)), "palm": np.tile([-0.003, 0.0, -0.065], (count, 1))}
    for finger in FINGERS:
        lengths = LENGTHS[finger]
        names = THUMB_NAMES if finger == "thumb" else NAMES
        point, angle = np.tile(ROOTS[finger], (count, 1)), np.zeros(count)
        joints[f"{finger} {names[0]}"] = point
        for position, length in enumerate(lengths):
            if position:
                angle = angle + (curls[finger] if finger != "thumb" else 0.5 * curls[finger])
            direction = np.stack(
                [-np.sin(SPREAD[finger]) * np.cos(angle), -np.sin(angle), -np.cos(SPREAD[finger]) * np.cos(angle)],
                axis=1,
            )
            point = point + length * direction
            joints[f"{finger} {names[position + 1]}"] = point
    mirror = np.array([-1.0 if side == "left" else 1.0, 1.0, 1.0])
    return {name: size * points * mirror + np.asarray(wrist) for name, points in joints.items()}


def camel(joint):
    """``IndexTip`` of ``index tip``."""
    return "".join(word.capitalize() for word in joint.split())


MEDIAPIPE = {
    "wrist": "WRIST", "thumb metacarpal": "THUMB_CMC", "thumb proximal": "THUMB_MCP", "thumb distal": "THUMB_IP",
    "thumb tip": "THUMB_TIP",
    **{
        f"{finger} {segment}": f"{shown}_{word}"
        for finger, shown in {
            "index": "INDEX_FINGER", "middle": "MIDDLE_FINGER", "ring": "RING_FINGER", "little": "PINKY",
        }.items()
        for segment, word in {"proximal": "MCP", "intermediate": "PIP", "distal": "DIP", "tip": "TIP"}.items()
    },
}  # fmt: skip
WEBXR = {
    "wrist": "wrist",
    **{
        f"thumb {segment}": f"thumb-{word}"
        for segment, word in {
            "metacarpal": "metacarpal", "proximal": "phalanx-proximal", "distal": "phalanx-distal", "tip": "tip",
        }.items()
    },
    **{
        f"{finger} {segment}": f"{'pinky' if finger == 'little' else finger}-finger-{word}"
        for finger in FINGERS[1:]
        for segment, word in {
            "metacarpal": "metacarpal", "proximal": "phalanx-proximal", "intermediate": "phalanx-intermediate",
            "distal": "phalanx-distal", "tip": "tip",
        }.items()
    },
}  # fmt: skip
LEAP_BONES = {
    **{
        f"{finger}_{bone}": (f"{finger} {first}", f"{finger} {last}")
        for finger in FINGERS[1:]
        for bone, first, last in (
            ("metacarpal", "metacarpal", "proximal"),
            ("proximal", "proximal", "intermediate"),
            ("intermediate", "intermediate", "distal"),
            ("distal", "distal", "tip"),
        )
    },
    "thumb_metacarpal": ("thumb metacarpal", "thumb metacarpal"),
    "thumb_proximal": ("thumb metacarpal", "thumb proximal"),
    "thumb_intermediate": ("thumb proximal", "thumb distal"),
    "thumb_distal": ("thumb distal", "thumb tip"),
}


def write_rows(path, head, rows):
    """A CSV of these cells; floats with seven decimals."""
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(head)
        writer.writerows([f"{cell:.7f}" if isinstance(cell, float) else cell for cell in row] for row in rows)
    return path


def write_wide(
    path, times, hands, name=lambda side, joint: f"{side[0].upper()}_XRHand_{camel(joint)}", axes="P", more=()
):
    """A row per time, columns per joint; ``hands``: side -> joint -> (n, 3); ``more``: further columns."""
    columns = [
        (f"{name(side, joint)}_{axes}{axis}", points[:, k])
        for side, joints in hands.items()
        for joint, points in joints.items()
        for k, axis in enumerate("xyz")
    ]
    columns += more
    rows = ([float(time), *(values[row] for _, values in columns)] for row, time in enumerate(times))
    return write_rows(path, ["time", *(column for column, _ in columns)], rows)


def write_long(path, times, hands, name=camel, radii=None):
    """A row per time, hand and joint."""
    rows = (
        [float(time), side, name(joint), *map(float, points[row]), *([radii[joint]] if radii else [])]
        for row, time in enumerate(times)
        for side, joints in hands.items()
        for joint, points in joints.items()
    )
    return write_rows(path, ["time", "hand", "joint", "x", "y", "z", *(["radius"] if radii else [])], rows)


def write_leap(path, times, hands):
    """A row per time and hand, millimetres, bones with a start and an end, and widths of fingers."""
    head = ["timestamp", "hand_type", "palm_width"]
    head += [f"{bone}_{end}_{axis}" for bone in LEAP_BONES for end in ("start", "end") for axis in "xyz"]
    head += [f"{finger}_width" for finger in FINGERS] + ["index_length"]
    rows = (
        [float(time), side, 85.0]
        + [float(1000.0 * joints[joint][row, k]) for ends in LEAP_BONES.values() for joint in ends for k in range(3)]
        + [18.0, 16.0, 16.0, 15.0, 13.0, 90.0]
        for row, time in enumerate(times)
        for side, joints in hands.items()
    )
    return write_rows(path, head, rows)
