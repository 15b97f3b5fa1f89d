import pytest

from replay.effects import declaring
from replay.effects.declaring import declare
from replay.errors import PlanError
from sessions.model.scene import Scene, SceneBody, SceneEffect

SCENE = Scene(bodies=(SceneBody("cup", tags=("glass",)), SceneBody("jar", tags=("glass",)), SceneBody("top")))
FIELDS = {
    "from": declaring.bodies("who pours"), "into": declaring.body("who receives", default=""),
    "between": declaring.pairs("who meets", default=()),
    "speed": declaring.number("how fast", "m/s", default=2.0, above=0.0, most=9.0),
    "of": declaring.text("what", default="", among=("flame", "dilution")),
    "tip": declaring.vector("where", default=(0.0, 0.0, 0.0)),
    "colours": declaring.mapping("which", default={}),
}  # fmt: skip


def made(**settings):
    return declare(SceneEffect("pour", {"from": "cup", **settings}), 2, FIELDS, SCENE, "lab.toml")


def test_given_fields_are_checked_and_selectors_become_names():
    declared = made(
        **{"from": ["tag:glass", "cup"], "into": "jar", "between": ["tag:glass", "top"], "speed": 3, "of": "flame"},
        tip=[1, 2.5, 3], colours={"Na": "yellow"},
    )  # fmt: skip
    assert declared["from"] == ("cup", "jar") and declared["into"] == "jar"
    assert declared["between"] == (("cup", "top"), ("jar", "top")) and declared["speed"] == 3.0
    assert declared["tip"] == (1.0, 2.5, 3.0) and declared["colours"] == {"Na": "yellow"}


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"from": "cap"}, "from: no body is 'cap'; did you mean 'cup'"),
        ({"from": "tag:glas"}, "no body is 'tag:glas'; did you mean 'tag:glass'"),
        ({"from": []}, "from is empty"),
        ({"from": [3]}, "from names 3"),
        ({"into": "tag:glass"}, "which stands for cup, jar; give one body"),
        ({"between": ["cup"]}, r"between is \['cup'\]; give two"),
        ({"between": ["cup", "cup"]}, "pairs 'cup' with itself"),
        ({"speed": "fast"}, "speed is 'fast'; give a finite number in m/s"),
        ({"speed": float("nan")}, "give a finite number"),
        ({"speed": True}, "give a finite number"),
        ({"speed": 0.0}, "give above 0.0 m/s"),
        ({"speed": 9.5}, "give at most 9.0 m/s"),
        ({"of": "flme"}, "did you mean 'flame'"),
        ({"of": ""}, "of is ''; give text"),
        ({"tip": [1, 2]}, "give three finite numbers"),
        ({"colours": 3}, "give a table"),
        ({"spede": 3}, "unknown key 'spede'; did you mean 'speed'"),
    ],
)
def test_a_wrong_field_is_named_with_file_table_and_key(settings, said):
    with pytest.raises(PlanError, match=r"lab.toml: \[\[effect\]\] 2 \('pour'\): .*" + said):
        made(**settings)
