"""The sphere stage over a whole motion: padded so that rounding never rejects bodies that touch.

``candidate iff |c_A - c_B| <= d_A + d_B + 16 eps (size_A + size_B)`` with ``size = |o| + |t|_inf + d``. Touching
counts, and nothing is squared before it is padded. The size is that of the numbers that were rounded, not of the
centre they gave: a pad from the world centre missed 1,478 of 3,000 tangent pairs of meshes that lie 1 km from their
own origin.

Every pair-frame is tested: to leap along the recorded paths over frames that cannot meet, 15 of 16 of them, took as
long, and a kernel more (2026-11).
"""

from collections.abc import Sequence

import numpy as np

from cdcore.bounding.bounding_sphere import Sphere
from cdcore.kernels.compiling import hot_kernel, kernel
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray
from cdcore.poses.kernels import place_coordinate
from cdcore.protocol import Motion, Verdict
from cdcore.tolerances import EPS, PAD_ULPS, UNDERFLOW_PAD

CLEAR, CANDIDATE, NO_POSE = np.uint8(Verdict.CLEAR), np.uint8(Verdict.CANDIDATE), np.uint8(Verdict.NO_POSE)


Arrays = tuple[FloatArray, ...]
"""What a kernel is handed as one operand: a plain tuple, since numba takes longer to see what a named one is."""


@kernel
def sphere_verdicts(
    poses: Arrays, valid: BoolArray, spheres: Arrays, ends: tuple[IntArray, IntArray], room: Arrays, verdict: ByteArray
) -> int:
    """Fill ``verdict`` (T, P) with CLEAR, CANDIDATE or NO_POSE; returns how many pair-frames were tested.

    ``spheres``: centres, radii, and sizes of bodies at rest; ``room``: as ``sphere_room`` makes it.
    """
    return fill_sphere_verdicts(poses, valid, spheres, ends, room, verdict)


@hot_kernel
def fill_sphere_verdicts(
    poses: Arrays, valid: BoolArray, spheres: Arrays, ends: tuple[IntArray, IntArray], room: Arrays, verdict: ByteArray
) -> int:
    """The same, for kernels: compiled once for a whole motion and for a live look."""
    (rotation, translation), (centres, radii, size_at_rest), (first, second) = poses, spheres, ends
    world, size = room
    frames, bodies = valid.shape
    tests = 0
    for t in range(frames):
        for k in range(bodies):
            x, y, z, largest = centres[k, 0], centres[k, 1], centres[k, 2], 0.0
            for i in range(3):
                row = rotation[t, k, i, 0], rotation[t, k, i, 1], rotation[t, k, i, 2]
                world[k, i] = place_coordinate(row, translation[t, k, i], (x, y, z))
                largest = max(largest, abs(translation[t, k, i]))
            size[k] = size_at_rest[k] + largest
        for p in range(len(first)):
            a, b = first[p], second[p]
            if not (valid[t, a] and valid[t, b]):
                verdict[t, p] = NO_POSE
                continue
            tests += 1
            square = 0.0
            for i in range(3):
                offset = world[a, i] - world[b, i]
                square += offset * offset
            reach = radii[a] + radii[b] + UNDERFLOW_PAD
            # Asked this way round, a distance that overflowed to NaN is a candidate.
            separated = np.sqrt(square) > reach + PAD_ULPS * EPS * (size[a] + size[b])
            verdict[t, p] = CLEAR if separated else CANDIDATE
    return tests


def sphere_room(bodies: int) -> Arrays:
    """Scratch memory of ``sphere_verdicts``."""
    return np.empty((bodies, 3)), np.empty(bodies)


class SphereStage:
    """Finds the pair-frames whose spheres, one a body, overlap; ``pairs`` (P, 2) are body numbers."""

    def __init__(self, spheres: Sequence[Sphere], pairs: IntArray) -> None:
        centres: FloatArray = np.array([sphere.centre for sphere in spheres]).reshape(-1, 3)
        radii = np.array([sphere.radius for sphere in spheres], dtype=np.float64)
        x, y, z = centres.T
        self.spheres = centres, radii, np.sqrt(x * x + y * y + z * z) + radii
        self.ends = np.ascontiguousarray(pairs[:, 0]), np.ascontiguousarray(pairs[:, 1])

    def candidates(self, motion: Motion) -> tuple[ByteArray, int]:
        """CLEAR, CANDIDATE or NO_POSE for every frame and pair, (T, P), and how many were tested."""
        verdict = np.empty((len(motion), len(self.ends[0])), dtype=np.uint8)
        poses, room = (motion.rotations, motion.translations), sphere_room(len(self.spheres[0]))
        return verdict, int(sphere_verdicts(poses, motion.valid, self.spheres, self.ends, room, verdict))
