"""A made-up session for timing: the same arguments always give the same meshes and poses, and bodies touch in it.

A tray, a cup, a ring and a bottle stand; a rod stirs in the cup and knocks at its wall, a tube is put into the ring and
leans on it, then pours over the cup's rim, a hand touches bottle, cup and tray. Things are near each other for much of
the time and touch in some 10 % of the frames, which makes such a session hard. The motion repeats every 30 s. Meshes
have nearly as many faces as asked for, none of them degenerate; corners are rounded to single precision, so that
engines of either precision see the same geometry.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, Int32Array, IntArray
from replay.base.constants import HEADSET_HZ

Mesh = tuple[FloatArray, Int32Array]

RATE_HZ: Final = HEADSET_HZ
PERIOD: Final = 30.0
STATION: Final = ("cup", "rod", "ring", "tube", "bottle", "hand")
"""What follows the tray, again and again."""
STATION_STEP: Final = 0.9
"""Metres from one station to the next."""
DISTANCE: Final = 5.0
"""Metres between neighbouring bodies of a distant session."""
PLACES: Final = {
    "tray": (0.0, 0.0, 0.0), "cup": (0.02, 0.10, 0.0005), "ring": (-0.30, 0.08, 0.0), "bottle": (0.24, -0.08, 0.0),
}  # fmt: skip
"""Of what stands; the cup half a millimetre above the tray."""
TREMOR: Final = (0.0012, 0.02)
"""Largest amplitude in metres and radians."""
SLACK: Final = (0.001, 0.03)
"""How far a seed moves a pose near something, metres an axis, and a pose in the air."""

# seconds, near what, x, y, z from there, rotation vector
Key = tuple[float, str, float, float, float, float, float, float]
_STIRRING: Final[list[Key]] = [
    (5.0 + 0.35 * k, "cup", radius * np.cos(1.76 * k), radius * np.sin(1.76 * k), 0.145, 0.03, 0.02, 0.0)
    for k in range(22)
    for radius in [0.0335 if k in (7, 13, 14) else 0.02]
]
SCRIPTS: Final[dict[str, list[Key]]] = {
    "rod": [
        (0.0, "air", -0.1, -0.2, 0.25, 1.2, 0.0, 0.0), (1.5, "air", -0.1, -0.2, 0.25, 1.2, 0.0, 0.0),
        (4.0, "cup", 0.0, 0.0, 0.30, 0.2, 0.1, 0.0), *_STIRRING, (13.5, "cup", 0.0, 0.0, 0.30, 0.2, 0.1, 0.0),
        (15.5, "air", -0.1, -0.2, 0.25, 1.2, 0.0, 0.0),
    ],
    "tube": [
        (0.0, "air", -0.2, -0.25, 0.3, 0.3, 0.0, 0.0), (14.0, "air", -0.2, -0.25, 0.3, 0.3, 0.0, 0.0),
        (15.5, "ring", 0.0, 0.0, 0.46, 0.0, 0.0, 0.0), (16.5, "ring", 0.0, 0.0, 0.32, 0.0, 0.0, 0.0),
        (17.0, "ring", 0.0, 0.0, 0.32, 0.0, 0.0, 0.0), (17.4, "ring", 0.0285, 0.0, 0.32, 0.0, 0.0, 0.0),
        (17.7, "ring", 0.0285, 0.0, 0.32, 0.0, 0.0, 0.0), (18.1, "ring", 0.0, 0.0, 0.32, 0.0, 0.0, 0.0),
        (19.0, "ring", 0.0, 0.0, 0.46, 0.0, 0.0, 0.0), (21.5, "cup", -0.16, 0.0, 0.22, 0.0, 0.4, 0.0),
        (23.0, "cup", -0.095, 0.0, 0.135, 0.0, 1.75, 0.0), (24.0, "cup", -0.095, 0.0, 0.130, 0.0, 1.8, 0.0),
        (24.4, "cup", -0.085, 0.0, 0.1075, 0.0, 1.7, 0.0), (24.6, "cup", -0.085, 0.0, 0.1075, 0.0, 1.7, 0.0),
        (25.2, "cup", -0.10, 0.0, 0.15, 0.0, 1.6, 0.0), (27.5, "air", -0.2, -0.25, 0.3, 0.3, 0.0, 0.0),
    ],
    "hand": [
        (0.0, "air", 0.35, -0.3, 0.25, 0.0, 0.0, 0.0), (2.0, "bottle", 0.12, 0.0, 0.07, 0.0, 0.2, 0.0),
        (2.5, "bottle", 0.079, 0.0, 0.07, 0.0, 0.2, 0.0), (2.8, "bottle", 0.077, 0.0, 0.07, 0.0, 0.2, 0.0),
        (3.4, "bottle", 0.13, 0.0, 0.09, 0.0, 0.0, 0.0), (9.0, "air", 0.35, -0.3, 0.25, 0.0, 0.0, 0.0),
        (14.5, "cup", 0.13, 0.02, 0.06, 0.0, 0.0, 0.0), (15.0, "cup", 0.072, 0.0, 0.06, 0.0, 0.0, 0.0),
        (15.3, "cup", 0.072, 0.0, 0.06, 0.0, 0.0, 0.0), (15.9, "cup", 0.14, 0.03, 0.09, 0.0, 0.0, 0.0),
        (19.0, "tray", 0.3, 0.2, 0.075, 0.0, 0.0, 0.0), (19.5, "tray", 0.3, 0.2, 0.0535, 0.0, 0.0, 0.0),
        (19.8, "tray", 0.3, 0.2, 0.0535, 0.0, 0.0, 0.0), (20.5, "tray", 0.3, 0.2, 0.09, 0.0, 0.0, 0.0),
        (24.5, "bottle", 0.0, 0.0, 0.27, 0.0, 0.0, 0.0), (25.3, "bottle", 0.0, 0.0, 0.20, 0.0, 0.0, 0.0),
        (25.6, "bottle", 0.0, 0.0, 0.193, 0.0, 0.0, 0.0), (26.6, "bottle", 0.1, 0.0, 0.3, 0.0, 0.0, 0.0),
        (28.5, "air", 0.35, -0.3, 0.25, 0.0, 0.0, 0.0),
    ],
}  # fmt: skip

PINHOLE: Final = 2e-4
"""Metres: surfaces of revolution stay open by that much at their axis, where faces would have no area."""

CUP: Final = ((PINHOLE, 0.0), (0.031, 0.0), (0.034, 0.006), (0.035, 0.09), (0.038, 0.094))
"""(radius, height) in metres from bottom to top; likewise below. The cup is open at the top."""
BOTTLE: Final = ((PINHOLE, 0.002), (0.041, 0.002), (0.045, 0.010), (0.038, 0.035), (0.016, 0.10), (0.018, 0.14))
ROD: Final = ((PINHOLE, -0.125), (0.002, -0.1246), (0.003, -0.1225), (0.003, 0.1225), (0.002, 0.1246), (PINHOLE, 0.125))
TUBE: Final = (
    (PINHOLE, -0.075), (0.005, -0.0735), (0.009, -0.066), (0.009, 0.073), (0.0105, 0.075), (0.008, 0.0745),
    (0.008, -0.066), (PINHOLE, -0.074),
)  # fmt: skip
"""An outer and an inner wall, 1 mm apart."""
TRAY_SIZE: Final = (1.2, 0.7)


@dataclass(frozen=True, eq=False)
class BenchWorkload:
    """N meshes, their poses (T, N, 4, 4) and the pairs (P, 2) of which at least one body moves."""

    names: tuple[str, ...]
    meshes: tuple[Mesh, ...]
    poses: FloatArray
    pairs: IntArray
    rate_hz: float = RATE_HZ


def make_workload(
    faces: int, frames: int = 5400, *, bodies: int = 7, seed: int = 0, distant: bool = False
) -> BenchWorkload:
    """Lay the bench: a tray, then stations of six ``bodies`` with nearly so many ``faces`` each.

    A session longer than 30 s repeats the motion; ``seed`` is of tremor, times and places. ``distant``: every body is
    5 m from the next, and each moves as it does on the bench.
    """
    if bodies < 3:
        raise ValueError(f"a bench has 3 bodies or more, not {bodies}; ask for a tray, a cup and a rod")
    rng = np.random.default_rng(seed)
    kinds = ["tray"] + [STATION[k % len(STATION)] for k in range(bodies - 1)]
    shapes = {kind: MAKERS[kind](faces) for kind in dict.fromkeys(kinds)}
    poses = np.tile(np.eye(4), (frames, bodies, 1, 1))
    seconds = np.arange(frames) / RATE_HZ
    for body, kind in enumerate(kinds):
        if kind in SCRIPTS:
            _follow(SCRIPTS[kind], seconds, rng, poses[:, body])
        else:
            poses[:, body, :3, 3] = PLACES[kind]
        poses[:, body, 0, 3] += DISTANCE * body if distant else STATION_STEP * (max(0, body - 1) // len(STATION))
    pairs = [(i, j) for i in range(bodies) for j in range(i + 1, bodies) if {kinds[i], kinds[j]} & set(SCRIPTS)]
    names = tuple(f"{kind}-{k}" for k, kind in enumerate(kinds))
    return BenchWorkload(names, tuple(shapes[kind] for kind in kinds), poses, np.array(pairs, dtype=np.int64))


def _follow(script: list[Key], seconds: FloatArray, rng: np.random.Generator, poses: FloatArray) -> None:
    """Write the poses along the keys, smooth in between, with tremor."""
    table = np.array([[key[0], *np.array(key[2:5]) + PLACES.get(key[1], (0.0, 0.0, 0.0)), *key[5:]] for key in script])
    slack = np.array([SLACK[key[1] == "air"] for key in script])
    table[:, 1:4] += rng.uniform(-1, 1, (len(table), 3)) * slack[:, None]
    table = np.vstack([table, [PERIOD, *table[0, 1:]]])
    clock = np.mod(seconds + rng.uniform(-1, 1), PERIOD)
    leg = np.minimum(np.searchsorted(table[:, 0], clock, side="right"), len(table) - 1)
    start, end = table[leg - 1], table[leg]
    p = (clock - start[:, 0]) / (end[:, 0] - start[:, 0])
    blend = (p**3 * (10 - 15 * p + 6 * p * p))[:, None]
    way = start[:, 1:] + (end[:, 1:] - start[:, 1:]) * blend + _tremor(seconds, rng)
    poses[:, :3, 3] = way[:, :3]
    poses[:, :3, :3] = _turned_by(way[:, 3:])


def _tremor(seconds: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Shaking (T, 6) in metres and radians: four waves of 0.2 to 2.2 Hz an axis."""
    rate, phase = rng.uniform(0.2, 2.2, (6, 4)), rng.uniform(0, 2 * np.pi, (6, 4))
    wave = np.stack([sum(np.sin(2 * np.pi * f * seconds + p) for f, p in zip(*axis, strict=True)) / 4
                     for axis in zip(rate, phase, strict=True)], axis=1)  # fmt: skip
    return wave * np.repeat(TREMOR, 3)


def _turned_by(vectors: FloatArray) -> FloatArray:
    """Rotations (T, 3, 3) about vectors (T, 3) by their lengths (Rodrigues)."""
    angle = np.linalg.norm(vectors, axis=1)
    # No turn has no axis; its sine is 0, whatever the axis.
    x, y, z = (vectors / np.maximum(angle, 1e-300)[:, None]).T
    cross = np.zeros((len(vectors), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -z, y, -x
    cross -= cross.transpose(0, 2, 1)
    turned: FloatArray = np.eye(3) + np.sin(angle)[:, None, None] * cross
    turned += (1 - np.cos(angle))[:, None, None] * (cross @ cross)
    return turned


def _tray(faces: int) -> Mesh:
    """A flat grid at height 0."""
    n = max(1, round(np.sqrt(faces / 2)))
    x, y = np.meshgrid(*(np.linspace(-size / 2, size / 2, n + 1) for size in TRAY_SIZE), indexing="ij")
    return _grid(np.stack([x, y, np.zeros_like(x)], axis=-1))


def _ring(faces: int) -> Mesh:
    """A wire of 4 mm bent to a ring of 4 cm, 30 cm above its place."""
    around = max(8, round(np.sqrt(1.5 * faces)))
    turn, across = np.linspace(0, 2 * np.pi, around + 1), np.linspace(0, 2 * np.pi, max(4, faces // (2 * around)) + 1)
    radius = 0.04 + 0.004 * np.cos(across)
    x, y = (np.outer(circle(turn), radius) for circle in (np.cos, np.sin))
    return _grid(np.stack([x, y, np.tile(0.3 + 0.004 * np.sin(across), (around + 1, 1))], axis=-1))


def _hand(faces: int) -> Mesh:
    """An egg of 4 by 5.5 cm with bumps for fingers."""
    angle = np.linspace(0.01, np.pi - 0.01, 60)
    points = _revolved(np.stack([0.04 * np.sin(angle), -0.055 * np.cos(angle)], axis=1), faces, 1.2)
    around = np.arctan2(points[..., 1], points[..., 0])
    points[..., :2] *= (1 + 0.1 * np.sin(4 * around + 90 * points[..., 2]))[..., None]
    return _grid(points)


def _turned(profile: tuple[tuple[float, float], ...], aspect: float) -> Callable[[int], Mesh]:
    return lambda faces: _grid(_revolved(np.array(profile), faces, aspect))


MAKERS: Final[dict[str, Callable[[int], Mesh]]] = {
    "tray": _tray, "cup": _turned(CUP, 1.6), "bottle": _turned(BOTTLE, 1.4), "ring": _ring, "rod": _turned(ROD, 0.4),
    "tube": _turned(TUBE, 0.8), "hand": _hand,
}  # fmt: skip


def _revolved(profile: FloatArray, faces: int, aspect: float) -> FloatArray:
    """Points (along, around, 3) of a profile (m, 2) turned about z; ``aspect`` is sides for each step along it."""
    along = max(4, round(np.sqrt(faces / (2 * aspect))))
    around = max(6, round(faces / (2 * along)))
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(profile, axis=0).T))])
    at = np.linspace(0, arc[-1], along + 1)
    radius, height = (np.interp(at, arc, column) for column in profile.T)
    angle = np.linspace(0, 2 * np.pi, around + 1)
    x, y = (np.outer(radius, circle(angle)) for circle in (np.cos, np.sin))
    return np.stack([x, y, np.tile(height[:, None], (1, around + 1))], axis=-1)


def _grid(points: FloatArray) -> Mesh:
    """Two triangles a cell of a grid of points (rows, columns, 3)."""
    rows, columns = points.shape[:2]
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3).astype(np.int32)
    return points.reshape(-1, 3).astype(np.float32).astype(np.float64), faces
