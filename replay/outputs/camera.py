"""Where to look from: across the gap between two bodies, from the user's side, and what stands in between."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore import Motion, TriangleMesh
from cdcore.narrow.containment.first_hits import crossing
from cdcore.numerics import FloatArray, place_points
from replay.comparison.first_touch import at_touch
from replay.comparison.outcome import Miss
from replay.effects.output import vector_of
from replay.outputs.palette import tags_of
from replay.prepare.assembly import Assembly
from sessions.model.scene import Scene

CLOSE_UP: Final = 0.125
"""Metres from eye to contact: bench glass fills the view, and its surroundings can still be recognised."""

AZIMUTHS: Final = 16
RAISED: Final = np.radians(20.0)
"""Directions to look from, so far above the horizon: a lid is seen from above, and a gap below it."""

USER_SIDE: Final = 0.6
"""What looking from the side opposite to the user costs, beside a gap seen end on."""

SKIN: Final = 0.003
"""Metres around a contact in which nothing stands in between: the two surfaces that meet are always there."""

FIELD_OF_VIEW: Final = np.radians(55.0)
"""Vertical opening of Rerun's eye."""

ASPECT: Final = 1.5
"""Width of the overview over its height; a wider one shows more to the sides."""

MARGIN: Final = 1.12
"""Room around what the overview shows, for words and pins at the rim."""

TURNED_DEG: Final = 14.0
RAISED_DEG: Final = 22.0
"""How far the overview stands aside of the user, and above the horizon."""


@dataclass(frozen=True)
class Eye:
    """A camera: where it stands and the point it looks at, world metres."""

    position: tuple[float, float, float]
    target: tuple[float, float, float]


def across(along: FloatArray, user: FloatArray) -> FloatArray:
    """The unit direction to look from: across a gap, or ``along`` the surfaces that meet, from the ``user``'s side.

    ``along`` is from one body to the other, of any length; 0: unknown.
    """
    step = along / max(float(np.linalg.norm(along)), 1e-12)
    turn = np.arange(AZIMUTHS) * (2 * np.pi / AZIMUTHS)
    flat, up = np.cos(RAISED), np.full(AZIMUTHS, np.sin(RAISED))
    choices = np.stack([flat * np.sin(turn), up, flat * np.cos(turn)], axis=1)
    chosen: FloatArray = choices[int(np.argmin(np.abs(choices @ step) - USER_SIDE * (choices @ user)))]
    return chosen


class Obstacles:
    """All bodies of a session, ready to say what stands in front of a point in any frame."""

    def __init__(self, assembly: Assembly) -> None:
        self._motion = assembly.motion
        self._bodies = [_Surface(body.mesh) for body in assembly.bodies]

    def hiding(self, frame: int, eye: Eye) -> frozenset[int]:
        """Bodies of the assembly of which a surface stands between an eye and what it looks at."""
        motion, ray = self._motion, np.subtract(eye.position, eye.target)
        far = float(np.linalg.norm(ray))
        found = set()
        for body in np.flatnonzero(motion.valid[frame]).tolist():
            turn = motion.rotations[frame, body]
            local = (np.asarray(eye.target) - motion.translations[frame, body]) @ turn
            surface = self._bodies[body]
            if surface.is_near(local, ray @ turn) and surface.is_crossed(local, (ray / far) @ turn, far):
                found.add(body)
        return frozenset(found)


class _Surface:
    """One mesh in its own frame, with a ball around all of it and one around each face."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self._triangles = mesh.triangles
        self._centres = mesh.triangles.mean(axis=1)
        self._radii = np.sqrt(((mesh.triangles - self._centres[:, None]) ** 2).sum(axis=2).max(axis=1))
        self._middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
        self._radius = float(np.linalg.norm(mesh.vertices - self._middle, axis=1).max())

    def is_near(self, point: FloatArray, way: FloatArray) -> bool:
        """Whether the way from a point comes into the ball around the mesh; few bodies stand near a view."""
        away = self._middle - point
        share = min(max(float(away @ way) / float(way @ way), 0.0), 1.0)
        return float(np.linalg.norm(away - share * way)) <= self._radius * 1.001

    def is_crossed(self, point: FloatArray, ray: FloatArray, length: float) -> bool:
        """Whether a ray crosses a face between ``SKIN`` and ``length`` from the point."""
        away = self._centres - point
        along = away @ ray
        aside = (away * away).sum(axis=1) - along**2
        near = (aside <= self._radii**2 * 1.001) & (along > -self._radii) & (along < length + self._radii)
        ahead = crossing(self._triangles[near], point, ray)
        return bool(((ahead > SKIN) & (ahead < length)).any())


def placed(motion: Motion, frame: int, body: int, points: FloatArray) -> FloatArray:
    """Points (n, 3) of a body where it stands in a frame, world metres."""
    return place_points(points, motion.rotations[frame, body], motion.translations[frame, body])


def standing(assembly: Assembly, miss: Miss) -> tuple[Assembly, int]:
    """Where all bodies stand when there is most to see of a miss: an assembly, and the frame in it."""
    if miss.touch is None:
        return assembly, miss.deepest
    return at_touch(assembly, miss.pair, miss.touch), 0


def towards_user(assembly: Assembly, scene: Scene, frame: int, point: Sequence[float]) -> FloatArray:
    """Horizontal unit direction from a point to the user's head; +Z, towards the user of a fresh frame, if unknown."""
    for column, body in enumerate(assembly.bodies):
        if "headset" in tags_of(body.name, scene) and assembly.motion.valid[frame, column]:
            away = assembly.motion.translations[frame, column] - np.asarray(point)
            length = float(np.hypot(away[0], away[2]))
            if length > 0.05:
                return np.array([away[0] / length, 0.0, away[2] / length])
    return np.array([0.0, 0.0, 1.0])


def overview(assembly: Assembly, scene: Scene, points: FloatArray, frame: int, aspect: float = ASPECT) -> Eye:
    """An eye that sees these points (n, 3) as large as the view allows, from the user's side, a little from above.

    ``aspect``: width of the view over its height.
    """
    if not len(points):
        some = slice(None, None, 1 + len(assembly.motion) // 10_000)  # hours of poses need not be held to frame a bench
        points = assembly.motion.translations[some][assembly.motion.valid[some]]
    if not len(points):
        points = np.zeros((1, 3))
    side = towards_user(assembly, scene, min(frame, len(assembly.motion) - 1), points.mean(axis=0).tolist())
    # A turn aside shows depth: straight from the user's eye, hands and rims line up.
    turn, rise = np.radians(TURNED_DEG), np.radians(RAISED_DEG)
    cos, sin = np.cos(turn), np.sin(turn)
    aside = np.array([side[0] * cos + side[2] * sin, 0.0, side[2] * cos - side[0] * sin])
    back = aside * np.cos(rise) + np.array([0.0, np.sin(rise), 0.0])
    return framing(points, back, aspect)


def framing(points: FloatArray, away: FloatArray, aspect: float = ASPECT) -> Eye:
    """The eye in the direction ``away`` from points (n, 3) that sees them as large as the view allows."""
    axes = axes_of(away)
    local = points @ axes
    centre = (local.min(axis=0) + local.max(axis=0)) / 2
    across, up = np.abs(local - centre)[:, :2].T
    depth = (local - centre)[:, 2]
    slope = np.tan(FIELD_OF_VIEW / 2)
    distance = max(0.2, float(np.max(depth + np.maximum(up / slope, across / (slope * aspect)) * MARGIN)))
    target = axes @ centre
    return Eye(vector_of(target + distance * axes[:, 2]), vector_of(target))


def look_rotation(eye: Eye) -> FloatArray:
    """Rotation of a camera whose axes are right, up and back, (3, 3) column convention."""
    return axes_of(np.subtract(eye.position, eye.target))


def axes_of(away: FloatArray) -> FloatArray:
    """Axes right, up and back as columns (3, 3) of an eye in the direction ``away``, of any length."""
    back = away / np.linalg.norm(away)
    right = np.cross([0.0, 1.0, 0.0], back)
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back], axis=1)
