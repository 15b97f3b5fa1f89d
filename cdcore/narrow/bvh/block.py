"""Two trees against each other in a block of eight frames: depth first, lanes drop out as soon as they are decided."""

from __future__ import annotations

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, fetch_early
from cdcore.kernels.simd import load4, plus, times
from cdcore.narrow.bvh.box_lanes import lanes_that_may_meet
from cdcore.narrow.bvh.leaf_lanes import survivors_of_leaves
from cdcore.narrow.bvh.tree_memory import ALIVE, DEPTH, MOST_AT_ONCE, Pair, PoseMemory, Question, Scratch, TreeMemory
from cdcore.narrow.triangles.filter import UNDECIDED, Corners, faces_meet_filtered

NODE_TESTS, LEAF_PAIRS, FACE_PAIRS, WORLD_TESTS, EXACT_TESTS, INTEGER_TESTS, BLOCKS, SKIPPED = range(8)
GAP_TESTS, REUSED = 8, 9
"""Places of the counters in ``work``; the exact stage fills its own two."""
COUNTERS = 10


@hot_kernel
def append(rows: Memory, value: int) -> None:
    """One more number on a list that has room."""
    become_part_of_caller()
    count = rows[0] + 1
    rows[count] = value
    rows[0] = count


@hot_kernel
def have_room(scratch: Scratch) -> bool:
    """Whether both lists can take what two leaves may add."""
    become_part_of_caller()
    room: bool = min(scratch.keys_end - scratch.keys[0], scratch.later_end - scratch.later[0]) > MOST_AT_ONCE
    return room


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
def opened(pair: Pair, a: int, b: int, open_a: bool, mask: int, stack: Memory, depth: int) -> int:
    """Put both children of a node of A or B, each with the other node, on the stack; returns its height."""
    become_part_of_caller()
    if open_a:
        child = first_child(pair.tree_a, a)
        stack[depth], stack[depth + 1], stack[depth + 3], stack[depth + 4] = child, b, child + 1, b
    else:
        child = first_child(pair.tree_b, b)
        stack[depth], stack[depth + 1], stack[depth + 3], stack[depth + 4] = a, child, a, child + 1
    stack[depth + 2], stack[depth + 5] = mask, mask
    return depth + 6


@hot_kernel
def place_face(placed: Memory, face: int, pose: PoseMemory, frame: int) -> Corners:
    """World corners of a face, rounded as the reference vertices: no fused multiply-add."""
    become_part_of_caller()
    row, entries, stride, at = 12 * face, pose.entries, pose.stride, frame * pose.step
    x, y, z = load4(placed, row), load4(placed, row + 4), load4(placed, row + 8)
    a, b, c = entries[at], entries[at + stride], entries[at + 2 * stride]
    wx = plus(plus(plus(times(a, x), times(b, y)), times(c, z)), entries[at + 9 * stride])
    a, b, c = entries[at + 3 * stride], entries[at + 4 * stride], entries[at + 5 * stride]
    wy = plus(plus(plus(times(a, x), times(b, y)), times(c, z)), entries[at + 10 * stride])
    a, b, c = entries[at + 6 * stride], entries[at + 7 * stride], entries[at + 8 * stride]
    wz = plus(plus(plus(times(a, x), times(b, y)), times(c, z)), entries[at + 11 * stride])
    return Corners(wx, wy, wz)


@hot_kernel
def faces_meet(pair: Pair, face_a: int, face_b: int, frame: int) -> int:
    """Whether two faces meet at the reference vertices of a frame: 0, 1, or UNDECIDED for exact arithmetic."""
    stay_one_function()
    first = place_face(pair.tree_a.placed, face_a, pair.pose_a, frame)
    return faces_meet_filtered(first, place_face(pair.tree_b.placed, face_b, pair.pose_b, frame))


@hot_kernel
def ask_face_pair(
    pair: Pair, face_a: int, face_b: int, frame: int, asked: int, meet: int, question: Question, scratch: Scratch
) -> int:
    """Ask two faces at the reference vertices, lane by lane; returns the lanes in contact, ``meet`` among them."""
    become_part_of_caller()
    key = (runtime_int(pair.tree_a.faces[face_a]) << question.bits_b) | runtime_int(pair.tree_b.faces[face_b])
    place = (face_a << question.bits_b) | face_b
    contact, lane, lanes = 0, 0, asked | meet
    while lanes != 0:
        if lanes & 1:
            row = frame + lane
            answer = 1 if meet >> lane & 1 else faces_meet(pair, face_a, face_b, row)
            packed = (row - question.start) << question.bits
            if answer == 1:
                question.hits[row] = 1
                contact |= 1 << lane
                if question.every:
                    append(scratch.keys, packed | key)
            elif answer == UNDECIDED:
                append(scratch.later, packed | place)
        lanes >>= 1
        lane += 1
    return contact


@hot_kernel
def ask_leaves(
    pair: Pair, a: int, b: int, frame: int, mask: int, pad: float, question: Question, scratch: Scratch
) -> int:
    """Ask the faces of two leaf nodes in the lanes of ``mask``; returns the lanes that are decided."""
    stay_one_function()
    found, work, decided = scratch.found, scratch.work, 0
    count = survivors_of_leaves(pair, a, b, pad, mask, scratch)
    work[LEAF_PAIRS] += 1
    work[FACE_PAIRS] += count
    for row in range(0, 4 * count, 4):
        asked, meet = found[row + 2] & ~decided, found[row + 3] & ~decided
        if asked | meet == 0:
            continue
        contact = ask_face_pair(pair, found[row], found[row + 1], frame, asked, meet, question, scratch)
        while asked != 0:
            work[WORLD_TESTS] += asked & 1
            asked >>= 1
        if not question.every:
            decided |= contact
    return decided


@hot_kernel
def search_block(pair: Pair, frame: int, chord: float, pad: float, question: Question, scratch: Scratch) -> bool:
    """Decide one block, going on from ``scratch.state``; False when it stopped because a list was full."""
    stay_one_function()
    boxes_a, boxes_b, links_a, links_b = pair.tree_a.boxes, pair.tree_b.boxes, pair.tree_a.links, pair.tree_b.links
    stack, state, work = scratch.stack, scratch.state, scratch.work
    depth, alive = state[DEPTH], state[ALIVE]
    while depth > 0:
        depth -= 3
        a, b, mask = stack[depth], stack[depth + 1], stack[depth + 2] & alive
        if mask == 0:
            continue
        leaf_a, leaf_b = runtime_int(links_a[2 * a + 1]), runtime_int(links_b[2 * b + 1])
        both = leaf_a >= 0 and leaf_b >= 0
        mask = lanes_that_may_meet(boxes_a, a, boxes_b, b, chord, pad, mask, both, scratch)
        work[NODE_TESTS] += 1
        if a == 0 and b == 0:
            for lane in range(8):
                if mask >> lane & 1:
                    question.volumes[frame + lane] = 1
        if mask == 0:
            continue
        if not both:
            open_a = leaf_b >= 0 or (leaf_a < 0 and boxes_a[16 * a + 15] > boxes_b[16 * b + 15])
            depth = opened(pair, a, b, open_a, mask, stack, depth)
            continue
        if not have_room(scratch):
            work[NODE_TESTS] -= 1
            state[DEPTH], state[ALIVE] = depth + 3, alive
            return False
        alive &= ~ask_leaves(pair, a, b, frame, mask, pad, question, scratch)
    return True
