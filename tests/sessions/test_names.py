"""Heads, hands and sides are recognised by whole words of a name, however it is written."""

import pytest

from sessions.importers.importing import proxy_for
from sessions.names import is_hand, is_head, name_tokens, side_of

LEFT_HANDS = (
    "LeftHand",
    "left_hand",
    "hand-left",
    "lefthand",
    "handLeft",
    "handleft",
    "LHand",
    "lhand",
    "VIVEWandLeft",
)


@pytest.mark.parametrize("name", [*LEFT_HANDS, "LeftGlove", "glove_left", "left controller 2", "hand_L"])
def test_spellings_of_a_left_hand(name):
    """Each name is a hand's, on the left; a body of that name without a mesh gets that of a controller."""
    assert is_hand(name)
    assert not is_head(name)
    assert side_of(name) == "left"
    assert proxy_for(name) == "proxy_wand"


OTHERS = ("handle", "beaker_handle", "handbook", "wanderer", "GloveBox", "glove_box", "glovebox", "header", "forehead")


@pytest.mark.parametrize("name", OTHERS)
def test_words_containing_hand_or_head_are_neither(name):
    """A body of such a name without a mesh gets none in its place ("")."""
    assert not is_hand(name)
    assert not is_head(name)
    assert proxy_for(name) == ""


@pytest.mark.parametrize("name", ["righthandanchor", "RightHandAnchor", "hand_tracker_right", "rightcontroller1"])
def test_spellings_of_a_right_hand_with_its_role(name):
    """Each name has, beside hand and side, what the object is for: an anchor, a tracker."""
    assert is_hand(name)
    assert side_of(name) == "right"


@pytest.mark.parametrize("name", ["handmodel", "HandModel", "controllertracker", "glovemesh"])
def test_hands_with_a_role_and_no_side(name):
    """A side that is not in the name is "": nothing is guessed."""
    assert is_hand(name)
    assert side_of(name) == ""


@pytest.mark.parametrize("name", ["HMD", "Main Camera", "head", "vive-headset"])
def test_spellings_of_a_head(name):
    """A head has no side; a body of such a name without a mesh gets that of a headset."""
    assert is_head(name)
    assert not is_hand(name)
    assert side_of(name) == ""
    assert proxy_for(name) == "proxy_headset"


@pytest.mark.parametrize(("name", "mesh"), [("left", "proxy_wand"), ("left_wheel", ""), ("bright", "")])
def test_a_side_is_a_controller_only_alone(name, mesh):
    """A body called "left" alone is a controller, and without a mesh of its own gets a wand's; the others get none."""
    assert proxy_for(name) == mesh


def test_name_is_split_into_terms():
    """Numbers are no terms; words are split where capitals begin, or where two known words meet (lefthand)."""
    assert name_tokens("LeftHand_2") == ["left", "hand"]
    assert name_tokens("lefthand") == ["left", "hand"]
    assert name_tokens("VIVEController") == ["vive", "controller"]
