"""The one way down two trees: a pair of nodes after the other is dropped, opened, or asked about.

A query is a named tuple of what it reads and writes, and three kernels, which are compiled into the descent:

- ``box_test(query, a, b, lanes)``: the lanes in which the boxes of two nodes are not certainly apart.
- ``opened(query, a, b)``: the first child of each node that opens, ``CLOSED`` for a node that does not.
- ``leaf_work(query, a, b, lanes)``: for two nodes of which none opens. Returns the lanes that are decided and asked no
  more, or ``STOP`` where there is no room for what these nodes may add.

===================  ==================  =========================  ======================  ===========================
query                lanes               box test                   opens                   leaf work
===================  ==================  =========================  ======================  ===========================
``bvh.traverse``     frames, up to 8     spheres, 6 axes, 15 for    the larger box          faces that meet: the first
                                         two leaves                                         or all, in each frame
``continuous``       one, a motion       6 axes at both ends, and   the larger, unless the  faces that may meet; nodes
                     over an interval    the way between            motion is longer        for a shorter interval
``clearance``        one, at rest        the same, and a reach      the larger box          ends it at the first
``published_trees``  one pose            a row of ``TREE_KINDS``: world's axes, 15 or 6;    faces that meet: the first
                                         the larger box or both                             or all, within a budget
===================  ==================  =========================  ======================  ===========================
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, TypeVar

from cdcore.kernels.compiling import always_inlined, hot_kernel
from cdcore.kernels.memory import Memory

Query = TypeVar("Query")

CLOSED: Final = -1
"""In place of a first child: the node stays as it is."""
STOP: Final = -1
"""In place of decided lanes: the descent ends here, and goes on from the same two nodes when it is called again."""

DEPTH, ALIVE = range(2)
"""Places of the state of a descent: height of the stack, and lanes not yet decided. A query may keep more behind it."""
DESCENT_STATES: Final = 2
FIRST, SECOND = range(2)
"""Which of two children is asked before the other."""
WIDTH: Final = 3
"""Numbers of a pair on the stack: node of A, node of B, lanes."""


@hot_kernel
def start_at(a: int, b: int, lanes: int, stack: Memory, state: Memory) -> None:
    """Let a descent begin at two nodes, in these lanes."""
    always_inlined()
    state[DEPTH], state[ALIVE] = push(a, b, lanes, stack, 0), lanes


@hot_kernel
def push(a: int, b: int, lanes: int, stack: Memory, depth: int) -> int:
    """Put a pair on the stack; returns its height."""
    always_inlined()
    stack[depth], stack[depth + 1], stack[depth + 2] = a, b, lanes
    return depth + WIDTH


@hot_kernel
def descend(
    query: Query,
    stack: Memory,
    state: Memory,
    box_test: Callable[[Query, int, int, int], int],
    opened: Callable[[Query, int, int], tuple[int, int]],
    leaf_work: Callable[[Query, int, int, int], int],
    next_child: int,
) -> bool:
    """Go down from the pairs on the stack until none is left; False where the leaf work stopped it.

    Of two children the ``next_child``, FIRST or SECOND, is asked before the other. A pair puts two on the stack in its
    place, or four where both nodes open.
    """
    always_inlined()
    depth, alive, other = state[DEPTH], state[ALIVE], 1 - next_child
    while depth > 0:
        depth -= WIDTH
        a, b, lanes = stack[depth], stack[depth + 1], stack[depth + 2] & alive
        if lanes == 0:
            continue
        lanes = box_test(query, a, b, lanes)
        if lanes == 0:
            continue
        child_a, child_b = opened(query, a, b)
        if child_a >= 0 and child_b >= 0:
            depth = push(child_a + other, child_b + other, lanes, stack, depth)
            depth = push(child_a + other, child_b + next_child, lanes, stack, depth)
            depth = push(child_a + next_child, child_b + other, lanes, stack, depth)
            depth = push(child_a + next_child, child_b + next_child, lanes, stack, depth)
        elif child_a >= 0:
            depth = push(child_a + other, b, lanes, stack, depth)
            depth = push(child_a + next_child, b, lanes, stack, depth)
        elif child_b >= 0:
            depth = push(a, child_b + other, lanes, stack, depth)
            depth = push(a, child_b + next_child, lanes, stack, depth)
        else:
            decided = leaf_work(query, a, b, lanes)
            if decided == STOP:
                state[DEPTH], state[ALIVE] = depth + WIDTH, alive
                return False
            alive &= ~decided
    return True
