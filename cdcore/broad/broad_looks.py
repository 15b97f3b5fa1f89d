"""Spheres and boxes of one frame after another, as ``BroadPhase`` decides them, in one call of a kernel a frame."""

from __future__ import annotations

import numpy as np

from cdcore.broad.box_stage import BOX_PAD_ULPS, boxes_may_meet
from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.sphere_stage import CANDIDATE, CLEAR, NO_POSE, place_centres, sphere_verdicts
from cdcore.kernels.compiling import kernel
from cdcore.numerics import EPS, PAD_ULPS, BoolArray, ByteArray, FloatArray, IntArray
from cdcore.protocol import Motion


@kernel
def note_moves(
    rotation: FloatArray, translation: FloatArray, valid: BoolArray, before: FloatArray, moved: BoolArray
) -> None:
    """Fill ``moved`` (N,): whether a body's pose is not bit for bit its last one, ``before`` (N, 12), and keep it."""
    for body in range(len(moved)):
        moved[body] = False
        if not valid[0, body]:
            continue
        for k in range(12):
            entry = rotation[0, body, k // 3, k % 3] if k < 9 else translation[0, body, k - 9]
            if entry != before[body, k]:
                moved[body] = True
                before[body, k] = entry


@kernel
def look_at_volumes(
    rotation: FloatArray, translation: FloatArray, valid: BoolArray, centres: FloatArray, radii: FloatArray,
    box_centres: FloatArray, axes: FloatArray, halves: FloatArray, sizes: FloatArray, first: IntArray, second: IntArray,
    before: FloatArray, moved: BoolArray, spheres: ByteArray, near: IntArray, verdict: ByteArray,
) -> int:  # fmt: skip
    """Write to ``verdict`` (P,) what volumes decide about one frame; returns how many pairs are left, in ``near`` (P,).

    A pair neither of whose bodies moved keeps its verdict. ``spheres`` (1, P) is scratch.
    """
    bodies, count = len(radii), 0
    world, path, size = np.empty((bodies, 1, 3)), np.empty((bodies, 1)), np.empty((bodies, 1))
    note_moves(rotation, translation, valid, before, moved)
    place_centres(rotation, translation, valid, centres, radii, world, path, size)
    sphere_verdicts(first, second, valid, radii, world, path, size, PAD_ULPS * EPS, False, spheres)
    for p in range(len(first)):
        if spheres[0, p] == NO_POSE:
            verdict[p] = NO_POSE
        elif verdict[p] == NO_POSE or moved[first[p]] or moved[second[p]]:
            verdict[p] = CLEAR
            if spheres[0, p] == CANDIDATE:
                near[count] = p
                count += 1
    a, b, meets = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64), np.empty(count, dtype=np.bool_)
    for k in range(count):
        a[k], b[k] = first[near[k]], second[near[k]]
    boxes_may_meet(
        np.zeros(count, dtype=np.int64), a, b, rotation, translation, box_centres, axes, halves, sizes,
        BOX_PAD_ULPS * EPS, meets,
    )  # fmt: skip
    left = 0
    for k in range(count):
        if meets[k]:
            near[left] = near[k]
            left += 1
    return left


class BroadLooks:
    """The volumes of a ``BroadPhase``, asked one frame after the other.

    ``verdict`` (P,): the answer of the last look; the caller writes into it what it decides about the pairs named.
    """

    def __init__(self, broad: BroadPhase) -> None:
        spheres, boxes = broad.spheres, broad.boxes
        bodies, pairs = len(spheres.radii), len(spheres.first)
        self._volumes = (spheres.centres, spheres.radii, boxes.centres, boxes.axes, boxes.halves, boxes.sizes)
        self._pairs = spheres.first, spheres.second
        self._near = np.empty(pairs, dtype=np.int64)
        self.verdict: ByteArray = np.full(pairs, NO_POSE, dtype=np.uint8)
        self._memory = (
            np.full((bodies, 12), np.nan), np.empty(bodies, dtype=np.bool_), np.empty((1, pairs), dtype=np.uint8),
            self._near, self.verdict,
        )  # fmt: skip

    def near(self, now: Motion) -> list[int]:
        """The pairs that may meet in a motion of one frame, by number; not those that stand as they were answered."""
        count = look_at_volumes(now.rotations, now.translations, now.valid, *self._volumes, *self._pairs, *self._memory)
        near: list[int] = self._near[:count].tolist()
        return near
