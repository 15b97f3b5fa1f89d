"""The sphere stage over a whole motion: padded so that rounding never rejects bodies that touch.

``candidate iff |c_A - c_B| <= d_A + d_B + 16 eps (size_A + size_B)`` with ``size = |o| + |t|_inf + d``. Touching
counts, and nothing is squared before it is padded. The size is that of the numbers that were rounded, not of the
centre they gave: a pad from the world centre missed 1,478 of 3,000 tangent pairs of meshes that lie 1 km from their
own origin.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdcore.bounding.bounding_sphere import Sphere
from cdcore.kernels.compiling import hot_kernel, kernel
from cdcore.numerics import EPS, PAD_ULPS, UNDERFLOW_PAD, BoolArray, ByteArray, FloatArray, IntArray
from cdcore.protocol import Motion, Verdict

CLEAR, CANDIDATE, NO_POSE = np.uint8(Verdict.CLEAR), np.uint8(Verdict.CANDIDATE), np.uint8(Verdict.NO_POSE)


@kernel
def place_centres(
    rotation: FloatArray, translation: FloatArray, valid: BoolArray, centres: FloatArray, radii: FloatArray,
    world: FloatArray, path: FloatArray, size: FloatArray,
) -> None:  # fmt: skip
    """World centres (N, T, 3), path lengths (N, T) and sizes ``|o| + |t|_inf + d`` (N, T) of all bodies.

    Without a pose the centre stays where it was, so that a gap adds no path.
    """
    frames, bodies = valid.shape
    for k in range(bodies):
        ox, oy, oz = centres[k, 0], centres[k, 1], centres[k, 2]
        rest = np.sqrt(ox * ox + oy * oy + oz * oz) + radii[k]
        length = 0.0
        x = y = z = largest = 0.0
        known = False
        for t in range(frames):
            if valid[t, k]:
                r = rotation[t, k]
                tx, ty, tz = translation[t, k, 0], translation[t, k, 1], translation[t, k, 2]
                nx = ((r[0, 0] * ox + r[0, 1] * oy) + r[0, 2] * oz) + tx
                ny = ((r[1, 0] * ox + r[1, 1] * oy) + r[1, 2] * oz) + ty
                nz = ((r[2, 0] * ox + r[2, 1] * oy) + r[2, 2] * oz) + tz
                if known:
                    length += np.sqrt((nx - x) ** 2 + (ny - y) ** 2 + (nz - z) ** 2)
                known = True
                x, y, z = nx, ny, nz
                largest = max(abs(tx), abs(ty), abs(tz))
            world[k, t, 0], world[k, t, 1], world[k, t, 2] = x, y, z
            path[k, t] = length
            size[k, t] = rest + largest


@hot_kernel
def last_certain_frame(path_a: FloatArray, path_b: FloatArray, frame: int, gap: float) -> int:
    """The last frame until which both centres together move less than ``gap``: gallop, then bisect."""
    last = len(path_a) - 1
    start = path_a[frame] + path_b[frame]
    low, step = frame, 1
    while low + step <= last and (path_a[low + step] + path_b[low + step]) - start < gap:
        low += step
        step *= 2
    high = min(low + step, last + 1)
    while high - low > 1:
        middle = (low + high) // 2
        if (path_a[middle] + path_b[middle]) - start < gap:
            low = middle
        else:
            high = middle
    return low


@kernel
def sphere_verdicts(
    first: IntArray, second: IntArray, valid: BoolArray, radii: FloatArray, world: FloatArray, path: FloatArray,
    size: FloatArray, pad: float, skip: bool, verdict: ByteArray,
) -> tuple[int, int]:  # fmt: skip
    """Fill ``verdict`` (T, P) with CLEAR, CANDIDATE or NO_POSE; returns (tests done, pair-frames skipped).

    ``pad`` is in units of size. A skip must not depend on rounding: it is taken only where the gap exceeds the largest
    pad of the motion and what the path sums and the distances may have lost.
    """
    frames = valid.shape[0]
    tests = skipped = 0
    for p in range(len(first)):
        a, b = first[p], second[p]
        reach = radii[a] + radii[b] + UNDERFLOW_PAD
        largest = size[a].max() + size[b].max()
        slack = pad * largest + (frames + 8) * 2.3e-16 * (path[a, -1] + path[b, -1])
        t = 0
        while t < frames:
            if not (valid[t, a] and valid[t, b]):
                verdict[t, p] = NO_POSE
                t += 1
                continue
            tests += 1
            x = world[a, t, 0] - world[b, t, 0]
            y = world[a, t, 1] - world[b, t, 1]
            z = world[a, t, 2] - world[b, t, 2]
            distance = np.sqrt(x * x + y * y + z * z)
            # Asked this way round, a distance that overflowed to NaN is a candidate.
            if not distance > reach + pad * (size[a, t] + size[b, t]):
                verdict[t, p] = CANDIDATE
                t += 1
                continue
            verdict[t, p] = CLEAR
            stop = t + 1
            gap = (distance - reach) - pad * largest - slack
            if skip and gap > 0.0:
                stop = last_certain_frame(path[a], path[b], t, gap) + 1
            for f in range(t + 1, stop):
                if valid[f, a] and valid[f, b]:
                    verdict[f, p] = CLEAR
                    skipped += 1
                else:
                    verdict[f, p] = NO_POSE
            t = stop
    return tests, skipped


@dataclass(frozen=True, eq=False)
class VolumeAnswer:
    """Verdicts (T, P) of volumes: CLEAR, CANDIDATE or NO_POSE; and counters of what that took."""

    verdict: ByteArray
    work: dict[str, int]


class SphereStage:
    """Finds the pair-frames whose spheres, one a body, overlap; ``pairs`` (P, 2) are body numbers.

    *For a short time, made exact*: where two spheres are apart by a gap, with ``skip`` the pair is not looked at again
    before the recorded paths of both centres add up to that gap. The trajectory is known, so nothing can be missed;
    verdicts with and without skipping are identical.
    """

    def __init__(self, spheres: Sequence[Sphere], pairs: IntArray, *, skip: bool = True) -> None:
        self.centres: FloatArray = np.array([sphere.centre for sphere in spheres]).reshape(-1, 3)
        self.radii: FloatArray = np.array([sphere.radius for sphere in spheres], dtype=np.float64)
        self.first = np.ascontiguousarray(pairs[:, 0])
        self.second = np.ascontiguousarray(pairs[:, 1])
        self._skip = skip

    def candidates(self, motion: Motion) -> VolumeAnswer:
        """Answer for every frame and pair of the motion; counts sphere tests, and pair-frames that needed none."""
        frames, bodies = motion.valid.shape
        verdict = np.zeros((frames, len(self.first)), dtype=np.uint8)
        if frames == 0 or len(self.first) == 0:
            return VolumeAnswer(verdict, {"sphere_tests": 0, "skipped": 0})
        world, path, size = np.empty((bodies, frames, 3)), np.empty((bodies, frames)), np.empty((bodies, frames))
        place_centres(motion.rotations, motion.translations, motion.valid, self.centres, self.radii, world, path, size)
        tests, skipped = sphere_verdicts(
            self.first, self.second, motion.valid, self.radii, world, path, size, PAD_ULPS * EPS, self._skip, verdict
        )
        return VolumeAnswer(verdict, {"sphere_tests": int(tests), "skipped": int(skipped)})
