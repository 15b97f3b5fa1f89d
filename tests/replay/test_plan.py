from replay.plan import plan
from sessions.scene import Scene, SceneEffect


def test_a_plan_names_each_declared_effect_once_in_order():
    scene = Scene(effects=(SceneEffect("pour"), SceneEffect("contact"), SceneEffect("pour", {"from": "beaker"})))
    assert plan(scene).effects == ("pour", "contact")


def test_a_scene_that_declares_nothing_runs_no_effect():
    assert plan(Scene()).effects == plan(Scene(effects=())).effects == ()


def test_declared_pairs_are_the_plans_pairs():
    assert plan(Scene(pairs=(("a", "b"),))).pairs == (("a", "b"),)
    assert plan(Scene()).pairs is None


def test_contacts_are_detected_only_where_a_declared_effect_needs_them_or_nothing_is_declared():
    assert plan(Scene()).detection
    assert not plan(Scene(effects=())).detection
    assert not plan(Scene(effects=(SceneEffect("burette"), SceneEffect("mixing")))).detection
    assert plan(Scene(effects=(SceneEffect("mixing"), SceneEffect("grasp")))).detection
