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
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.bvh.block import COUNTERS
from cdcore.narrow.bvh.box_tree import BoxTree
from cdcore.narrow.bvh.pose_lanes import Tracks
from cdcore.narrow.bvh.traverse import Workspace
from cdcore.narrow.bvh.tree_memory import (
    BEYOND,
    BITS_A,
    BITS_B,
    EVERY,
    FRAMES,
    MARKS,
    NEAR,
    PAIR_WORDS,
    POSE_A,
    POSE_B,
    POSE_WORDS,
    START,
    STOP,
    TREE_B,
)
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray, place_points
from cdcore.protocol import FaceSets, Motion, pair_has_pose

COUNTER_NAMES = (
    "node_tests", "leaf_pairs", "face_tests", "world_tests", "exact_tests", "integer_tests", "blocks", "skipped",
    "gap_tests", "reused",
)  # fmt: skip
"""Names of the kernel's counters, in its order."""
STAGES: Final = ("poses", "search", "faces")
"""Reading poses; spheres, trees, and what only exact arithmetic decides; sorting and collecting."""
FRAMES_AT_ONCE: Final = 16384
"""Frames that one task answers: a face pair of a frame is one number, which leaves 24 bits for each face."""
KEY_BITS: Final = 62
FRAMES_PER_TASK: Final = 4096
"""With threads: short enough to share the work, long enough for skips along the path."""

Faces = NDArray[np.int32]
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
    work, found = np.zeros(COUNTERS, dtype=np.int64), list[Found]()
    known: BoolArray | None = None if motion.valid.all() else pair_has_pose(motion, pairs).T
    if marks.size:
        turns, places = _without_gaps(motion)
        tracks = Tracks(trees, np.unique(pairs), len(turns), motion.still)
        tracks.fill(turns, places, motion.changed)
        rows_of_body = np.zeros((len(trees), POSE_WORDS), dtype=np.int64)
        rows_of_body[tracks.bodies] = tracks.rows
        rows = rows_of_pairs(trees, pairs, rows_of_body, marks, every=faces)
        clock.append(perf_counter())
        found = _searched(trees, rows, work, threads, _turned(trees, pairs))
        found += _beyond(trees, pairs, (turns, places), marks)
    clock += [perf_counter()] * (3 - len(clock))
    sets = _face_sets(marks, found, known, faces)
    hits, near = marks[:, 0].view(np.bool_), marks[:, 1] > marks[:, 0]
    column, frame = np.divmod(np.flatnonzero(near), max(1, marks.shape[2]))
    clock.append(perf_counter())
    seconds = dict(zip(STAGES, np.diff(clock).tolist(), strict=True))
    counters = dict(zip(COUNTER_NAMES, work.tolist(), strict=True))
    return MotionAnswer(np.ascontiguousarray(hits.T), sets, (frame, column), counters, seconds)


def rows_of_pairs(
    trees: Sequence[BoxTree], pairs: IntArray, poses: IntArray, marks: ByteArray, *, every: bool
) -> IntArray:
    """The kernels' rows of P pairs, about all T frames; ``poses`` (N, POSE_WORDS), ``marks`` (P, 3, T), zeros."""
    turned = _turned(trees, pairs)[:, None]
    a, b = np.where(turned, pairs[:, ::-1], pairs).T
    rows, of_tree = np.empty((len(pairs), PAIR_WORDS), dtype=np.int64), np.array([tree.row for tree in trees])
    bits = np.array([(len(tree.faces) - 1).bit_length() for tree in trees])
    rows[:, :TREE_B], rows[:, TREE_B:POSE_A] = of_tree[a], of_tree[b]
    rows[:, POSE_A:POSE_B], rows[:, POSE_B:MARKS] = poses[a], poses[b]
    rows[:, MARKS], rows[:, FRAMES] = address_of(marks) + 3 * marks.shape[2] * np.arange(len(pairs)), marks.shape[2]
    rows[:, START], rows[:, STOP], rows[:, EVERY] = 0, marks.shape[2], every
    rows[:, BITS_A], rows[:, BITS_B] = bits[a], bits[b]
    return rows


def _turned(trees: Sequence[BoxTree], pairs: IntArray) -> BoolArray:
    """Pairs whose second body is the smaller one, which is moved into the frame of the larger one, (P,)."""
    radius = np.array([tree.boxes[0, 15] for tree in trees])
    turned: BoolArray = radius[pairs[:, 0]] > radius[pairs[:, 1]]
    return turned


def _without_gaps(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Rotations and translations in which a body without a pose stays where it was, or where it will be first."""
    valid = motion.valid
    if valid.all():
        return motion.rotations, motion.translations
    last = np.maximum.accumulate(np.where(valid, np.arange(len(valid))[:, None], -1), axis=0)
    source, body = np.where(last < 0, valid.argmax(axis=0), last), np.arange(valid.shape[1])
    return motion.rotations[source, body], motion.translations[source, body]


def _searched(trees: Sequence[BoxTree], rows: IntArray, work: IntArray, threads: int, turned: BoolArray) -> list[Found]:
    """Search all frames of all pairs, stretch by stretch; ``work`` is added to."""
    frames, room = int(rows[0, FRAMES]), KEY_BITS - int((rows[:, BITS_A] + rows[:, BITS_B]).max())
    step = min(FRAMES_PER_TASK if threads > 1 else FRAMES_AT_ONCE, 1 << max(0, room))
    here, spent = local(), list[IntArray]()

    def stretch(first: int, last: int, start: int) -> list[Found]:
        if not hasattr(here, "workspace"):
            here.workspace = Workspace(trees, np.zeros(COUNTERS, dtype=np.int64))
            spent.append(here.workspace.work)
        part = rows[first:last].copy()
        part[:, START], part[:, STOP] = start, min(start + step, frames)
        found = []
        for k, keys in here.workspace.search(part):
            frame, faces = _unpacked(keys, part[k], turned[first + k])
            found.append(Found(first + k, frame + start, faces))
        return found

    starts = range(0, frames, step)
    if threads <= 1:
        parts = [stretch(0, len(rows), start) for start in starts]
    else:
        with ThreadPoolExecutor(threads) as pool:
            tasks = [pool.submit(stretch, k, k + 1, start) for k in range(len(rows)) for start in starts]
            parts = [task.result() for task in tasks]
    work += np.sum(spent, axis=0)
    return [one for part in parts for one in part]


def _unpacked(keys: IntArray, row: IntArray, turned: bool) -> tuple[IntArray, Faces]:
    """Frames and face pairs, sorted, faces in the order of the pair."""
    bits_a, bits_b = int(row[BITS_A]), int(row[BITS_B])
    both = bits_a + bits_b
    if turned:
        low = keys & ((1 << bits_b) - 1)
        keys = (keys >> both << both) | (low << bits_a) | ((keys >> bits_b) & ((1 << bits_a) - 1))
        bits_a, bits_b = bits_b, bits_a
    keys = np.sort(keys)
    faces = np.empty((len(keys), 2), dtype=np.int32)
    faces[:, 0] = (keys >> bits_b) & ((1 << bits_a) - 1)
    faces[:, 1] = keys & ((1 << bits_b) - 1)
    return keys >> both, faces


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
        ends = pairs[column].tolist()
        first, second = (
            place_points(_triangles(trees[body]), turns[frame, body], places[frame, body]) for body in ends
        )
        faces = meeting_faces_exhaustive(first, second).astype(np.int32)
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
