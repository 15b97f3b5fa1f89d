"""The things on the timed bench as meshes of nearly as many faces as asked for, none of them degenerate.

Corners are rounded to single precision, so that engines of either precision see the same geometry.
"""

from collections.abc import Callable
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, Int32Array

Mesh = tuple[FloatArray, Int32Array]

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


def bench_mesh(kind: str, faces: int) -> Mesh:
    """The mesh of one kind of thing: tray, cup, bottle, ring, rod, tube or hand."""
    return MAKERS[kind](faces)


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
