import json

from support.small_worlds import cubes

from replay.cli.main import main
from replay.cli.scene import plan_lines
from replay.effects.effect_plan import plan
from replay.effects.effect_summary import plan_summary
from sessions import write_session
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.scene_files.scene_toml import parse_scene

TEXT = """
[[body]]
id = "cup"
tags = ["glass"]
[[body]]
id = "top"
[[effect]]
kind = "contact"
between = ["tag:glass", "top"]
"""


def test_a_session_file_has_the_plan_of_the_scene_it_carries(tmp_path, capsys):
    session = cubes({"cup": [0, 0], "top": [3, 3]}, scene=parse_scene(TEXT))
    write_session(session, tmp_path / "s.mcap")
    assert main(["scene", "check", str(tmp_path / "s.mcap"), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["bodies"] == {"cup": ["contact"], "top": ["contact"]}


BODIES = (SceneBody("a"), SceneBody("b"))


def shown(scene):
    return "\n".join(plan_lines("lab", plan_summary(plan(scene))))


def test_every_item_stands_with_its_reason():
    effects = (SceneEffect("breakage", {"between": ["a", "b"], "speed_m_s": 1.0}),)
    text = shown(Scene(bodies=BODIES, effects=effects))
    for line in (
        "contact: because breakage needs it", "breakage: because the scene declares it",
        "a-b: because contact needs it",
        "exact: because contact needs it", "/tf: because contact and breakage need it", "pairs (1)", "not run: grasp",
    ):  # fmt: skip
        assert line in text, line


def test_what_is_not_needed_is_said_too():
    text = shown(Scene(bodies=BODIES, effects=()))
    assert "no collision query is made" in text and "no effect is declared" in text
    assert "all with relative motion" in shown(Scene(bodies=BODIES))
