"""All pairs of bodies over all frames of a motion, exactly: which meet when, on request in which faces.

The answer of a frame depends on that frame's poses alone, whatever the blocks, threads or order of pairs; poses that do
not change are asked once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from threading import local
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.spacetime.block import COUNTERS
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.spacetime.far_poses import FAR, asked_apart, far_poses, without
from cdcore.narrow.spacetime.pair_job import NO_FACES, NO_FRAMES, FramesAnswer, PairJob, Poses
from cdcore.narrow.spacetime.pose_lanes import Tracks, ends_of
from cdcore.narrow.spacetime.together import search_together
from cdcore.narrow.spacetime.traverse import Workspace
from cdcore.numerics import BoolArray, ByteArray, IntArray
from cdcore.protocol import Motion

COUNTER_NAMES = (
    "node_tests", "leaf_pairs", "face_tests", "world_tests", "exact_tests", "integer_tests", "blocks", "skipped",
    "span_tests", "gap_tests",
)  # fmt: skip
"""Names of the kernel's counters, in its order."""
STAGES = ("poses", "search", "exact", "faces")
"""Reading poses; planning pairs, spheres and trees; what only exact arithmetic decides; sorting and collecting."""
_Read = tuple[Tracks | None, float]
"""The tracks of all bodies of pairs, ``None`` where they are read pair by pair, and the seconds that it took."""
_Done = tuple[int, PairJob, list[FramesAnswer]]
"""Column of a pair, and the answers of its stretches."""
FRAMES_AT_ONCE = 16384
"""Bounds the list of face pairs left to exact arithmetic: 500 a frame, as in resting contact, make 65 MB."""
FRAMES_PER_TASK = 4096
"""With threads, frames that a task answers: short enough to share the work, long enough for skips along the path."""


@dataclass(frozen=True, eq=False)
class MotionAnswer:
    """What was found for T frames and P pairs.

    ``hits`` (T, P). With faces, entries stand for the pair-frames in contact, sorted by frame, then pair: ``frame``,
    ``pair``, and the face pairs ``faces[start:stop]``, (K,) each; equal poses share them. ``faces`` (M, 2) is sorted
    within an entry. ``near``: frames and pairs, (n,) each, without contact that no bounding volume keeps apart.
    ``seconds`` of ``STAGES``; workers side by side add up.
    """

    hits: BoolArray
    frame: IntArray
    pair: IntArray
    start: IntArray
    stop: IntArray
    faces: NDArray[np.int32]
    near: tuple[IntArray, IntArray]
    work: dict[str, int]
    seconds: dict[str, float]


def decide_motion(
    trees: Sequence[BoxTree], pairs: IntArray, poses: Poses | Motion, *, faces: bool = False, threads: int = 1
) -> MotionAnswer:
    """Decide every pair (P, 2) in every frame at which both bodies have a pose; a tree per body.

    ``faces``: list all face pairs that meet. ``threads``: workers; the answer does not depend on it.
    """
    reaches, read = np.array([tree.reach for tree in trees]), _read(trees, pairs, poses)
    far = None if _all_near(read[0]) else far_poses(poses.translations, poses.valid, reaches)
    if far is None:
        return _decide(trees, pairs, poses, read, faces, threads)
    near = Poses(without(poses.rotations, far, poses.valid), without(poses.translations, far, poses.valid), poses.valid)
    found = _decide(trees, pairs, near, _read(trees, pairs, near), faces, threads)
    answers = [(found, poses.everywhere, np.arange(len(pairs)))]
    kept = np.ones((len(poses.valid), len(pairs)), dtype=np.bool_)
    for column, rows, asked in asked_apart(far, poses.valid, poses.translations, pairs, reaches):
        kept[rows, column] = False
        alone = Poses(poses.rotations[asked], poses.translations[asked], poses.valid[asked])
        one = pairs[[column]]
        found = _decide(trees, one, alone, _read(trees, one, alone), faces, 1)
        answers.append((found, asked, np.array([column])))
    return _together(answers, kept)


def _read(trees: Sequence[BoxTree], pairs: IntArray, poses: Poses | Motion) -> _Read:
    """The tracks of all bodies of pairs, if poses are known everywhere."""
    begin, tracks = perf_counter(), None
    if len(poses.everywhere) > 0 and len(pairs) > 0 and bool(poses.valid.all()):
        bodies = np.unique(pairs)
        still = None if poses.still is None else poses.still[bodies]
        ends = ends_of([trees[body] for body in bodies.tolist()])
        tracks = Tracks(poses.rotations, poses.translations, bodies, poses.everywhere, ends, still)
    return tracks, perf_counter() - begin


def _all_near(tracks: Tracks | None) -> bool:
    """Whether all poses are read and none is far from the origin."""
    return tracks is not None and bool((tracks.found[:, 0] <= FAR * tracks.ends[:, 16]).all())


def _together(answers: list[tuple[MotionAnswer, IntArray, IntArray]], kept: BoolArray) -> MotionAnswer:
    """One answer of several, each with its frames and columns; of the first only the pair-frames that are kept."""
    hits, rows = answers[0][0].hits & kept, 0
    entries, near, seconds, work = [], [], dict.fromkeys(STAGES, 0.0), dict.fromkeys(answers[0][0].work, 0)
    for number, (answer, frames, columns) in enumerate(answers):
        frame, pair = frames[answer.frame], columns[answer.pair]
        close = frames[answer.near[0]], columns[answer.near[1]]
        use, still = (slice(None) if number else kept[where] for where in ((frame, pair), close))
        if number:
            hits[np.ix_(frames, columns)] |= answer.hits
        near.append([part[still] for part in close])
        entries.append((frame[use], pair[use], answer.start[use] + rows, answer.stop[use] + rows))
        rows += len(answer.faces)
        seconds = {stage: seconds[stage] + answer.seconds[stage] for stage in STAGES}
        work = {name: work[name] + answer.work[name] for name in work}
    frame, pair, start, stop = (np.concatenate(some) for some in zip(*entries, strict=True))
    order, faces = np.lexsort((pair, frame)), np.concatenate([answer.faces for answer, _, _ in answers])
    together = np.concatenate(near, axis=1)
    return MotionAnswer(
        hits, frame[order], pair[order], start[order], stop[order], faces, (together[0], together[1]), work, seconds
    )


def _decide(
    trees: Sequence[BoxTree],
    pairs: IntArray,
    poses: Poses | Motion,
    read: _Read,
    faces: bool,
    threads: int,
) -> MotionAnswer:
    """``decide_motion`` of poses none of which is far."""
    clock, (tracks, reading) = [perf_counter()], read
    shared: Tracks | list[None] = [None] * len(trees) if tracks is None else tracks
    marks, work = np.zeros((len(pairs), 2, len(poses.valid)), dtype=np.uint8), np.zeros(COUNTERS, dtype=np.int64)

    @cache
    def job(column: int) -> PairJob:
        i, j = pairs[column].tolist()
        return PairJob(trees, i, j, poses, shared, faces=faces)

    left, done = np.ones(len(pairs), dtype=np.bool_), list[_Done]()
    workspace, sorting = Workspace(), 0.0

    def settle(column: int, keys: IntArray) -> IntArray:
        return job(column).settled(keys, 0, marks[column, 0])

    if tracks is not None and threads <= 1 and len(poses.valid) <= FRAMES_AT_ONCE:
        columns, found = search_together(trees, pairs, tracks, faces, workspace, settle, marks, work)
        left[columns] = False
        for column, keys in found:
            begin = perf_counter()
            frame, some = job(column).unpacked(keys)
            sorting += perf_counter() - begin
            done.append((column, job(column), [FramesAnswer(frame, some, np.zeros_like(work), (0.0, 0.0, 0.0))]))
    jobs = [(column, job(column)) for column in np.flatnonzero(left).tolist()]
    clock.append(perf_counter())
    done += _answered(jobs, threads, marks)
    clock.append(perf_counter())
    answer = _collected(done, marks, work, faces)
    parts = [part.seconds for _, _, some in done for part in some]
    exact = workspace.exact_seconds
    together = clock[1] - clock[0] - exact - sorting, exact, sorting
    spent = [reading, *(sum(stage) for stage in zip(together, *parts, strict=True))]
    spent[3] += perf_counter() - clock[2]
    return replace(answer, seconds=dict(zip(STAGES, spent, strict=True)))


def _stretches(job: PairJob, frames: int) -> Iterator[tuple[int, int]]:
    """Cut the frames of a pair; frames that spans dismiss are one stretch of any length, because it lists no faces."""
    step, start = min(frames, job.most_frames), 0
    while start < job.count:
        near = job.first_near(start)
        stop = near if near > start + step else min(start + step, job.count)
        yield start, stop
        start = stop


def _answered(jobs: list[tuple[int, PairJob]], threads: int, marks: ByteArray) -> list[_Done]:
    """The answers of all stretches of each pair, which leave their ``marks`` (P, 2, T) at distinct frames."""
    if not jobs:
        return []
    if threads <= 1:
        workspace = Workspace()
        return [
            (column, job, [job.stretch(*part, workspace, marks[column]) for part in _stretches(job, FRAMES_AT_ONCE)])
            for column, job in jobs
        ]
    here = local()

    def answer(job: PairJob, start: int, stop: int, own: ByteArray) -> FramesAnswer:
        if not hasattr(here, "workspace"):
            here.workspace = Workspace()
        return job.stretch(start, stop, here.workspace, own)

    with ThreadPoolExecutor(threads) as pool:
        parts = [
            [pool.submit(answer, job, *part, marks[column]) for part in _stretches(job, FRAMES_PER_TASK)]
            for column, job in jobs
        ]
        answers = [[part.result() for part in some] for some in parts]
    return [(column, job, some) for (column, job), some in zip(jobs, answers, strict=True)]


def _collected(done: list[_Done], marks: ByteArray, total: IntArray, faces: bool) -> MotionAnswer:
    entries, rows, row_count = [(NO_FRAMES,) * 4], [NO_FACES], 0
    for column, job, parts in done:
        own = marks[column]
        for part in parts:
            total += part.work
        if job.which is not job.everywhere:
            known = own[:, job.which]
            own[:] = 0
            own[:, job.frames] = known
        if faces and own[0].any():
            touching = np.flatnonzero(own[0, job.frames])
            found = np.concatenate([part.frame for part in parts])
            bounds = np.searchsorted(found, np.arange(job.count + 1)) + row_count
            which = job.which[touching]
            entries.append((job.frames[touching], np.full(len(touching), column), bounds[which], bounds[which + 1]))
            rows += [part.faces for part in parts]
            row_count += len(found)
    hits, near = marks.transpose(1, 0, 2).view(np.bool_)
    close = np.flatnonzero(near > hits)
    column = close // max(1, hits.shape[1])  # a second quotient, of divmod, takes longer than a product
    close -= column * hits.shape[1]
    frame, pair, start, stop = (np.concatenate(some) for some in zip(*entries, strict=True))
    order, reused = np.lexsort((pair, frame)), sum(len(job.frames) - job.count for _, job, _ in done)
    work = dict(zip(COUNTER_NAMES, total.tolist(), strict=True)) | {"reused": reused}
    return MotionAnswer(
        np.ascontiguousarray(hits.T), frame[order], pair[order], start[order], stop[order], np.concatenate(rows),
        (close, column), work, {},
    )  # fmt: skip
