"""One pair of bodies over a motion: its distinct frames, and the answer of kernels and integers for a stretch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from time import perf_counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.spacetime.block import COUNTERS, SKIPPED_FRAMES, BlockQuestion
from cdcore.narrow.spacetime.bounds import LARGEST_SIZE, LARGEST_SKEW, SMALLEST_SIZE, position_pad
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.spacetime.far_poses import certainly_apart
from cdcore.narrow.spacetime.pose_lanes import PoseLanes, Tracks, pose_lanes
from cdcore.narrow.spacetime.time_spans import SPAN_TESTS, first_near_of
from cdcore.narrow.spacetime.traverse import Workspace
from cdcore.narrow.spacetime.undecided import decide_by_integers
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray, place_points
from cdcore.protocol import Motion

REPEATS_WORTH_LEAVING_OUT = 0.25
"""From this share of repeated or missing poses on, a pair's frames are gathered first, which costs 40 ns a frame."""
KEY_BITS = 62
"""A face pair of a frame is sorted as one 64-bit number, so a stretch has as many frames as that leaves room for."""

NO_FRAMES: IntArray = np.zeros(0, dtype=np.int64)
NO_FACES: NDArray[np.int32] = np.zeros((0, 2), dtype=np.int32)


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of all bodies: (T, N, 3, 3), (T, N, 3), where they exist, (T, N), and bodies known not to move, (N,).

    A ``Motion`` does as well.
    """

    rotations: FloatArray
    translations: FloatArray
    valid: BoolArray
    still: BoolArray | None = None

    @cached_property
    def everywhere(self) -> IntArray:
        """(T,) the numbers of all frames."""
        return np.arange(len(self.valid), dtype=np.int64)


class FramesAnswer(NamedTuple):
    """What was found in some of a pair's distinct frames, beside what is marked.

    ``frame`` (m,) distinct frame of each face pair, not decreasing; ``faces`` (m, 2) in the order of the pair, sorted
    within a frame, empty where they were not asked for; ``seconds`` spent in the search, in exact arithmetic, in
    sorting face pairs.
    """

    frame: IntArray
    faces: NDArray[np.int32]
    work: IntArray
    seconds: tuple[float, float, float]


class PairJob:
    """Answers any stretch of the distinct frames of one pair, independently of every other stretch."""

    def __init__(
        self, trees: Sequence[BoxTree], i: int, j: int, poses: Poses | Motion,
        shared: Tracks | Sequence[PoseLanes | None], *, faces: bool,
    ) -> None:  # fmt: skip
        # the smaller body is moved into the larger one's frame
        self.turned = bool(trees[i].boxes[0, 15] > trees[j].boxes[0, 15])
        self._a, self._b = (j, i) if self.turned else (i, j)
        self._trees = trees[self._a], trees[self._b]
        self._poses, self._faces = poses, faces
        self.everywhere = self.frames = self.which = self._asked = poses.everywhere
        self._take(tuple(one for one in (shared[self._a], shared[self._b]) if one is not None))
        self._apart = self._near == len(poses.valid)
        if not self._apart:
            self.frames, self._asked, self.which = _distinct_frames(poses, i, j, shared)
            if len(self._lanes) < 2 or self._asked is not poses.everywhere:
                bodies = (self._a, self._b) if len(self._asked) else ()
                self._take(tuple(self._lanes_of(body, shared) for body in bodies))
        self.count = len(self._asked)
        """Number of distinct frames; all frames, as they come, of bodies that spans alone keep apart."""
        self._bits = bits_of(self._trees)
        self.most_frames = 1 << max(0, KEY_BITS - sum(self._bits))
        """Most frames that one stretch may have."""

    def first_near(self, frame: int) -> int:
        """The first distinct frame from this one on that no span of frames dismisses."""
        return self._climb(frame)[0] if frame else self._near

    def _take(self, lanes: tuple[PoseLanes, ...]) -> None:
        """Keep the tracks of A and B, or what is known of them."""
        self._lanes = lanes
        self._pad = self._pad_of_lanes()
        self._near, self._tests = self._climb(0)

    def _climb(self, frame: int) -> tuple[int, int]:
        """``first_near``, and how many spans were tested."""
        if not isfinite(self._pad):
            return frame, 0
        a, b = self._lanes
        reach = float(self._trees[0].boxes[0, 15] + self._trees[1].boxes[0, 15]) + self._pad
        return first_near_of(a.row, b.row, frame, reach)

    def _pad_of_lanes(self) -> float:
        """What a dismissal keeps; infinity where poses are not known yet or sizes not for the kernels."""
        if len(self._lanes) < 2:
            return np.inf
        a, b = self._lanes
        return pad_between(self._trees, a.size + b.size, a.skew + b.skew)

    def _lanes_of(self, body: int, shared: Tracks | Sequence[PoseLanes | None]) -> PoseLanes:
        known = shared[body]
        if known is not None and (known.step == 0 or len(self._asked) == len(self._poses.valid)):
            return known
        tree = self._trees[0] if body == self._a else self._trees[1]
        return pose_lanes(self._poses.rotations, self._poses.translations, body, self._asked, tree.boxes[0], tree.reach)

    def stretch(self, start: int, stop: int, workspace: Workspace, marks: ByteArray) -> FramesAnswer:
        """Answer the distinct frames ``start <= f < stop``.

        ``marks`` (2, n), all 0 before: sets hits to 1, and where no bounding volume keeps the bodies apart.
        """
        if self._apart:
            return self._dismissed(stop - start)
        if not isfinite(self._pad):
            return self._exhaustive(start, stop, marks)
        work, before, clock = np.zeros(COUNTERS, dtype=np.int64), workspace.exact_seconds, [perf_counter()]
        (tree_a, tree_b), (a, b) = self._trees, self._lanes
        question = BlockQuestion(start, stop, self._pad, self._faces, *self._bits)

        def settle(_row: int, keys: IntArray) -> IntArray:
            return self.settled(keys, start, marks[0])

        keys = workspace.traverse(tree_a, a, tree_b, b, question, settle, marks, work)
        clock.append(perf_counter())
        frame, faces = self.unpacked(keys)
        clock.append(perf_counter())
        exact = workspace.exact_seconds - before
        return FramesAnswer(frame + start, faces, work, (clock[1] - clock[0] - exact, exact, clock[2] - clock[1]))

    def _dismissed(self, count: int) -> FramesAnswer:
        """Frames that one climb over the spans dismissed: 5 us a pair where setting up the kernel's row takes 25."""
        work = np.zeros(COUNTERS, dtype=np.int64)
        work[SKIPPED_FRAMES], work[SPAN_TESTS] = count, self._tests
        return FramesAnswer(NO_FRAMES, NO_FACES, work, (0.0, 0.0, 0.0))

    def unpacked(self, keys: IntArray) -> tuple[IntArray, NDArray[np.int32]]:
        """Frames and face pairs, sorted, faces in the order of the pair."""
        if not len(keys):
            return NO_FRAMES, NO_FACES
        bits_a, bits_b = self._bits
        both = bits_a + bits_b
        if self.turned:
            low = keys & ((1 << bits_b) - 1)
            keys = (keys >> both << both) | (low << bits_a) | ((keys >> bits_b) & ((1 << bits_a) - 1))
            bits_a, bits_b = bits_b, bits_a
        keys = np.sort(keys)
        faces = np.empty((len(keys), 2), dtype=np.int32)
        faces[:, 0] = (keys >> bits_b) & ((1 << bits_a) - 1)
        faces[:, 1] = keys & ((1 << bits_b) - 1)
        return keys >> both, faces

    def settled(self, keys: IntArray, start: int, hits: ByteArray) -> IntArray:
        """Decide face pairs in integers, as ``decide_by_integers`` does."""
        return decide_by_integers(keys, self._bits, start, self._trees, self._lanes, hits)

    def _placed(self, row: int) -> tuple[FloatArray, FloatArray]:
        """World triangles of A and B, by face number, in a distinct frame."""
        frame = self._asked[row]
        placed = []
        for body, tree in zip((self._a, self._b), self._trees, strict=True):
            corners = np.empty((len(tree.faces), 3, 3))
            corners[tree.faces] = tree.placed.reshape(-1, 3, 4)[:, :, :3].transpose(0, 2, 1)
            pose = self._poses.rotations[frame, body], self._poses.translations[frame, body]
            placed.append(place_points(corners.reshape(-1, 3), *pose).reshape(-1, 3, 3))
        return placed[0], placed[1]

    def _exhaustive(self, start: int, stop: int, marks: ByteArray) -> FramesAnswer:
        """Every face against every face: coordinates too large for the bounds of the kernels."""
        begin, found = perf_counter(), []
        for row in range(start, stop):
            origins, reach = self._poses.translations[[self._asked[row]]], sum(tree.reach for tree in self._trees)
            if certainly_apart(origins[:, self._a], origins[:, self._b], reach).all():
                found.append(NO_FACES.astype(np.int64))
                continue
            first, second = self._placed(row)
            found.append(meeting_faces_exhaustive(*((second, first) if self.turned else (first, second))))
        sizes = np.array([len(one) for one in found])
        frame = np.repeat(np.arange(start, stop), sizes) if self._faces else NO_FRAMES
        faces = np.concatenate(found).astype(np.int32) if self._faces else NO_FACES
        marks[0, start:stop], marks[1, start:stop] = sizes > 0, 1
        return FramesAnswer(frame, faces, np.zeros(COUNTERS, dtype=np.int64), (0.0, perf_counter() - begin, 0.0))


def bits_of(trees: tuple[BoxTree, BoxTree]) -> tuple[int, int]:
    """Bits that the number of a face takes, for both bodies."""
    return face_bits(trees[0]), face_bits(trees[1])


def face_bits(tree: BoxTree) -> int:
    """Bits that the number of a face takes."""
    return (len(tree.faces) - 1).bit_length()


def pad_between(trees: tuple[BoxTree, BoxTree], away: float, skew: float) -> float:
    """What a dismissal keeps, for bodies so far from the origin together; infinity where sizes are not for kernels."""
    size = trees[0].reach + trees[1].reach + away
    if not SMALLEST_SIZE <= size <= LARGEST_SIZE or skew > LARGEST_SKEW:
        return np.inf
    return position_pad(size, skew)


def _distinct_frames(
    poses: Poses | Motion, i: int, j: int, shared: Tracks | Sequence[PoseLanes | None]
) -> tuple[IntArray, IntArray, IntArray]:
    """Frames with both poses (K,), those to ask (D,), and which of these answers each of the K.

    Poses that repeat are asked again unless they are many.
    """
    frames = poses.everywhere
    lanes = [shared[body] for body in (i, j)]
    moving = [one.changed for one in lanes if one is not None and one.step]
    if None not in lanes:
        if not moving:
            return frames, frames[:1], np.zeros(len(frames), dtype=np.int64)
        if any(one is not None and one.restless for one in lanes):
            return frames, frames, frames
        fresh = np.ones(len(frames), dtype=np.bool_)
        fresh[1:] = np.logical_or.reduce([changed[1:] for changed in moving])
    else:
        frames = np.flatnonzero(poses.valid[:, i] & poses.valid[:, j])
        fresh = np.ones(len(frames), dtype=np.bool_)
        fresh[1:] = False
        for body in (i, j):
            turn, move = poses.rotations[frames, body], poses.translations[frames, body]
            fresh[1:] |= (turn[1:] != turn[:-1]).any(axis=(1, 2)) | (move[1:] != move[:-1]).any(axis=1)
    if fresh.sum() > (1 - REPEATS_WORTH_LEAVING_OUT) * len(frames):
        return frames, frames, frames if len(frames) == len(poses.valid) else np.arange(len(frames))
    return frames, frames[fresh], np.cumsum(fresh) - 1
