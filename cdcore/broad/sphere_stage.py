"""The sphere stage over a whole motion: padded so that rounding never rejects bodies that touch.

``candidate iff |c_A - c_B| <= d_A + d_B + 16 eps (size_A + size_B)`` with ``size = |o| + |t|_inf + d``. Touching
counts, and nothing is squared before it is padded. The size is that of the numbers that were rounded, not of the
centre they gave: a pad from the world centre missed 1,478 of 3,000 tangent pairs of meshes that lie 1 km from their
own origin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdcore.bounding.sphere import Sphere
from cdcore.broad.sphere_kernels import place_centres, sphere_verdicts
from cdcore.numerics import EPS, PAD_ULPS, ByteArray, FloatArray, IntArray
from cdcore.protocol import Motion


@dataclass(frozen=True, eq=False)
class SphereAnswer:
    """Verdicts (T, P): CLEAR, CANDIDATE or NO_POSE; sphere tests done and pair-frames that needed none."""

    verdict: ByteArray
    tests: int
    skipped: int


class SphereStage:
    """Finds the pair-frames whose spheres overlap.

    *For a short time, made exact*: where two spheres are apart by a gap, the pair is not looked at again before the
    recorded paths of both centres add up to that gap. The trajectory is known, so nothing can be missed; verdicts
    with and without skipping are identical.

    Parameters
    ----------
    spheres : one per body.
    pairs : (P, 2) body numbers.
    skip : whether to skip.
    """

    def __init__(self, spheres: Sequence[Sphere], pairs: IntArray, *, skip: bool = True) -> None:
        self._centres: FloatArray = np.array([sphere.centre for sphere in spheres]).reshape(-1, 3)
        self._radii: FloatArray = np.array([sphere.radius for sphere in spheres], dtype=np.float64)
        self._first = np.ascontiguousarray(pairs[:, 0])
        self._second = np.ascontiguousarray(pairs[:, 1])
        self._skip = skip

    def candidates(self, motion: Motion) -> SphereAnswer:
        """Answer for every frame and pair of the motion."""
        frames, bodies = motion.valid.shape
        verdict = np.zeros((frames, len(self._first)), dtype=np.uint8)
        if frames == 0 or len(self._first) == 0:
            return SphereAnswer(verdict, 0, 0)
        world, path, size = np.empty((bodies, frames, 3)), np.empty((bodies, frames)), np.empty((bodies, frames))
        place_centres(
            motion.rotations, motion.translations, motion.valid, self._centres, self._radii, world, path, size
        )
        tests, skipped = sphere_verdicts(
            self._first, self._second, motion.valid, self._radii, world, path, size, PAD_ULPS * EPS, self._skip, verdict
        )
        return SphereAnswer(verdict, int(tests), int(skipped))
