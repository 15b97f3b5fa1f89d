from __future__ import annotations

import pytest

from sessions.errors import SceneError
from sessions.scene import Pose, Scene, SceneBody, SceneEffect
from sessions.scene_toml import parse_scene
from sessions.synthetic.scene_text import with_text

SCENE = Scene(
    "a test",
    (
        SceneBody("bench", instrument="bench", fixed=Pose(), tags=("bench",)),
        SceneBody("glass", instrument="beaker_250", group="g", tags=("glass",), extra={"faces": 600, "mass": 0.25}),
    ),
    effects=(SceneEffect("contact", {"between": ["tag:glass", "tag:bench"]}),),
)


def test_the_text_read_again_is_the_scene():
    done = with_text(SCENE, ["a remark", "and another"])
    assert done.text.startswith("# a remark\n# and another\n")
    assert parse_scene(done.text) == done
    assert (done.name, done.bodies, done.effects) == (SCENE.name, SCENE.bodies, SCENE.effects)


def test_a_scene_that_declares_no_effect_says_so():
    assert with_text(Scene("none", effects=())).effects == ()
    assert with_text(Scene("unsaid")).effects is None


def test_an_effect_between_what_is_not_there_is_refused():
    with pytest.raises(SceneError, match="tag:lamp"):
        with_text(Scene("x", SCENE.bodies, effects=(SceneEffect("contact", {"between": ["tag:lamp", "glass"]}),)))
