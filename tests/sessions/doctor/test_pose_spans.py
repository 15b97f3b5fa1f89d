import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.planted_faults import FAULTS, clean

from sessions.doctor.pose_pass import look_through
from sessions.doctor.pose_spans import pose_spans, rest_spans
from sessions.doctor.runs import runs


def spans(draft):
    return [(one.code, one.column, one.first, one.last) for one in pose_spans(look_through([draft.session().frames]))]


def test_a_clean_session_has_no_span_and_its_tray_rests():
    draft = clean()
    assert spans(draft) == []
    (rest,) = rest_spans(look_through([draft.session().frames]))
    assert (rest.column, rest.first, rest.last) == (2, 1, 899)


@pytest.mark.parametrize("name", ["nan position", "zero quaternion", "non-unit quaternion", "frozen pose", "teleport"])
def test_a_fault_is_one_span_and_nothing_beside_it(name):
    draft = clean()
    planted = FAULTS[name](draft, 1, 400)
    assert (planted.code, 1, *planted.rows) in spans(draft)
    assert {one[0] for one in spans(draft)} - {planted.code} <= {"teleport"}


def test_a_body_that_lies_at_the_origin_or_starts_there_is_not_lost():
    draft = clean()
    draft.arrays["position"][:, 2] = 0.0
    slow = 1e-4 * np.maximum(0, np.arange(900) - 100)
    draft.arrays["position"][:, 1] = slow[:, None] * [1.0, 0.0, 0.0]
    draft.arrays["quaternion_xyzw"][:, 1] = [0.0, 0.0, 0.0, 1.0]
    assert spans(draft) == []


def test_a_position_that_stands_still_while_the_rotation_goes_on_is_frozen():
    draft = clean()
    rng = np.random.default_rng(3)
    draft.arrays["position"][:, 1] = rng.normal([0.2, 1.0, 0.1], 1e-4, (900, 3))
    draft.arrays["position"][500:560, 1] = draft.arrays["position"][499, 1]
    assert spans(draft) == [("frozen", 1, 500, 559)]


def test_a_body_that_turns_in_place_all_the_time_is_not_frozen():
    draft = clean()
    draft.arrays["position"][:, 1] = [0.2, 1.0, 0.1]
    assert spans(draft) == []


def test_a_stretch_frozen_after_a_jump_begins_with_the_jump():
    draft = clean()
    draft.arrays["position"][300:330, 0] = [2.0, 2.0, 2.0]
    assert ("frozen", 0, 300, 329) in spans(draft)


@given(st.lists(st.booleans(), max_size=40))
def test_the_runs_of_a_mask_make_the_mask_again(mask):
    again = np.zeros(len(mask), dtype=bool)
    found = runs(np.array(mask, dtype=bool))
    for first, last in found.tolist():
        assert not again[first : last + 1].any()
        again[first : last + 1] = True
    assert again.tolist() == mask
    assert (found[1:, 0] > found[:-1, 1] + 1).all()
