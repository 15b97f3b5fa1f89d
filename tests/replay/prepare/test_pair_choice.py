import numpy as np
import pytest

from replay.prepare.pair_choice import chosen_pairs, held_pairs
from sessions.model.scene import Pose, Scene, SceneBody

NAMES = ("hand", "glass", "lid", "bench", "shelf")
MOVES = {"hand": True, "glass": True, "lid": False, "bench": False}
LID, SHELF = SceneBody("lid", parent="glass"), SceneBody("shelf", fixed=Pose())
BODIES = (SceneBody("hand"), SceneBody("glass"), LID, SceneBody("bench"), SHELF)
GROUPED = (SceneBody("hand", group="g"), SceneBody("glass", group="g"), *BODIES[2:])
MOVING = {
    "hand-glass", "hand-lid", "hand-bench", "hand-shelf", "glass-bench", "glass-shelf", "lid-bench", "lid-shelf",
}  # fmt: skip
"""All pairs but those without relative motion: glass and lid, bench and shelf."""


@pytest.mark.parametrize(
    ("scene", "moves", "asked", "expected"),
    [
        (Scene(bodies=BODIES), {}, None, MOVING),
        (Scene(bodies=BODIES), {"lid": True}, None, MOVING | {"glass-lid"}),
        # Declared pairs are taken even without motion, and absent bodies left out.
        (Scene(bodies=BODIES, pairs=(("shelf", "bench"), ("hand", "ghost"))), {}, None, {"bench-shelf"}),
        (Scene(bodies=GROUPED, ignore=(("bench", "hand"),)), {}, None, MOVING - {"hand-glass", "hand-bench"}),
        (Scene(), {}, [("lid", "glass"), ("bench", "hand"), ("glass", "lid")], {"hand-bench", "glass-lid"}),
    ],
)
def test_pairs_come_from_request_scene_or_relative_motion(scene, moves, asked, expected):
    actual = chosen_pairs(scene, NAMES, MOVES | moves, asked).tolist()
    assert {f"{NAMES[i]}-{NAMES[j]}" for i, j in actual} == expected and actual == sorted(actual)


def test_grasped_pairs_are_parent_child_and_hand_group():
    hands = (SceneBody(name, group="g", tags=("hand",)) for name in ("hand", "ghand"))
    scene = Scene(
        bodies=(*hands, SceneBody("rod", group="g"), SceneBody("cup"), SceneBody("lid", parent="cup", group="g"))
    )
    names = ("hand", "rod", "cup", "lid", "ghand", "undeclared")
    pairs = {(0, 1): True, (0, 2): False, (1, 3): False, (2, 3): True, (2, 5): False, (0, 4): False, (3, 4): True}
    assert held_pairs(scene, names, np.array([*pairs])).tolist() == [*pairs.values()]
