"""Contacts of a group of bodies count as one, and frames without a pose within a contact are lost."""

import numpy as np
import pytest

from replay.auditing.outcome import Comparison, Episode, Outcome, joined_outcome

OUTCOMES = {
    ".": Outcome.NEITHER, "B": Outcome.BOTH, "M": Outcome.MISSED, "F": Outcome.FALSE_CONTACT,
    "t": Outcome.WITHIN_TOLERANCE, "b": Outcome.BETWEEN_FRAMES, "-": Outcome.LEFT_OUT, "g": Outcome.GRASPED,
}  # fmt: skip
"""What a detector and the reference say of a pair in a frame: neither or both report contact, it is missed, ..."""


def outcome_row(outcomes):
    """Outcomes of one frame (1, P), a letter a pair."""
    return np.array([[OUTCOMES[letter] for letter in outcomes]], dtype=np.uint8)


@pytest.mark.parametrize(
    ("members", "joined"),
    [
        ("..", "."), (".B", "B"), ("BM", "B"), ("MF", "B"), ("M.", "M"), ("-M", "M"), ("-F", "-"), ("gM", "g"),
        ("gB", "B"), ("tF", "F"), ("bt", "t"), ("b.", "b"),
    ],
)  # fmt: skip
def test_members_of_a_group_have_a_joint_outcome(members, joined):
    """Two bodies count as one against a third: a letter of OUTCOMES a member, in either order, and that of the group.

    Where one member is missed (M) and another reported falsely (F) both sides say contact of the group (B).
    """
    for outcomes in (members, members[::-1]):
        assert joined_outcome(outcome_row(outcomes)).tolist() == [OUTCOMES[joined]]


@pytest.mark.parametrize(
    ("first_pair_of_group", "by_contact"),
    [
        pytest.param([0, 1, 0], "BF.", id="first and third are a group"),
        pytest.param([0, 1, 2], "MFB", id="each alone"),
        pytest.param([0, 0, 0], "B..", id="all are a group"),
        pytest.param(None, "MFB", id="no groups"),
    ],
)
def test_contacts_of_a_group_stand_in_its_first_column(first_pair_of_group, by_contact):
    """In a frame the first of three pairs is missed (M), the second false (F), and both say contact of the third (B).

    A group has its joint outcome in the column of its first pair, and nothing (.) in those of the others.
    """
    columns = None if first_pair_of_group is None else np.array(first_pair_of_group)
    comparison = Comparison("subject", "oracle", outcome_row("MFB"), columns)
    assert comparison.by_contact.tolist() == outcome_row(by_contact).tolist()


def test_frames_without_a_pose_are_no_frames_of_contact():
    """A contact of frames 2 to 9; poses are lost in frames 3 and 4, and from 8 to 12, of which 8 and 9 are in it.

    Frames 4 to 8 of it hold two lost ones, 4 and 8; frames 5 to 7 none; frame 3 one.
    """
    contact = Episode(pair=0, first=2, last=9, start=0.0, end=1.0, lost=((3, 4), (8, 12)))
    assert (contact.frames_lost, contact.frames) == (2 + 2, 8 - 4)
    assert contact.lost_within(4, 8) == 2
    assert contact.lost_within(5, 7) == 0
    assert contact.lost_within(3, 3) == 1
