"""A made-up bench for timing: the same arguments always give the same meshes and poses, and some bodies touch.

A tray, cups and balls: the tray and the cups stand, the balls hover and dip
against the walls.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import FloatArray

RATE_HZ: Final = 90.0
SPACING: Final = 0.25
"""Metres between neighbouring cups."""

Mesh = tuple[FloatArray, NDArray[np.int32]]


@dataclass(frozen=True, eq=False)
class BenchWorkload:
    """N meshes, their poses (T, N, 4, 4) and the pairs (P, 2) of which at least one body moves."""

    names: tuple[str, ...]
    meshes: tuple[Mesh, ...]
    poses: FloatArray
    pairs: NDArray[np.int64]
    rate_hz: float = RATE_HZ


def make_workload(faces: int, frames: int = 5400, *, bodies: int = 7, seed: int = 0) -> BenchWorkload:
    """Lay the bench.

    Parameters
    ----------
    faces : triangles per body, nearly.
    frames : at 90 Hz; a longer session goes on, it is not slower.
    bodies : 3 or more: a tray, then cups and balls in turn.
    seed : of speeds, phases and tremor.
    """
    if bodies < 3:
        raise ValueError(f"a bench has 3 bodies or more, not {bodies}; ask for a tray, a cup and a ball")
    rng = np.random.default_rng(seed)
    kinds = ["tray"] + [("cup", "ball")[k % 2] for k in range(bodies - 1)]
    shapes = {"tray": _tray(faces), "cup": _cup(faces), "ball": _ball(faces)}
    poses = np.tile(np.eye(4), (frames, bodies, 1, 1))
    seconds = np.arange(frames) / RATE_HZ
    for body, kind in enumerate(kinds):
        place = np.array([SPACING * ((body - 1) // 2), 0.0, 0.0])
        if kind == "ball":
            poses[:, body] = _travel(seconds, place, rng)
        elif kind == "cup":
            poses[:, body, :3, 3] = place
        else:
            poses[:, body, 2, 3] = -0.01
    moving = [k for k, kind in enumerate(kinds) if kind == "ball"]
    pairs = [(i, j) for i in range(bodies) for j in range(i + 1, bodies) if i in moving or j in moving]
    names = tuple(f"{kind}-{k}" for k, kind in enumerate(kinds))
    return BenchWorkload(names, tuple(shapes[kind] for kind in kinds), poses, np.array(pairs, dtype=np.int64))


def _travel(seconds: FloatArray, home: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Mostly high above the bench; every ten seconds down to the rim of the own cup, turning and trembling."""
    phase = rng.uniform(0, 10)
    dip = np.maximum(0.0, np.cos(2 * np.pi * (seconds + phase) / 10)) ** 6
    wave = rng.uniform(0, 2 * np.pi, 3)
    tremor = 0.0012 * np.sin(2 * np.pi * rng.uniform(0.5, 2, 3) * seconds[:, None] + wave)
    away = rng.uniform(0.02, 0.06, 2)
    poses = np.tile(np.eye(4), (len(seconds), 1, 1))
    poses[:, :3, 3] = home + tremor
    poses[:, 0, 3] += 0.052 * dip + away[0] * (1 - dip)
    poses[:, 1, 3] += away[1] * (1 - dip)
    poses[:, 2, 3] += 0.09 + 0.3 * (1 - dip)
    angle = rng.uniform(0.1, 0.5) * seconds
    poses[:, 0, 0] = poses[:, 1, 1] = np.cos(angle)
    poses[:, 1, 0], poses[:, 0, 1] = np.sin(angle), -np.sin(angle)
    return poses


def _cup(faces: int) -> Mesh:
    """An open surface: a floor and a wall, 9 cm high."""
    around, along = _sides(faces)
    t = np.linspace(0, 1, along + 1)
    return _revolved(0.04 * np.minimum(1, 0.05 + 3 * t), 0.09 * np.maximum(0, 1.5 * t - 0.5), around)


def _ball(faces: int) -> Mesh:
    """An uneven ball of 2 cm, open by a pinhole at both ends."""
    around, along = _sides(faces)
    angle = np.linspace(0.02, np.pi - 0.02, along + 1)
    radius = 0.02 * (1 + 0.06 * np.sin(5 * angle))
    return _revolved(radius * np.sin(angle), -radius * np.cos(angle), around)


def _tray(faces: int) -> Mesh:
    """A flat grid of 1.2 m by 0.6 m."""
    n = max(1, round(np.sqrt(faces / 2)))
    x, y = np.meshgrid(np.linspace(-0.3, 0.9, n + 1), np.linspace(-0.3, 0.3, n + 1), indexing="ij")
    return _grid(np.stack([x, y, np.zeros_like(x)], axis=-1))


def _sides(faces: int) -> tuple[int, int]:
    around = max(3, round(np.sqrt(faces / 2)))
    return around, max(1, faces // (2 * around))


def _revolved(radius: FloatArray, height: FloatArray, around: int) -> Mesh:
    angle = np.linspace(0, 2 * np.pi, around + 1)
    x, y = (np.outer(radius, turn(angle)) for turn in (np.cos, np.sin))
    return _grid(np.stack([x, y, np.tile(height[:, None], (1, around + 1))], axis=-1))


def _grid(points: FloatArray) -> Mesh:
    """Two triangles per cell of a grid of points (R, C, 3), rounded to single precision so that all see the same."""
    rows, columns = points.shape[:2]
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3).astype(np.int32)
    return points.reshape(-1, 3).astype(np.float32).astype(np.float64), faces
