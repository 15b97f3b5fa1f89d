"""Frames that a search skips, and the poses of bodies with the lengths of their paths, which tell them.

Skipped is a frame that repeats the one before, and one in which two bodies certainly stay apart: how long they do is
known from the gap of two root boxes now and both paths (`next_frame_to_search`). A path bounds how far any point of its
body moves between two frames; it errs upwards only. Equal entries of consecutive frames lie side by side, as kernels
load them.

Frames of a live session are skipped in ``cdcore.broad.live_skips``; a pair whose poses repeat bit for bit keeps its
answer in ``cdcore.narrow.pair_frames``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from cdcore.kernels.compiling import always_inlined, hot_kernel, kernel, never_inlined
from cdcore.kernels.memory import Memory, address_of, doubles_of, fetch_early, integers_of, integers_of_rows, layout
from cdcore.kernels.simd import (
    LANES,
    above,
    dot,
    fused,
    load8,
    minus,
    most,
    moved,
    plus,
    root,
    splat8,
    store,
    times,
)
from cdcore.narrow.bvh.bounds import LARGEST_SIZE, LARGEST_SKEW, ROUNDOFF, SMALLEST_SIZE
from cdcore.narrow.bvh.box_tree import BoxTree
from cdcore.narrow.bvh.tree_memory import (
    BEYOND,
    GAP_TESTS,
    REUSED,
    SKIPPED,
    STEP,
    STRIDE,
    Pair,
    PoseMemory,
    pose_at,
)
from cdcore.numerics import BoolArray, FloatArray, IntArray

STEP_ULPS: Final = 16.0
"""Placing a centre rounds by at most 7 u of the body's size and distance; taken twice."""
GROWN: Final = 1.0 + 1e-12
"""Covers the rounding of a length, relative to it."""
ROWS, CENTRES = 12, 3
"""Rotation row by row, translation; world centre of the root box."""
SPARE: Final = 22
"""Entries of a row beside its frames, at most."""
AHEAD: Final = 24
"""Frames by which memory is asked early: the poses of one body lie too far apart for the machine to guess the next."""
SHORTEST_SKIP: Final = 4
"""Frames: a shorter skip saves less than the half-used block after it costs."""
GAP_FRACTION: Final = 1.0 - 1e-12
"""Share of a gap that two paths may use up: covers the rounding of what each moved, and of the sum."""


@hot_kernel
def copy_poses(
    rotation_entries: Memory, translation_entries: Memory, bodies: int, body: int, count: int, pose: PoseMemory
) -> None:
    """Fill the twelve rows of ``pose.entries`` with the first ``count`` of a body's poses, the last one repeated."""
    never_inlined()
    entries, stride = pose.entries, pose.stride
    for f in range(stride):
        later = min(f + AHEAD, count - 1) * bodies + body
        fetch_early(rotation_entries, 9 * later)
        fetch_early(rotation_entries, 9 * later + 8)
        fetch_early(translation_entries, 3 * later)
        row = min(f, count - 1) * bodies + body
        for k in range(9):
            entries[k * stride + f] = rotation_entries[9 * row + k]
        for k in range(3):
            entries[(9 + k) * stride + f] = translation_entries[3 * row + k]


@hot_kernel
def place_centres(pose: PoseMemory, x: float, y: float, z: float, lanes: Memory) -> float:
    """Fill centres, of a root box centred there, and distances; returns the largest skew, infinity where not finite.

    ``lanes`` (LANES,) is scratch.
    """
    never_inlined()
    entries, stride, skew, unknown = pose.entries, pose.stride, splat8(0.0), 0
    for f in range(0, stride, LANES):
        away, off = splat8(0.0), splat8(0.0)
        for i in range(3):
            p, q = load8(entries, 3 * i * stride + f), load8(entries, (3 * i + 1) * stride + f)
            r, t = load8(entries, (3 * i + 2) * stride + f), load8(entries, (9 + i) * stride + f)
            store(pose.centres, i * stride + f, moved(t, x, y, z, p, q, r))
            away = fused(t, t, away)
            for j in range(i, 3):
                u, v = load8(entries, i * stride + f), load8(entries, (3 + i) * stride + f)
                w, p = load8(entries, (6 + i) * stride + f), load8(entries, j * stride + f)
                q, r = load8(entries, (3 + j) * stride + f), load8(entries, (6 + j) * stride + f)
                product = dot(u, v, w, p, q, r)
                if i == j:
                    product = minus(product, 1.0)
                    off = fused(product, product, off)
                else:
                    off = fused(times(2.0, product), product, off)
        store(pose.away, f, times(root(away), GROWN))
        skew = most(off, skew)
        # a comparison with NaN gives no bit
        unknown |= 255 ^ above(np.inf, off)
    worst = 0.0
    store(lanes, 0, skew)
    for k in range(LANES):
        worst = max(worst, lanes[k])
    return np.inf if unknown != 0 else np.sqrt(worst) + 16.0 * ROUNDOFF


@hot_kernel
def fill_path(pose: PoseMemory, count: int, radius: float, reach: float) -> None:
    """Fill ``path`` of ``count`` frames for a root box of this half diagonal and a body of this reach."""
    never_inlined()
    entries, centres, stride, path = pose.entries, pose.centres, pose.stride, pose.path
    for f in range(0, stride - LANES, LANES):
        rotation_change, move = splat8(0.0), splat8(0.0)
        for k in range(9):
            change = minus(load8(entries, k * stride + f + 1), load8(entries, k * stride + f))
            rotation_change = fused(change, change, rotation_change)
        for k in range(CENTRES):
            change = minus(load8(centres, k * stride + f + 1), load8(centres, k * stride + f))
            move = fused(change, change, move)
        size = plus(plus(load8(pose.away, f), load8(pose.away, f + 1)), 2.0 * reach)
        path_length = fused(root(rotation_change), radius * GROWN, times(root(move), GROWN))
        store(path, f + 1, fused(size, STEP_ULPS * ROUNDOFF, path_length))
    total = path[0] = 0.0
    for f in range(1, count):
        # rounding of the sum so far is below 2 u of it: growing by 4 u keeps every difference an upper bound
        if pose.changed[f] != 0:
            grown = total * (1.0 + 4.0 * ROUNDOFF)
            total = grown + path[f]
        path[f] = total


@kernel
def fill_tracks(
    rotations: FloatArray,
    translations: FloatArray,
    changed: BoolArray,
    bodies: IntArray,
    rows: IntArray,
    ends: FloatArray,
    lanes: FloatArray,
) -> None:
    """Fill the memory that ``rows`` (n, words) of ``PoseMemory`` name for these bodies, and two words of each row.

    A body that rests keeps one pose for all frames. ``ends`` (n, 17): root box and reach. ``lanes`` (LANES,): scratch.
    """
    rotation_entries, translation_entries, scratch = doubles_of(rotations), doubles_of(translations), doubles_of(lanes)
    frames, many = changed.shape
    for k in range(len(bodies)):
        body, count = bodies[k], 1
        for f in range(1, frames):
            if changed[f, body]:
                count = frames
                break
        # Eight from any frame lie in a row, and whole eights.
        rows[k, STRIDE], rows[k, STEP] = (count + SPARE) // LANES * LANES, min(count - 1, 1)
        pose = pose_at(integers_of(rows), k)
        copy_poses(rotation_entries, translation_entries, many, body, count, pose)
        pose.facts[0] = place_centres(pose, ends[k, 0], ends[k, 1], ends[k, 2], scratch)
        pose.facts[1], pose.path[0], pose.changed[0] = ends[k, 16], 0.0, pose.step
        for f in range(1, count):
            pose.changed[f] = changed[f, body]
        if count > 1:
            fill_path(pose, count, ends[k, 15], ends[k, 16])


class Tracks:
    """The poses of some bodies in a stretch of frames, laid out by one call in one block of memory that is used again.

    ``bodies`` (n,) ascending numbers; ``rows`` (n,): each body's ``PoseMemory``.
    """

    def __init__(self, trees: Sequence[BoxTree], bodies: IntArray, frames: int) -> None:
        """Make room for at most so many frames of these of all bodies, each with a tree."""
        self.bodies, self.rows = bodies, np.zeros(len(bodies), dtype=layout(PoseMemory))
        self._ends = np.array([[*trees[body].boxes[0], trees[body].reach] for body in bodies.tolist()])
        row = frames + SPARE
        lengths = {"entries": ROWS * row, "centres": CENTRES * row, "away": row, "path": row, "facts": 2}
        self._room = np.empty((len(bodies), sum(lengths.values())))
        address = address_of(self._room) + self._room.strides[0] * np.arange(len(bodies))
        for name, length in lengths.items():
            self.rows[name] = address
            address = address + 8 * length
        self._changed = np.empty((len(bodies), frames), dtype=np.uint8)
        self.rows["changed"] = [address_of(row) for row in self._changed]
        self._memory_rows, self._lanes = integers_of_rows(self.rows), np.empty(LANES)

    def addresses_of(self, bodies: IntArray) -> IntArray:
        """Addresses of the rows of some of its bodies."""
        return address_of(self.rows) + self.rows.itemsize * np.searchsorted(self.bodies, bodies)

    def fill(self, rotations: FloatArray, translations: FloatArray, changed: BoolArray) -> None:
        """Lay out the poses (T, N, 3, 3), (T, N, 3) of all N bodies in a stretch, and where they change, (T, N).

        Its first frame counts as changed.
        """
        rotation_rows, translation_rows = np.ascontiguousarray(rotations)[:], np.ascontiguousarray(translations)[:]
        changed_rows = np.ascontiguousarray(changed)[:]
        for rows in (rotation_rows, translation_rows, changed_rows):
            # read-only like those of a motion: else the kernel would be compiled for both kinds
            rows.setflags(write=False)
        fill_tracks(
            rotation_rows, translation_rows, changed_rows, self.bodies, self._memory_rows, self._ends, self._lanes
        )


@hot_kernel
def distance_to_box(pose: PoseMemory, frame: int, box: Memory, x: float, y: float, z: float) -> float:
    """Distance of a point, given by its world offset from a root box's centre, to that box."""
    always_inlined()
    entries, stride = pose.entries, pose.stride
    bx = entries[frame] * x + entries[3 * stride + frame] * y + entries[6 * stride + frame] * z
    by = entries[stride + frame] * x + entries[4 * stride + frame] * y + entries[7 * stride + frame] * z
    bz = entries[2 * stride + frame] * x + entries[5 * stride + frame] * y + entries[8 * stride + frame] * z
    squared = 0.0
    for k in range(3):
        over = abs(box[3 + k] * bx + box[6 + k] * by + box[9 + k] * bz) - box[12 + k]
        if over > 0.0:
            squared += over * over
    distance: float = np.sqrt(squared)
    return distance


@hot_kernel
def root_gap(pair: Pair, frame: int, pad: float) -> float:
    """A distance the bodies certainly keep in this frame; not positive where none is certain."""
    never_inlined()
    pose_a, pose_b, boxes_a, boxes_b = pair.pose_a, pair.pose_b, pair.tree_a.boxes, pair.tree_b.boxes
    f_a, f_b = frame * pose_a.step, frame * pose_b.step
    x = pose_a.centres[f_a] - pose_b.centres[f_b]
    y = pose_a.centres[pose_a.stride + f_a] - pose_b.centres[pose_b.stride + f_b]
    z = pose_a.centres[2 * pose_a.stride + f_a] - pose_b.centres[2 * pose_b.stride + f_b]
    to_b = distance_to_box(pose_b, f_b, boxes_b, x, y, z) - boxes_a[15]
    to_a = distance_to_box(pose_a, f_a, boxes_a, x, y, z) - boxes_b[15]
    gap: float = max(to_a, to_b) - pad
    return gap


@hot_kernel
def uses_up(pair: Pair, frame: int, later: int, gap: float) -> bool:
    """Whether two bodies may have moved by the gap between two frames.

    The difference of each path comes first: a path of 18 million km is rounded to 4 micrometres, and so is its sum with
    another, which let bodies come nearer by that without a test.
    """
    always_inlined()
    pose_a, pose_b = pair.pose_a, pair.pose_b
    moved_a = pose_a.path[later * pose_a.step] - pose_a.path[frame * pose_a.step]
    moved_b = pose_b.path[later * pose_b.step] - pose_b.path[frame * pose_b.step]
    # asked this way round, paths that overflowed to NaN use up any gap
    return not moved_a + moved_b < gap * GAP_FRACTION


@hot_kernel
def first_unsafe(pair: Pair, frame: int, gap: float) -> int:
    """First frame by which the two paths together may have used up the gap; at most the last asked about and one."""
    never_inlined()
    step, safe, stop = 1, frame, pair.stop
    while safe + step < stop and not uses_up(pair, frame, safe + step, gap):
        safe += step
        step *= 2
    while step > 0:
        if safe + step < stop and not uses_up(pair, frame, safe + step, gap):
            safe += step
        step //= 2
    return safe + 1


@hot_kernel
def size_at(pair: Pair, frame: int) -> float:
    """The size S of ``cdcore.narrow.bvh.bounds`` in a frame."""
    always_inlined()
    a, b = pair.pose_a, pair.pose_b
    size: float = a.facts[1] + b.facts[1] + a.away[frame * a.step] + b.away[frame * b.step]
    return size


@hot_kernel
def poses_repeat(pair: Pair, frame: int) -> bool:
    """Whether both poses are those of the frame before."""
    always_inlined()
    a, b = pair.pose_a, pair.pose_b
    return bool(a.changed[frame * a.step] == 0 and b.changed[frame * b.step] == 0)


@hot_kernel
def next_frame_to_search(pair: Pair, frame: int, pad: float, work: Memory) -> int:
    """The next frame that is to be searched: marks frames that repeat the one before, or lie beyond the kernels.

    Bodies are certainly apart in the others that it passes. ``pad``: as a share of the size.
    """
    never_inlined()
    if frame > 0 and poses_repeat(pair, frame):
        pair.repeats[frame] = 1
        work[REUSED] += 1
        return frame + 1
    size, skew = size_at(pair, frame), pair.pose_a.facts[0] + pair.pose_b.facts[0]
    # asked this way round, a size that is not a number is beyond them
    if not (size >= SMALLEST_SIZE and size <= LARGEST_SIZE and skew <= LARGEST_SKEW):
        pair.volumes[frame] = BEYOND
        return frame + 1
    following = frame
    work[GAP_TESTS] += 1
    gap = root_gap(pair, frame, pad * size)
    if gap > 0.0:
        # sizes, and what a dismissal keeps, grow by no more than the bodies move
        following = first_unsafe(pair, frame, gap * (1.0 - 2.0 * pad))
        if following - frame < SHORTEST_SKIP and following < pair.stop:
            following = frame
    work[SKIPPED] += following - frame
    return following
