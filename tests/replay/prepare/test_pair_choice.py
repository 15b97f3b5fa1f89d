import numpy as np
import pytest

from replay.errors import AssemblyError
from replay.prepare.pair_choice import chosen_pairs, grasped_pairs
from sessions.model.scene import Pose, Scene, SceneBody, SceneGroup

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
    ("scene", "moves", "requested", "expected"),
    [
        (Scene(bodies=BODIES), {}, None, MOVING),
        (Scene(bodies=BODIES), {"lid": True}, None, MOVING | {"glass-lid"}),
        # Declared pairs are taken even without motion, and absent bodies left out.
        (Scene(bodies=BODIES, pairs=(("shelf", "bench"), ("hand", "ghost"))), {}, None, {"bench-shelf"}),
        (Scene(bodies=GROUPED, ignore=(("bench", "hand"),)), {}, None, MOVING - {"hand-glass", "hand-bench"}),
        (Scene(), {}, [("lid", "glass"), ("bench", "hand"), ("glass", "lid")], {"hand-bench", "glass-lid"}),
    ],
)
def test_pairs_come_from_request_scene_or_relative_motion(scene, moves, requested, expected):
    """Without a request the scene's pairs are taken, else all that move against each other. ``moves`` adds to MOVES."""
    actual = chosen_pairs(scene, NAMES, MOVES | moves, requested).tolist()
    assert {f"{NAMES[i]}-{NAMES[j]}" for i, j in actual} == expected and actual == sorted(actual)


def test_grasped_pairs_are_parent_child_and_hand_group():
    """Grasped are a parent and its child, and a hand and a thing of one group; not two things, not two hands."""
    hands = (SceneBody(name, group="g", tags=("hand",)) for name in ("hand", "ghand"))
    scene = Scene(
        bodies=(*hands, SceneBody("rod", group="g"), SceneBody("cup"), SceneBody("lid", parent="cup", group="g"))
    )
    names = ("hand", "rod", "cup", "lid", "ghand", "undeclared")
    pairs = {(0, 1): True, (0, 2): False, (1, 3): False, (2, 3): True, (2, 5): False, (0, 4): False, (3, 4): True}
    assert grasped_pairs(scene, names, np.array([*pairs])).tolist() == [*pairs.values()]


UNITED = Scene(
    bodies=(SceneBody("thumb", tags=("finger",)), SceneBody("index", tags=("finger",)), SceneBody("glass")),
    groups=(SceneGroup("hand", ("thumb", "index")),),
)
LINKS = ("thumb", "index", "glass", "table")


@pytest.mark.parametrize(
    ("requested", "expected"),
    [
        (None, {"thumb-glass", "index-glass", "thumb-table", "index-table", "glass-table"}),
        ([("hand", "glass")], {"thumb-glass", "index-glass"}),
        ([("glass", "ha*")], {"thumb-glass", "index-glass"}),
        ([("t*", "glass")], {"thumb-glass", "glass-table"}),
        ([("tag:finger", "table")], {"thumb-table", "index-table"}),
        ([("hand", "*")], {"thumb-glass", "index-glass", "thumb-table", "index-table"}),
        ([("thumb", "index")], {"thumb-index"}),
    ],
)
def test_pairs_of_groups_and_patterns_expand_to_member_pairs(requested, expected):
    """The group "hand" is thumb and index, both tagged "finger"; ``*`` stands for any letters of a name."""
    moves = dict.fromkeys(LINKS, True)
    actual = chosen_pairs(UNITED, LINKS, moves, requested).tolist()
    assert {f"{LINKS[i]}-{LINKS[j]}" for i, j in actual} == expected


def test_unknown_body_in_a_pair_is_refused_listing_names():
    """A pair of the group "hand" with "glas", which is no name."""
    with pytest.raises(AssemblyError, match=r"pair hand-glas names 'glas'.*there are: hand, thumb, index"):
        chosen_pairs(UNITED, LINKS, {}, [("hand", "glas")])


@pytest.mark.parametrize("pair", [("glass",), ("glass", "glass"), ("hand", "glass", "table")])
def test_pair_of_other_than_two_bodies_is_refused(pair):
    """A single name, a body with itself, and three names."""
    with pytest.raises(AssemblyError, match="is no pair; name two different bodies"):
        chosen_pairs(UNITED, LINKS, {}, [pair])
