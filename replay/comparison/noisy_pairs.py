"""Noisy copies asked about one pair of bodies, in the frames in which noise may change the answer."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from cdcore import Body, Detector, Motion
from cdcore.bounding.sphere import sphere_by_box_centre
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray
from cdcore.protocol import counts_as_contact
from replay.base.constants import HEADSET_HZ
from replay.prepare.noise import BodyNoise, NoisyCopies


class Surfaces:
    """Box trees, bounding spheres and longest levers of bodies, each made once."""

    def __init__(self, bodies: Sequence[Body]) -> None:
        # Here, since a run without noise and contacts loads no compiler.
        from cdcore.narrow.spacetime.box_tree import build_box_tree

        self.trees = [build_box_tree(body.mesh.triangles) for body in bodies]
        self.spheres = [sphere_by_box_centre(body.mesh) for body in bodies]
        self.levers = [float(np.linalg.norm(body.mesh.referenced_vertices, axis=1).max()) for body in bodies]

    def gap(self, motion: Motion, ends: Sequence[int]) -> FloatArray:
        """Metres (T,) between the bounding spheres of two bodies; below 0 where they overlap."""
        one, other = (
            motion.rotations[:, end] @ np.asarray(self.spheres[end].centre) + motion.translations[:, end]
            for end in ends
        )
        gap: FloatArray = np.linalg.norm(one - other, axis=1) - sum(self.spheres[end].radius for end in ends)
        return gap


class PairAnswer(NamedTuple):
    """Of a pair: frames (k,) in reach of the noise, the copies with contact there as bits (k, ceil(C / 8)), and frames
    (n,) with a contact that no noise changes."""

    frames: IntArray
    said: ByteArray
    certain: IntArray

    @property
    def counts(self) -> IntArray:
        """How many copies have contact, (k,)."""
        return np.bitwise_count(self.said).sum(axis=1, dtype=np.int64)

    def found(self, first: int, last: int, copies: int) -> BoolArray:
        """Which copies (C,) have a contact in a span of frames."""
        rows, anyhow = self._within(first, last)
        bits = np.bitwise_or.reduce(self.said[rows], axis=0)
        return np.unpackbits(bits, count=copies).view(np.bool_) | (anyhow > 0)

    def share(self, first: int, last: int, copies: int) -> float:
        """Share of the copies with contact, in the mean over a span of frames."""
        rows, anyhow = self._within(first, last)
        return float((np.bitwise_count(self.said[rows]).sum() / copies + anyhow) / (last + 1 - first))

    def _within(self, first: int, last: int) -> tuple[slice, int]:
        (a, b), (c, d) = (np.searchsorted(some, [first, last + 1]).tolist() for some in (self.frames, self.certain))
        return slice(a, b), d - c


class NoisyPair:
    """A pair of bodies: where noise may change the answer about it, and what the copies say there."""

    def __init__(
        self, column: int, ends: Sequence[int], noise: BodyNoise, surfaces: Surfaces, make: Callable[[int], Detector]
    ) -> None:
        self.column, self._ends, self._surfaces, self._make = column, ends, surfaces, make
        self._reach = noise.reach_between(ends, [surfaces.levers[end] for end in ends])
        self._detector: Detector | None = None
        self._parts: list[tuple[IntArray, ByteArray, IntArray]] = []

    def ask(
        self, start: int, block: Motion, touching: BoolArray, drawn: NoisyCopies, errors: Mapping[str, FloatArray]
    ) -> None:
        """Ask all copies about a block that begins with frame ``start``, where the noise may change the answer."""
        near = self._near(block, touching)
        said = np.zeros((0, drawn.copies), dtype=np.bool_)
        if near.any():
            if self._detector is None:
                self._detector = self._make(self.column)
            turn, place = zip(*(drawn.poses(block, errors, end, near) for end in self._ends), strict=True)
            count = drawn.copies * int(near.sum())
            valid, times = np.ones((count, 2), dtype=np.bool_), np.arange(count) / HEADSET_HZ
            motion = Motion.of_rigid(times, np.stack(place, axis=1), np.stack(turn, axis=1), valid, valid)
            said = counts_as_contact(self._detector.detect(motion).verdict[:, 0]).reshape(drawn.copies, -1).T
        frames, certain = np.flatnonzero(near) + start, np.flatnonzero(touching & ~near) + start
        self._parts.append((frames, np.packbits(said, axis=1), certain))

    def _near(self, block: Motion, touching: BoolArray) -> BoolArray:
        """Frames (T,) in which noise may change the answer: surfaces meet, or are nearer than it reaches."""
        if not self._reach:
            return np.zeros_like(touching)
        # Here, since a run without noise and contacts loads no compiler.
        from cdcore.narrow.contact_offset import ContactOffset

        ends, reach = list(self._ends), self._reach
        known = block.valid[:, ends].all(axis=1)
        rows = np.flatnonzero(known & ~touching & (self._surfaces.gap(block, ends) <= reach))
        offset = ContactOffset([self._surfaces.trees[end] for end in ends], np.array([[0, 1]]), reach)
        poses = block.translations[:, ends], block.rotations[:, ends], block.valid[:, ends], block.linked[:, ends]
        near = touching.copy()
        near[rows] = offset.near(Motion.of_rigid(block.times, *poses), rows, np.zeros_like(rows))
        return near

    def answer(self) -> PairAnswer:
        """All that was asked."""
        frames, said, certain = (np.concatenate(some) for some in zip(*self._parts, strict=True))
        return PairAnswer(frames, said, certain)
