"""Two trees against each other in a block of eight frames: depth first, lanes drop out as soon as they are decided."""

from __future__ import annotations

from typing import NamedTuple

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, fetch_early
from cdcore.narrow.spacetime.bounds import EDGE_SLACK
from cdcore.narrow.spacetime.leaf_test import survivors_of_leaves
from cdcore.narrow.spacetime.memory import PoseMemory, TreeMemory
from cdcore.narrow.spacetime.node_test import lanes_that_may_meet
from cdcore.narrow.spacetime.time_spans import SPAN_TESTS
from cdcore.narrow.spacetime.world_test import UNDECIDED, faces_meet

NODE_TESTS, LEAF_PAIRS, FACE_PAIRS, WORLD_TESTS, EXACT_TESTS, INTEGER_TESTS, BLOCKS, SKIPPED_FRAMES = range(8)
GAP_TESTS = SPAN_TESTS + 1
"""Places of the counters in ``work``; the exact stage fills its own two."""
COUNTERS = GAP_TESTS + 1
OPEN_A, OPEN_B, ASK = range(3)
"""What follows for two nodes that may meet: the children of one, or the faces of both."""


class BlockQuestion(NamedTuple):
    """What is asked of a pair, and how a face pair of a frame is packed into one number.

    Frames ``start`` to ``stop``; packed frames count from ``start``, faces take ``bits_a`` and ``bits_b`` bits.
    ``pad``: metres that a dismissal keeps. ``faces``: all face pairs; else a frame is done at its first one.
    """

    start: int
    stop: int
    pad: float
    faces: bool
    bits_a: int
    bits_b: int


class Lists(NamedTuple):
    """Lists that the kernels fill and their caller empties: place 0 counts what follows, ``_end`` is the memory.

    ``keys``: face pairs that meet, as frame, face of A, face of B. ``later``: those that only exact arithmetic decides,
    faces in leaf order.
    """

    keys: Memory
    keys_end: int
    later: Memory
    later_end: int


NEAR_LANES = 2
MOST_AT_ONCE = 512
"""Numbers that one step may add to a list: eight faces against eight in eight frames."""


class Scratch(NamedTuple):
    """Memory of a traversal, so that nothing is allocated inside it.

    ``state``: height of the stack and lanes still alive, for a traversal that stopped for its caller; at
    ``NEAR_LANES`` the lanes in which the two root boxes are not certainly apart.
    """

    stack: Memory
    relative: Memory
    middle: Memory
    offset: Memory
    turned: Memory
    moved: Memory
    plane: Memory
    span: Memory
    edges: Memory
    found: Memory
    state: Memory


@hot_kernel
def append(rows: Memory, value: int) -> None:
    """One more number on a list that has room."""
    become_part_of_caller()
    count = rows[0] + 1
    rows[count] = value
    rows[0] = count


@hot_kernel
def step_below(boxes_a: Memory, a: int, leaf_a: int, boxes_b: Memory, b: int, leaf_b: int) -> int:
    """What to do with two nodes that may meet: open the larger one that is no leaf, or ask their faces."""
    become_part_of_caller()
    if leaf_a >= 0 and leaf_b >= 0:
        return runtime_int(ASK)
    a_first = leaf_b >= 0 or (leaf_a < 0 and boxes_a[16 * a + 15] > boxes_b[16 * b + 15])
    return runtime_int(OPEN_A) if a_first else runtime_int(OPEN_B)


@hot_kernel
def first_child(tree: TreeMemory, node: int) -> int:
    """The first child of a node; memory is asked early for its sibling too."""
    become_part_of_caller()
    child = runtime_int(tree.links[2 * node])
    fetch_early(tree.links, 2 * child)
    for k in range(16 * child, 16 * child + 32, 8):
        fetch_early(tree.boxes, k)
    return child


@hot_kernel
def have_room(lists: Lists) -> bool:
    """Whether every list can take what one step may add."""
    become_part_of_caller()
    room: bool = min(lists.keys_end - lists.keys[0], lists.later_end - lists.later[0]) > MOST_AT_ONCE
    return room


@hot_kernel
def opened(
    tree_a: TreeMemory, a: int, tree_b: TreeMemory, b: int, kind: int, mask: int, stack: Memory, depth: int
) -> int:
    """Put both children of a node of A or B, each with the other node, on the stack; returns its height."""
    become_part_of_caller()
    if kind == OPEN_A:
        child = first_child(tree_a, a)
        stack[depth], stack[depth + 1], stack[depth + 3], stack[depth + 4] = child, b, child + 1, b
    else:
        child = first_child(tree_b, b)
        stack[depth], stack[depth + 1], stack[depth + 3], stack[depth + 4] = a, child, a, child + 1
    stack[depth + 2], stack[depth + 5] = mask, mask
    return depth + 6


@hot_kernel
def ask_face_pair(
    tree_a: TreeMemory, pose_a: PoseMemory, face_a: int, tree_b: TreeMemory, pose_b: PoseMemory, face_b: int,
    frame: int, asked: int, meet: int, question: BlockQuestion, lists: Lists, hits: Memory, scratch: Memory,
) -> int:  # fmt: skip
    """Ask two faces at the reference vertices, lane by lane; returns the lanes in contact, ``meet`` among them."""
    become_part_of_caller()
    edge_a = tree_a.planes[11 * face_a + 10] * EDGE_SLACK + question.pad
    edge_b = tree_b.planes[11 * face_b + 10] * EDGE_SLACK + question.pad
    key = (runtime_int(tree_a.faces[face_a]) << question.bits_b) | runtime_int(tree_b.faces[face_b])
    place = (face_a << question.bits_b) | face_b
    contact, lane, lanes = 0, 0, asked | meet
    while lanes != 0:
        if lanes & 1:
            row = frame + lane
            answer = 1 if meet >> lane & 1 else faces_meet(
                tree_a.placed, face_a, edge_a, pose_a.entries, pose_a.stride, row * pose_a.step,
                tree_b.placed, face_b, edge_b, pose_b.entries, pose_b.stride, row * pose_b.step, scratch,
            )  # fmt: skip
            packed = (row - question.start) << (question.bits_a + question.bits_b)
            if answer == 1:
                hits[row] = 1
                contact |= 1 << lane
                if question.faces:
                    append(lists.keys, packed | key)
            elif answer == UNDECIDED:
                append(lists.later, packed | place)
        lanes >>= 1
        lane += 1
    return contact


@hot_kernel
def ask_leaves(
    tree_a: TreeMemory, pose_a: PoseMemory, leaf_a: int, tree_b: TreeMemory, pose_b: PoseMemory, b: int, leaf_b: int,
    frame: int, mask: int, alive: int, question: BlockQuestion, lists: Lists, hits: Memory, work: Memory,
    scratch: Scratch,
) -> int:  # fmt: skip
    """Ask the faces of two leaves; returns the lanes still alive."""
    stay_one_function()
    found = scratch.found
    count = survivors_of_leaves(
        tree_a, leaf_a, tree_b, b, leaf_b, scratch.relative, scratch.offset, question.pad, mask, scratch.turned,
        scratch.moved, scratch.plane, scratch.span, scratch.edges, found,
    )  # fmt: skip
    work[LEAF_PAIRS] += 1
    work[FACE_PAIRS] += count
    for row in range(0, 4 * count, 4):
        asked, meet = found[row + 2] & alive, found[row + 3] & alive
        if asked | meet == 0:
            continue
        contact = ask_face_pair(
            tree_a, pose_a, found[row], tree_b, pose_b, found[row + 1], frame, asked, meet, question, lists, hits,
            scratch.plane,
        )  # fmt: skip
        while asked != 0:
            work[WORLD_TESTS] += asked & 1
            asked >>= 1
        if not question.faces:
            alive &= ~contact
    return alive


@hot_kernel
def traverse_block(
    tree_a: TreeMemory, pose_a: PoseMemory, tree_b: TreeMemory, pose_b: PoseMemory, frame: int, chord: float,
    question: BlockQuestion, lists: Lists, hits: Memory, work: Memory, scratch: Scratch,
) -> bool:  # fmt: skip
    """Decide one block, going on from ``scratch.state``; False when it stopped for its caller.

    It stops where a list is full; a boolean question also where a leaf pair leaves something open: the first contact
    ends it, and listing first what only exact arithmetic decides took 2 MB a frame of two plates in one plane.
    """
    stay_one_function()
    boxes_a, boxes_b, links_a, links_b = tree_a.boxes, tree_b.boxes, tree_a.links, tree_b.links
    stack, pad = scratch.stack, question.pad
    depth, alive = scratch.state[0], scratch.state[1]
    while depth > 0:
        depth -= 3
        a, b, mask = stack[depth], stack[depth + 1], stack[depth + 2] & alive
        if mask == 0:
            continue
        leaf_a, leaf_b = runtime_int(links_a[2 * a + 1]), runtime_int(links_b[2 * b + 1])
        mask = lanes_that_may_meet(
            boxes_a, a, boxes_b, b, scratch.relative, scratch.middle, chord, pad, mask, leaf_a >= 0 and leaf_b >= 0,
            scratch.offset,
        )  # fmt: skip
        work[NODE_TESTS] += 1
        if a == 0 and b == 0:
            scratch.state[NEAR_LANES] = mask
        if mask == 0:
            continue
        kind = step_below(boxes_a, a, leaf_a, boxes_b, b, leaf_b)
        if kind != ASK:
            depth = opened(tree_a, a, tree_b, b, kind, mask, stack, depth)
            continue
        if not have_room(lists):
            work[NODE_TESTS] -= 1
            scratch.state[0], scratch.state[1] = depth + 3, alive
            return False
        alive = ask_leaves(
            tree_a, pose_a, leaf_a, tree_b, pose_b, b, leaf_b, frame, mask, alive, question, lists, hits, work, scratch
        )
        if not question.faces and lists.later[0] > 0:
            scratch.state[0], scratch.state[1] = depth, alive
            return False
    return True
