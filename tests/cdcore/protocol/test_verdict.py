"""Every verdict counts as contact, as no contact, or is left out, and its number never changes."""

from __future__ import annotations

import numpy as np

from cdcore import Verdict
from cdcore.protocol import counts_as_contact, is_undecided
from cdcore.protocol.verdict import CONTACT_VERDICTS, UNDECIDED_VERDICTS

ALL = np.arange(8, dtype=np.uint8).reshape(2, 4)


def test_the_numbers_that_stand_in_files_stay_as_they_are():
    assert {verdict.name: int(verdict) for verdict in Verdict} == {
        "CLEAR": 0,
        "CONTACT": 1,
        "CONTAINED": 2,
        "CANDIDATE": 3,
        "NOT_FOUND": 4,
        "UNRESOLVED": 5,
        "INVALID": 6,
        "NO_POSE": 7,
    }


def test_contact_contained_and_candidate_count_as_contact():
    assert counts_as_contact(ALL).tolist() == [[False, True, True, True], [False, False, False, False]]


def test_unresolved_invalid_and_no_pose_are_left_out():
    assert is_undecided(ALL).tolist() == [[False, False, False, False], [False, True, True, True]]


def test_no_verdict_is_both_contact_and_undecided():
    assert not set(CONTACT_VERDICTS) & set(UNDECIDED_VERDICTS)
