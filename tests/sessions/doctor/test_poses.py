import numpy as np
from support.planted_faults import clean

from sessions import Severity
from sessions.doctor.pose_pass import look_through
from sessions.doctor.poses import MOST_OF_A_KIND, pose_findings


def findings(draft, code):
    return [one for one in pose_findings(look_through([draft.session().frames])) if one.code == code]


def test_a_fault_in_every_other_frame_is_listed_so_often_and_then_counted():
    draft = clean()
    draft.arrays["position"][::2, 0] = np.inf
    found = findings(draft, "not-finite")
    assert len(found) == MOST_OF_A_KIND + 1
    assert sum(one.count for one in found) == 450
    assert found[-1].message == f"{450 - MOST_OF_A_KIND} more stretches of the same, {450 - MOST_OF_A_KIND} samples"


def test_sign_flips_are_counted_and_only_noted():
    draft = clean()
    draft.arrays["quaternion_xyzw"][100:200, 1] *= -1
    (one,) = findings(draft, "sign-flips")
    assert (one.count, one.severity, one.body) == (2, Severity.NOTE, "hand-left")


def test_rounded_rotations_are_noted_with_their_decimals():
    draft = clean()
    turns = draft.arrays["quaternion_xyzw"]
    turns[:, :2] = np.round(turns[:, :2], 4)
    assert [one.message.split(",")[0] for one in findings(draft, "rounded-rotations")] == [
        "quaternions have 4 decimals"
    ] * 2
    (off, _) = findings(draft, "off-unit-quaternion")
    assert off.severity == Severity.NOTE and off.count > 100
    assert findings(clean(), "rounded-rotations") == []


def test_an_empty_session_has_no_pose_to_speak_of():
    assert [*pose_findings(look_through([]))] == []
