"""Volume that a tilted vessel keeps: by slices of its cavity's mesh with spout and neck; a cylinder in closed form."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray

NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)
"""Of Gauss and Legendre, on -1 to 1."""


def tilt_of(down: FloatArray) -> FloatArray:
    """Radians (n,) from upright, of the direction of gravity (n, 3) in a vessel's frame."""
    # The arc tangent keeps its digits near 0 and pi, where the arc cosine of a rounded cosine loses half of them.
    return np.arctan2(np.hypot(down[:, 0], down[:, 2]), -down[:, 1])


def volume_kept(tilt: FloatArray, radius: float, height: float) -> FloatArray:
    """Volume (n,) that an overfull cylinder keeps when it is tilted slowly; the unit is that of the sizes, cubed.

    ``tilt``: (n,) radians from upright, 0 to pi; from a right angle on nothing is kept.
    ``radius``, ``height``: inner sizes, from the floor to the lip; above 0.

    Source: a cylinder cut by a horizontal plane through its lip. While the plane does not meet the floor the volume is
    pi R^2 (H - R tan); beyond, with phi = 2 asin sqrt(H / (2 R tan)) the half angle of the wetted part of the floor,
    R^3 tan (sin phi - sin^3 phi / 3 - phi cos phi).
    """
    slope = np.tan(np.clip(tilt, 0.0, 0.5 * math.pi))
    is_steep = 2.0 * radius * slope > height
    wedge_angle = 2.0 * np.arcsin(np.sqrt(height / np.where(is_steep, 2.0 * radius * slope, height)))
    floor_area = math.pi * radius**2
    # The rounding of a sum must not let more tilt keep more.
    wedge_volume = np.minimum(radius**3 * slope * _wedge_integral(wedge_angle), 0.5 * floor_area * height)
    kept_volume = np.where(is_steep, wedge_volume, floor_area * (height - radius * slope))
    return np.where(tilt >= 0.5 * math.pi, 0.0, kept_volume)


def _wedge_integral(phi: FloatArray) -> FloatArray:
    # As 2 integral(sin^2 t (cos t - cos phi)) from 0 to phi: the closed form cancels where phi is small, and was 21 %
    # wrong at 89.9999 degrees.
    end_angle = phi[..., None]
    t = 0.5 * end_angle * (1.0 + NODES)
    fall = 2.0 * np.sin(0.5 * (end_angle + t)) * np.sin(0.5 * (end_angle - t))
    return phi * ((np.sin(t) ** 2 * fall) @ WEIGHTS)


_TO_LEVEL: Final = np.concatenate([np.arange(0.0, 80.0, 0.5), np.arange(80.0, 88.0, 0.25), np.arange(88.0, 90.0, 0.05)])
TILTS_RAD: Final = np.radians(np.concatenate([_TO_LEVEL, [90.0], 180.0 - _TO_LEVEL[::-1]]))
"""Rows of the table, radians from upright: closer where a long tube lies nearly level and a degree is half of it."""

ANGLE_COUNT: Final = 180
"""Columns of the table, one every 2 degrees about the vessel's axis."""

DIRECTIONS_AT_ONCE: Final = 16
"""Directions sliced together, so that the heights of a mesh of 2,500 faces stay in a processor's cache."""

LEVEL_COUNT: Final = 200
"""Heights between which a level is interpolated: half a millimetre apart in a beaker."""

RIM_TOLERANCE_M: Final = 1e-5
"""Metres; vertices no farther than this from the plane of the opening are its rim. Meshes are right to 3e-8."""

ML_PER_M3: Final = 1e6
"""Millilitres in a cubic metre."""


def volume_below(vertices: FloatArray, faces: IntArray, down: FloatArray, depth: FloatArray) -> FloatArray:
    """Volume (n,) of the part of a closed mesh that lies deeper than ``depth`` (n,) along unit ``down`` (n or 1, 3).

    ``vertices``: (v, 3); ``faces``: (f, 3), outwards; the unit is that of the vertices, cubed.

    Source: divergence theorem. With h the depth below the plane, the field h down has divergence 1 and is 0 on the
    cut, so that the volume is the integral of h over the faces below it, each times the part of its area that faces
    down. That of a triangle which the plane cuts is in closed form.
    """
    corners = vertices[faces]
    facing_areas = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) @ down.T
    depths_below = vertices @ down.T - depth
    first_depths, second_depths, third_depths = (depths_below[faces[:, corner]] for corner in range(3))
    lower, upper = (
        np.minimum(np.minimum(first_depths, second_depths), third_depths),
        np.maximum(np.maximum(first_depths, second_depths), third_depths),
    )
    depth_sums = first_depths + second_depths + third_depths
    mean = np.where(lower >= 0.0, depth_sums, 0.0)
    is_cut = (lower < 0.0) & (upper > 0.0)
    lower, upper, depth_sums = lower[is_cut], upper[is_cut], depth_sums[is_cut]
    middle_depths = depth_sums - lower - upper
    single_corner_volume = upper**3 / ((upper - lower) * np.where(middle_depths < 0.0, upper - middle_depths, upper))
    two_corner_volume = depth_sums - lower**3 / (
        (upper - lower) * np.where(middle_depths < 0.0, -lower, middle_depths - lower)
    )
    mean[is_cut] = np.where(middle_depths < 0.0, single_corner_volume, two_corner_volume)
    return (facing_areas * mean).sum(axis=0) / 3.0


@dataclass(frozen=True, eq=False)
class SlicedCavity:
    """A vessel whose cavity is a closed mesh, filled up to the lowest point of its rim.

    Between the directions of a table what it keeps is interpolated. Only the directions asked for are sliced, each
    once.
    """

    vertices: FloatArray  # (v, 3) metres
    faces: IntArray  # (f, 3)
    opening: FloatArray  # (3,) the middle of the opening
    normal: FloatArray  # (3,) unit, out of the vessel
    table: FloatArray = field(default_factory=lambda: np.full((len(TILTS_RAD), ANGLE_COUNT), np.nan))

    @property
    def rim(self) -> FloatArray:
        """The vertices (r, 3) of the opening's rim, and any within it."""
        plane_distance = np.abs((self.vertices - self.opening) @ self.normal)
        return self.vertices[plane_distance <= RIM_TOLERANCE_M]

    @property
    def brim_ml(self) -> float:
        """Volume of the full vessel."""
        inward_direction = -self.normal[None]
        full_volume = volume_below(
            self.vertices, self.faces, inward_direction, (self.vertices @ inward_direction.T).min(axis=0)
        )
        return float(full_volume[0]) * ML_PER_M3

    def kept_ml(self, down: FloatArray) -> FloatArray:
        """By slices, interpolated over tilt and the side it is tilted to."""
        tilt = np.interp(tilt_of(down), TILTS_RAD, np.arange(len(TILTS_RAD), dtype=np.float64))
        angle = np.arctan2(down[:, 2], down[:, 0]) * (ANGLE_COUNT / (2.0 * np.pi))
        row = np.minimum(tilt.astype(np.int64), len(TILTS_RAD) - 2)
        column = np.floor(angle).astype(np.int64)
        tilt, angle = tilt - row, angle - column
        first, second = column % ANGLE_COUNT, (column + 1) % ANGLE_COUNT
        self._fill_table(np.concatenate([row, row, row + 1, row + 1]), np.concatenate([first, second, first, second]))
        volume_at_lower_tilt = (1.0 - angle) * self.table[row, first] + angle * self.table[row, second]
        volume_at_higher_tilt = (1.0 - angle) * self.table[row + 1, first] + angle * self.table[row + 1, second]
        return (1.0 - tilt) * volume_at_lower_tilt + tilt * volume_at_higher_tilt

    def level(self, volume_ml: FloatArray) -> FloatArray:
        """Height (n,) in the body's frame to which so much rises in the upright vessel."""
        return np.interp(volume_ml, *self._upright_volumes)

    @cached_property
    def _upright_volumes(self) -> tuple[FloatArray, FloatArray]:
        """Millilitres (LEVELS,) below each of as many heights of the upright vessel, and these heights."""
        heights = np.linspace(float(self.vertices[:, 1].min()), float(self.opening[1]), LEVEL_COUNT)
        upright_down = np.array([[0.0, -1.0, 0.0]])
        volume_blocks = [
            volume_below(self.vertices, self.faces, upright_down, -heights[start : start + DIRECTIONS_AT_ONCE])
            for start in range(0, LEVEL_COUNT, DIRECTIONS_AT_ONCE)
        ]
        return np.concatenate(volume_blocks) * ML_PER_M3, heights

    def exit(self, down: FloatArray) -> FloatArray:
        """The lowest point of the rim."""
        rim = self.rim
        return rim[np.argmax(down @ rim.T, axis=1)]

    def _fill_table(self, rows: IntArray, columns: IntArray) -> None:
        """Fill the table where it is asked for and empty."""
        is_queried = np.zeros(self.table.shape, dtype=bool)
        is_queried[rows, columns] = True
        rows, columns = np.nonzero(is_queried & np.isnan(self.table))
        tilt, angle, rim = TILTS_RAD[rows], columns * (2.0 * np.pi / ANGLE_COUNT), self.rim
        down = np.stack([np.sin(tilt) * np.cos(angle), -np.cos(tilt), np.sin(tilt) * np.sin(angle)], axis=1)
        for start in range(0, len(down), DIRECTIONS_AT_ONCE):
            chunk = slice(start, start + DIRECTIONS_AT_ONCE)
            depth = (down[chunk] @ rim.T).max(axis=1)
            self.table[rows[chunk], columns[chunk]] = (
                volume_below(self.vertices, self.faces, down[chunk], depth) * ML_PER_M3
            )
