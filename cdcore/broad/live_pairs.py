"""Spheres and boxes of one frame after another, as ``BroadPhase`` decides them, in one call of a kernel a frame.

What they leave is asked of a narrow phase, pair by pair.
"""

from collections import Counter
from collections.abc import Callable, Collection
from time import perf_counter

import numpy as np

from cdcore.broad.box_stage import boxes_may_meet
from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.live_skips import LiveSkips, note_moves, pair_is_skipped
from cdcore.broad.sphere_stage import CANDIDATE, CLEAR, NO_POSE, Arrays, fill_sphere_verdicts
from cdcore.kernels.compiling import kernel
from cdcore.numerics import BoolArray, ByteArray, IntArray
from cdcore.protocol import Motion

Decide = Callable[[Motion, int, float], tuple[int, bool]]
"""``(now, pair, margin)``: the verdict of one pair in a motion of one frame, and whether its surfaces are known to be
apart by the margin."""

DecideInside = Callable[[Motion, int, float], tuple[int, float]]
"""``(now, pair, clearance)``: the verdict of a pair whose surfaces are CLEAR, by whether one body is inside the other,
and the metres by which points may move before holes could change it; ``clearance``: what is left of the last ones."""


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

    ``memory``: that of ``LiveSkips``, which says which pairs keep their verdict.
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
        is_skipped = pair_is_skipped(steps[a] + steps[b], p, margins, clearances)
        if sphere_verdict[0, p] == NO_POSE:
            verdict[p] = NO_POSE
        elif verdict[p] == NO_POSE or not is_skipped:
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
        bodies, pairs = len(spheres.spheres[0]), len(spheres.ends[0])
        self.skips = LiveSkips(bodies, spheres.ends)
        self._named = np.empty(pairs, dtype=np.int64)
        self.verdict: ByteArray = np.full(pairs, NO_POSE, dtype=np.uint8)
        self._clock = (0.0, 0.0, 0.0, 0.0)
        self._samples = self._surfaces = self._insides = 0

    def near(self, now: Motion) -> list[int]:
        """The pairs that may meet in a motion of one frame, by number; not those that keep their verdict."""
        poses = now.rotations, now.translations
        count = decide_by_volumes(poses, now.valid, *self._volumes, self.skips.memory, self._named, self.verdict)
        near: list[int] = self._named[:count].tolist()
        return near

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
        start, verdict, skips = perf_counter(), self.verdict, self.skips
        columns = self.near(now)
        volumes_done = perf_counter()
        for column in columns:
            margin = skips.margin(column)
            verdict[column], separated = self._decide(now, column, margin)
            skips.keep_margin(column, margin, separated)
        surfaces = perf_counter()
        if self._inside is not None:
            clear = [column for column in columns if verdict[column] == CLEAR]
            for column in clear:
                verdict[column], clearance = self._inside(now, column, skips.clearances[column])
                skips.keep_clearance(column, clearance, holed=column in self._holed)
            self._insides += len(clear)
        self._samples += 1
        self._surfaces += len(columns)
        self._clock = start, volumes_done, surfaces, perf_counter()
        return verdict.copy()
