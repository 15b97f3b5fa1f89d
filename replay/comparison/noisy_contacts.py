"""Which contacts hold in spite of tracker noise: the oracle asked again about noisy copies of the recording."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import numpy as np

from cdcore import Body, Detection, Detector, Motion
from cdcore.bounding.sphere import Sphere, sphere_by_box_centre
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import counts_as_contact
from replay.base.constants import HEADSET_HZ
from replay.base.progress import Advance
from replay.comparison.episodes import column_runs
from replay.comparison.outcome import Episode
from replay.detection.run_detector import Run, make_detector
from replay.errors import NoiseError
from replay.prepare.assembly import Assembly
from replay.prepare.noise import BodyNoise, NoiseSpec, NoisyCopies, joined_spans, noise_of
from sessions import Scene

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
    sizes : tracker -> millimetres, degrees and seconds of its noise.
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
    sizes: Mapping[str, tuple[float, float, float]]

    def count(self, word: str) -> int:
        """Contacts of a word."""
        return self.words.count(word)

    def as_json(self) -> dict[str, Any]:
        """Plain data; the word and the share of each contact stand in the tables of contacts and misses."""
        return {
            "copies": self.copies, "sizes": {name: list(size) for name, size in self.sizes.items()},
            "contacts": {word: self.count(word) for word in (HOLDS, UNDECIDABLE, ABSENT)},
            "near": [asdict(one) for one in self.near], "resting": [asdict(one) for one in self.resting],
            "open_frames": self.open_frames, "asked": self.asked, "frames": self.frames, "digest": self.digest,
        }  # fmt: skip


def in_noise(
    spec: NoiseSpec, assembly: Assembly, scene: Scene, oracle: Run, contacts: Sequence[Episode], seed: int,
    advance: Advance,
) -> NoiseResult:  # fmt: skip
    """What the oracle of a run says of noisy copies; ``NoiseError``: it does not decide at instants."""
    if oracle.detection.covers != "instants":
        raise NoiseError(f"noise is asked of an oracle of instants, which {oracle.spec.name} is not; trust exact")

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
    sizes = {
        root: (1e3 * one.position_rms_m, one.rotation_rms_deg, one.correlation_s) for root, one in noise.noise.items()
    }
    return _result(motion.times, windows, len(contacts), found, counts, near, sizes)


def _result(
    times: FloatArray, windows: Sequence[tuple[int, int, int]], contacts: int, found: BoolArray, counts: IntArray,
    near: BoolArray, sizes: Mapping[str, tuple[float, float, float]],
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
        int(open_.sum()), int(near.sum()), near.size, digest, sizes,
    )  # fmt: skip


def _near(assembly: Assembly, column: int, touching: BoolArray, noise: BodyNoise) -> BoolArray:
    """Frames (T,) of a pair in which noise may change the answer: surfaces meet, or are nearer than it reaches."""
    ends = [int(end) for end in assembly.pairs[column]]
    bodies, motion = [assembly.bodies[end] for end in ends], assembly.motion
    reach = float(np.linalg.norm([noise.reach(end, _lever(body)) for end, body in zip(ends, bodies, strict=True)]))
    near = np.zeros(len(motion), dtype=np.bool_)
    if not reach:
        return near
    # Here, since a run without noise and contacts loads no compiler.
    from cdcore.narrow.contact_offset import ContactOffset
    from cdcore.narrow.spacetime.box_tree import build_box_tree

    surfaces = ContactOffset([build_box_tree(body.mesh.triangles) for body in bodies], np.array([[0, 1]]), reach)
    for start in range(0, len(motion), BLOCK):
        block = motion.frames(start, min(start + BLOCK, len(motion)))
        meets = touching[start : start + len(block)]
        rows = np.flatnonzero(block.valid[:, ends].all(axis=1) & (_sphere_gap(bodies, block, ends) <= reach) & ~meets)
        poses = block.translations[:, ends], block.rotations[:, ends], block.valid[:, ends]
        close = surfaces.near(Motion(block.times, *poses), rows, np.zeros_like(rows))
        near[start : start + len(block)] = meets
        near[start + rows] = close
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
    motion = Motion(np.arange(count) / HEADSET_HZ, np.stack(place, axis=1), np.stack(turn, axis=1))
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
