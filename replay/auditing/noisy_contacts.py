"""Contacts that hold in spite of tracker noise: the oracle decides noisy copies of the recording."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from cdcore import Detector, Motion
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray
from cdcore.protocol import counts_as_contact
from replay.auditing.outcome import Episode
from replay.detection.progress import Advance
from replay.detection.run_detector import Run, make_detector
from replay.errors import NoiseError
from replay.prepare.assembly import Assembly
from replay.prepare.noise import NoiseSpec, NoisyCopies, noise_of
from sessions import Scene
from sessions.model.constants import HEADSET_HZ

if TYPE_CHECKING:
    from cdcore.narrow.continuous.clearance import ContactOffset

HOLDS, UNDECIDABLE, ABSENT = "holds", "undecidable", "absent"

SURE_FRACTION: Final = 0.95
"""Share of the copies from which a contact holds; found in at most the rest, it is absent."""

CONTACT_MARGIN_S: Final = 0.1
"""A contact is found in a copy that has one of the same pair at most this long before or after it."""

REST_DISAGREEMENT_S: Final = 1.0
"""Copies that disagree for this long are about bodies at rest on each other: one statement for all of the stretch."""

LONGEST_AGREEMENT_S: Final = 0.2
"""For less than this all copies may agree meanwhile: thrice the time over which the noise of a tracker correlates."""

BLOCK_FRAMES: Final = 1024
"""Frames drawn at once: 64 copies of 12 bodies take 38 MB."""


class NoisySpan(NamedTuple):
    """Frames ``first`` to ``last`` of a pair (column), and the fraction of the copies with contact there."""

    pair: int
    first: int
    last: int
    fraction: float

    @property
    def word(self) -> str:
        """``holds``, ``undecidable`` or ``absent``."""
        return (
            HOLDS
            if self.fraction >= SURE_FRACTION
            else ABSENT
            if self.fraction <= 1.0 - SURE_FRACTION + 1e-12
            else UNDECIDABLE
        )


@dataclass(frozen=True)
class NoiseResult:
    """Contacts of a recording in its noisy copies."""

    copies: int  # number of noisy copies
    contacts: tuple[NoisySpan, ...]  # of every contact of the oracle, in its order, how many copies have it
    labels: tuple[str, ...]  # the same in a word; a contact of bodies at rest on each other is undecidable
    near: tuple[NoisySpan, ...]  # stretches without contact in the recording in which copies have some
    # stretches of a second and more in which copies disagree: bodies at rest on each other
    resting: tuple[NoisySpan, ...]
    queried: int  # pair-frames that copies were asked about; the others are farther apart than the noise reaches
    sizes: Mapping[str, tuple[float, float, float]]  # tracker -> millimetres, degrees and seconds of its noise

    def count(self, word: str) -> int:
        """Contacts of a word."""
        return self.labels.count(word)

    @property
    def settings(self) -> dict[str, Any]:
        """Return the settings as plain data; the word and the share of each contact stand in the tables of contacts."""
        return {"copies": self.copies, "sizes": {name: list(size) for name, size in self.sizes.items()}}


def in_noise(
    spec: NoiseSpec,
    assembly: Assembly,
    scene: Scene,
    oracle: Run,
    contacts: Sequence[Episode],
    seed: int,
    advance: Advance,
) -> NoiseResult:
    """Ask the oracle of a run about noisy copies of the recording, where noise can change the answer.

    ``contacts`` are its episodes; ``advance`` is told frames. The answer depends neither on the size of blocks nor on
    threads, which share nothing that changes. Raises ``NoiseError``: it does not decide at instants.
    """
    if oracle.detection.covers != "instants":
        raise NoiseError(
            f"noise needs a reference that decides at frames, and {oracle.spec.name} does not; use --oracle exact"
        )
    # Here, since a run without noise and contacts loads no compiler.
    from cdcore.narrow.bvh.box_tree import box_trees_of
    from cdcore.narrow.continuous.clearance import ContactOffset

    motion, noise = assembly.motion, noise_of(spec, assembly, scene)
    noisy_copies = NoisyCopies(noise, spec.copies, seed)
    box_trees = box_trees_of([body.mesh for body in assembly.bodies])
    farthest_vertices = [float(np.linalg.norm(body.mesh.referenced_vertices, axis=1).max()) for body in assembly.bodies]
    pairs = []
    for column, pair_bodies in enumerate(assembly.pairs.tolist()):
        noise_reach = noise.reach(pair_bodies, [farthest_vertices[body] for body in pair_bodies])
        offset = ContactOffset(box_trees, assembly.pairs, noise_reach) if noise_reach else None
        pairs.append(NoisyPair(column, assembly, offset, oracle, seed))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for start in range(0, len(motion), BLOCK_FRAMES):
            block = motion.frames(start, min(start + BLOCK_FRAMES, len(motion)))
            errors = noisy_copies.errors(block.times)
            answers = [pool.submit(pair.query_block, start, block, noisy_copies, errors) for pair in pairs]
            for answer in answers:
                answer.result()
            advance(len(block))
    return _result(assembly, contacts, pairs, noisy_copies)


def _result(
    assembly: Assembly, contacts: Sequence[Episode], pairs: Sequence[NoisyPair], noisy_copies: NoisyCopies
) -> NoiseResult:
    times, columns = assembly.motion.times, assembly.contact_columns
    near_passes, resting_spans = list[NoisySpan](), list[NoisySpan]()
    windows = [_widened_segment(contact, times) for contact in contacts]
    for pair in pairs:
        frames, in_contact = pair.answer
        copies_in_contact = np.bitwise_count(in_contact).sum(axis=1, dtype=np.int64)
        uncertain_frames = frames[(copies_in_contact > 0) & (copies_in_contact < noisy_copies.copies)]
        for first, last in _spans(uncertain_frames, times, LONGEST_AGREEMENT_S):
            if times[last] - times[first] >= REST_DISAGREEMENT_S:
                resting_spans.append(pair.span(first, last))
        contact_windows = [
            window for contact, window in zip(contacts, windows, strict=True) if contact.pair == columns[pair.column]
        ]
        passes_of_pair = [pair.span(*window) for window in _near_passes(frames, contact_windows, times)]
        near_passes += [
            window for window in passes_of_pair if window.word != ABSENT and not _at_rest(window, resting_spans)
        ]
    # A contact of a group holds where that of a member holds.
    spans_of_contacts = tuple(
        max(
            (pairs[member].span(*window) for member in assembly.columns_of_contact(contact.pair)),
            key=attrgetter("fraction"),
        )
        for contact, window in zip(contacts, windows, strict=True)
    )
    return NoiseResult(
        copies=noisy_copies.copies,
        contacts=spans_of_contacts,
        labels=tuple(UNDECIDABLE if _at_rest(window, resting_spans) else window.word for window in spans_of_contacts),
        near=tuple(near_passes),
        resting=tuple(resting_spans),
        queried=sum(pair.queried for pair in pairs),
        sizes={
            root: (1e3 * size.position_rms_m, size.rotation_rms_deg, size.correlation_s)
            for root, size in noisy_copies.noise.noise.items()
        },
    )


def _widened_segment(contact: Episode, times: FloatArray) -> tuple[int, int]:
    first = int(np.searchsorted(times, times[contact.first] - CONTACT_MARGIN_S))
    last = int(np.searchsorted(times, times[contact.last] + CONTACT_MARGIN_S, side="right")) - 1
    return first, last


def _near_passes(
    frames: IntArray, contact_windows: Sequence[tuple[int, int]], times: FloatArray
) -> list[tuple[int, int]]:
    """Near passes: frames in reach of the noise that belong to no contact, those close in time as one."""
    is_free = np.ones(len(frames), dtype=np.bool_)
    for a, b in np.searchsorted(frames, np.add(np.reshape(contact_windows, (-1, 2)), [0, 1])).tolist():
        is_free[a:b] = False
    return _spans(frames[is_free], times, CONTACT_MARGIN_S)


def _spans(frames: IntArray, times: FloatArray, gap_s: float) -> list[tuple[int, int]]:
    """First and last of frames that follow each other, or in less than ``apart`` seconds."""
    if not len(frames):
        return []
    break_indices = np.flatnonzero((np.diff(frames) > 1) & (np.diff(times[frames]) >= gap_s))
    return list(
        zip(
            frames[np.insert(break_indices + 1, 0, 0)].tolist(),
            frames[np.append(break_indices, -1)].tolist(),
            strict=True,
        )
    )


def _at_rest(span: NoisySpan, resting: Sequence[NoisySpan]) -> bool:
    """Whether most of a span lies in stretches at rest of its pair."""
    rests_of_pair = [resting_span for resting_span in resting if resting_span.pair == span.pair]
    resting_frames = sum(
        max(0, min(span.last, resting_span.last) - max(span.first, resting_span.first) + 1)
        for resting_span in rests_of_pair
    )
    return 2 * resting_frames > span.last - span.first + 1


class NoisyPair:
    """A pair of bodies: where noise may change the answer about it, and what the copies say there."""

    def __init__(self, column: int, assembly: Assembly, offset: ContactOffset | None, oracle: Run, seed: int) -> None:
        self.column, self._ends = column, assembly.pairs[column].tolist()
        self._assembly, self._offset, self._oracle, self._seed = assembly, offset, oracle, seed
        self._copies, self.queried = 1, 0
        self._blocks: list[tuple[IntArray, ByteArray]] = []

    @cached_property
    def _detector(self) -> Detector:
        """The oracle for the two bodies alone."""
        bodies = tuple(self._assembly.bodies[end] for end in self._ends)
        pair_assembly = replace(self._assembly, bodies=bodies, pairs=np.array([[0, 1]]))
        return make_detector(self._oracle.spec, pair_assembly, self._seed)

    def query_block(
        self, first_frame: int, block: Motion, noisy_copies: NoisyCopies, errors: Mapping[str, FloatArray]
    ) -> None:
        """Query all copies about a block that starts at frame ``first_frame``, where noise may change the answer."""
        self._copies = noisy_copies.copies
        is_contact = counts_as_contact(
            self._oracle.detection.verdict[first_frame : first_frame + len(block), self.column]
        )
        is_uncertain_clear = self._uncertain_frames(block, is_contact)
        is_uncertain = is_uncertain_clear | is_contact
        # What no noise reaches all copies say alike.
        in_contact = np.ones((int(is_uncertain.sum()), noisy_copies.copies), dtype=np.bool_)
        if is_uncertain_clear.any():
            rotations, positions = zip(
                *(noisy_copies.poses(block, errors, body, is_uncertain_clear) for body in self._ends), strict=True
            )
            pose_count = noisy_copies.copies * int(is_uncertain_clear.sum())
            has_pose, times = np.ones((pose_count, 2), dtype=np.bool_), np.arange(pose_count) / HEADSET_HZ
            motion = Motion.of_rigid(
                times, np.stack(positions, axis=1), np.stack(rotations, axis=1), has_pose, has_pose
            )
            answers = counts_as_contact(self._detector.detect(motion).verdict[:, 0])
            in_contact[is_uncertain_clear[is_uncertain]] = answers.reshape(noisy_copies.copies, -1).T
            self.queried += int(is_uncertain_clear.sum())
        self._blocks.append((np.flatnonzero(is_uncertain) + first_frame, np.packbits(in_contact, axis=1)))

    def _uncertain_frames(self, block: Motion, is_contact: BoolArray) -> BoolArray:
        """Frames (T,) in which noise may change the answer: surfaces meet, or are nearer than it reaches."""
        if self._offset is None:
            return np.zeros_like(is_contact)
        is_uncertain = is_contact.copy()
        clear_frames = np.flatnonzero(block.valid[:, self._ends].all(axis=1) & ~is_contact)
        is_uncertain[clear_frames] = self._offset.near(block, clear_frames, np.full_like(clear_frames, self.column))
        return is_uncertain

    @cached_property
    def answer(self) -> tuple[IntArray, ByteArray]:
        """Frames (k,) with contact or in reach of the noise, and the copies with contact there as bits (k, C / 8), the
        last byte filled up with none; after the last block."""
        frames, in_contact = (np.concatenate(block_arrays) for block_arrays in zip(*self._blocks, strict=True))
        return frames, in_contact

    def span(self, first: int, last: int) -> NoisySpan:
        """Return the fraction of the copies that have a contact anywhere in a segment of frame_numbers."""
        frame_numbers, in_contact = self.answer
        answer_rows = slice(*np.searchsorted(frame_numbers, [first, last + 1]))
        copies_in_contact = np.bitwise_count(np.bitwise_or.reduce(in_contact[answer_rows], axis=0)).sum()
        return NoisySpan(self.column, first, last, float(copies_in_contact / self._copies))
