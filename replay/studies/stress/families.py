"""Twenty-six families of hard triangle pairs, each made so that one way of being wrong shows.

Arrays only: every family turns a random stream and a count into pairs (n, 2, 3, 3) float64. Dyadic coordinates
(integers times 2^-6) keep sums and halves exact, so that *touching* is touching and not nearly so.

Source: section 7.2 of the project's specification.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from cdcore.numerics import FloatArray
from cdcore.transforms.rigid import rotation_from_quaternion

Maker = Callable[[Generator, int], FloatArray]

FIRST_SEED = 100
"""Seed of family k (from 0) is this plus k in the reference set."""


@dataclass(frozen=True)
class Family:
    """One family: its number from 1, its name, how to make it, and the answer where construction fixes it."""

    number: int
    name: str
    make: Maker
    expected: bool | None = None
    metric: bool = True
    """False where the coordinates are not metres, so that a tolerance in metres means nothing."""

    def pairs(self, count: int, seed: int = FIRST_SEED) -> FloatArray:
        """Triangle pairs (count, 2, 3, 3); the same seed gives the same bits."""
        rng = np.random.default_rng(seed + self.number - 1)
        return np.ascontiguousarray(self.make(rng, count)).reshape(-1, 2, 3, 3)


def uniform(rng: Generator, n: int) -> FloatArray:
    """Six corners with coordinates uniform in [0, 1)."""
    return rng.random((n, 6, 3))


def grid(rng: Generator, n: int, half: int = 64, step: float = 2.0**-6) -> FloatArray:
    """Six corners on a grid: integers in [-half, half] times step."""
    return rng.integers(-half, half + 1, (n, 6, 3)).astype(np.float64) * step


def log_uniform(rng: Generator, low: float, high: float, shape: int | tuple[int, ...]) -> FloatArray:
    """Ten to a power uniform in [low, high)."""
    return np.asarray(10.0 ** rng.uniform(low, high, shape), dtype=np.float64)


def face_point(rng: Generator, triangles: FloatArray, weight: float = 1.0) -> FloatArray:
    """A random point (n, 3) of each triangle (n, 3, 3), Dirichlet weights."""
    return np.einsum("nk,nkd->nd", rng.dirichlet([weight] * 3, len(triangles)), triangles)


def unit_normal(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit normals (n, 3) and the lengths (n,) they had."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normal, axis=1)
    return normal / np.where(length > 0, length, 1)[:, None], length


def _vertex_by_ulps(rng: Generator, n: int) -> FloatArray:
    t = uniform(rng, n)
    normal, _ = unit_normal(t[:, :3])
    p = face_point(rng, t[:, :3]) + normal * (rng.integers(-4, 5, n) * 2.0**-53)[:, None]
    t[:, 3] = p
    t[:, 4:] = (p + normal)[:, None] + rng.normal(0, 0.3, (n, 2, 3))
    return t


def _shared_vertex(rng: Generator, n: int) -> FloatArray:
    t = uniform(rng, n)
    t[:, 3] = t[np.arange(n), rng.integers(0, 3, n)]
    return t


def _shared_edge(rng: Generator, n: int) -> FloatArray:
    t = uniform(rng, n)
    t[:, 3], t[:, 4] = t[:, 1].copy(), t[:, 0].copy()
    return t


def _identical(rng: Generator, n: int) -> FloatArray:
    t = uniform(rng, n)
    order = rng.permuted(np.tile(np.arange(3), (n, 1)), axis=1)
    t[:, 3:] = np.take_along_axis(t[:, :3], order[..., None], axis=1)
    return t


def _coplanar_axis(rng: Generator, n: int) -> FloatArray:
    t = uniform(rng, n)
    t[np.arange(n), :, rng.integers(0, 3, n)] = 0.5
    return t


def _oblique(t: FloatArray) -> FloatArray:
    t[..., 2] = 2 * t[..., 0] - 3 * t[..., 1]
    return t


def _coplanar_touching(rng: Generator, n: int) -> FloatArray:
    t = grid(rng, n, 16, 1.0)
    t[:, 3] = (t[:, 0] + t[:, 1]) / 2
    return _oblique(t)


def _collinear(rng: Generator, n: int) -> FloatArray:
    t = grid(rng, n)
    t[:, 5] = t[:, 3] + (t[:, 4] - t[:, 3]) * (rng.integers(1, 4, n) / 4)[:, None]
    return t


def _quarter_point(t: FloatArray) -> FloatArray:
    return t[:, 0] / 4 + t[:, 1] / 4 + t[:, 2] / 2


def _point_on_face(rng: Generator, n: int) -> FloatArray:
    t = grid(rng, n)
    t[:, 3:] = _quarter_point(t)[:, None]
    return t


def _point_off_face(rng: Generator, n: int) -> FloatArray:
    t = np.zeros((0, 6, 3))
    while len(t) < n:
        more = grid(rng, n)
        t = np.concatenate([t, more[unit_normal(more[:, :3])[1] >= 1e-3]])[:n]
    normal, _ = unit_normal(t[:, :3])
    t[:, 3:] = (_quarter_point(t) + normal * log_uniform(rng, -3, 0, n)[:, None])[:, None]
    return t


def _needles(rng: Generator, n: int) -> FloatArray:
    t = uniform(rng, n)
    for first in (0, 3):
        along = rng.random((n, 1))
        on_edge = t[:, first] + (t[:, first + 1] - t[:, first]) * along
        t[:, first + 2] = on_edge + rng.normal(0, 1, (n, 3)) * log_uniform(rng, -12, -6, (n, 1))
    t[:, 3:] += ((t[:, 0] + t[:, 1]) / 2 - (t[:, 3] + t[:, 4]) / 2)[:, None]
    return t


def _far(rng: Generator, n: int) -> FloatArray:
    direction = rng.normal(0, 1, (n, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return uniform(rng, n) * 1e-2 + (direction * log_uniform(rng, 5, 8, (n, 1)))[:, None]


def _edges_cross(rng: Generator, n: int) -> FloatArray:
    t = grid(rng, n, 32, 1.0)
    middle = (t[:, 0] + t[:, 1]) / 2
    offset = rng.integers(-8, 9, (n, 3)).astype(np.float64)
    offset[(offset == 0).all(axis=1), 0] = 1
    t[:, 3], t[:, 4] = middle - offset, middle + offset
    return t


def _vertex_on_face(rng: Generator, n: int) -> FloatArray:
    t = grid(rng, n, 32, 1.0)
    t[:, 3] = _quarter_point(t)
    return t


def _parallel_gap(rng: Generator, n: int) -> FloatArray:
    t = uniform(rng, n)
    t[:, :3, 2] = 0
    t[:, 3:, 2] = log_uniform(rng, -15, -6, (n, 1))
    return t


def _shallow(rng: Generator, n: int) -> FloatArray:
    t = np.zeros((n, 6, 3))
    t[:, 1, 0] = t[:, 2, 1] = 1
    p = face_point(rng, t[:, :3], 2.0)[:, :2]
    t[:, 3, :2], t[:, 3, 2] = p, -log_uniform(rng, -15, -6, n)
    t[:, 4:, :2] = p[:, None] + rng.normal(0, 0.05, (n, 2, 2))
    t[:, 4:, 2] = 0.1 + rng.random((n, 2))
    return t


def _size_ratio(rng: Generator, n: int) -> FloatArray:
    t = uniform(rng, n)
    p = face_point(rng, t[:, :3])
    t[:, 3:] = p[:, None] + rng.normal(0, 1, (n, 3, 3)) * log_uniform(rng, -9, -6, (n, 1, 1))
    return t


def _near_coplanar(rng: Generator, n: int) -> FloatArray:
    t = uniform(rng, n)
    t[..., 2] = 0.5 + rng.normal(0, 1, (n, 6)) * log_uniform(rng, -14, -8, (n, 1))
    return t


def _thin_wall(rng: Generator, n: int) -> FloatArray:
    t = np.empty((n, 6, 3))
    t[:, :3] = [(-1, -1, 0), (1, -1, 0), (-1, 1, 0)]
    t[:, 3:, :2] = rng.normal(0, 0.02, (n, 3, 2)) - 0.3
    t[:, 3:, 2] = np.sort(rng.normal(0, 1e-4, (n, 3)), axis=1) + rng.choice([-1e-4, 0, 1e-4], (n, 1))
    return t


def _lattice(rng: Generator, n: int) -> FloatArray:
    return rng.integers(0, 4, (n, 6, 3)).astype(np.float64)


def random_rotations(rng: Generator, n: int) -> FloatArray:
    """Rotation matrices (n, 3, 3) from random unit quaternions."""
    return rotation_from_quaternion(rng.normal(0, 1, (n, 4)))


def _moved_lattice(rng: Generator, n: int) -> FloatArray:
    t, rotation, shift = _lattice(rng, n), random_rotations(rng, n), rng.normal(0, 1, (n, 1, 3))
    x, y, z = t[..., 0], t[..., 1], t[..., 2]
    r = rotation[:, None]
    rows = [(r[..., k, 0] * x + r[..., k, 1] * y) + r[..., k, 2] * z for k in range(3)]
    return np.stack(rows, axis=-1) + shift


def _glass_facets(rng: Generator, n: int) -> FloatArray:
    width, height, radius = 0.002, 6e-5, 0.03
    start = rng.uniform(0, 2 * np.pi, n)
    outside = radius + rng.choice([0.0, 1e-6, 1e-4], n)
    turn, lift = rng.uniform(-width, width, n), rng.uniform(-3e-5, 3e-5, n)
    t = np.empty((n, 6, 3))
    for row, (step, level) in enumerate([(0, 0), (1, 0), (0, 1)] * 2):
        second = row >= 3
        angle = start + step * width + (turn if second else 0)
        r = outside if second else radius
        up = level * height + (lift if second else np.zeros(n))
        t[:, row] = np.stack([r * np.cos(angle), r * np.sin(angle), up], axis=-1)
    return t.astype(np.float32).astype(np.float64)


_TABLE: tuple[tuple[str, Maker, bool | None], ...] = (
    ("generic control", uniform, None),
    ("vertex within ulps of a face", _vertex_by_ulps, None),
    ("shared vertex", _shared_vertex, True),
    ("shared edge, folded", _shared_edge, True),
    ("identical, permuted", _identical, True),
    ("coplanar, axis plane", _coplanar_axis, None),
    ("coplanar oblique", lambda rng, n: _oblique(grid(rng, n, 16, 1.0)), None),
    ("coplanar touching", _coplanar_touching, True),
    ("collinear against proper", _collinear, None),
    ("point on a face", _point_on_face, True),
    ("point off a face", _point_off_face, False),
    ("needles", _needles, None),
    ("far from the origin", _far, None),
    ("tiny", lambda rng, n: (uniform(rng, n) - 0.5) * log_uniform(rng, -9, -5, (n, 1, 1)), None),
    ("products underflow", lambda rng, n: (uniform(rng, n) - 0.5) * 2.0**-500, None),
    ("products overflow", lambda rng, n: (uniform(rng, n) - 0.5) * 2.0**400, None),
    ("edges cross in one point", _edges_cross, True),
    ("vertex exactly on a face", _vertex_on_face, True),
    ("parallel planes, small gap", _parallel_gap, False),
    ("shallow overlap", _shallow, True),
    ("size ratio 1e6 to 1e9", _size_ratio, None),
    ("near-coplanar", _near_coplanar, None),
    ("thin wall, poke", _thin_wall, None),
    ("lattice", _lattice, None),
    ("lattice, rounded motion", _moved_lattice, None),
    ("float32 glass facets", _glass_facets, None),
)

FAMILIES: tuple[Family, ...] = tuple(
    Family(number, name, make, expected, metric=number not in (14, 15, 16))
    for number, (name, make, expected) in enumerate(_TABLE, start=1)
)
"""All families in the order of the specification."""
