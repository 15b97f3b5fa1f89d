"""All pairs of bodies over all frames of a motion, exactly: which meet when, on request in which faces.

The answer of a frame depends on that frame's poses alone, whatever the blocks, threads or order of pairs; poses that do
not change are asked once.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import local
from time import perf_counter
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdcore.kernels.memory import address_of
from cdcore.narrow.brute_force import meeting_faces_placed
from cdcore.narrow.bvh.box_tree import BoxTree
from cdcore.narrow.bvh.pose_lanes import Tracks
from cdcore.narrow.bvh.traverse import MOST_AT_ONCE, search_pairs
from cdcore.narrow.bvh.tree_memory import (
    AT_FRAME,
    BEYOND,
    COUNTERS,
    DOUBLES,
    NEAR,
    STATES,
    Pair,
    PoseMemory,
    Rows,
    Scratch,
    layout,
    row_of,
    words_of_rows,
)
from cdcore.narrow.bvh.undecided import settled
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray
from cdcore.protocol import FaceSets, Motion, Verdict, pair_has_pose

STAGES: Final = ("poses", "search", "faces")
"""Reading poses; spheres, trees, and what only exact arithmetic decides; sorting and collecting."""
FRAMES_AT_ONCE: Final = 16384
"""Frames that one task answers: face pairs are sorted as one number each, which leaves 24 bits for each face."""
KEY_BITS: Final = 62
FRAMES_PER_TASK: Final = 4096
"""With threads: short enough to share the work, long enough for skips along the path."""
LIST: Final = 4096
"""Face pairs that a list holds before it is emptied."""
FEW: Final = 16
"""The same of face pairs left open, where a frame is done at the first that meets."""

CONTACT, CLEAR = int(Verdict.CONTACT), int(Verdict.CLEAR)
Faces = NDArray[np.int32]
POSE_WORDS: Final = len(PoseMemory._fields)
NO_FACES: Faces = np.zeros((0, 2), dtype=np.int32)
NO_FRAMES: IntArray = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class MotionAnswer:
    """What was found for T frames and P pairs.

    ``hits`` (T, P). ``sets``: the faces of each contact, none unless asked for; equal poses share them. ``near``:
    frames and pairs, (n,) each, without contact that no bounding volume keeps apart. ``seconds`` of ``STAGES``; workers
    side by side add up.
    """

    hits: BoolArray
    sets: FaceSets
    near: tuple[IntArray, IntArray]
    work: dict[str, int]
    seconds: dict[str, float]


class Found(NamedTuple):
    """Face pairs (m, 2) of one pair that meet, and the frame of each, (m,), not decreasing."""

    column: int
    frame: IntArray
    faces: Faces


def decide_motion(
    trees: Sequence[BoxTree], pairs: IntArray, motion: Motion, *, faces: bool = False, threads: int = 1
) -> MotionAnswer:
    """Decide every pair (P, 2) in every frame at which both bodies have a pose; a tree per body.

    ``faces``: list all face pairs that meet. ``threads``: workers; the answer does not depend on it.
    """
    clock = [perf_counter()]
    marks = np.zeros((len(pairs), 3, len(motion.valid)), dtype=np.uint8)
    work, found = np.zeros(len(COUNTERS), dtype=np.int64), list[Found]()
    known: BoolArray | None = None if motion.valid.all() else pair_has_pose(motion, pairs).T
    if marks.size:
        turns, places = _without_gaps(motion)
        tracks = Tracks(trees, np.unique(pairs), len(turns), motion.still)
        tracks.fill(turns, places, motion.changed)
        rows = rows_of_pairs(trees, pairs, tracks, marks, every=faces)
        clock.append(perf_counter())
        found = _searched(trees, rows, work, threads)
        found += _beyond(trees, pairs, (turns, places), marks)
    clock += [perf_counter()] * (3 - len(clock))
    sets = _face_sets(marks, found, known, faces)
    hits, near = marks[:, 0].view(np.bool_), marks[:, 1] > marks[:, 0]
    column, frame = np.divmod(np.flatnonzero(near), max(1, marks.shape[2]))
    clock.append(perf_counter())
    seconds = dict(zip(STAGES, np.diff(clock).tolist(), strict=True))
    counters = dict(zip(COUNTERS, work.tolist(), strict=True))
    return MotionAnswer(np.ascontiguousarray(hits.T), sets, (frame, column), counters, seconds)


class FrameLooks:
    """Asks about pairs (P, 2) of bodies with a tree each in one frame after the other; only the poses are set up."""

    def __init__(self, trees: Sequence[BoxTree], pairs: IntArray) -> None:
        self._trees, self._pairs = trees, pairs
        self._workspace = Workspace(trees, every=False)
        self._tracks = Tracks(trees, np.arange(len(trees)), 1, np.ones(len(trees), dtype=np.bool_))
        self._ready: Motion | None = None
        self._marks = np.zeros((len(pairs), 3, 1), dtype=np.uint8)
        rows = rows_of_pairs(trees, pairs, self._tracks, self._marks, every=False)
        self._rows = list(words_of_rows(rows)[:, None])

    def decide(self, now: Motion, column: int, _margin: float) -> tuple[int, bool]:
        """CONTACT or CLEAR for one pair, and False: to know how far it is apart costs more than to ask again."""
        if self._ready is not now:
            self._tracks.fill(now.rotations, now.translations, now.valid)
            self._ready = now
            self._marks[:] = 0
        self._workspace.search(self._rows[column], 0, 1)
        hit, volumes, _ = self._marks[column, :, 0].tolist()
        if volumes == BEYOND:
            hit = decide_motion(self._trees, self._pairs[[column]], now).hits[0, 0]
        return (CONTACT if hit else CLEAR), False


def rows_of_pairs(trees: Sequence[BoxTree], pairs: IntArray, tracks: Tracks, marks: ByteArray, *, every: bool) -> Rows:
    """The ``Pair`` of each of P pairs, (P,), about all T frames; ``marks`` (P, 3, T), zeros."""
    count, frames = len(pairs), marks.shape[2]
    radius = np.array([tree.boxes[0, 15] for tree in trees])
    bits = np.array([(len(tree.faces) - 1).bit_length() for tree in trees])
    turned = radius[pairs[:, 0]] > radius[pairs[:, 1]]
    a, b = np.where(turned[:, None], pairs[:, ::-1], pairs).T
    of_tree, of_body = np.array([tree.words for tree in trees]), np.zeros((len(trees), POSE_WORDS), dtype=np.int64)
    of_body[tracks.bodies] = words_of_rows(tracks.rows)
    of_marks = address_of(marks) + frames * np.arange(3 * count).reshape(count, 3)
    numbers = np.zeros((count, 6), dtype=np.int64)
    numbers[:, 1], numbers[:, 2], numbers[:, 5] = frames, every, turned
    numbers[:, 3], numbers[:, 4] = bits[a], bits[b]
    # words side by side, in the order of a Pair's names: filling a row name by name takes twice as long
    words = np.concatenate([of_tree[a], of_body[a], of_tree[b], of_body[b], of_marks, numbers], axis=1)
    return words.view(layout(Pair))[:, 0]


def _without_gaps(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Rotations and translations in which a body without a pose stays where it was, or where it will be first."""
    valid = motion.valid
    if valid.all():
        return motion.rotations, motion.translations
    last = np.maximum.accumulate(np.where(valid, np.arange(len(valid))[:, None], -1), axis=0)
    source, body = np.where(last < 0, valid.argmax(axis=0), last), np.arange(valid.shape[1])
    return motion.rotations[source, body], motion.translations[source, body]


class Workspace:
    """Memory for one search after another, which all ask for ``every`` face pair or none does; one a thread."""

    def __init__(self, trees: Sequence[BoxTree], *, every: bool) -> None:
        self._every, self.work = every, np.zeros(len(COUNTERS), dtype=np.int64)
        depth = 6 * (max((len(tree.links) for tree in trees), default=0) + 1)
        many = LIST + MOST_AT_ONCE
        lengths = {"stack": depth, "found": 4 * 64, "state": STATES, "keys": many, "later": many}
        lists = {name: np.zeros(length, dtype=np.int64) for name, length in lengths.items()}
        self._state, self._keys, self._later = lists["state"], lists["keys"], lists["later"]
        self._kept = lists, {name: np.empty(length) for name, length in zip(Scratch._fields, DOUBLES, strict=False)}
        ends = {"keys_end": LIST, "later_end": LIST if every else FEW}
        row = row_of(Scratch, **lists, **self._kept[1], **ends, work=self.work)
        self._room = row.reshape(1).view(np.int64)

    def search(self, rows: IntArray, start: int, stop: int) -> list[tuple[int, IntArray]]:
        """Decide frames ``start`` to ``stop`` of each ``Pair`` of the rows (P, words), which is what these ask.

        Returns the numbers of rows with face pairs that meet, if these are asked for, and the pairs, packed.
        """
        parts = dict[int, list[IntArray]]()
        row, done = 0, True
        while row < len(rows):
            if done:
                self._state[:] = 0
                self._state[AT_FRAME] = start
            # a row that ends with nothing in the lists is followed by the next one, inside the kernel
            row = int(search_pairs(rows, self._room, row))
            if row == len(rows):
                break
            meeting = [self._keys[1 : self._keys[0] + 1].copy()]
            if self._later[0]:
                meeting.append(settled(rows[row], self._later[1 : self._later[0] + 1], self.work))
            if self._every:
                parts.setdefault(row, []).extend(meeting)
            self._keys[0] = self._later[0] = 0
            done = bool(self._state[AT_FRAME] == stop)
            row += done
        return [(row, np.concatenate(some)) for row, some in parts.items()]


def _searched(trees: Sequence[BoxTree], rows: Rows, work: IntArray, threads: int) -> list[Found]:
    """Search all frames of all pairs, stretch by stretch; ``work`` is added to."""
    frames, every = int(rows["stop"][0]), bool(rows["every"][0])
    room = KEY_BITS - int((rows["bits_a"] + rows["bits_b"]).max())
    step = min(FRAMES_PER_TASK if threads > 1 else FRAMES_AT_ONCE, 1 << max(0, room))
    here, spent = local(), list[IntArray]()

    def stretch(first: int, last: int, start: int) -> list[Found]:
        if not hasattr(here, "workspace"):
            here.workspace = Workspace(trees, every=every)
            spent.append(here.workspace.work)
        part, stop = rows[first:last].copy(), min(start + step, frames)
        part["start"], part["stop"] = start, stop
        return [
            _unpacked(first + k, keys, part[k]) for k, keys in here.workspace.search(words_of_rows(part), start, stop)
        ]

    starts = range(0, frames, step)
    if threads <= 1:
        parts = [stretch(0, len(rows), start) for start in starts]
    else:
        with ThreadPoolExecutor(threads) as pool:
            tasks = [pool.submit(stretch, k, k + 1, start) for k in range(len(rows)) for start in starts]
            parts = [task.result() for task in tasks]
    work += np.sum(spent, axis=0)
    return [found for part in parts for found in part]


def _unpacked(column: int, keys: IntArray, row: np.void) -> Found:
    """Frames and face pairs of a ``Pair``, sorted, faces in the order in which it was asked about."""
    bits_a, bits_b, faces = int(row["bits_a"]), int(row["bits_b"]), np.empty((len(keys), 2), dtype=np.int32)
    if row["turned"]:
        low = keys & ((1 << bits_b) - 1)
        keys = (keys >> (bits_a + bits_b) << bits_b | low) << bits_a | ((keys >> bits_b) & ((1 << bits_a) - 1))
        bits_a, bits_b = bits_b, bits_a
    keys = np.sort(keys)
    faces[:, 0], faces[:, 1] = (keys >> bits_b) & ((1 << bits_a) - 1), keys & ((1 << bits_b) - 1)
    return Found(column, (keys >> (bits_a + bits_b)) + int(row["start"]), faces)


def _beyond(
    trees: Sequence[BoxTree], pairs: IntArray, poses: tuple[FloatArray, FloatArray], marks: ByteArray
) -> list[Found]:
    """Every face against every face in frames beyond the bounds of the kernels, which are noted as ``NEAR``."""
    found, (turns, places) = list[Found](), poses
    if marks[:, 1].max() < BEYOND:
        return found
    beyond = marks[:, 1] == BEYOND
    marks[:, 1][beyond] = NEAR
    for column, frame in np.argwhere(beyond).tolist():
        a, b = pairs[column].tolist()
        faces = meeting_faces_placed(
            _triangles(trees[a]), (turns[frame, a], places[frame, a]),
            _triangles(trees[b]), (turns[frame, b], places[frame, b]),
        )  # fmt: skip
        marks[column, 0, frame] = len(faces) > 0
        found.append(Found(column, np.full(len(faces), frame), faces))
    return found


def _triangles(tree: BoxTree) -> FloatArray:
    """The mesh's triangles (f, 3, 3), body frame."""
    triangles = np.empty((len(tree.faces), 3, 3))
    triangles[tree.faces] = tree.placed.reshape(-1, 3, 4)[:, :, :3].transpose(0, 2, 1)
    return triangles


def _face_sets(marks: ByteArray, found: list[Found], known: BoolArray | None, faces: bool) -> FaceSets:
    """Give frames that repeat poses the answer of the first of them, and those without a pose none."""
    everywhere, repeats = np.arange(marks.shape[2]), np.logical_or.reduce(marks[:, 2], axis=1)
    parts: dict[int, list[Found]] = {}
    for one in sorted(found, key=lambda one: one.column):
        parts.setdefault(one.column, []).append(one)
    entries, rows, row_count = [(NO_FRAMES,) * 4], [NO_FACES], 0
    for column in range(len(marks)):
        source = everywhere
        if repeats[column]:
            source = np.maximum.accumulate(np.where(marks[column, 2], 0, everywhere))
            marks[column, :2] = marks[column, :2][:, source]
        if known is not None:
            marks[column, :2] *= known[column]
        if faces and column in parts:
            of_faces, sets = (np.concatenate(some) for some in list(zip(*parts[column], strict=True))[1:])
            if (np.diff(of_faces) < 0).any():  # frames beyond the kernels come last
                order = np.argsort(of_faces, kind="stable")
                of_faces, sets = of_faces[order], sets[order]
            touching = np.flatnonzero(marks[column, 0])
            first, last = np.searchsorted(of_faces, [source[touching], source[touching] + 1]) + row_count
            entries.append((touching, np.full(len(touching), column), first, last))
            rows.append(sets)
            row_count += len(of_faces)
    frame, pair, start, stop = (np.concatenate(some) for some in zip(*entries, strict=True))
    order = np.lexsort((pair, frame))
    return FaceSets(frame[order], pair[order], start[order], stop[order], np.concatenate(rows))
