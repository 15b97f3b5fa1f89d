"""One pair of bodies over all its frames: path-length skips, then blocks of eight frames through both trees."""

from __future__ import annotations

import numpy as np

from cdcore.narrow.compiling import kernel, stay_one_function
from cdcore.narrow.spacetime.block import (
    BLOCKS,
    BY_PATH,
    MOST_AT_ONCE,
    SKIPPED_FRAMES,
    Lists,
    Question,
    Scratch,
    have_room,
    note,
    traverse_block,
)
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.spacetime.lanes import LANES
from cdcore.narrow.spacetime.pose_lanes import PoseLanes
from cdcore.narrow.spacetime.relative_poses import fill_relative, largest_chord
from cdcore.narrow.spacetime.skips import first_unsafe, root_gap
from cdcore.numerics import ByteArray, IntArray

SHORTEST_SKIP = 4
"""Frames: a shorter skip saves less than the half-used block after it costs."""
MOST_LEAF_CORNERS = 24
"""Three for each of at most eight faces of a leaf."""


@kernel
def longer(rows: IntArray) -> IntArray:
    """The list itself if it has room for one step, else a copy in twice the room."""
    stay_one_function()
    if len(rows) - rows[0] > 2 * MOST_AT_ONCE:
        return rows
    copy = np.empty(2 * len(rows) + 2 * MOST_AT_ONCE, dtype=np.int64)
    for k in range(rows[0] + 1):
        copy[k] = rows[k]
    return copy


@kernel
def lengthened(lists: Lists) -> Lists:
    """The lists, each with room for one step."""
    stay_one_function()
    return Lists(longer(lists.keys), longer(lists.later), longer(lists.dismissed))


@kernel
def traverse_pair(
    tree_a: BoxTree, pose_a: PoseLanes, tree_b: BoxTree, pose_b: PoseLanes, question: Question, hits: ByteArray,
    work: IntArray,
) -> Lists:  # fmt: skip
    """Decide the frames of a question; sets ``hits`` to 1 in frames with contact and returns what was found."""
    scratch = Scratch(
        np.empty(3 * (len(tree_a.links) + len(tree_b.links) + 2), dtype=np.int64), np.empty(96), np.empty(9),
        np.empty(24), np.empty(72), np.empty(24 * MOST_LEAF_CORNERS), np.empty(32), np.empty(48),
        np.empty(192, dtype=np.int64), np.empty(2, dtype=np.int64),
    )  # fmt: skip
    lists = Lists(np.empty(4096, np.int64), np.empty(1024, np.int64), np.empty(1024, np.int64))
    lists.keys[0], lists.later[0], lists.dismissed[0] = 0, 0, 0
    f = question.start
    while f < question.stop:
        if not have_room(lists):
            lists = lengthened(lists)
        gap = root_gap(tree_a.boxes, pose_a, tree_b.boxes, pose_b, f, question.pad)
        if gap > 0.0:
            following = first_unsafe(pose_a, pose_b, f, question.stop, gap)
            if following - f >= SHORTEST_SKIP or following == question.stop:
                work[SKIPPED_FRAMES] += following - f
                if question.record:
                    note(lists, BY_PATH, f, following - 1, 0 * f, 0 * f)
                f = following
                continue
        lanes = min(LANES, question.stop - f)
        fill_relative(pose_a, pose_b, f, scratch.relative)
        chord = largest_chord(scratch.relative, lanes // 2, lanes, scratch.middle, scratch.plane)
        work[BLOCKS] += 1
        scratch.stack[0], scratch.stack[1], scratch.stack[2] = 0, 0, (1 << lanes) - 1
        scratch.state[0], scratch.state[1] = 3, (1 << lanes) - 1
        while not traverse_block(tree_a, pose_a, tree_b, pose_b, f, chord, question, lists, hits, work, scratch):
            lists = lengthened(lists)
        f += lanes
    return lists
