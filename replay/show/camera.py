"""Camera positions: across the gap between two bodies, from the user's side."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore import Motion
from cdcore.numerics import FloatArray
from cdcore.poses import place_points
from replay.effects.output import vector_of
from replay.prepare.assembly import Assembly
from replay.show.palette import tags_of
from sessions.model.scene import Scene

CLOSE_UP_M: Final = 0.125
"""Metres from eye to contact: bench glass fills the view, and its surroundings can still be recognised."""

AZIMUTH_COUNT: Final = 16
ELEVATION_RAD: Final = np.radians(20.0)
"""Directions to look from, so far above the horizon: a lid is seen from above, and a gap below it."""

OPPOSITE_SIDE_COST: Final = 0.6
"""What looking from the side opposite to the user costs, beside a gap seen end on."""

FIELD_OF_VIEW_RAD: Final = np.radians(55.0)
"""Vertical opening of Rerun's eye."""

OVERVIEW_ASPECT: Final = 1.5
"""Width of the overview over its height; a wider one shows more to the sides."""

OVERVIEW_MARGIN_FACTOR: Final = 1.12
"""Room around what the overview shows, for words and pins at the rim."""

OVERVIEW_AZIMUTH_DEG: Final = 14.0
OVERVIEW_ELEVATION_DEG: Final = 22.0
"""How far the overview stands aside of the user, and above the horizon."""


@dataclass(frozen=True)
class Eye:
    """A camera: where it stands and the point it looks at, world metres."""

    position: tuple[float, float, float]
    target: tuple[float, float, float]


def viewing_direction(gap_direction: FloatArray, user_direction: FloatArray) -> FloatArray:
    """The unit direction to look from: across a gap, or along the surfaces that meet, from the user's side.

    ``gap_direction`` is from one body to the other, of any length; 0: unknown.
    """
    unit_gap = gap_direction / max(float(np.linalg.norm(gap_direction)), 1e-12)
    azimuth = np.arange(AZIMUTH_COUNT) * (2 * np.pi / AZIMUTH_COUNT)
    horizontal_component, vertical_component = np.cos(ELEVATION_RAD), np.full(AZIMUTH_COUNT, np.sin(ELEVATION_RAD))
    candidate_directions = np.stack(
        [horizontal_component * np.sin(azimuth), vertical_component, horizontal_component * np.cos(azimuth)], axis=1
    )
    chosen_direction: FloatArray = candidate_directions[
        int(
            np.argmin(
                np.abs(candidate_directions @ unit_gap) - OPPOSITE_SIDE_COST * (candidate_directions @ user_direction)
            )
        )
    ]
    return chosen_direction


def eye_before(target: FloatArray, offset: FloatArray) -> Eye:
    """An eye that looks at a point (3,) from an ``offset`` of it, metres."""
    return Eye(vector_of(target + offset), vector_of(target))


def points_in_world(motion: Motion, frame: int, body: int, points: FloatArray) -> FloatArray:
    """Points (n, 3) of a body where it stands in a frame, world metres."""
    return place_points(points, motion.rotations[frame, body], motion.translations[frame, body])


def towards_user(assembly: Assembly, scene: Scene, frame: int, point: Sequence[float]) -> FloatArray:
    """Horizontal unit direction from a point to the user's head; +Z, towards the user of a fresh frame, if unknown."""
    for column, body in enumerate(assembly.bodies):
        if "headset" in tags_of(body.name, scene) and assembly.motion.valid[frame, column]:
            offset = assembly.motion.translations[frame, column] - np.asarray(point)
            length = float(np.hypot(offset[0], offset[2]))
            if length > 0.05:
                return np.array([offset[0] / length, 0.0, offset[2] / length])
    return np.array([0.0, 0.0, 1.0])


def aside_and_above(direction: FloatArray, azimuth_deg: float, elevation_deg: float) -> FloatArray:
    """Return a horizontal unit direction (3,) turned about +Y and raised, so that hands and rims do not line up."""
    azimuth, elevation = np.radians(azimuth_deg), np.radians(elevation_deg)
    x, _, z = direction * np.cos(elevation)
    cos, sin = np.cos(azimuth), np.sin(azimuth)
    return np.array([x * cos + z * sin, np.sin(elevation), z * cos - x * sin])


def overview(assembly: Assembly, scene: Scene, points: FloatArray, frame: int, aspect: float = OVERVIEW_ASPECT) -> Eye:
    """An eye that sees these points (n, 3) as large as the view allows, from the user's side, a little from above.

    ``aspect``: width of the view over its height.
    """
    if not len(points):
        # Hours of poses need not be held to frame a bench.
        sampled_frames = slice(None, None, len(assembly.motion) // 10_000 or 1)
        points = assembly.motion.translations[sampled_frames][assembly.motion.valid[sampled_frames]]
    if not len(points):
        points = np.zeros((1, 3))
    side = towards_user(assembly, scene, min(frame, len(assembly.motion) - 1), points.mean(axis=0).tolist())
    axes = axes_of(aside_and_above(side, OVERVIEW_AZIMUTH_DEG, OVERVIEW_ELEVATION_DEG))
    camera_points = points @ axes
    centre = (camera_points.min(axis=0) + camera_points.max(axis=0)) / 2
    right, up, depth = (camera_points - centre).T
    slope = np.tan(FIELD_OF_VIEW_RAD / 2)
    eye_distances = np.maximum(np.abs(up) / slope, np.abs(right) / (slope * aspect))
    distance = max(0.2, float(np.max(depth + eye_distances * OVERVIEW_MARGIN_FACTOR)))
    return eye_before(axes @ centre, distance * axes[:, 2])


def view_rotation(eye: Eye) -> FloatArray:
    """Rotation of a camera whose axes are right, up and back, (3, 3) column convention."""
    return axes_of(np.subtract(eye.position, eye.target))


def axes_of(offset: FloatArray) -> FloatArray:
    """Axes right, up and back as columns (3, 3) of an eye in the direction ``offset``, of any length."""
    backward = offset / np.linalg.norm(offset)
    right = np.cross([0.0, 1.0, 0.0], backward)
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(backward, right), backward], axis=1)
