"""Skips of live frames: a pair keeps its verdict until its bodies may have moved by the gap of its surfaces.

A narrow phase that finds surfaces apart by a margin lets as much of the bodies' steps pass before it is asked again.
Frames of a whole motion are skipped in ``cdcore.narrow.bvh.frame_skips``.
"""

from typing import Final, NamedTuple

import numpy as np

from cdcore.broad.sphere_stage import Arrays
from cdcore.kernels.compiling import hot_kernel
from cdcore.kernels.memory import doubles_of
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.poses.kernels import copy_pose, length_moved, same_pose
from cdcore.tolerances import EPS

STEP_ULPS: Final = 64.0
"""In eps of a body's size and distance: placing a point rounds by less than 8, twice."""
MARGIN_FRACTION: Final = 1.0 - 1e-6
"""Share of a margin that steps may use up: taking one off rounds by 1e-16 of it, and 1e9 frames may follow."""


class SkipSchedule(NamedTuple):
    """How many steps ahead a pair is tested, so that samples can be skipped while its surfaces are far apart.

    Two thirds of the tree searches of the bench are left out so (2026-11): 2.6 of a python-fcl loop became 1.6 to 1.8.
    """

    first_reach: float = 4.0
    """Steps ahead at the first test of a pair."""
    least_reach: float = 1.5
    """Fewest steps ahead: a quarter as many after each test that fails."""
    most_reach: float = 16.0
    """Most steps ahead: twice as many after each test that succeeds."""
    wait: int = 3
    """Samples without such a test after one that failed at the least reach: ``aabb`` and ``obb`` take 0.93 of the time
    so, ``exact`` 0.97 (2026-11); 7 samples and 31 save less."""


SKIPS: Final = SkipSchedule()


@hot_kernel
def note_moves(poses: Arrays, valid: BoolArray, spheres: Arrays, last_poses: Arrays, steps: FloatArray) -> None:
    """Fill ``steps`` (N,): how far any point of a body may have moved since its last pose.

    0 only of a pose that is bit for bit the last one; infinity of the first. ``last_poses``: rotations (N, 3, 3) and
    translations (N, 3), NaN before the first.
    """
    rotation, translation = poses
    last_rotation, last_translation = last_poses
    centres, radii, _ = spheres
    positions, rotations = doubles_of(translation), doubles_of(rotation)
    last_positions, last_rotations = doubles_of(last_translation), doubles_of(last_rotation)
    for body in range(len(steps)):
        steps[body] = 0.0
        if not valid[0, body]:
            continue
        now_rotation, now_translation = rotation[0, body], translation[0, body]
        if same_pose(positions, rotations, body, last_positions, last_rotations, body):
            continue
        size = radii[body]
        for i in range(3):
            size += abs(now_translation[i]) + abs(centres[body, i])
        moved = length_moved(
            now_rotation, now_translation, last_rotation[body], last_translation[body], centres[body], radii[body]
        )
        step = moved * (1.0 + 1e-9) + STEP_ULPS * EPS * size
        steps[body] = step if step == step else np.inf
        copy_pose(now_rotation, now_translation, last_rotation[body], last_translation[body])


@hot_kernel
def pair_is_skipped(step: float, pair: int, margins: FloatArray, clearances: FloatArray) -> bool:
    """Take the steps of both bodies off what is left of a pair; returns whether it keeps its verdict in this frame.

    It does if neither body moved, or as long as its steps leave anything of its margin: until points have moved by the
    distance of two surfaces, they neither meet nor pass through each other. What is left shrinks from frame to frame,
    since a sum of all steps would lose small ones after a long way.
    """
    margins[pair] -= step
    clearances[pair] -= step
    return step == 0.0 or margins[pair] > 0.0


class LiveSkips:
    """The rest of the margin and of the clearance of each pair (P,), and how far ahead its surfaces are tested.

    ``memory``: what kernels write: last poses, ``steps`` (N,) of the bodies, ``margins`` and ``clearances`` (P,).
    """

    def __init__(self, bodies: int, ends: tuple[IntArray, IntArray]) -> None:
        self._ends = list(zip(*ends, strict=True))
        pairs = len(self._ends)
        self._steps, self._margins, self.clearances = np.zeros(bodies), np.zeros(pairs), np.zeros(pairs)
        last_poses = np.full((bodies, 3, 3), np.nan), np.full((bodies, 3), np.nan)
        self.memory = *last_poses, self._steps, self._margins, self.clearances
        self._reach, self._waits = [SKIPS.first_reach] * pairs, [0] * pairs

    def margin(self, pair: int) -> float:
        """Metres by which it is worth to know that the surfaces of a pair are apart: some steps as long as the last."""
        if self._waits[pair]:
            self._waits[pair] -= 1
            return 0.0
        a, b = self._ends[pair]
        margin = float(self._steps[a] + self._steps[b]) * self._reach[pair]
        return margin if margin < np.inf else 0.0

    def keep_margin(self, pair: int, margin: float, separated: bool) -> None:
        """Skip a pair until its bodies moved by the margin, if its surfaces are ``separated`` by it."""
        if separated:
            self._margins[pair] = margin * MARGIN_FRACTION
            self._reach[pair] = min(2.0 * self._reach[pair], SKIPS.most_reach)
        elif margin > 0.0:
            self._waits[pair] = SKIPS.wait if self._reach[pair] == SKIPS.least_reach else 0
            self._reach[pair] = max(0.25 * self._reach[pair], SKIPS.least_reach)

    def keep_clearance(self, pair: int, clearance: float, *, holed: bool) -> None:
        """Keep the metres by which points may move before holes could change the verdict; of a holed pair no longer."""
        self.clearances[pair] = clearance
        if holed:
            self._margins[pair] = min(self._margins[pair], clearance)
