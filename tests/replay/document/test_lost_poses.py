"""Lost poses cut contacts, hide them, and are said: they never make several contacts of one."""

from dataclasses import replace

import numpy as np
from support.small_worlds import STEP_NS, session_of_frames

from replay.document.gates import Gates
from replay.engine import compute
from replay.show.run_tables import CUT_COLUMN, pair_table
from sessions.doctor.runs import runs
from sessions.model.session import Status
from sessions.synthetic.analytic import make_analytic
from sessions.synthetic.truth import PRESENT

X_OF_SECOND_CUBE = [3, 3.1, 3, 0.9, 0.9, 0.9, 0.9, 0.9, 0.9, 0.9, 3, 3.1, 0.9, 3, 3]
"""Two contacts: frames 3 to 9, and frame 12."""


def cubes_with_lost_poses(lost):
    """Two cubes, the second without a pose in the frames ``lost``."""
    status, position = np.ones((len(X_OF_SECOND_CUBE), 2)), np.zeros((len(X_OF_SECOND_CUBE), 2, 3))
    position[:, 1, 0] = X_OF_SECOND_CUBE
    status[list(lost), 1] = Status.LOST
    return session_of_frames(np.arange(len(X_OF_SECOND_CUBE)) * STEP_NS, status, position)


def test_touch_with_two_lost_segments_is_a_single_contact():
    """The contact of frames 3 to 9 loses frames 5 and 7: rows are (first, last, frames, frames lost, cuts).

    The table of pairs has a column of cut contacts, which it has not where a pose is lost in no contact.
    """
    result = compute(cubes_with_lost_poses([5, 7]), detectors="hybrid")
    lost_beside_contacts = compute(cubes_with_lost_poses([1]), detectors="hybrid")
    assert CUT_COLUMN in pair_table(result, "hybrid").head
    assert CUT_COLUMN not in pair_table(lost_beside_contacts, "hybrid").head
    audit = result.document.audit["hybrid"]
    assert (audit.contacts, audit.contacts_cut) == (2, 1)
    assert [actual.cut for actual in result.document.pairs[0].contacts.values()] == [1, 1]
    assert (audit.matching.matched, audit.matching.split) == (2, 0)
    assert result.answers[0].sentence.endswith("no contact of 2 missed, none false. Lost poses cut 1 of 2 contacts.")
    reported = result.tables["episodes"].only("detector", "first", "last", "frames", "frames_lost", "cuts").rows
    both = [(3, 9, 5, 2, 2), (12, 12, 1, 0, 0)]
    assert reported == tuple((label, *item) for label in ("hybrid", "exact") for item in both)
    # A frame that nobody could see is no frame of contact left undecided.
    assert Gates(max_missed=0.0).broken_limits(result.document.audit, []) == []


def test_lost_poses_that_hide_every_contact_are_reported_first():
    """All eight frames of both contacts are lost, of 15."""
    text = compute(cubes_with_lost_poses([*range(3, 10), 12]), detectors="hybrid").answers[0].sentence
    assert text.startswith("No contact found") and "poses are lost in 8 of 15 pair-frames" in text
    text = (
        compute(cubes_with_lost_poses([*range(3, 10), 12]), detectors="hybrid,slow=discrete[rate_hz=50]")
        .answers[0]
        .sentence
    )
    assert "poses are lost in 8 of 15 pair-frames" in text


def test_losing_every_seventh_pose_keeps_the_number_of_contacts():
    """The contacts of a ball on a plate are known in closed form; all are cut, and none becomes two."""
    whole, truth = make_analytic("ball-plate", seconds=9.5)
    frames = whole.frames
    contact = truth.expected("ball", "plate", frames.stamp_ns) == PRESENT
    status = frames.status.copy()
    lost = np.arange(len(status)) % 7 == 6
    status[lost] = Status.LOST
    result = compute(replace(whole, source=replace(frames, status=status)), detectors="hybrid")
    spans = runs(contact).tolist()
    assert len(result.episodes["exact"]) == len(result.episodes["hybrid"]) == len(spans)
    assert f"Lost poses cut {len(spans)} of {len(spans)} contacts" in result.answers[0].sentence
    assert sum(item.frames for item in result.episodes["exact"]) == int((contact & ~lost).sum())
