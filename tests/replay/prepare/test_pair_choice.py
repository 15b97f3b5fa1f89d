import numpy as np
import pytest

from replay.errors import AssemblyError
from replay.prepare.pair_choice import chosen_pairs, held_pairs
from sessions.model.scene import Pose, Scene, SceneBody

NAMES = ("hand", "glass", "lid", "bench", "shelf")
MOVES = {"hand": True, "glass": True, "lid": False, "bench": False}
SCENE = Scene(
    bodies=(
        SceneBody("hand"),
        SceneBody("glass"),
        SceneBody("lid", parent="glass"),
        SceneBody("bench"),
        SceneBody("shelf", fixed=Pose()),
    )
)


def named(pairs):
    return {f"{NAMES[i]}-{NAMES[j]}" for i, j in pairs.tolist()}


def test_pairs_without_relative_motion_are_left_out():
    got = named(chosen_pairs(SCENE, NAMES, MOVES))
    assert "glass-lid" not in got and "bench-shelf" not in got
    assert len(got) == 8
    assert "glass-lid" in named(chosen_pairs(SCENE, NAMES, {**MOVES, "lid": True}))


def test_declared_pairs_are_taken_even_without_motion_and_absent_bodies_left_out():
    scene = Scene(bodies=SCENE.bodies, pairs=(("shelf", "bench"), ("hand", "ghost")))
    assert named(chosen_pairs(scene, NAMES, MOVES)) == {"bench-shelf"}


def test_groups_and_ignored_pairs_are_left_out():
    bodies = (SceneBody("hand", group="g"), SceneBody("glass", group="g"), *SCENE.bodies[2:])
    got = named(chosen_pairs(Scene(bodies=bodies, ignore=(("bench", "hand"),)), NAMES, MOVES))
    assert not got & {"hand-glass", "hand-bench"} and "glass-bench" in got


def test_pairs_asked_for_win_and_are_sorted():
    got = chosen_pairs(SCENE, NAMES, MOVES, [("lid", "glass"), ("bench", "hand"), ("glass", "lid")])
    assert got.tolist() == [[0, 3], [1, 2]]


@pytest.mark.parametrize(
    ("pair", "words"), [(("hand", "ghost"), "names 'ghost'"), (("hand", "hand"), "two different bodies")]
)
def test_a_pair_of_nobody_is_refused(pair, words):
    with pytest.raises(AssemblyError, match=words):
        chosen_pairs(SCENE, NAMES, MOVES, [pair])


def test_held_pairs_are_those_of_a_child_and_its_parent_and_of_a_hand_and_a_thing_of_its_group():
    assert held_pairs(SCENE, NAMES, np.array([[0, 1], [1, 2], [0, 2]])).tolist() == [False, True, False]
    hand, other = SceneBody("hand", group="g", tags=("hand",)), SceneBody("ghand", group="g", tags=("hand",))
    scene = Scene(bodies=(hand, SceneBody("rod", group="g"), SceneBody("cup"), SceneBody("lid", group="g"), other))
    pairs = np.array([[0, 1], [0, 2], [1, 3], [2, 5], [0, 4], [3, 4]])
    held = held_pairs(scene, ["hand", "rod", "cup", "lid", "ghand", "undeclared"], pairs)
    assert held.tolist() == [True, False, False, False, False, True]
