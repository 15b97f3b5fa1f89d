import pytest

from replay.studies.minimise.names import Names, plain_scene
from sessions.scene_files.scene_toml import parse_scene

SCENE = """
[scene]
name = "Anna's desk"
[[body]]
id = "hand-left"
tags = ["hand"]
[[body]]
id = "Anna beaker"
mesh = "C:/Users/anna/cup.glb"
group = "anna"
tags = ["glass", "annas"]
fixed = { position = [1, 2, 3] }
properties = { liquid = { solute = "anna" } }
[[effect]]
kind = "contact"
between = ["hand-left", "tag:annas"]
[[effect]]
kind = "colour"
indicator = "as Anna says"
[[effect]]
kind = "colour"
indicator = "N1701199"
[[effect]]
kind = "reaction"
equation = "Ag+ + Cl- -> AgCl(s)"
"""


@pytest.mark.parametrize("name", ["hand-left", "LeftHand", "beaker_250", "proxy/wand 2", "cube"])
def test_words_of_a_laboratory_stay(name):
    assert Names().of("body", name) == name


@pytest.mark.parametrize("name", ["LHR-0A1B2C3D", "anna", "1998", "beaker 17011998", "ünal", "hand\nleft", "hand:left"])
def test_any_other_name_gets_another(name):
    assert name not in Names().of("body", name)
    assert Names([name]).of("body", name) == name


def test_names_keep_their_known_words_and_stay_different():
    names = Names()
    names.settle("body", ["anna hand left", "hand-left", "bea hand left", "x17171717"])
    assert [names.of("body", one) for one in ("hand-left", "anna hand left", "bea hand left", "x17171717")] == [
        "hand-left", "hand-left-2", "hand-left-3", "body-1",
    ]  # fmt: skip
    assert names.changed() == {"body": 3} and names.of("body", "") == ""


def test_a_scene_keeps_what_effects_need_and_loses_words_of_its_author():
    scene, lost = plain_scene(parse_scene(SCENE), Names(), lambda pose: pose)
    assert [body.id for body in scene.bodies] == ["hand-left", "beaker"] and lost == (2, 3)
    assert "nna" not in repr(scene) and scene.bodies[1].tags == ("glass", "tag-1") and not scene.bodies[1].extra
    assert [one.settings for one in scene.effects] == [
        {"between": ["hand-left", "tag:tag-1"]}, {"equation": "Ag+ + Cl- -> AgCl(s)"},
    ]  # fmt: skip
