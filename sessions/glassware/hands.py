"""Hands that hold: palm, thumb and four fingers curled about a cylinder whose axis is +Y through the origin.

So a hand's pose in a scene is the pose of the thing it holds: put the origin on the axis of a beaker at the height
of the grip.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sessions.glassware.field import (
    Distance,
    Points,
    Solid,
    blended,
    capsule,
    carved,
    ellipsoid,
    rounded_box,
    surface_of,
)
from sessions.glassware.instrument import TYPICAL, Instrument, Site, weighed
from sessions.mesh_data import MeshData

CLEARANCE = 2.0e-3  # between skin and the held cylinder; blending takes up to half of it
MOST_BEND = np.radians(105.0)
WRIST = 0.135  # how far behind the grip the arm is cut off
LEAST_GRIP, MOST_GRIP = 0.008, 0.045


@dataclass(frozen=True)
class Finger:
    """Height of a finger above the grip, how far in front its knuckle lies, the lengths of its bones and its radius."""

    height: float
    forward: float
    lengths: tuple[float, float, float]
    radius: float
    droop: float


FINGERS = (
    Finger(0.031, 0.011, (0.043, 0.025, 0.020), 0.0088, -0.002),
    Finger(0.011, 0.015, (0.047, 0.029, 0.021), 0.0092, -0.001),
    Finger(-0.009, 0.012, (0.044, 0.027, 0.021), 0.0088, 0.001),
    Finger(-0.027, 0.006, (0.035, 0.020, 0.018), 0.0076, 0.003),
)
THUMB = Finger(0.036, 0.030, (0.036, 0.030, 0.024), 0.0104, 0.0015)


def hand_right(faces: int, *, grip_radius: float = 0.030) -> Instrument:
    """Return a right hand about a cylinder of ``grip_radius``: thumb up, fingers forward (-Z) and round to -X."""
    return _hand("hand_right", faces, grip_radius, 1.0)


def hand_left(faces: int, *, grip_radius: float = 0.030) -> Instrument:
    """Return a left hand, the mirror image of `hand_right` in X."""
    return _hand("hand_left", faces, grip_radius, -1.0)


def _hand(name: str, faces: int, grip_radius: float, side: float) -> Instrument:
    grip = float(np.clip(grip_radius, LEAST_GRIP, MOST_GRIP))
    mesh = _right_skin(faces, grip)
    if side < 0.0:
        mesh = mesh.transformed(np.diag([-1.0, 1.0, 1.0, 1.0]))
    sites = {
        "grip": Site(point=(0.0, 0.0, 0.0)),
        "wrist": Site(point=(side * (grip + 0.022), -0.003, WRIST), direction=(0.0, 0.0, 1.0)),
    }
    origin = "on the axis of what is held, between the second and third finger"
    tags, sources = f"hand {name.removeprefix('hand_')}", (f"a hand of 185 mm: {TYPICAL}",)
    return weighed(name, mesh, tags, "tissue", sources, sites=sites, origin=origin)


@lru_cache(maxsize=16)
def _right_skin(faces: int, grip: float) -> MeshData:
    """The surface of a right hand, made once: it takes a second, and the left hand is its mirror image."""
    reach = grip + 0.06
    return surface_of(_solid(grip), (-reach, -0.07, -reach), (reach + 0.03, 0.075, 0.15), faces)


@lru_cache(maxsize=16)
def _solid(grip: float) -> Solid:
    return lambda points: _distance(points, grip)


def _distance(points: Points, grip: float) -> Distance:
    palm = grip + CLEARANCE + 0.0125
    back = rounded_box(points, (palm, 0.002, 0.026), (0.0125, 0.043, 0.042), 0.0122)
    heel = ellipsoid(points, (palm + 0.001, -0.012, 0.062), (0.015, 0.031, 0.030))
    ball = capsule(points, (palm - 0.003, 0.026, 0.060), (palm - 0.006, 0.037, 0.034), 0.0155, 0.0125)
    flat = points * np.array([1.4, 1.0, 1.0])
    wrist = capsule(flat, (1.4 * palm + 0.004, -0.003, 0.070), (1.4 * palm + 0.010, -0.003, 0.180), 0.026, 0.029) / 1.2
    hand = blended(blended(blended(back, heel, 0.012), ball, 0.014), wrist, 0.016)
    hand = carved(hand, WRIST - points[:, 2], 0.004)
    for finger in FINGERS:
        hand = blended(hand, _curled(points, _joints(finger, grip, 1.0), finger.radius), 0.0055)
    return blended(hand, _curled(points, _joints(THUMB, grip, -1.0), THUMB.radius), 0.008)


def _curled(points: Points, joints: NDArray[np.float64], radius: float) -> Distance:
    """Return the distance to a finger along four joints, thicker at its knuckles than between them."""
    sizes = radius * np.array([1.10, 1.0, 0.93, 0.82])
    bones = [capsule(points, joints[i], joints[i + 1], sizes[i], sizes[i + 1]) for i in range(3)]
    knuckles = [np.linalg.norm(points - joints[i], axis=1) - 1.06 * sizes[i] for i in (1, 2)]
    distance: Distance = np.minimum(bones[0], knuckles[0])
    for other in (bones[1], knuckles[1], bones[2]):
        distance = blended(distance, other, 0.0015)
    return distance


def _joints(finger: Finger, grip: float, side: float) -> NDArray[np.float64]:
    """Return the joints (4, 3) of a finger; ``side`` is 1 for fingers, which bend round the front, -1 for a thumb.

    Each bone points along the tangent to the held cylinder, widened by the finger's radius, as links wrap a post.
    """
    post = grip + CLEARANCE + 1.1 * finger.radius
    place = np.array([grip + CLEARANCE + 0.0115, finger.forward])
    heading = np.pi / 2.0
    joints = [place]
    for length in finger.lengths:
        beyond = float(np.arccos(min(1.0, post / float(np.hypot(*place)))))
        wanted = float(np.arctan2(place[1], place[0])) + beyond + np.pi / 2.0
        bend = np.mod(wanted - heading + np.pi, 2.0 * np.pi) - np.pi
        heading += float(np.clip(bend, 0.0, MOST_BEND))
        place = place + length * np.array([np.cos(heading), np.sin(heading)])
        joints.append(place)
    heights = finger.height + finger.droop * np.arange(4)
    return np.array([[x, y, -side * forward] for (x, forward), y in zip(joints, heights, strict=True)])
