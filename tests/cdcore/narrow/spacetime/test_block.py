"""Lists grow by one number at a time and say when they are full."""

import numpy as np

from cdcore.kernels.compiling import kernel
from cdcore.narrow.spacetime.block import MOST_AT_ONCE, Lists, append, have_room, note


@kernel
def add(lists, value):
    append(lists.keys, value)
    note(lists, value, value + 1, value + 2, value + 3, value + 4)
    return have_room(lists)


def test_appending_keeps_the_order_and_the_length_in_front():
    length = MOST_AT_ONCE + 20
    lists = Lists(*(part for _ in range(3) for part in (np.zeros(length, dtype=np.int64), length)))
    room = [add(lists, value) for value in range(1, 6)]
    assert lists.keys[:6].tolist() == [5, 1, 2, 3, 4, 5]
    assert lists.dismissed[0] == 20
    assert lists.dismissed[1:5].tolist() == [1, 2, 3, (4 << 32) | 5]
    assert room == [True, True, True, True, False]
