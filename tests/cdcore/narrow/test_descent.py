"""A descent asks about all leaves that meet, child by child, and goes on where it stopped."""

from typing import NamedTuple

import pytest

from cdcore.narrow.descent import CLOSED, DESCENT_STATES, FIRST, SECOND, STOP, descend, start_at

LEAVES = 8
FIRST_LEAF = LEAVES - 1


class Segments(NamedTuple):
    """Two trees over the segments [k, k + 1] of a line, B's moved in each lane; and what is noted of them."""

    moves: list
    opens_both: bool
    enough: int
    room: list
    leaves: list


def bounds(node):
    """First and last place of what lies below a node; its children are 2 node + 1 and 2 node + 2."""
    first = last = node
    while first < FIRST_LEAF:
        first, last = 2 * first + 1, 2 * last + 2
    return first - FIRST_LEAF, last - FIRST_LEAF + 1


def lanes_that_meet(query, a, b, lanes):
    """Lanes, as bits, in which the intervals of two nodes meet."""
    (first_a, last_a), (first_b, last_b) = bounds(a), bounds(b)
    meets = [first_a <= last_b + move and first_b + move <= last_a for move in query.moves]
    return lanes & sum(1 << lane for lane, meet in enumerate(meets) if meet)


def opened(query, a, b):
    """Children of the two nodes that are visited next, one for each node or CLOSED."""
    children = [2 * node + 1 if node < FIRST_LEAF else CLOSED for node in (a, b)]
    if query.opens_both or CLOSED in children:
        return children
    return (children[0], CLOSED) if a <= b else (CLOSED, children[1])


def note_leaves(query, a, b, lanes):
    """Note both, and return the lanes that have met often enough; stop where the room is used up."""
    if not query.room:
        return STOP
    query.room.pop()
    query.leaves.append((a - FIRST_LEAF, b - FIRST_LEAF, lanes))
    counts = [sum(noted >> lane & 1 for _, _, noted in query.leaves) for lane in range(len(query.moves))]
    return sum(1 << lane for lane, count in enumerate(counts) if count >= query.enough)


def descend_through(next_child, *, moves=(0, 2, 5, 40), opens_both=False, enough=LEAVES**2, room=LEAVES**2):
    """Leaf pairs that the descent visits, with the lanes in which they meet, and how often it stopped for want of room.

    ``moves``: of the second row of leaves, a lane each; ``enough``: meetings after which a lane is searched no longer.
    """
    stack, state, stops = [0] * 99, [0] * DESCENT_STATES, 0
    query = Segments(moves, opens_both, enough, [None] * room, [])
    start_at(0, 0, (1 << len(moves)) - 1, stack, state)
    while not descend(query, stack, state, lanes_that_meet, opened, note_leaves, next_child):
        query.room.extend([None] * room)
        stops += 1
    return query.leaves, stops


each_order = pytest.mark.parametrize("next_child", [FIRST, SECOND], ids=["first child first", "second child first"])


@each_order
@pytest.mark.parametrize("opens_both", [False, True], ids=["opens one node", "opens both nodes"])
def test_descent_visits_exactly_the_leaf_pairs_that_meet(next_child, opens_both):
    """Two binary trees over 8 unit intervals in a row; a lane is a pose, in which the second row is moved.

    Intervals i and j + move meet where they are the same or neighbours. Lanes are bits, 1, 2 and 4.
    """
    moves = (0, 2, 5)
    expected = []
    for i in range(LEAVES):
        for j in range(LEAVES):
            lanes = sum(1 << lane for lane, move in enumerate(moves) if abs(i - (j + move)) <= 1)
            if lanes:
                expected.append((i, j, lanes))
    leaves, _stops = descend_through(next_child, moves=moves, opens_both=opens_both)
    assert sorted(leaves) == expected


@each_order
def test_descent_begins_with_the_first_leaves_where_first_goes_first(next_child):
    """The first intervals of both rows meet where the second row is not moved."""
    leaves, _stops = descend_through(next_child, moves=(0,))
    first_i, first_j, _lanes = leaves[0]
    assert ((first_i, first_j) == (0, 0)) == (next_child == FIRST)


@each_order
def test_descent_resumed_after_a_full_buffer_visits_the_same_leaves(next_child):
    """The buffer holds three leaf pairs: the descent stops at each that finds it full, the 4th, the 7th, and so on."""
    whole, _stops = descend_through(next_child)
    resumed, stops = descend_through(next_child, room=3)
    assert resumed == whole
    assert stops == (len(whole) - 1) // 3


@each_order
def test_descent_skips_lanes_that_already_met(next_child):
    """Four poses (lanes) of two trees are searched together until each has met once (``enough``).

    Lanes 0 to 2 meet, at moves of 0, 2 and 5; lane 3, moved by 40 intervals from a row of 8, never does.
    """
    leaves, _stops = descend_through(next_child, moves=(0, 2, 5, 40), enough=1)
    lanes_that_met = [lane for _, _, lanes in leaves for lane in range(4) if lanes >> lane & 1]
    assert sorted(lanes_that_met) == [0, 1, 2]
