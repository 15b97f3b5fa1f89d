"""Spheres and boxes of one frame after another, as ``BroadPhase`` decides them, in one call of a kernel a frame.

What they leave is asked of a narrow phase, pair by pair.
"""

from collections import Counter
from collections.abc import Callable, Collection
from time import perf_counter
from typing import Final, NamedTuple

import numpy as np

from cdcore.broad.box_stage import boxes_may_meet
from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.sphere_stage import CANDIDATE, CLEAR, NO_POSE, Arrays, fill_sphere_verdicts
from cdcore.kernels.compiling import hot_kernel, kernel
from cdcore.kernels.memory import doubles_of
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray
from cdcore.poses.kernels import copy_pose, length_moved, same_pose
from cdcore.protocol import Motion
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

Decide = Callable[[Motion, int, float], tuple[int, bool]]
"""``(now, pair, margin)``: the verdict of one pair in a motion of one frame, and whether its surfaces are known to be
apart by the margin."""

DecideInside = Callable[[Motion, int, float], tuple[int, float]]
"""``(now, pair, clearance)``: the verdict of a pair whose surfaces are CLEAR, by whether one body is inside the other,
and the metres by which points may move before holes could change it; ``clearance``: what is left of the last ones."""


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


@kernel
def decide_by_volumes(
    poses: Arrays,
    valid: BoolArray,
    spheres: Arrays,
    boxes: Arrays,
    ends: tuple[IntArray, IntArray],
    memory: Arrays,
    near: IntArray,
    verdict: ByteArray,
) -> int:
    """Write to ``verdict`` (P,) what volumes decide about one frame; returns how many pairs are left, in ``near`` (P,).

    A pair keeps its verdict if neither body moved, or as long as its steps leave anything of its margin: until points
    have moved by the distance of two surfaces, they neither meet nor pass through each other. What is left shrinks
    from frame to frame, since a sum of all steps would lose small ones after a long way. ``memory``: last poses,
    steps (N,), margins and clearances (P,).
    """
    first, second = ends
    last_rotation, last_translation, steps, margins, clearances = memory
    sphere_verdict = np.empty((1, len(first)), dtype=np.uint8)
    sphere_room = np.empty((len(steps), 3)), np.empty(len(steps))
    box_room = np.empty((3, 3)), np.empty(3), np.empty((3, 3)), np.empty(3)
    note_moves(poses, valid, spheres, (last_rotation, last_translation), steps)
    fill_sphere_verdicts(poses, valid, spheres, ends, sphere_room, sphere_verdict)
    count = 0
    for p in range(len(first)):
        a, b = first[p], second[p]
        step = steps[a] + steps[b]
        margins[p] -= step
        clearances[p] -= step
        if sphere_verdict[0, p] == NO_POSE:
            verdict[p] = NO_POSE
        elif verdict[p] == NO_POSE or (step > 0.0 and not margins[p] > 0.0):
            verdict[p] = CLEAR
            if sphere_verdict[0, p] == CANDIDATE and boxes_may_meet(0, a, b, poses, boxes, box_room):
                near[count] = p
                count += 1
    return count


class LivePairs:
    """Looks of the volumes of a ``BroadPhase``, then of a narrow phase pair by pair.

    ``decide`` gives the verdict of a pair whose surfaces are asked about; ``inside``, that of a pair whose surfaces are
    CLEAR, by whether one body is inside the other; ``None`` where that is not asked. ``holed`` are pairs whose bodies
    can get into each other through a hole: that surfaces are apart keeps their verdict no longer than their clearance.
    ``verdict`` (P,): the answer of the last look.
    """

    def __init__(
        self,
        broad: BroadPhase,
        decide: Decide,
        inside: DecideInside | None,
        holed: Collection[int] = (),
    ) -> None:
        self._decide, self._inside, spheres = decide, inside, broad.spheres
        self._holed = frozenset(holed)
        self._volumes = spheres.spheres, broad.boxes.boxes, spheres.ends
        self._ends = list(zip(*spheres.ends, strict=True))
        bodies, pairs = len(spheres.spheres[0]), len(self._ends)
        self._steps, self._margins, self._clearances = np.zeros(bodies), np.zeros(pairs), np.zeros(pairs)
        last_poses = np.full((bodies, 3, 3), np.nan), np.full((bodies, 3), np.nan)
        self._memory = *last_poses, self._steps, self._margins, self._clearances
        self._named = np.empty(pairs, dtype=np.int64)
        self._reach, self._waits = [SKIPS.first_reach] * pairs, [0] * pairs
        self.verdict: ByteArray = np.full(pairs, NO_POSE, dtype=np.uint8)
        self._clock = (0.0, 0.0, 0.0, 0.0)
        self._samples = self._surfaces = self._insides = 0

    def near(self, now: Motion) -> list[int]:
        """The pairs that may meet in a motion of one frame, by number; not those that keep their verdict."""
        poses = now.rotations, now.translations
        count = decide_by_volumes(poses, now.valid, *self._volumes, self._memory, self._named, self.verdict)
        near: list[int] = self._named[:count].tolist()
        return near

    def _margin(self, pair: int) -> float:
        """Metres by which it is worth to know that the surfaces of a pair are apart: some steps as long as the last."""
        if self._waits[pair]:
            self._waits[pair] -= 1
            return 0.0
        a, b = self._ends[pair]
        margin = float(self._steps[a] + self._steps[b]) * self._reach[pair]
        return margin if margin < np.inf else 0.0

    def keep_margin(self, pair: int, margin: float, separated: bool) -> None:
        """Keep the verdict of a pair until its bodies moved by the margin, if its surfaces are ``separated`` by it."""
        if separated:
            self._margins[pair] = margin * MARGIN_FRACTION
            self._reach[pair] = min(2.0 * self._reach[pair], SKIPS.most_reach)
        elif margin > 0.0:
            self._waits[pair] = SKIPS.wait if self._reach[pair] == SKIPS.least_reach else 0
            self._reach[pair] = max(0.25 * self._reach[pair], SKIPS.least_reach)

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds of the last sample, by stage."""
        start, near, surfaces, end = self._clock
        return {"volumes": near - start, "surfaces": surfaces - near, "containment": end - surfaces}

    @property
    def work(self) -> Counter[str]:
        """Counters of all samples so far."""
        return Counter(looks=self._samples, surface_queries=self._surfaces, containment_tests=self._insides)

    def look(self, now: Motion) -> ByteArray:
        """Verdicts of all pairs (P,) in a motion of one frame; see ``Live.look``."""
        start, verdict = perf_counter(), self.verdict
        columns = self.near(now)
        volumes_done = perf_counter()
        for column in columns:
            margin = self._margin(column)
            verdict[column], separated = self._decide(now, column, margin)
            self.keep_margin(column, margin, separated)
        surfaces = perf_counter()
        if self._inside is not None and columns:
            clear = [column for column in columns if verdict[column] == CLEAR]
            for column in clear:
                verdict[column], clearance = self._inside(now, column, self._clearances[column])
                self._clearances[column] = clearance
                if column in self._holed:
                    self._margins[column] = min(self._margins[column], clearance)
            self._insides += len(clear)
        self._samples += 1
        self._surfaces += len(columns)
        self._clock = start, volumes_done, surfaces, perf_counter()
        return verdict.copy()
