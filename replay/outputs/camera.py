"""Where to look from: the direction in which fewest surfaces stand between the eye and a contact.

"Outward along the contact normal" ends inside a flask. So directions are tried and crossings counted.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore import Motion, TriangleMesh
from cdcore.narrow.containment.first_hits import crossing
from cdcore.numerics import FloatArray, IntArray
from replay.comparison.first_touch import at_touch
from replay.comparison.outcome import Miss
from replay.effects.output import vector_of
from replay.outputs.palette import is_ghost, tags_of
from replay.prepare.assembly import Assembly
from sessions.model.scene import Scene

CLOSE_UP: Final = 0.125
"""Metres from eye to contact: bench glass fills the view, and its surroundings can still be recognised."""

AZIMUTHS: Final = 16
ELEVATIONS_DEG: Final = (12.0, 38.0)
"""32 directions from slightly to clearly above: nobody looks at a bench from below."""

SKIN: Final = 0.003
"""Metres around the contact in which crossings are not counted: the two surfaces that meet are always there."""

USER_SIDE: Final = 1.5
"""What looking from the side opposite to the user costs, in crossings: unfamiliar views are worth one wall, not two."""

OPAQUE: Final = 3.0
GLASS: Final = 1.0
GHOST: Final = 0.25
"""What crossing a surface costs by how much it hides."""

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


def directions() -> FloatArray:
    """The 32 unit vectors from a contact to a possible eye, (32, 3)."""
    azimuth = np.arange(AZIMUTHS) * (2 * np.pi / AZIMUTHS)
    rows = [
        np.stack([np.sin(azimuth) * np.cos(e), np.full(AZIMUTHS, np.sin(e)), np.cos(azimuth) * np.cos(e)], axis=1)
        for e in np.radians(ELEVATIONS_DEG)
    ]
    return np.concatenate(rows)


class Obstacles:
    """All bodies of a session, ready to count what stands in front of a point in any frame."""

    def __init__(self, assembly: Assembly, scene: Scene) -> None:
        self._motion = assembly.motion
        self._bodies = [_Surface(body.mesh) for body in assembly.bodies]
        self._costs = [_cost(tags_of(body.name, scene)) for body in assembly.bodies]

    def close_up(
        self, frame: int, point: Sequence[float], towards_user: FloatArray, motion: Motion | None = None
    ) -> Eye:
        """The eye from which fewest surfaces hide a point, on the user's side where that costs nothing.

        ``frame`` is of ``motion``, else of the assembly's.
        """
        motion = self._motion if motion is None else motion
        place, choices = np.asarray(point, dtype=np.float64), directions()
        cost = np.zeros(len(choices))
        for body, surface in enumerate(self._bodies):
            if motion.valid[frame, body]:
                turn = motion.rotations[frame, body]
                local = (place - motion.translations[frame, body]) @ turn
                cost += self._costs[body] * surface.crossings(local, choices @ turn, CLOSE_UP)
        cost += USER_SIDE * 0.5 * (1.0 - choices @ towards_user)
        best = choices[int(np.argmin(cost))]
        return Eye(vector_of(place + CLOSE_UP * best), vector_of(place))

    def hiding(self, frame: int, eye: Eye) -> set[int]:
        """Bodies of the assembly of which a surface stands between an eye and what it looks at."""
        motion, ray = self._motion, np.subtract(eye.position, eye.target)
        far = float(np.linalg.norm(ray))
        found = set()
        for body in np.flatnonzero(motion.valid[frame]).tolist():
            turn = motion.rotations[frame, body]
            local = (np.asarray(eye.target) - motion.translations[frame, body]) @ turn
            if self._bodies[body].crossings(local, (ray / far)[None] @ turn, far).any():
                found.add(body)
        return found


class _Surface:
    """One mesh in its own frame, with a ball around each face."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self._triangles = mesh.triangles
        self._centres = mesh.triangles.mean(axis=1)
        self._radii = np.sqrt(((mesh.triangles - self._centres[:, None]) ** 2).sum(axis=2).max(axis=1))

    def crossings(self, point: FloatArray, rays: FloatArray, length: float) -> IntArray:
        """How many faces each ray (n, 3) crosses between ``SKIN`` and ``length`` from the point, (n,)."""
        away = self._centres - point
        distance = np.sqrt((away * away).sum(axis=1))
        near = np.flatnonzero(distance - self._radii <= length)
        along = away[near] @ rays.T
        aside = (distance[near] ** 2)[:, None] - along**2
        radii = self._radii[near, None]
        face, ray = np.nonzero((aside <= radii**2 * 1.001) & (along > -radii))
        ahead = crossing(self._triangles[near[face]], point, rays[ray])
        hit = (ahead > SKIN) & (ahead < length)
        return np.bincount(ray[hit], minlength=len(rays))


def _cost(tags: tuple[str, ...]) -> float:
    if is_ghost(tags):
        return GHOST
    return GLASS if "glass" in tags and "rod" not in tags else OPAQUE


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
    back = away / np.linalg.norm(away)
    axes = look_rotation(Eye(vector_of(back), (0.0, 0.0, 0.0)))
    local = points @ axes
    centre = (local.min(axis=0) + local.max(axis=0)) / 2
    across, up = np.abs(local - centre)[:, :2].T
    depth = (local - centre)[:, 2]
    slope = np.tan(FIELD_OF_VIEW / 2)
    distance = max(0.2, float(np.max(depth + np.maximum(up / slope, across / (slope * aspect)) * MARGIN)))
    target = axes @ centre
    return Eye(vector_of(target + distance * back), vector_of(target))


def look_rotation(eye: Eye) -> FloatArray:
    """Rotation of a camera whose axes are right, up and back, (3, 3) column convention."""
    back = np.subtract(eye.position, eye.target)
    back = back / np.linalg.norm(back)
    right = np.cross([0.0, 1.0, 0.0], back)
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back], axis=1)
