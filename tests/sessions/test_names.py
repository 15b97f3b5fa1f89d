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


@pytest.mark.parametrize(
    "name", [*LEFT_HANDS, "VIVEWandLeft", "LeftGlove", "glove_left", "left controller 2", "hand_L"]
)
def test_spellings_of_a_left_hand(name):
    """``proxy_for`` names the mesh that may stand in for such a body: a controller."""
    assert is_hand(name) and not is_head(name) and side_of(name) == "left"
    assert proxy_for(name) == "proxy_wand"


OTHERS = ("handle", "beaker_handle", "handbook", "wanderer", "GloveBox", "glove_box", "glovebox", "header", "forehead")


@pytest.mark.parametrize("name", OTHERS)
def test_words_containing_hand_or_head_are_neither(name):
    """``proxy_for`` names the mesh that may stand in for a hand or a head, and none for these."""
    assert not is_hand(name) and not is_head(name) and proxy_for(name) == ""


@pytest.mark.parametrize("name", ["righthandanchor", "RightHandAnchor", "hand_tracker_right", "rightcontroller1"])
def test_spellings_of_a_right_hand_with_its_role(name):
    assert is_hand(name) and side_of(name) == "right"


@pytest.mark.parametrize("name", ["handmodel", "HandModel", "controllertracker", "glovemesh"])
def test_hands_with_a_role_and_no_side(name):
    assert is_hand(name) and side_of(name) == ""


@pytest.mark.parametrize("name", ["HMD", "Main Camera", "head", "vive-headset"])
def test_spellings_of_a_head(name):
    """``proxy_for`` names the mesh that may stand in for such a body: a headset."""
    assert is_head(name) and not is_hand(name) and side_of(name) == "" and proxy_for(name) == "proxy_headset"


@pytest.mark.parametrize(("name", "proxy"), [("left", "proxy_wand"), ("left_wheel", ""), ("bright", "")])
def test_a_side_is_a_controller_only_alone(name, proxy):
    """``proxy``: the mesh that may stand in for it, none for another body."""
    assert proxy_for(name) == proxy


def test_name_is_split_into_terms():
    """Numbers are no terms; words are split where capitals begin, or are known (lefthand)."""
    assert name_tokens("LeftHand_2") == name_tokens("lefthand") == ["left", "hand"]
    assert name_tokens("VIVEController") == ["vive", "controller"]
