"""Names of bodies, groups and contacts of an assembly, and its second 0."""

import numpy as np
import pytest
from support.shapes import box_mesh

from cdcore import Body, Motion
from replay.prepare.assembly import Assembly

SECOND_NS = 1_000_000_000


@pytest.fixture
def hand_and_glass():
    """Two fingers of one hand, a glass, and every pair of them, in a frame 2 s after second 0."""
    thumb, index, glass = 0, 1, 2
    return Assembly(
        bodies=tuple(Body(name, box_mesh()) for name in ("thumb", "index", "glass")),
        motion=Motion(np.array([2.0]), np.zeros((1, 3, 3)), np.tile(np.eye(3), (1, 3, 1, 1))),
        pairs=np.array([[thumb, glass], [thumb, index], [index, glass]]),
        grasped=np.zeros(3, bool),
        stamp_ns=np.array([7 * SECOND_NS]),
        origin=np.ones((1, 3), np.uint8),
        group_of={"thumb": "hand", "index": "hand"},
    )


def test_members_of_a_group_are_named_with_it(hand_and_glass):
    """Pairs are thumb and glass, thumb and index, index and glass; between two members the group is not named."""
    assert [hand_and_glass.pair_name(pair) for pair in range(3)] == ["hand-glass", "thumb-index", "hand-glass"]
    names = [hand_and_glass.fault_names(pair) for pair in range(3)]
    assert names == [("hand (thumb)", "glass"), ("thumb", "index"), ("hand (index)", "glass")]


def test_contacts_of_a_group_are_counted_in_its_first_column(hand_and_glass):
    """Columns 0 and 2 are of a finger and the glass, both the hand's: contacts of both are counted in column 0.

    Column 1 is of the two fingers and stands alone.
    """
    assert hand_and_glass.contact_columns.tolist() == [0, 1, 0]
    assert [hand_and_glass.columns_of_contact(pair) for pair in range(3)] == [[0, 2], [1], [0, 2]]


def test_second_zero_is_the_first_stamp_less_its_time(hand_and_glass):
    """The only frame has the stamp of 7 s and the time of 2 s: second 0 was at 5 s."""
    assert hand_and_glass.first_ns == (7 - 2) * SECOND_NS
