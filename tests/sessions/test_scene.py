import dataclasses

import pytest

from sessions.scene import Pose, Scene, SceneBody


def test_a_body_is_found_by_its_id_and_only_by_that():
    scene = Scene(bodies=(SceneBody("beaker", tags=("glass",)), SceneBody("rod")))
    assert scene.body("rod") is scene.bodies[1]
    assert scene.body("glass") is None


def test_a_scene_that_says_nothing_declares_neither_pairs_nor_effects():
    assert Scene().pairs is None and Scene().effects is None
    assert SceneBody("x").fixed is None and SceneBody("x").offset == Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def test_a_scene_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Scene().name = "x"
