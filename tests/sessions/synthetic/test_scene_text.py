from __future__ import annotations

import tomllib

from sessions.scene import Pose, Scene, SceneBody, SceneEffect
from sessions.synthetic.scene_text import scene_text, with_text

SCENE = Scene(
    "a test",
    (
        SceneBody("plain"),
        SceneBody(
            "full",
            instrument="beaker_250",
            size={"faces": 500},
            scale=0.5,
            group="g",
            parent="plain",
            offset=Pose((1.0, 2.0, 3.0)),
            fixed=Pose(),
            tags=("glass", 'sm"art'),
            proxy=True,
            extra={"mass": 0.25, "liquid": {"moles per litre": 0.1, "of": "HCl"}},
        ),
    ),
    pairs=(("plain", "full"),),
    ignore=(("full", "plain"),),
    effects=(SceneEffect("pour", {"from": ["full"], "rate": 1e-07}),),
)


def test_the_text_is_toml_and_says_what_the_scene_holds():
    held = tomllib.loads(scene_text(SCENE, ["a remark"]))
    plain, full = held["body"]
    assert held["name"] == "a test"
    assert plain == {"id": "plain"}
    assert full["offset"] == {"position": [1.0, 2.0, 3.0], "quaternion_xyzw": [0.0, 0.0, 0.0, 1.0]}
    assert full["fixed"] == {"position": [0.0, 0.0, 0.0]}
    assert full["tags"] == ["glass", 'sm"art']
    assert full["proxy"] is True and full["mass"] == 0.25 and full["parent"] == "plain"
    assert full["liquid"] == {"moles per litre": 0.1, "of": "HCl"}
    assert held["pair"] == [{"between": ["plain", "full"]}]
    assert held["ignore"] == [{"between": ["full", "plain"]}]
    assert held["effect"] == [{"kind": "pour", "from": ["full"], "rate": 1e-07}]
    assert scene_text(SCENE, ["a remark"]).startswith("# a remark\n")


def test_a_scene_that_declares_no_effect_says_so():
    assert tomllib.loads(scene_text(Scene("none", effects=())))["effect"] == []
    assert "effect" not in tomllib.loads(scene_text(Scene("unsaid")))


def test_with_text_changes_the_text_only():
    done = with_text(SCENE)
    assert done.text == scene_text(SCENE)
    assert done.bodies == SCENE.bodies
