from sessions.model.scene import Pose, Scene, SceneBody
from sessions.model.scene_pairs import absent_bodies, wanted_pairs


def test_without_a_word_every_pair_is_wanted_once():
    assert wanted_pairs(Scene(), ["a", "b", "c"]) == [("a", "b"), ("a", "c"), ("b", "c")]


def test_bodies_of_one_group_and_ignored_pairs_are_left_out_in_either_order():
    bodies = (SceneBody("a", group="g"), SceneBody("b", group="g"), SceneBody("c"), SceneBody("d"))
    scene = Scene(bodies=bodies, ignore=(("d", "c"),))
    assert wanted_pairs(scene, ["a", "b", "c", "d"]) == [("a", "c"), ("a", "d"), ("b", "c"), ("b", "d")]


def test_declared_pairs_win_and_those_of_absent_bodies_are_named():
    scene = Scene(pairs=(("c", "a"), ("a", "x"), ("y", "x")))
    assert wanted_pairs(scene, ["a", "b", "c"]) == [("c", "a")]
    assert absent_bodies(scene, ["a", "b", "c"]) == ["x", "y"]
    assert wanted_pairs(Scene(pairs=()), ["a", "b"]) == []


def test_a_body_is_found_by_its_id_and_only_by_that():
    scene = Scene(bodies=(SceneBody("beaker", tags=("glass",)), SceneBody("rod")))
    assert scene.body("rod") is scene.bodies[1]
    assert scene.body("glass") is None


def test_a_scene_that_says_nothing_declares_neither_pairs_nor_effects():
    assert Scene().pairs is None and Scene().effects is None
    assert SceneBody("x").fixed is None and SceneBody("x").offset == Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
