import numpy as np
import pytest
from support.planted_faults import clean

from sessions import Scene
from sessions.doctor.pose_pass import look_through
from sessions.doctor.scale import roles_of, scale_findings, unit_guess
from sessions.model.scene import SceneBody


def test_heads_and_hands_are_told_by_their_names_and_nothing_else_is():
    roles = roles_of(("camera", "leftHand", "right", "beaker-left", "rod"), Scene())
    assert (roles.head, roles.left, roles.right) == (0, 1, 2)
    roles = roles_of(("flask", "hand-right", "headset"), Scene(bodies=(SceneBody("headset", parent="flask"),)))
    assert (roles.head, roles.left, roles.right) == (None, None, 1)


@pytest.mark.parametrize(("factor", "unit"), [(1000.0, "millimetres"), (100.0, "centimetres")])
def test_other_units_are_named(factor, unit):
    draft = clean()
    draft.arrays["position"][:, 1] *= factor
    looked = look_through([draft.session().frames])
    (one,) = scale_findings(looked, Scene(), {})
    assert (one.code, one.body) == ("unit-suspect", "hand-left")
    assert unit_guess(looked, 1) is not None and unit_guess(looked, 0) is None
    assert unit in one.message or unit == "centimetres"


def test_a_child_is_not_judged_by_where_it_is_in_its_parent():
    draft = clean()
    draft.arrays["position"][:, 1] *= 1000
    scene = Scene(bodies=(SceneBody("hand-left", parent="tray"),))
    assert [*scale_findings(look_through([draft.session().frames]), scene, {})] == []


def test_a_head_below_the_hands_is_named():
    looked = look_through([clean().session().frames])
    names = {"flask": "hmd", "hand-left": "hand-left", "tray": "tray"}
    looked = type(looked)(tuple(names[name] for name in looked.names), *list(vars(looked).values())[1:])
    (one,) = scale_findings(looked, Scene(), {})
    assert (one.code, one.body) == ("head-below-hands", "hmd")


def test_facts_that_admit_a_left_handed_source_are_believed():
    looked = look_through([clean().session().frames])
    assert [one.code for one in scale_findings(looked, Scene(), {"handedness": "left"})] == ["handedness"]
    told = {"handedness": "left", "conversions": "handedness mirrored along Z"}
    assert [*scale_findings(looked, Scene(), told)] == []
    assert np.isfinite(looked.position).all()
