"""Which contacts hold in spite of tracker noise: the oracle asked again about noisy copies of the recording."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore import Body, Detection, Detector, Motion
from cdcore.bounding.sphere import Sphere, sphere_by_box_centre
from cdcore.narrow.fcl_meshes import FclMeshes
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import counts_as_contact
from replay.base.progress import Advance
from replay.comparison.episodes import column_runs
from replay.comparison.outcome import Episode
from replay.prepare.assembly import Assembly
from replay.prepare.noise import BodyNoise, NoisyCopies, joined_spans

COPIES: Final = 64
HOLDS, UNDECIDABLE, ABSENT = "holds", "undecidable", "absent"

SURE: Final = 0.95
"""Share of the copies from which a contact holds; found in at most the rest, it is absent."""

WIDENED_S: Final = 0.1
"""A contact is found in a copy that has one of the same pair at most this long before or after it."""

REST_S: Final = 1.0
"""Frames that the noise leaves open for this long are bodies at rest on each other: one statement for all of them."""

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
    """What noise leaves of the contacts of a recording.

    Parameters
    ----------
    copies : number of noisy copies.
    contacts : of every contact of the oracle, in its order, how many copies have it.
    words : the same in a word; a contact of bodies at rest on each other is undecidable.
    near : stretches without contact in the recording in which copies have some.
    resting : stretches of a second and more whose frames are open: bodies at rest on each other.
    open_frames : pair-frames with contact in some copies and not in others.
    asked, frames : pair-frames that copies were asked about, and all there are; the others are farther apart than the
        noise reaches, or further in.
    digest : of all answers.
    """

    copies: int
    contacts: tuple[NoisySpan, ...]
    words: tuple[str, ...]
    near: tuple[NoisySpan, ...]
    resting: tuple[NoisySpan, ...]
    open_frames: int
    asked: int
    frames: int
    digest: str

    def count(self, word: str) -> int:
        """Contacts of a word."""
        return self.words.count(word)


def noisy_contacts(
    assembly: Assembly, oracle: Detection, contacts: Sequence[Episode], noise: BodyNoise,
    make: Callable[[int], Detector], *, copies: int = COPIES, seed: int = 0, advance: Advance = lambda _: None,
) -> NoiseResult:  # fmt: skip
    """Ask noisy copies of a recording, where noise can change the answer.

    ``oracle``: what it said of the recording itself, and ``contacts`` its episodes; ``make``: column of a pair -> the
    oracle for its two bodies; ``advance`` is told frames. The answer does not depend on the size of blocks.
    """
    motion, touching = assembly.motion, counts_as_contact(oracle.verdict)
    near = np.stack(
        [_near(assembly, column, touching[:, column], noise) for column in range(len(assembly.pairs))], axis=1
    )
    windows = [_widened(one, motion.times) for one in contacts]
    windows += _between(near, windows, motion.times)
    found = np.zeros((len(windows), copies), dtype=np.bool_)
    counts = np.where(touching & ~near, copies, 0).astype(np.int64)
    detectors = {int(column): make(int(column)) for column in np.flatnonzero(near.any(axis=0))}
    drawn = NoisyCopies(noise, copies, seed)
    for start in range(0, len(motion), BLOCK):
        block = motion.frames(start, min(start + BLOCK, len(motion)))
        errors = drawn.errors(block.times)
        for column, detector in detectors.items():
            rows = near[start : start + len(block), column]
            if rows.any():
                said = _asked(detector, block, assembly.pairs[column], rows, drawn, errors)
                where = np.flatnonzero(rows) + start
                counts[where, column] = said.sum(axis=0)
                for number, (pair, first, last) in enumerate(windows):
                    if pair == column and first <= where[-1] and last >= where[0]:
                        found[number] |= said[:, (where >= first) & (where <= last)].any(axis=1)
        advance(len(block))
    for number, (pair, first, last) in enumerate(windows):
        found[number] |= bool((counts[first : last + 1, pair] == copies).any())
    return _result(motion.times, windows, len(contacts), found, counts, near)


def _result(
    times: FloatArray, windows: Sequence[tuple[int, int, int]], contacts: int, found: BoolArray, counts: IntArray,
    near: BoolArray,
) -> NoiseResult:  # fmt: skip
    copies = found.shape[1]
    spans = [NoisySpan(*window, float(one.mean())) for window, one in zip(windows, found, strict=True)]
    open_ = (counts > (1.0 - SURE) * copies + 1e-9) & (counts < SURE * copies)
    resting = tuple(_resting(open_, counts / copies, times))
    rests = [_at_rest(one, resting) for one in spans]
    words = tuple(UNDECIDABLE if rest else one.word for one, rest in zip(spans[:contacts], rests, strict=False))
    near_passes = (one for one, rest in zip(spans[contacts:], rests[contacts:], strict=True) if not rest)
    digest = hashlib.sha256(np.ascontiguousarray(counts, dtype="<u2").tobytes() + found.tobytes()).hexdigest()
    return NoiseResult(
        copies, tuple(spans[:contacts]), words, tuple(one for one in near_passes if one.word != ABSENT), resting,
        int(open_.sum()), int(near.sum()), near.size, digest,
    )  # fmt: skip


def _near(assembly: Assembly, column: int, touching: BoolArray, noise: BodyNoise) -> BoolArray:
    """Frames (T,) of a pair in which noise may change the answer: surfaces meet, or are nearer than it reaches.

    Each distance holds for all frames in which the bodies have moved less against each other than what it leaves over.
    """
    ends = [int(end) for end in assembly.pairs[column]]
    bodies, motion = [assembly.bodies[end] for end in ends], assembly.motion
    reach = float(np.linalg.norm([noise.reach(end, _lever(body)) for end, body in zip(ends, bodies, strict=True)]))
    surfaces = FclMeshes([body.mesh for body in bodies])
    near = np.zeros(len(motion), dtype=np.bool_)
    if not reach:
        return near
    for start in range(0, len(motion), BLOCK):
        block = motion.frames(start, min(start + BLOCK, len(motion)))
        known = block.valid[:, ends].all(axis=1)
        rows = np.flatnonzero(known & (_sphere_gap(bodies, block, ends) <= reach))
        meets = touching[start : start + len(block)]
        near[start + rows] = _within(surfaces, block, ends, rows, meets[rows], reach, _lever(bodies[1]))
    return near


def _within(
    surfaces: FclMeshes, motion: Motion, ends: Sequence[int], rows: IntArray, meets: BoolArray, reach: float,
    lever: float,
) -> BoolArray:  # fmt: skip
    """Which of some rows, in order, have surfaces that meet or are at most ``reach`` apart."""
    turn = [motion.rotations[rows, end] for end in ends]
    place = [motion.translations[rows, end] for end in ends]
    back = np.swapaxes(turn[0], 1, 2)
    rotation, offset = back @ turn[1], (back @ (place[1] - place[0])[..., None])[..., 0]
    near, k = meets.copy(), 0
    while k < len(rows):
        if meets[k]:
            k += 1
            continue
        for body in range(2):
            surfaces.place_known(body, turn[body][k], place[body][k])
        left = surfaces.distance(0, 1) - reach
        moved = np.linalg.norm(offset[k:] - offset[k], axis=1)
        # The spectral norm of a difference of rotations is its Frobenius norm over the root of two.
        moved += lever * np.linalg.norm(rotation[k:] - rotation[k], axis=(1, 2)) / np.sqrt(2.0)
        beyond = np.flatnonzero((moved >= abs(left)) | meets[k:])
        stop = k + max(1, int(beyond[0]) if len(beyond) else len(rows) - k)
        near[k:stop] |= left <= 0.0
        k = stop
    return near


def _lever(body: Body) -> float:
    return float(np.linalg.norm(body.mesh.referenced_vertices, axis=1).max())


def _sphere_gap(bodies: Sequence[Body], motion: Motion, ends: Sequence[int]) -> FloatArray:
    """Metres (T,) between the bounding spheres of two bodies; below 0 where they overlap."""
    spheres: list[Sphere] = [sphere_by_box_centre(body.mesh) for body in bodies]
    centres = [
        (motion.rotations[:, end] @ np.asarray(one.centre)) + motion.translations[:, end]
        for one, end in zip(spheres, ends, strict=True)
    ]
    gap: FloatArray = np.linalg.norm(centres[0] - centres[1], axis=1) - sum(one.radius for one in spheres)
    return gap


def _asked(
    detector: Detector, block: Motion, pair: IntArray, rows: BoolArray, drawn: NoisyCopies,
    errors: dict[str, tuple[FloatArray, FloatArray]],
) -> BoolArray:  # fmt: skip
    """Contact (C, k) of one pair in every copy, at k rows of a block."""
    turn, place = zip(*(drawn.poses(block, errors, int(end), rows) for end in pair), strict=True)
    count = drawn.copies * int(rows.sum())
    motion = Motion(np.arange(count) / 90.0, np.stack(place, axis=1), np.stack(turn, axis=1))
    return counts_as_contact(detector.detect(motion).verdict[:, 0]).reshape(drawn.copies, -1)


def _widened(contact: Episode, times: FloatArray) -> tuple[int, int, int]:
    first = int(np.searchsorted(times, times[contact.first] - WIDENED_S))
    last = int(np.searchsorted(times, times[contact.last] + WIDENED_S, side="right")) - 1
    return contact.pair, first, last


def _between(near: BoolArray, windows: Sequence[tuple[int, int, int]], times: FloatArray) -> list[tuple[int, int, int]]:
    """Near passes: frames in reach of the noise that belong to no contact, those close in time as one."""
    free = near.copy()
    for pair, first, last in windows:
        free[first : last + 1, pair] = False
    return [(pair, *span) for pair, span in _spans(free, times)]


def _spans(mask: BoolArray, times: FloatArray) -> Iterator[tuple[int, tuple[int, int]]]:
    found = column_runs(mask.T)
    for pair in range(mask.shape[1]):
        spans = [(first, last) for _, first, last in found[found[:, 0] == pair].tolist()]
        yield from ((pair, span) for span in joined_spans(spans, times, WIDENED_S))


def _resting(open_: BoolArray, share: FloatArray, times: FloatArray) -> Iterator[NoisySpan]:
    for pair, (first, last) in _spans(open_, times):
        if times[last] - times[first] >= REST_S:
            yield NoisySpan(pair, first, last, float(share[first : last + 1, pair].mean()))


def _at_rest(span: NoisySpan, resting: Sequence[NoisySpan]) -> bool:
    """Whether most of a span lies in stretches at rest."""
    frames = sum(
        max(0, min(span.last, one.last) - max(span.first, one.first) + 1) for one in resting if one.pair == span.pair
    )
    return 2 * frames > span.last - span.first + 1
