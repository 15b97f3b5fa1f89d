"""Lost poses cut contacts, hide them, and are said: they never make several contacts of one."""

from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import STEP_NS, session_of_frames

from replay.document.certainty import certainty
from replay.document.gates import Gates
from replay.document.ranking import any_decided
from replay.engine import compute
from replay.show.run_tables import CUT_COLUMN, pair_table
from replay.show.sections import SectionName, section_of
from sessions.doctor.runs import runs
from sessions.model.session import Status
from sessions.synthetic.analytic import make_analytic
from sessions.synthetic.truth import PRESENT

X_OF_SECOND_CUBE = [3, 3.1, 3, 0.9, 0.9, 0.9, 0.9, 0.9, 0.9, 0.9, 3, 3.1, 0.9, 3, 3]
"""Metres, of a cube of 1 m beside one at 0, in 15 frames of 10 ms: contacts in frames 3 to 9, and in frame 12."""


def cubes_with_lost_poses(lost):
    """A session of two cubes, the second without a pose in the frames ``lost``."""
    status, position = np.ones((len(X_OF_SECOND_CUBE), 2)), np.zeros((len(X_OF_SECOND_CUBE), 2, 3))
    position[:, 1, 0] = X_OF_SECOND_CUBE
    status[list(lost), 1] = Status.LOST
    return session_of_frames(np.arange(len(X_OF_SECOND_CUBE)) * STEP_NS, status, position)


@pytest.fixture(scope="module")
def run_with_cut_contact():
    """A run in which the contact of frames 3 to 9 lost the poses of frames 5 and 7."""
    return compute(cubes_with_lost_poses([5, 7]), detectors="hybrid")


def test_touch_with_two_lost_segments_is_a_single_contact(run_with_cut_contact):
    """Two cubes touch in frames 3 to 9, without the poses of frames 5 and 7, and in frame 12.

    Rows are two contacts by both detectors, of which lost poses cut the first, twice.
    """
    episodes = run_with_cut_contact.tables["episodes"]
    rows = episodes.only("detector", "first", "last", "frames", "frames_lost", "cuts").rows
    assert rows == (
        ("hybrid", 3, 9, 5, 2, 2),
        ("hybrid", 12, 12, 1, 0, 0),
        ("exact", 3, 9, 5, 2, 2),
        ("exact", 12, 12, 1, 0, 0),
    )


def test_audit_counts_contacts_cut_by_lost_poses(run_with_cut_contact):
    """Two cubes touch in frames 3 to 9, without the poses of frames 5 and 7, and in frame 12.

    One of two contacts is cut; both are matched with those of exact, and none is taken for several.
    """
    audit = run_with_cut_contact.document.audit["hybrid"]
    assert (audit.contacts, audit.contacts_cut) == (2, 1)
    assert (audit.matching.matched, audit.matching.split) == (2, 0)
    (pair,) = run_with_cut_contact.document.pairs
    assert {label: lengths.cut for label, lengths in pair.contacts.items()} == {"hybrid": 1, "exact": 1}
    sentence = run_with_cut_contact.answers[0].sentence
    assert sentence.endswith("no contact of 2 missed, none false. Lost poses cut 1 of 2 contacts.")


def test_frames_without_a_pose_break_no_gate(run_with_cut_contact):
    """A contact lost the poses of two of its frames; no miss is allowed (``max_missed`` 0).

    Frames that nobody could see are no frames of contact that a detector left undecided.
    """
    assert Gates(max_missed=0.0).broken_limits(run_with_cut_contact.document.audit, session_times=[]) == []


def test_column_of_cut_contacts_stands_only_where_any_is_cut(run_with_cut_contact):
    """In the table of pairs; poses are lost within a contact, or, in the other run, in frame 1 without contact."""
    lost_beside_contacts = compute(cubes_with_lost_poses([1]), detectors="hybrid")
    assert CUT_COLUMN in pair_table(run_with_cut_contact, "hybrid").head
    assert CUT_COLUMN not in pair_table(lost_beside_contacts, "hybrid").head


@pytest.mark.parametrize("detectors", ["hybrid", "hybrid,slow=discrete[rate_hz=50]"], ids=["one", "two"])
def test_lost_poses_that_hide_every_contact_are_reported_first(detectors):
    """The only contacts are in frames 3 to 9 and in frame 12 of 15, and the poses of all these eight frames are lost.

    The first sentence on the first detector says so, of one detector and of two.
    """
    run = compute(cubes_with_lost_poses([*range(3, 10), 12]), detectors=detectors)
    assert run.answers[0].sentence.startswith("No contact found, but poses are lost in 8 of 15 pair-frames")


def test_losing_every_seventh_pose_keeps_the_number_of_contacts():
    """The contacts of a ball on a plate are known in closed form; lost poses cut all of them, and none becomes two.

    Frames 6, 13, 20 ... lose their poses. The frames of the contacts are those of the truth, without the lost ones.
    """
    whole, truth = make_analytic("ball-plate", seconds=9.5)
    frames = whole.frames
    is_contact = truth.expected("ball", "plate", frames.stamp_ns) == PRESENT
    is_lost = np.arange(len(frames.status)) % 7 == 6
    status = frames.status.copy()
    status[is_lost] = Status.LOST
    result = compute(replace(whole, source=replace(frames, status=status)), detectors="hybrid", offline=True)
    contacts = len(runs(is_contact))
    assert contacts > 1
    assert len(result.episodes["exact"]) == len(result.episodes["hybrid"]) == contacts
    assert f"Lost poses cut {contacts} of {contacts} contacts" in result.answers[0].sentence
    assert sum(contact.frames for contact in result.episodes["exact"]) == (is_contact & ~is_lost).sum()


def test_body_lost_in_every_frame_leaves_nothing_compared():
    """The first cube moves, the second has no pose in any of 15 frames: that is neither clear nor contact."""
    session = cubes_with_lost_poses(range(len(X_OF_SECOND_CUBE)))
    frames = session.frames
    positions = frames.position.copy()
    positions[:, 0, 1] = np.arange(len(positions)) * 0.1
    result = compute(replace(session, source=replace(frames, position=positions)), detectors="discrete")
    (headline,) = section_of(result, SectionName.ANSWER).sentences[:1]
    assert headline == "Nothing compared: each of 15 pair-frames lacks the pose of a body."
    assert certainty(result.document, result.ranking)[0] == "Not at all: nothing was compared."
    assert not any_decided(result.document)
