from rich.console import Console

from replay.cli.plan_tables import plan_tree
from replay.effect_summary import plan_summary
from replay.plan import plan
from sessions.scene import Scene, SceneBody, SceneEffect

BODIES = (SceneBody("a"), SceneBody("b"))


def shown(scene):
    console = Console(width=160, record=True, file=open("/dev/null", "w"))  # noqa: SIM115, PTH123
    console.print(plan_tree("lab", plan_summary(plan(scene))))
    return console.export_text()


def test_every_item_stands_with_its_reason():
    effects = (SceneEffect("breakage", {"between": ["a", "b"], "speed_m_s": 1.0}), SceneEffect("penetration"))
    text = shown(Scene(bodies=BODIES, effects=effects))
    for line in (
        "contact: because breakage needs it", "breakage: because the scene declares it",
        "a-b: because contact needs it",
        "exact: because contact needs it", "/tf: because contact and breakage need it", "pairs (1)", "not run: sweep",
        "declared, not computed by this version: penetration",
    ):  # fmt: skip
        assert line in text, line


def test_what_is_not_needed_is_said_too():
    text = shown(Scene(bodies=BODIES, effects=()))
    assert "no collision query is made" in text and "no effect is declared" in text
    assert "all with relative motion" in shown(Scene(bodies=BODIES))
