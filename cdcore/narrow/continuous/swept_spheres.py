"""Bounding spheres over whole segments: a segment is clear where the spheres stay apart, for any motion inside them.

A sphere's centre follows its body's origin along a line and turns about it; it leaves the chord between its places at
both ends by at most an eighth of the squared angle times its distance from the origin.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from cdcore.bounding.bounding_sphere import Sphere
from cdcore.numerics import EPS, UNDERFLOW_PAD, BoolArray, FloatArray, IntArray
from cdcore.poses import place_points

SWEPT_ULPS: Final = 4096.0
"""Pad in eps of both bodies' sizes, for rotations as far from orthonormal as a motion allows."""

ANGLE_OF_CHORD: Final = 1.1108
"""An angle of at most half a turn is at most pi / (2 sqrt 2) times the Frobenius norm of the rotations' difference."""


class SweptSpheres:
    """Finds the legs on which the bounding spheres of a pair, one a body, may meet."""

    def __init__(self, spheres: Sequence[Sphere]) -> None:
        self._spheres = tuple(spheres)

    def may_meet(
        self, rotations: FloatArray, translations: FloatArray, valid: BoolArray, pairs: IntArray, searched: BoolArray
    ) -> BoolArray:
        """Marks legs (T, P), of those searched, on which the spheres may meet; row t is from frame t-1 to t.

        Rows whose poses are not valid must not be asked about.
        """
        near = np.zeros_like(searched)
        if not searched.any():
            return near
        used = np.unique(pairs)
        centres, slack = {}, {}
        for body in used.tolist():
            centres[body], slack[body] = self._path(body, rotations[:, body], translations[:, body], valid[:, body])
        for column, (i, j) in enumerate(pairs.tolist()):
            reach = self._spheres[i].radius + self._spheres[j].radius + UNDERFLOW_PAD + slack[i][1:] + slack[j][1:]
            # "not above": a distance that overflowed to NaN counts as near
            near[1:, column] = searched[1:, column] & ~(_least_distance(centres[i] - centres[j]) > reach)
        return near

    def _path(
        self, body: int, rotations: FloatArray, translations: FloatArray, valid: BoolArray
    ) -> tuple[FloatArray, FloatArray]:
        """World centres (T, 3), and how far off the chord to frame t the sphere may reach, rounding included, (T,)."""
        sphere = self._spheres[body]
        off = float(np.linalg.norm(sphere.centre))
        slack = np.zeros(len(rotations))
        with np.errstate(invalid="ignore", over="ignore"):
            centres = place_points(sphere.centre[None], rotations, translations)[:, 0]
            angle = ANGLE_OF_CHORD * np.sqrt(((rotations[1:] - rotations[:-1]) ** 2).sum(axis=(1, 2)))
            far = np.abs(translations).max(axis=1)
            slack[1:] = angle**2 * (off / 8.0)
            slack[1:] += SWEPT_ULPS * EPS * (off + sphere.radius + np.maximum(far[1:], far[:-1]))
        return np.where(valid[:, None], centres, np.nan), slack


def _least_distance(translations: FloatArray) -> FloatArray:
    """Distance from the origin, (T - 1,), of the chords from each of the places (T, 3) to the next."""
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        start, displacement = translations[:-1], translations[1:] - translations[:-1]
        along, length = -(start * displacement).sum(axis=1), (displacement * displacement).sum(axis=1)
        fraction = np.where(length > 0.0, np.clip(along / length, 0.0, 1.0), 0.0)
        nearest = start + fraction[:, None] * displacement
        return np.sqrt((nearest * nearest).sum(axis=1))
