"""Twenty-six families of hard triangle pairs, each made so that one way of being wrong shows.

Arrays only: a family draws six corners a pair, (n, 6, 3) float64, then moves some of them. Dyadic coordinates
(integers times 2^-6) keep sums and halves exact, so that *touching* is touching and not nearly so.

Source: section 7.2 of the project's specification.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.random import Generator

from cdcore.numerics import FloatArray
from cdcore.poses import place_points, rotation_from_quaternion

Start = Callable[[Generator, int], FloatArray]
Change = Callable[[Generator, FloatArray], None]

FIRST_SEED = 100
"""Seed of family k (from 0) is this plus k in the reference set."""


@dataclass(frozen=True)
class Family:
    """One family: its number from 1, its name, how to make it, and the answer where construction fixes it."""

    number: int
    name: str
    start: Start  # six corners of each pair
    change: Change | None  # of the corners, in place
    expected: bool | None = None

    @property
    def metric(self) -> bool:
        """Whether the coordinates are metres: else a tolerance in metres means nothing."""
        return self.number not in (14, 15, 16)

    def pairs(self, count: int, seed: int = FIRST_SEED) -> FloatArray:
        """Triangle pairs (count, 2, 3, 3); the same seed gives the same bits."""
        rng = np.random.default_rng(seed + self.number - 1)
        corners = self.start(rng, count)
        if self.change is not None:
            self.change(rng, corners)
        return corners.reshape(-1, 2, 3, 3)


def zero_corners(_rng: Generator, n: int) -> FloatArray:
    """Six corners at the origin."""
    return np.zeros((n, 6, 3))


def uniform(rng: Generator, n: int) -> FloatArray:
    """Six corners with coordinates uniform in [0, 1)."""
    return rng.random((n, 6, 3))


def grid(rng: Generator, n: int, half: int = 64, step: float = 2.0**-6) -> FloatArray:
    """Six corners on a grid: integers in [-half, half] times step."""
    return rng.integers(-half, half + 1, (n, 6, 3)).astype(np.float64) * step


def lattice(rng: Generator, n: int) -> FloatArray:
    """Six corners with coordinates 0, 1, 2 or 3."""
    return rng.integers(0, 4, (n, 6, 3)).astype(np.float64)


def thick_grid(rng: Generator, n: int) -> FloatArray:
    """Pairs of ``grid`` whose first triangle has an area."""
    t = zero_corners(rng, 0)
    while len(t) < n:
        new_pairs = grid(rng, n)
        t = np.concatenate([t, new_pairs[unit_normal(new_pairs[:, :3])[1] >= 1e-3]])[:n]
    return t


COARSE_GRID = partial(grid, half=16, step=1.0)
WHOLE_GRID = partial(grid, half=32, step=1.0)


def log_uniform(rng: Generator, lower: float, upper: float, shape: int | tuple[int, ...]) -> FloatArray:
    """Ten to a power uniform in [low, high)."""
    return np.asarray(10.0 ** rng.uniform(lower, upper, shape), dtype=np.float64)


def face_point(rng: Generator, triangles: FloatArray, weight: float = 1.0) -> FloatArray:
    """A random point (n, 3) of each triangle (n, 3, 3), Dirichlet weights."""
    return np.einsum("nk,nkd->nd", rng.dirichlet([weight] * 3, len(triangles)), triangles)


def unit_normal(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit normals (n, 3) and the lengths (n,) they had."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normal, axis=1)
    return normal / np.where(length > 0, length, 1)[:, None], length


def random_rotations(rng: Generator, n: int) -> FloatArray:
    """Rotation matrices (n, 3, 3) from random unit quaternions."""
    return rotation_from_quaternion(rng.normal(0, 1, (n, 4)))


def _vertex_by_ulps(rng: Generator, t: FloatArray) -> None:
    normal, _ = unit_normal(t[:, :3])
    p = face_point(rng, t[:, :3]) + normal * (rng.integers(-4, 5, len(t)) * 2.0**-53)[:, None]
    t[:, 3] = p
    t[:, 4:] = (p + normal)[:, None] + rng.normal(0, 0.3, (len(t), 2, 3))


def _shared_vertex(rng: Generator, t: FloatArray) -> None:
    t[:, 3] = t[np.arange(len(t)), rng.integers(0, 3, len(t))]


def _shared_edge(_rng: Generator, t: FloatArray) -> None:
    t[:, 3:5] = t[:, 1::-1]


def _make_identical(rng: Generator, t: FloatArray) -> None:
    order = rng.permuted(np.tile(np.arange(3), (len(t), 1)), axis=1)
    t[:, 3:] = np.take_along_axis(t[:, :3], order[..., None], axis=1)


def _coplanar_axis(rng: Generator, t: FloatArray) -> None:
    t[np.arange(len(t)), :, rng.integers(0, 3, len(t))] = 0.5


def _coplanar_oblique(_rng: Generator, t: FloatArray) -> None:
    t[..., 2] = 2 * t[..., 0] - 3 * t[..., 1]


def _coplanar_touching(rng: Generator, t: FloatArray) -> None:
    t[:, 3] = (t[:, 0] + t[:, 1]) / 2
    _coplanar_oblique(rng, t)


def _collinear(rng: Generator, t: FloatArray) -> None:
    t[:, 5] = t[:, 3] + (t[:, 4] - t[:, 3]) * (rng.integers(1, 4, len(t)) / 4)[:, None]


def _quarter_point(t: FloatArray) -> FloatArray:
    return t[:, 0] / 4 + t[:, 1] / 4 + t[:, 2] / 2


def _point_on_face(_rng: Generator, t: FloatArray) -> None:
    t[:, 3:] = _quarter_point(t)[:, None]


def _point_off_face(rng: Generator, t: FloatArray) -> None:
    normal, _ = unit_normal(t[:, :3])
    t[:, 3:] = (_quarter_point(t) + normal * log_uniform(rng, -3, 0, len(t))[:, None])[:, None]


def _vertex_on_face(_rng: Generator, t: FloatArray) -> None:
    t[:, 3] = _quarter_point(t)


def _needles(rng: Generator, t: FloatArray) -> None:
    n = len(t)
    for triangle in (t[:, :3], t[:, 3:]):
        start, end = triangle[:, 0], triangle[:, 1]
        on_edge = start + (end - start) * rng.random((n, 1))
        triangle[:, 2] = on_edge + rng.normal(0, 1, (n, 3)) * log_uniform(rng, -12, -6, (n, 1))
    t[:, 3:] += ((t[:, 0] + t[:, 1]) / 2 - (t[:, 3] + t[:, 4]) / 2)[:, None]


def _move_far_away(rng: Generator, t: FloatArray) -> None:
    n = len(t)
    direction = rng.normal(0, 1, (n, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    t[:] = uniform(rng, n) * 1e-2 + (direction * log_uniform(rng, 5, 8, (n, 1)))[:, None]


def _shrink(rng: Generator, t: FloatArray) -> None:
    t[:] = (t - 0.5) * log_uniform(rng, -9, -5, (len(t), 1, 1))


def _underflow(_rng: Generator, t: FloatArray) -> None:
    t[:] = (t - 0.5) * 2.0**-500


def _overflow(_rng: Generator, t: FloatArray) -> None:
    t[:] = (t - 0.5) * 2.0**400


def _edges_cross(rng: Generator, t: FloatArray) -> None:
    middle = (t[:, 0] + t[:, 1]) / 2
    offset = rng.integers(-8, 9, middle.shape).astype(np.float64)
    offset[(offset == 0).all(axis=1), 0] = 1
    t[:, 3], t[:, 4] = middle - offset, middle + offset


def _parallel_gap(rng: Generator, t: FloatArray) -> None:
    t[:, :3, 2] = 0
    t[:, 3:, 2] = log_uniform(rng, -15, -6, (len(t), 1))


def _shallow(rng: Generator, t: FloatArray) -> None:
    n = len(t)
    t[:, 1, 0] = t[:, 2, 1] = 1
    p = face_point(rng, t[:, :3], 2.0)[:, :2]
    t[:, 3, :2], t[:, 3, 2] = p, -log_uniform(rng, -15, -6, n)
    t[:, 4:, :2] = p[:, None] + rng.normal(0, 0.05, (n, 2, 2))
    t[:, 4:, 2] = 0.1 + rng.random((n, 2))


def _size_ratio(rng: Generator, t: FloatArray) -> None:
    p = face_point(rng, t[:, :3])
    t[:, 3:] = p[:, None] + rng.normal(0, 1, (len(t), 3, 3)) * log_uniform(rng, -9, -6, (len(t), 1, 1))


def _near_coplanar(rng: Generator, t: FloatArray) -> None:
    t[..., 2] = 0.5 + rng.normal(0, 1, (len(t), 6)) * log_uniform(rng, -14, -8, (len(t), 1))


def _thin_wall(rng: Generator, t: FloatArray) -> None:
    n = len(t)
    t[:, :3] = [(-1, -1, 0), (1, -1, 0), (-1, 1, 0)]
    t[:, 3:, :2] = rng.normal(0, 0.02, (n, 3, 2)) - 0.3
    t[:, 3:, 2] = np.sort(rng.normal(0, 1e-4, (n, 3)), axis=1) + rng.choice([-1e-4, 0, 1e-4], (n, 1))


def _rounded_motion(rng: Generator, t: FloatArray) -> None:
    t[:] = place_points(t, random_rotations(rng, len(t)), rng.normal(0, 1, (len(t), 3)))


def _glass_facets(rng: Generator, t: FloatArray) -> None:
    n, width, height, radius = len(t), 0.002, 6e-5, 0.03
    start_angle = rng.uniform(0, 2 * np.pi, n)
    outer_radius = radius + rng.choice([0.0, 1e-6, 1e-4], n)
    tilt, lifts = rng.uniform(-width, width, n), rng.uniform(-3e-5, 3e-5, n)
    for row, (step, level) in enumerate([(0, 0), (1, 0), (0, 1)] * 2):
        is_second = row >= 3
        angle = start_angle + step * width + tilt * is_second
        r = outer_radius if is_second else radius
        t[:, row] = np.stack([r * np.cos(angle), r * np.sin(angle), level * height + lifts * is_second], axis=-1)
    t[:] = t.astype(np.float32)


_TABLE: tuple[tuple[str, Start, Change | None, bool | None], ...] = (
    ("generic control", uniform, None, None),
    ("vertex within ulps of a face", uniform, _vertex_by_ulps, None),
    ("shared vertex", uniform, _shared_vertex, True),
    ("shared edge, folded", uniform, _shared_edge, True),
    ("identical, permuted", uniform, _make_identical, True),
    ("coplanar, axis plane", uniform, _coplanar_axis, None),
    ("coplanar oblique", COARSE_GRID, _coplanar_oblique, None),
    ("coplanar touching", COARSE_GRID, _coplanar_touching, True),
    ("collinear against proper", grid, _collinear, None),
    ("point on a face", grid, _point_on_face, True),
    ("point off a face", thick_grid, _point_off_face, False),
    ("needles", uniform, _needles, None),
    ("far from the origin", zero_corners, _move_far_away, None),
    ("tiny", uniform, _shrink, None),
    ("products underflow", uniform, _underflow, None),
    ("products overflow", uniform, _overflow, None),
    ("edges cross in one point", WHOLE_GRID, _edges_cross, True),
    ("vertex exactly on a face", WHOLE_GRID, _vertex_on_face, True),
    ("parallel planes, small gap", uniform, _parallel_gap, False),
    ("shallow overlap", zero_corners, _shallow, True),
    ("size ratio 1e6 to 1e9", uniform, _size_ratio, None),
    ("near-coplanar", uniform, _near_coplanar, None),
    ("thin wall, poke", zero_corners, _thin_wall, None),
    ("lattice", lattice, None, None),
    ("lattice, rounded motion", lattice, _rounded_motion, None),
    ("float32 glass facets", zero_corners, _glass_facets, None),
)

FAMILIES: tuple[Family, ...] = tuple(Family(number, *row) for number, row in enumerate(_TABLE, start=1))
"""All families in the order of the specification."""
