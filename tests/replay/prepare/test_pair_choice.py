import numpy as np
import pytest

from replay.errors import AssemblyError
from replay.prepare.pair_choice import chosen_pairs, grasped_pairs
from sessions.model.scene import Pose, Scene, SceneBody, SceneGroup

NAMES = ("hand", "glass", "lid", "bench", "shelf")
MOVES = {"hand": True, "glass": True, "lid": False, "bench": False}
"""Which of the recorded bodies move; the shelf is fixed."""
LID, SHELF = SceneBody("lid", parent="glass"), SceneBody("shelf", fixed=Pose())
BODIES = (SceneBody("hand"), SceneBody("glass"), LID, SceneBody("bench"), SHELF)
GROUPED = (SceneBody("hand", group="g"), SceneBody("glass", group="g"), *BODIES[2:])
MOVING = {
    "hand-glass", "hand-lid", "hand-bench", "hand-shelf", "glass-bench", "glass-shelf", "lid-bench", "lid-shelf",
}  # fmt: skip
"""All pairs but those without relative motion: glass and its lid, bench and shelf."""


def pair_names(pairs, names):
    """Pairs of numbers of bodies as a set of their names."""
    return {f"{names[first]}-{names[second]}" for first, second in pairs}


@pytest.mark.parametrize(
    ("scene", "more_moves", "requested", "expected"),
    [
        pytest.param(Scene(bodies=BODIES), {}, None, MOVING, id="all that move"),
        pytest.param(Scene(bodies=BODIES), {"lid": True}, None, MOVING | {"glass-lid"}, id="the lid moves too"),
        # Declared pairs are taken even without motion, and absent bodies left out.
        pytest.param(
            Scene(bodies=BODIES, pairs=(("shelf", "bench"), ("hand", "ghost"))),
            {},
            None,
            {"bench-shelf"},
            id="pairs of the scene",
        ),
        pytest.param(
            Scene(bodies=GROUPED, ignore=(("bench", "hand"),)),
            {},
            None,
            MOVING - {"hand-glass", "hand-bench"},
            id="a group and an ignored pair",
        ),
        pytest.param(
            Scene(),
            {},
            [("lid", "glass"), ("bench", "hand"), ("glass", "lid")],
            {"hand-bench", "glass-lid"},
            id="requested, one twice",
        ),
    ],
)
def test_pairs_come_from_request_scene_or_relative_motion(scene, more_moves, requested, expected):
    """Without a request the scene's pairs are taken, else all that move against each other; in order of numbers.

    Hand and glass move, the lid is carried by the glass, the bench was recorded at rest and the shelf is fixed.
    """
    pairs = chosen_pairs(scene, NAMES, MOVES | more_moves, requested).tolist()
    assert pair_names(pairs, NAMES) == expected
    assert pairs == sorted(pairs)


@pytest.mark.parametrize(
    ("first", "second", "is_grasped"),
    [
        pytest.param("hand", "rod", True, id="hand and thing of a group"),
        pytest.param("cup", "lid", True, id="parent and child"),
        pytest.param("hand", "cup", False, id="hand and thing of no group"),
        pytest.param("rod", "lid", False, id="two things of a group"),
        pytest.param("hand", "ghand", False, id="two hands of a group"),
        pytest.param("lid", "ghand", True, id="thing and hand of a group"),
        pytest.param("cup", "undeclared", False, id="a body that no scene declares"),
    ],
)
def test_grasped_pairs_are_parent_child_and_hand_group(first, second, is_grasped):
    """Two hands, a rod and a lid are one group; a cup, of no group, carries the lid."""
    hands = (SceneBody(name, group="g", tags=("hand",)) for name in ("hand", "ghand"))
    things = (SceneBody("rod", group="g"), SceneBody("cup"), SceneBody("lid", parent="cup", group="g"))
    names = ("hand", "rod", "cup", "lid", "ghand", "undeclared")
    pair = [names.index(first), names.index(second)]
    assert grasped_pairs(Scene(bodies=(*hands, *things)), names, np.array([pair])).tolist() == [is_grasped]


UNITED = Scene(
    bodies=(SceneBody("thumb", tags=("finger",)), SceneBody("index", tags=("finger",)), SceneBody("glass")),
    groups=(SceneGroup("hand", ("thumb", "index")),),
)
LINKS = ("thumb", "index", "glass", "table")
"""Names of the recorded bodies, all of which move; thumb and index, both tagged "finger", are the group "hand"."""


@pytest.mark.parametrize(
    ("requested", "expected"),
    [
        pytest.param(
            None,
            {"thumb-glass", "index-glass", "thumb-table", "index-table", "glass-table"},
            id="nothing: all but members of one group",
        ),
        pytest.param(("hand", "glass"), {"thumb-glass", "index-glass"}, id="a group"),
        pytest.param(("glass", "ha*"), {"thumb-glass", "index-glass"}, id="a pattern of a group"),
        pytest.param(("t*", "glass"), {"thumb-glass", "glass-table"}, id="a pattern of bodies"),
        pytest.param(("tag:finger", "table"), {"thumb-table", "index-table"}, id="a tag"),
        pytest.param(
            ("hand", "*"), {"thumb-glass", "index-glass", "thumb-table", "index-table"}, id="a group and anything else"
        ),
        pytest.param(("thumb", "index"), {"thumb-index"}, id="two members by name"),
    ],
)
def test_pairs_of_groups_and_patterns_expand_to_member_pairs(requested, expected):
    """Thumb and index, both tagged "finger", are the group "hand"; glass and table are none. All of them move.

    ``requested``: names of two bodies, groups or tags; ``*`` stands for any letters of a name.
    """
    pairs = chosen_pairs(UNITED, LINKS, dict.fromkeys(LINKS, True), None if requested is None else [requested]).tolist()
    assert pair_names(pairs, LINKS) == expected


def test_unknown_body_in_a_pair_is_refused_listing_names():
    """A pair of the group "hand", thumb and index, with "glas", which is no name: the error lists groups and bodies."""
    with pytest.raises(AssemblyError, match=r"pair hand-glas names 'glas'.*there are: hand, thumb, index"):
        chosen_pairs(UNITED, LINKS, dict.fromkeys(LINKS, True), [("hand", "glas")])


@pytest.mark.parametrize(
    "pair",
    [
        pytest.param(("glass",), id="one name"),
        pytest.param(("glass", "glass"), id="a body with itself"),
        pytest.param(("hand", "glass", "table"), id="three names"),
    ],
)
def test_pair_of_other_than_two_bodies_is_refused(pair):
    """One name, a name twice and three names of recorded bodies: an error says that a pair has two different ones."""
    with pytest.raises(AssemblyError, match="is no pair; name two different bodies"):
        chosen_pairs(UNITED, LINKS, dict.fromkeys(LINKS, True), [pair])
