"""Which contacts hold in spite of tracker noise: the oracle asked again about noisy copies of the recording."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np

from cdcore import Body, Detection, Detector, Motion
from cdcore.bounding.sphere import sphere_by_box_centre
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray
from cdcore.protocol import counts_as_contact
from replay.base.constants import HEADSET_HZ
from replay.base.progress import Advance
from replay.comparison.outcome import Episode
from replay.detection.run_detector import Run, make_detector
from replay.errors import NoiseError
from replay.prepare.assembly import Assembly
from replay.prepare.noise import BodyNoise, NoiseSpec, NoisyCopies, noise_of
from sessions import Scene

HOLDS, UNDECIDABLE, ABSENT = "holds", "undecidable", "absent"

SURE: Final = 0.95
"""Share of the copies from which a contact holds; found in at most the rest, it is absent."""

WIDENED_S: Final = 0.1
"""A contact is found in a copy that has one of the same pair at most this long before or after it."""

REST_S: Final = 1.0
"""Copies that disagree for this long are about bodies at rest on each other: one statement for all of the stretch."""

AGREED_S: Final = 0.2
"""For less than this all copies may agree meanwhile: thrice the time over which the noise of a tracker correlates."""

BLOCK: Final = 1024
"""Frames drawn at once: 64 copies of 12 bodies take 38 MB."""


@dataclass(frozen=True)
class NoisySpan:
    """Frames ``first`` to ``last`` of a pair (column), and the share of the copies with contact there."""

    pair: int
    first: int
    last: int
    share: float

    @property
    def word(self) -> str:
        """``holds``, ``undecidable`` or ``absent``."""
        return HOLDS if self.share >= SURE else ABSENT if self.share <= 1.0 - SURE + 1e-12 else UNDECIDABLE


@dataclass(frozen=True)
class NoiseResult:
    """What noise leaves of the contacts of a recording."""

    copies: int  # number of noisy copies
    contacts: tuple[NoisySpan, ...]  # of every contact of the oracle, in its order, how many copies have it
    words: tuple[str, ...]  # the same in a word; a contact of bodies at rest on each other is undecidable
    near: tuple[NoisySpan, ...]  # stretches without contact in the recording in which copies have some
    # stretches of a second and more in which copies disagree: bodies at rest on each other
    resting: tuple[NoisySpan, ...]
    open_frames: int  # pair-frames with contact in some copies and not in others
    # asked, frames: pair-frames that copies were asked about, and all there are; the others are farther apart than the
    # noise reaches, or further in
    asked: int
    frames: int
    digest: str  # of all answers
    sizes: Mapping[str, tuple[float, float, float]]  # tracker -> millimetres, degrees and seconds of its noise

    def count(self, word: str) -> int:
        """Contacts of a word."""
        return self.words.count(word)

    @property
    def settings(self) -> dict[str, Any]:
        """What was asked, as plain data; the word and the share of each contact stand in the tables of contacts."""
        return {"copies": self.copies, "sizes": {name: list(size) for name, size in self.sizes.items()}}


def in_noise(
    spec: NoiseSpec, assembly: Assembly, scene: Scene, oracle: Run, contacts: Sequence[Episode], seed: int,
    advance: Advance,
) -> NoiseResult:  # fmt: skip
    """What the oracle of a run says of noisy copies; ``NoiseError``: it does not decide at instants."""
    if oracle.detection.covers != "instants":
        raise NoiseError(f"noise is asked of a reference of instants, which {oracle.spec.name} is not; trust exact")

    def of_pair(column: int) -> Detector:
        bodies = tuple(assembly.bodies[end] for end in assembly.pairs[column])
        return make_detector(oracle.spec, replace(assembly, bodies=bodies, pairs=np.array([[0, 1]])), seed)

    noise = noise_of(spec, assembly, scene)
    return noisy_contacts(assembly, oracle.detection, contacts, noise, of_pair, spec.copies, seed, advance)


def noisy_contacts(
    assembly: Assembly, oracle: Detection, contacts: Sequence[Episode], noise: BodyNoise,
    make: Callable[[int], Detector], copies: int, seed: int, advance: Advance,
) -> NoiseResult:  # fmt: skip
    """Ask noisy copies of a recording, where noise can change the answer.

    ``oracle``: what it said of the recording itself, and ``contacts`` its episodes; ``make``: column of a pair -> the
    oracle for its two bodies; ``advance`` is told frames. The answer depends neither on the size of blocks nor on
    threads, which share nothing that changes.
    """
    motion, drawn = assembly.motion, NoisyCopies(noise, copies, seed)
    surfaces = Surfaces(assembly.bodies)
    pairs = [NoisyPair(column, ends, noise, surfaces, make) for column, ends in enumerate(assembly.pairs.tolist())]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for start in range(0, len(motion), BLOCK):
            block = motion.frames(start, min(start + BLOCK, len(motion)))
            touching, errors = counts_as_contact(oracle.verdict[start : start + len(block)]), drawn.errors(block.times)
            asked = [pool.submit(one.ask, start, block, touching[:, one.column], drawn, errors) for one in pairs]
            for one in asked:
                one.result()
            advance(len(block))
    return _result(motion.times, contacts, [one.answer() for one in pairs], copies, noise, oracle.verdict.size)


def _result(
    times: FloatArray, contacts: Sequence[Episode], answers: Sequence[PairAnswer], copies: int, noise: BodyNoise,
    size: int,
) -> NoiseResult:  # fmt: skip
    windows = [_widened(one, times) for one in contacts]
    for pair, answer in enumerate(answers):
        taken = [window[1:] for window in windows[: len(contacts)] if window[0] == pair]
        windows += [(pair, *span) for span in _between(answer.frames, taken, times)]
    spans = [NoisySpan(*window, float(answers[window[0]].found(*window[1:], copies).mean())) for window in windows]
    counts = np.concatenate([one.counts for one in answers])
    open_frames = int(((counts > (1.0 - SURE) * copies + 1e-9) & (counts < SURE * copies)).sum())
    resting = tuple(
        NoisySpan(pair, first, last, answers[pair].share(first, last, copies))
        for pair, one in enumerate(answers)
        for first, last in _spans(one.frames[(one.counts > 0) & (one.counts < copies)], times, AGREED_S)
        if times[last] - times[first] >= REST_S
    )
    at_rest = {pair: [one for one in resting if one.pair == pair] for pair in range(len(answers))}
    rests = [_at_rest(one, at_rest[one.pair]) for one in spans]
    known = len(contacts)
    words = tuple(UNDECIDABLE if rest else one.word for one, rest in zip(spans[:known], rests, strict=False))
    near_passes = (one for one, rest in zip(spans[known:], rests[known:], strict=True) if not rest)
    digest = hashlib.sha256()
    for one in answers:
        digest.update(np.concatenate([one.frames, one.certain]).astype("<i8").tobytes() + one.said.tobytes())
    sizes = {
        root: (1e3 * one.position_rms_m, one.rotation_rms_deg, one.correlation_s) for root, one in noise.noise.items()
    }
    return NoiseResult(
        copies, tuple(spans[:known]), words, tuple(one for one in near_passes if one.word != ABSENT), resting,
        open_frames, len(counts), size, digest.hexdigest(), sizes,
    )  # fmt: skip


def _widened(contact: Episode, times: FloatArray) -> tuple[int, int, int]:
    first = int(np.searchsorted(times, times[contact.first] - WIDENED_S))
    last = int(np.searchsorted(times, times[contact.last] + WIDENED_S, side="right")) - 1
    return contact.pair, first, last


def _between(frames: IntArray, taken: Sequence[tuple[int, int]], times: FloatArray) -> list[tuple[int, int]]:
    """Near passes: frames in reach of the noise that belong to no contact, those close in time as one."""
    free = np.ones(len(frames), dtype=np.bool_)
    for a, b in np.searchsorted(frames, np.add(np.reshape(taken, (-1, 2)), [0, 1])).tolist():
        free[a:b] = False
    return _spans(frames[free], times, WIDENED_S)


def _spans(frames: IntArray, times: FloatArray, apart: float) -> list[tuple[int, int]]:
    """First and last of frames that follow each other, or in less than ``apart`` seconds."""
    if not len(frames):
        return []
    cut = np.flatnonzero((np.diff(frames) > 1) & (np.diff(times[frames]) >= apart))
    return list(zip(frames[np.insert(cut + 1, 0, 0)].tolist(), frames[np.append(cut, -1)].tolist(), strict=True))


def _at_rest(span: NoisySpan, resting: Sequence[NoisySpan]) -> bool:
    """Whether most of a span lies in stretches at rest of its pair."""
    frames = sum(max(0, min(span.last, one.last) - max(span.first, one.first) + 1) for one in resting)
    return 2 * frames > span.last - span.first + 1


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
