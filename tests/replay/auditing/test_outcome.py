"""Contacts of a group of bodies count as one, and frames without a pose within a contact are lost."""

import numpy as np
import pytest

from replay.auditing.outcome import Comparison, Episode, Outcome, joined_outcome

OUTCOMES = {
    ".": Outcome.NEITHER, "B": Outcome.BOTH, "M": Outcome.MISSED, "F": Outcome.FALSE_CONTACT,
    "t": Outcome.WITHIN_TOLERANCE, "b": Outcome.BETWEEN_FRAMES, "-": Outcome.LEFT_OUT, "g": Outcome.GRASPED,
}  # fmt: skip


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
    """A frame in which one member is missed and another reported falsely is a contact of both."""
    for outcomes in (members, members[::-1]):
        assert joined_outcome(outcome_row(outcomes)).tolist() == [OUTCOMES[joined]]


@pytest.mark.parametrize(
    ("contact_columns", "by_contact"), [([0, 1, 0], "BF."), ([0, 1, 2], "MFB"), ([0, 0, 0], "B.."), (None, "MFB")]
)
def test_contacts_of_a_group_stand_in_its_first_column(contact_columns, by_contact):
    """Three pairs are missed, false and both. ``contact_columns``: for each pair the first of its group.

    With [0, 1, 0] the first and third are a group: both (B) in column 0, and column 2 is empty.
    """
    columns = None if contact_columns is None else np.array(contact_columns)
    comparison = Comparison("subject", "oracle", outcome_row("MFB"), columns)
    assert comparison.by_contact.tolist() == outcome_row(by_contact).tolist()


def test_frames_without_a_pose_are_no_frames_of_contact():
    """Contact from frame 2 to 9; poses are lost in frames 3 and 4, and from 8 to 12."""
    contact = Episode(pair=0, first=2, last=9, start=0.0, end=1.0, lost=((3, 4), (8, 12)))
    assert (contact.frames_lost, contact.frames) == (4, 4)
    assert [contact.lost_within(*frames) for frames in ((4, 8), (5, 7), (3, 3))] == [2, 0, 1]
