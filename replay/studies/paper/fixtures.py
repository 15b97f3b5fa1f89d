"""Pairs of placed bodies in which a wanted number of faces meets, to 2 %, the same on every machine.

The columns of Table I are numbers of faces that intersect: the unique faces of both meshes that belong to a pair. A
tessellation is bisected until typical poses give about that number, then the distance of each random pose until it is
met. Everything random is keyed by seed, family, number of faces and pose.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Detector, Motion, TriangleMesh, Verdict, create_detector
from cdcore.bounding.bounding_sphere import sphere_about
from cdcore.numerics import BoolArray, FloatArray
from cdcore.poses import rotation_from_quaternion
from replay.errors import ReplayError
from sessions.glassware.catalogue import make_instrument
from sessions.model.constants import HEADSET_HZ
from sessions.synthetic.rng import random_stream

TARGET_FACES: Final = (100, 200, 300, 400, 500, 600, 700, 800, 900, 1000)
"""Faces that meet, the columns of Table I."""
POSES_PER_TARGET: Final = 20
TARGET_TOLERANCE: Final = 0.02
"""How far, relative, the number of faces that meet may be from the target."""

DISTANCES_AT_ONCE: Final = 48
"""Distances tried at once."""
MOST_BRACKETS: Final = 4
"""How many neighbouring distances, one below and one above the target, are looked between."""
MOST_DIRECTIONS: Final = 40
"""Fresh directions before a pose is given up; one or two do."""
PROBE_PATHS: Final = 4
"""Random directions over which the typical number of faces of a tessellation is taken."""


class FixtureError(ReplayError):
    """No pose with the wanted number of faces was found."""


@dataclass(frozen=True, eq=False)
class Fixture:
    """Two placed bodies and the truth about them."""

    family: str  # which two meshes
    target: int  # faces that were to meet
    number: int  # of the pose
    # bodies, motion: for a detector; one frame
    bodies: tuple[Body, Body]
    motion: Motion
    pairs: NDArray[np.int64]  # (k, 2) face pairs that meet, exactly

    @property
    def faces(self) -> int:
        """Unique faces of both meshes that meet another: what Table I counts."""
        return faces_of_pairs(self.pairs)


def faces_of_pairs(pairs: NDArray[np.integer]) -> int:
    """Unique faces of the first mesh plus unique faces of the second in face pairs (k, 2)."""
    return len(np.unique(pairs[:, 0])) + len(np.unique(pairs[:, 1]))


@cache
def make_fixture(target: int, number: int, seed: int = 0) -> Fixture:
    """One fixture; families take turns. Made once, then remembered. Raises FixtureError: no pose meets the target."""
    family = FAMILY_NAMES[number % len(FAMILY_NAMES)]
    bodies = _bodies_for(family, target, seed)
    rng = random_stream(seed, f"table-1/{target}/{number}", family)
    for _ in range(MOST_DIRECTIONS):
        motion = _frame_with_faces(SeparationPaths(rng, bodies, offset_spread=0.1), target)
        if motion is not None:
            # Every pose has a stamp, hence a random stream, of its own.
            motion = Motion([number / HEADSET_HZ], motion.translations, motion.rotations)
            pairs = _exact_detector(bodies).detect(motion, faces=True).faces(0, 0)
            return Fixture(family, target, number, bodies, motion, pairs)
    raise FixtureError(
        f"no pose {number} of {family} in which {target} faces meet; "
        f"choose a target from {TARGET_FACES[0]} to {TARGET_FACES[-1]}"
    )


@cache
def _exact_detector(bodies: tuple[Body, Body]) -> Detector:
    return create_detector("exact", bodies, containment=False)


class SeparationPaths:
    """Random directions, and random rotations of two bodies that part along them.

    ``offset_spread``: metres by which they all stand beside the origin, about.
    """

    def __init__(
        self, rng: np.random.Generator, bodies: tuple[Body, Body], count: int = 1, offset_spread: float = 0.0
    ) -> None:
        self.bodies = bodies
        self.body_rotations = rotation_from_quaternion(rng.normal(size=(2 * count, 4))).reshape(count, 2, 3, 3)
        directions = rng.normal(size=(count, 3))
        self.directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        spheres = [sphere_about(body.mesh, body.mesh.bounds.mean(axis=0)) for body in bodies]
        self.reach = sum(ball.radius for ball in spheres)
        start_offset = offset_spread * rng.normal(size=3) if offset_spread else np.zeros(3)
        self.base_positions = start_offset - np.einsum(
            "tbij,bj->tbi", self.body_rotations, [ball.centre for ball in spheres]
        )

    def motion(self, distances: FloatArray) -> Motion:
        """A frame for each distance (T,) of the middles: of each along its direction, or of all along a single one."""
        frame_count = len(distances)
        positions = np.broadcast_to(self.base_positions, (frame_count, 2, 3)).copy()
        positions[:, 1] += distances[:, None] * self.directions
        return Motion(
            np.arange(frame_count) / HEADSET_HZ, positions, np.broadcast_to(self.body_rotations, (frame_count, 2, 3, 3))
        )

    def do_meet(self, distances: FloatArray) -> BoolArray:
        """Whether the bodies meet at each distance."""
        return _exact_detector(self.bodies).detect(self.motion(distances)).verdict[:, 0] == Verdict.CONTACT

    def faces(self, distances: FloatArray) -> NDArray[np.int64]:
        """How many faces meet at each distance."""
        detection = _exact_detector(self.bodies).detect(self.motion(distances), faces=True)
        return np.array([faces_of_pairs(detection.faces(frame, 0)) for frame in range(len(distances))])


def _frame_with_faces(path: SeparationPaths, target: int) -> Motion | None:
    """The frame in which the number of faces is nearest to the target, if near enough."""
    distances = np.linspace(0.0, path.reach, DISTANCES_AT_ONCE, endpoint=False)
    face_counts = path.faces(distances)
    crossing_rows = np.flatnonzero((face_counts[1:] > target) != (face_counts[:-1] > target))[:MOST_BRACKETS]
    if len(crossing_rows):
        between_distances = np.concatenate(
            [np.linspace(distances[k], distances[k + 1], 16)[1:-1] for k in crossing_rows]
        )
        distances, face_counts = (
            np.concatenate([distances, between_distances]),
            np.concatenate([face_counts, path.faces(between_distances)]),
        )
    best_row = int(np.argmin(np.abs(face_counts - target)))
    if abs(int(face_counts[best_row]) - target) > TARGET_TOLERANCE * target:
        return None
    return path.motion(distances[best_row : best_row + 1])


@cache
def _bodies_for(family: str, target: int, seed: int) -> tuple[Body, Body]:
    """The coarsest tessellation at which half of the best distance's faces are the target, by bisection.

    Halves of the range are tried from the coarse end: what is finer than enough is enough, and takes longest to try.
    """
    make_bodies, lower, upper = FAMILIES[family]
    halves = [upper]
    while halves[-1] - lower > max(1, lower // 16):
        halves.append((lower + halves[-1]) // 2)
    for sections in reversed(halves[1:]):
        if _typical_faces(make_bodies(sections), family, seed) >= target:
            upper = sections
            break
        lower = sections
    while upper - lower > max(1, lower // 16):
        middle_sections = (lower + upper) // 2
        if _typical_faces(make_bodies(middle_sections), family, seed) < target:
            lower = middle_sections
        else:
            upper = middle_sections
    return make_bodies(upper)


def _typical_faces(bodies: tuple[Body, Body], family: str, seed: int) -> float:
    """The largest number of faces along some random ways, three quarters of their median."""
    rng = random_stream(seed, "table-1/tessellation", family)
    paths = [SeparationPaths(rng, bodies, offset_spread=0.1) for _ in range(PROBE_PATHS)]
    largest_face_counts = [path.faces(np.linspace(0.0, path.reach, 12, endpoint=False)).max() for path in paths]
    return 0.75 * float(np.median(largest_face_counts))


def torus(sections: int) -> TriangleMesh:
    """A closed torus about +Y of ``sections`` by half as many quads, two faces each; metres."""
    ring_radius, tube_radius, around_count, tube_sections = 0.05, 0.02, sections, max(3, sections // 2)
    u = 2 * np.pi * np.arange(around_count)[:, None] / around_count
    v = 2 * np.pi * np.arange(tube_sections)[None] / tube_sections
    points = _points_about_axis(u, ring_radius + tube_radius * np.cos(v), tube_radius * np.sin(v))
    vertex_numbers = np.arange(around_count * tube_sections).reshape(around_count, tube_sections)
    next_ring, next_around_tube = np.roll(vertex_numbers, -1, axis=0), np.roll(vertex_numbers, -1, axis=1)
    next_both = np.roll(next_ring, -1, axis=1)
    return TriangleMesh(
        points, _faces((vertex_numbers, next_ring, next_both), (vertex_numbers, next_both, next_around_tube))
    )


def sphere(sections: int, radius: float = 0.035) -> TriangleMesh:
    """A closed sphere of ``sections`` round its +Y axis and half as many from pole to pole; metres."""
    rings = max(3, sections // 2)
    u = 2 * np.pi * np.arange(sections)[None] / sections
    v = np.pi * np.arange(1, rings)[:, None] / rings
    points = radius * np.concatenate(
        [[[0.0, 1.0, 0.0]], _points_about_axis(u, np.sin(v), np.cos(v)), [[0.0, -1.0, 0.0]]]
    )
    vertex_numbers = 1 + np.arange((rings - 1) * sections).reshape(rings - 1, sections)
    next_ring = np.roll(vertex_numbers, -1, axis=1)
    north_pole, south_pole = np.zeros(sections, dtype=np.int64), np.full(sections, len(points) - 1)
    quads = (
        (vertex_numbers[:-1], vertex_numbers[1:], next_ring[1:]),
        (vertex_numbers[:-1], next_ring[1:], next_ring[:-1]),
    )
    return TriangleMesh(
        points,
        _faces(*quads, (north_pole, vertex_numbers[0], next_ring[0]), (south_pole, next_ring[-1], vertex_numbers[-1])),
    )


def _points_about_axis(angle: FloatArray, radius: FloatArray, height: FloatArray) -> FloatArray:
    """Points (n, 3) at some angles about +Y, row by row."""
    coordinates = np.broadcast_arrays(radius * np.cos(angle), height, -radius * np.sin(angle))
    return np.stack(coordinates, axis=-1).reshape(-1, 3)


def _faces(*corners: tuple[NDArray[np.int64], ...]) -> NDArray[np.int64]:
    """Faces (f, 3) from the numbers of their first, second and third corners."""
    return np.concatenate([np.stack(indices, axis=-1).reshape(-1, 3) for indices in corners])


@cache
def _torus_and_sphere(sections: int) -> tuple[Body, Body]:
    return Body("torus", torus(sections)), Body("sphere", sphere(sections))


@cache
def _beaker_and_flask(faces: int) -> tuple[Body, Body]:
    beaker, flask = (make_instrument(name, faces=faces).mesh for name in ("beaker_250", "erlenmeyer_flask"))
    first, second = (TriangleMesh(mesh.vertices, mesh.faces) for mesh in (beaker, flask))
    return Body("beaker", first), Body("flask", second)


Maker = Callable[[int], tuple[Body, Body]]
FAMILIES: Final[dict[str, tuple[Maker, int, int]]] = {
    "torus-sphere": (_torus_and_sphere, 8, 256),
    "beaker-flask": (_beaker_and_flask, 500, 50_000),
}
"""Family -> how to make it at a tessellation, and the coarsest and finest there is."""
FAMILY_NAMES: Final = tuple(FAMILIES)
