"""All pairs of bodies over all frames of a motion, exactly: which meet when, on request in which faces.

The answer of a frame depends on that frame's poses alone, whatever the blocks or the order of pairs; poses that do
not change are asked once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from time import perf_counter
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdcore.kernels.memory import address_of, integers_of_rows, keep_freed_memory, layout, row_of
from cdcore.narrow.brute_force import meeting_faces_placed
from cdcore.narrow.bvh.box_tree import BoxTree
from cdcore.narrow.bvh.frame_skips import Tracks
from cdcore.narrow.bvh.traverse import MOST_AT_ONCE, NOT_TESTED, answer_faces, search_pairs
from cdcore.narrow.bvh.tree_memory import (
    BEYOND,
    COUNTERS,
    DOUBLES,
    GOES_ON,
    INTEGER_TESTS,
    NEAR,
    STATES,
    Pair,
    Scratch,
)
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray
from cdcore.protocol import FaceSets, Motion, Verdict, pair_has_pose
from cdcore.triangles.decide import UNDECIDED, new_digits, unsummed_intersect

STAGES: Final = ("poses", "search", "faces")
"""Reading poses; spheres, trees, and what only exact arithmetic decides; sorting and collecting."""
SEGMENT_FRAMES: Final = 3072
"""Frames that are laid out at once: short enough to stay in the processor's cache, in memory that is used again, long
enough for skips along the path. All 5,400 frames of a bench at once took 1.2 of the time (2026-11)."""
KEY_BITS: Final = 62
"""Of a face pair and its frame as one number."""
LIST: Final = 4096
"""Face pairs that a list holds before it is emptied."""
FEW: Final = 16
"""The same of face pairs left open, where a frame is done at the first that meets."""

CONTACT, CLEAR = int(Verdict.CONTACT), int(Verdict.CLEAR)
Faces = NDArray[np.int32]
HITS, VOLUMES, REPEATS = range(3)
"""Planes of the marks (P, 3, T): frames with contact; what volumes say; frames that repeat the poses before them."""
NO_FACES: Faces = np.zeros((0, 2), dtype=np.int32)
NO_FRAMES: IntArray = np.zeros(0, dtype=np.int64)
NO_FACE_SETS: Final = FaceSets(NO_FRAMES, NO_FRAMES, NO_FRAMES, NO_FRAMES, NO_FACES)


@dataclass(frozen=True, eq=False)
class MotionAnswer:
    """Contacts for T frames and P pairs.

    ``hits`` (T, P). ``sets``: the faces of each contact, none unless asked for; equal poses share them. ``near``:
    frames and pairs, (n,) each, without contact that no bounding volume keeps apart. ``seconds`` of ``STAGES``; workers
    side by side add up.
    """

    hits: BoolArray
    sets: FaceSets
    near: tuple[IntArray, IntArray]
    work: dict[str, int]
    seconds: dict[str, float]


class PairMeetings(NamedTuple):
    """Face pairs (m, 2) of one pair that meet, and the frame of each, (m,), not decreasing."""

    column: int
    frame: IntArray
    faces: Faces


def decide_motion(trees: Sequence[BoxTree], pairs: IntArray, motion: Motion, *, faces: bool = False) -> MotionAnswer:
    """Decide every pair (P, 2) once, as ``MotionSearch`` does, which is for one motion after another."""
    return MotionSearch(trees, pairs).decide(motion, faces=faces)


class MotionSearch:
    """Decides pairs (P, 2) of bodies, a tree each, in every frame of a motion at which both have a pose."""

    def __init__(self, trees: Sequence[BoxTree], pairs: IntArray) -> None:
        keep_freed_memory()
        self._trees, self._pairs = trees, pairs
        bits = int(face_bits(trees)[pairs].sum(axis=1).max(initial=0))
        self._longest_segment = min(SEGMENT_FRAMES, 1 << max(0, KEY_BITS - bits))
        # Ready for the next motion: to make room takes a tenth of a short question.
        self._idle = list[SegmentSearch]()

    def decide(self, motion: Motion, *, faces: bool = False) -> MotionAnswer:
        """``faces``: list all face pairs that meet."""
        began = perf_counter()
        marks = np.zeros((len(self._pairs), 3, len(motion.valid)), dtype=np.uint8)
        complete = bool(motion.valid.all())
        segments, meetings = list[SegmentAnswer](), list[PairMeetings]()
        if marks.size:
            arrays = (motion.rotations, motion.translations) if complete else _without_gaps(motion)
            poses = Poses(*arrays, motion.changed)
            # segments of about equal length
            frames, count = marks.shape[2], -(-marks.shape[2] // self._longest_segment)
            for start, stop in pairwise(frames * k // count for k in range(count + 1)):
                search = self._ready(stop - start, every=faces)
                segments.append(search.decide(poses, start, stop))
                marks[:, :, start:stop] = search.marks[:, :, : stop - start]
                self._idle.append(search)
            meetings = [meeting for segment in segments for meeting in segment.meetings]
            if marks[:, VOLUMES].max() == BEYOND:
                meetings += _beyond(self._trees, self._pairs, poses, marks)
        searched = perf_counter()
        sources = _copy_to_repeats(marks)
        if not complete:
            marks[:, [HITS, VOLUMES]] *= pair_has_pose(motion, self._pairs).T[:, None]
        hits, near = marks[:, HITS].view(np.bool_), marks[:, VOLUMES] > marks[:, HITS]
        # by one index, as in ``true_indices``
        near_columns, near_frames = np.divmod(np.flatnonzero(near), near.shape[1])
        sets = _face_sets(hits, meetings, sources) if faces else NO_FACE_SETS
        laid_out = sum(segment.laid_out for segment in segments)
        seconds = (laid_out, max(0.0, searched - began - laid_out), perf_counter() - searched)
        work = np.sum([np.zeros(len(COUNTERS), np.int64), *(segment.work for segment in segments)], axis=0)
        return MotionAnswer(
            hits=np.ascontiguousarray(hits.T),
            sets=sets,
            near=(near_frames, near_columns),
            work=dict(zip(COUNTERS, work.tolist(), strict=True)),
            seconds=dict(zip(STAGES, seconds, strict=True)),
        )

    def _ready(self, frames: int, *, every: bool) -> SegmentSearch:
        """A search that no other thread uses, with room for so many frames."""
        while self._idle:
            search = self._idle.pop()
            if search.every == every and search.frames >= frames:
                return search
        return SegmentSearch(self._trees, self._pairs, frames, every=every)


class FrameLooks:
    """Asks about pairs (P, 2) of bodies with a tree each in one frame after the other; only the poses are set up."""

    def __init__(self, trees: Sequence[BoxTree], pairs: IntArray) -> None:
        self._trees, self._pairs = trees, pairs
        self._search = SegmentSearch(trees, pairs, 1, every=False)
        self._changed = np.ones((1, len(trees)), dtype=np.bool_)
        self._rows = list(self._search.rows[:, None])
        self._ready: Motion | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy has memory of its own."""
        return FrameLooks, (self._trees, self._pairs)

    def decide(self, now: Motion, column: int, _margin: float) -> tuple[int, bool]:
        """CONTACT or CLEAR for one pair, and False: to know how far it is apart costs more than to ask again."""
        search = self._search
        if self._ready is not now:
            search.tracks.fill(now.rotations, now.translations, self._changed)
            search.marks[:] = 0
            self._ready = now
        search.decide_rows(self._rows[column])
        hit, volumes, _ = search.marks[column, :, 0].tolist()
        if volumes == BEYOND:
            hit = decide_motion(self._trees, self._pairs[[column]], now).hits[0, 0]
        return (CONTACT if hit else CLEAR), False


def face_bits(trees: Sequence[BoxTree]) -> IntArray:
    """Bits of the largest number of a face of each tree."""
    return np.array([(len(tree.faces) - 1).bit_length() for tree in trees])


class Poses(NamedTuple):
    """Poses (T, N, 3, 3), (T, N, 3) without gaps, and ``changed`` (T, N) as of ``Motion``."""

    rotations: FloatArray
    translations: FloatArray
    changed: BoolArray


class SegmentAnswer(NamedTuple):
    """The faces that meet in a stretch, if these are asked for, its work, and seconds spent on poses."""

    meetings: list[PairMeetings]
    work: IntArray
    laid_out: float


class SegmentSearch:
    """Searches one segment of frames after another, each at most ``frames`` long, in memory of its own; one a thread.

    ``every``: all face pairs of pairs (P, 2) of bodies with a tree each, or else whether any meets. ``rows`` (P, w):
    each ``Pair``. ``marks`` (P, 3, frames): planes of the last segment.
    """

    def __init__(self, trees: Sequence[BoxTree], pairs: IntArray, frames: int, *, every: bool) -> None:
        self.frames, self.every = frames, every
        self._arguments = trees, pairs, frames
        self.tracks = Tracks(trees, np.unique(pairs), frames)
        self.marks = np.zeros((len(pairs), 3, frames), dtype=np.uint8)
        radius, bits = np.array([tree.boxes[0, 15] for tree in trees]), face_bits(trees)
        self._swapped = radius[pairs[:, 0]] > radius[pairs[:, 1]]
        body_a, body_b = np.where(self._swapped[:, None], pairs[:, ::-1], pairs).T
        self._bits_a, self._bits_b = bits[body_a], bits[body_b]
        self._pairs = np.zeros(len(pairs), dtype=layout(Pair))
        self._pairs["stop"], self._pairs["every"] = frames, every
        self._pairs["bits_a"], self._pairs["bits_b"] = self._bits_a, self._bits_b
        # The trees are kept because kernels know no more than addresses.
        self._trees, tree_rows = trees, np.array([address_of(tree.memory_row) for tree in trees])
        self._pairs["tree_a"], self._pairs["tree_b"] = tree_rows[body_a], tree_rows[body_b]
        self._pairs["pose_a"], self._pairs["pose_b"] = (
            self.tracks.addresses_of(body_a),
            self.tracks.addresses_of(body_b),
        )
        first = address_of(self.marks) + 3 * frames * np.arange(len(pairs))
        for plane, name in enumerate(("hits", "volumes", "repeats")):
            self._pairs[name] = first + plane * frames
        self.rows = integers_of_rows(self._pairs)
        self._make_room(max((len(tree.child) for tree in trees), default=0))

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy has memory of its own."""
        return partial(SegmentSearch, every=self.every), self._arguments

    def _make_room(self, nodes: int) -> None:
        """Make the ``Scratch`` memory of trees of at most so many nodes."""
        self._work = np.zeros(len(COUNTERS), dtype=np.int64)
        # what is decided later joins the keys
        most = LIST + MOST_AT_ONCE
        depth = 6 * (nodes + 1)
        lengths = {"stack": depth, "candidates": 4 * 64, "near": 8, "state": STATES, "keys": 2 * most, "later": most}
        lists = {name: np.zeros(length, dtype=np.int64) for name, length in lengths.items()}
        self._state, self._keys, self._later = lists["state"], lists["keys"], lists["later"]
        self._kept = lists, {name: np.empty(length) for name, length in zip(Scratch._fields, DOUBLES, strict=False)}
        ends = {"keys_end": LIST, "later_end": LIST if self.every else FEW}
        row = row_of(Scratch, **lists, **self._kept[1], **ends, work=self._work)
        self._room = integers_of_rows(row)[0]
        self._points, self._answers, self._digits = np.empty((most, 18)), np.empty(most, np.uint8), new_digits()

    def decide(self, poses: Poses, start: int, stop: int) -> SegmentAnswer:
        """Mark the contacts of frames ``start`` to ``stop`` in ``marks``, counted from ``start``."""
        began = perf_counter()
        self.tracks.fill(poses.rotations[start:stop], poses.translations[start:stop], poses.changed[start:stop])
        laid_out = perf_counter() - began
        self.marks[:] = 0
        self._pairs["stop"] = stop - start
        self._work[:] = 0
        meetings = [self._unpacked(column, keys, start) for column, keys in self.decide_rows(self.rows)]
        return SegmentAnswer(meetings, self._work.copy(), laid_out)

    def decide_rows(self, rows: IntArray) -> list[tuple[int, IntArray]]:
        """Decide all frames that each ``Pair`` of the rows (P, w) asks about.

        Returns the numbers of rows with face pairs that meet, if these are asked for, and the pairs, packed.
        """
        by_row: dict[int, list[IntArray]] = {}
        row = 0
        self._state[GOES_ON] = 0
        while row < len(rows):
            # a row that ends with nothing in the lists is followed by the next one, inside the kernel
            row = search_pairs(rows, self._room, row)
            if row == len(rows):
                break
            if self._later[0]:
                self._decide_later(rows[row])
            if self.every:
                by_row.setdefault(row, []).append(self._keys[1 : self._keys[0] + 1].copy())
            self._keys[0] = self._later[0] = 0
            if not self._state[GOES_ON]:
                row += 1
        return [(number, np.concatenate(keys)) for number, keys in by_row.items()]

    def _decide_later(self, row: IntArray) -> None:
        """Note the contacts among the face pairs that the filter left open of a row, by exact sums, then integers."""
        answers = self._answers[: self._later[0]]
        answers[:] = NOT_TESTED
        undecided = answer_faces(row, self._room, self._points, self._digits, answers)
        if undecided:
            self._work[INTEGER_TESTS] += undecided
            left = np.flatnonzero(answers == UNDECIDED)
            answers[left] = unsummed_intersect(self._points[left].reshape(-1, 2, 3, 3))
            answer_faces(row, self._room, self._points, self._digits, answers)

    def _unpacked(self, column: int, keys: IntArray, start: int) -> PairMeetings:
        """Frames and face pairs of a pair, sorted, faces in the order in which it was asked about."""
        bits_a, bits_b = int(self._bits_a[column]), int(self._bits_b[column])
        faces = np.empty((len(keys), 2), dtype=np.int32)
        if self._swapped[column]:
            lower = keys & ((1 << bits_b) - 1)
            keys = (keys >> (bits_a + bits_b) << bits_b | lower) << bits_a | ((keys >> bits_b) & ((1 << bits_a) - 1))
            bits_a, bits_b = bits_b, bits_a
        # They lie in ascending stretches. On a processor whose vector instructions make NumPy's default slow 327,000
        # keys took 15 ms this way and 39 the other (2026-11).
        keys = np.sort(keys, kind="stable")
        faces[:, 0], faces[:, 1] = (keys >> bits_b) & ((1 << bits_a) - 1), keys & ((1 << bits_b) - 1)
        return PairMeetings(column, (keys >> (bits_a + bits_b)) + start, faces)


def _without_gaps(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Rotations and translations in which a body without a pose stays where it was, or where it will be first."""
    valid = motion.valid
    last = np.maximum.accumulate(np.where(valid, np.arange(len(valid))[:, None], -1), axis=0)
    source, body = np.where(last < 0, valid.argmax(axis=0), last), np.arange(valid.shape[1])
    return motion.rotations[source, body], motion.translations[source, body]


def _beyond(trees: Sequence[BoxTree], pairs: IntArray, poses: Poses, marks: ByteArray) -> list[PairMeetings]:
    """Every face against every face in frames beyond the bounds of the kernels, which are noted as ``NEAR``."""
    meetings, (rotations, translations, _) = list[PairMeetings](), poses
    beyond = marks[:, VOLUMES] == BEYOND
    marks[:, VOLUMES][beyond] = NEAR
    for column, frame in np.argwhere(beyond).tolist():
        a, b = pairs[column].tolist()
        faces = meeting_faces_placed(
            _triangles(trees[a]),
            (rotations[frame, a], translations[frame, a]),
            _triangles(trees[b]),
            (rotations[frame, b], translations[frame, b]),
        )
        marks[column, HITS, frame] = len(faces) > 0
        meetings.append(PairMeetings(column, np.full(len(faces), frame), faces))
    return meetings


def _triangles(tree: BoxTree) -> FloatArray:
    """The mesh's triangles (f, 3, 3), body frame."""
    triangles = np.empty((len(tree.faces), 3, 3))
    triangles[tree.faces] = tree.placed.reshape(-1, 3, 4)[:, :, :3].transpose(0, 2, 1)
    return triangles


def _face_sets(hits: BoolArray, meetings: list[PairMeetings], sources: list[IntArray]) -> FaceSets:
    """Collects the faces of all contacts, ``hits`` (P, T); ``sources``: per pair the frame that each one repeats."""
    by_pair: dict[int, list[PairMeetings]] = {}
    for meeting in meetings:
        by_pair.setdefault(meeting.column, []).append(meeting)
    entries, rows, row_count = [(NO_FRAMES,) * 4], [NO_FACES], 0
    for column in sorted(by_pair):
        frames, sets = _by_frame(by_pair[column])
        touching = np.flatnonzero(hits[column])
        source = sources[column][touching]
        first, last = np.searchsorted(frames, [source, source + 1]) + row_count
        entries.append((touching, np.full(len(touching), column), first, last))
        rows.append(sets)
        row_count += len(frames)
    frame, pair, start, stop = (np.concatenate(some) for some in zip(*entries, strict=True))
    order = np.lexsort((pair, frame))
    return FaceSets(frame[order], pair[order], start[order], stop[order], np.concatenate(rows))


def _copy_to_repeats(marks: ByteArray) -> list[IntArray]:
    """Copies hits and volumes to frames that repeat a pose; returns per pair the frame that each one repeats, (T,)."""
    every_frame = np.arange(marks.shape[2])
    sources = [every_frame] * len(marks)
    for column in np.flatnonzero(np.logical_or.reduce(marks[:, REPEATS], axis=1)).tolist():
        source = np.maximum.accumulate(np.where(marks[column, REPEATS], 0, every_frame))
        for plane in (HITS, VOLUMES):
            marks[column, plane] = marks[column, plane][source]
        sources[column] = source
    return sources


def _by_frame(meetings: list[PairMeetings]) -> tuple[IntArray, Faces]:
    """Frames (m,), ascending, and face pairs (m, 2) of all meetings of one pair."""
    frames = np.concatenate([meeting.frame for meeting in meetings])
    faces = np.concatenate([meeting.faces for meeting in meetings])
    if (np.diff(frames) < 0).any():  # frames beyond the kernels come last
        order = np.argsort(frames, kind="stable")
        frames, faces = frames[order], faces[order]
    return frames, faces
