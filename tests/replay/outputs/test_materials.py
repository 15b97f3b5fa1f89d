"""What bodies look like follows from their tags."""

import pytest

from replay.outputs.materials import albedo, is_ghost, tags_of
from sessions import Scene
from sessions.model.scene import SceneBody


def test_glass_is_translucent_and_a_rod_of_glass_is_not():
    assert albedo(("glass", "vessel"))[3] < 60
    assert albedo(("glass", "tool", "rod"))[3] == 255


@pytest.mark.parametrize("tag", ["hand", "controller", "headset", "wand"])
def test_what_belongs_to_the_user_never_hides_a_contact(tag):
    assert albedo((tag,))[3] <= 40
    assert is_ghost((tag,))


def test_furniture_is_no_ghost():
    assert not is_ghost(("bench", "furniture"))


def test_declared_tags_win_over_the_name():
    scene = Scene("s", (SceneBody("hand-left", shape="box", tags=("glass",)),))
    assert tags_of("hand-left", scene) == ("glass",)


def test_a_body_nobody_declared_is_told_by_its_name():
    assert "hand" in tags_of("Hand_Left2", Scene())
    assert "bench" in tags_of("lab bench", Scene())
