import numpy as np
import pytest
from support.motions import grid_plate, soup
from support.shapes import random_rotations

from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.certificates import faces_below
from cdcore.narrow.spacetime.fronts import EVERY_FACE, PairFronts
from cdcore.numerics import place_points


def walked(trees, front):
    """The ends of a walk: letter, node, node."""
    todo, ends = [(0, 0)], []
    for letter in front.decode():
        a, b = todo.pop()
        if letter in "XF":
            ends.append((letter, a, b))
            continue
        child = trees["AB".index(letter)].links[(a, b)["AB".index(letter)], 0]
        assert child >= 0
        todo += [(child, b), (child + 1, b)] if letter == "A" else [(a, child), (a, child + 1)]
    assert not todo
    return ends


@pytest.mark.parametrize("sizes", [(30, 12), (12, 30)])
def test_a_front_covers_every_pair_of_faces_once_and_what_it_calls_apart_is_apart(sizes):
    rng = np.random.default_rng(4)
    triangles = [soup(rng, size) for size in sizes]
    trees = tuple(build_box_tree(one) for one in triangles)
    turns = random_rotations(rng, 12, 2)
    places = np.cumsum(rng.normal(size=(12, 2, 3)), axis=0)
    clear = [
        k for k in range(12)
        if not len(meeting_faces_exhaustive(*(
            place_points(one.reshape(-1, 3), turns[k, n], places[k, n]).reshape(-1, 3, 3)
            for n, one in enumerate(triangles)
        )))
    ]  # fmt: skip
    fronts, which = PairFronts(trees).of(turns[clear], places[clear])
    assert len({fronts[k] for k in which}) > 3
    for row, k in zip(which.tolist(), clear, strict=True):
        covered = np.zeros(sizes, dtype=int)
        for letter, a, b in walked(trees, fronts[row]):
            below = faces_below(trees[0], a), faces_below(trees[1], b)
            covered[np.ix_(*below)] += 1
            if letter == "X":
                placed = [
                    place_points(one[faces].reshape(-1, 3), turns[k, n], places[k, n]).reshape(-1, 3, 3)
                    for n, (one, faces) in enumerate(zip(triangles, below, strict=True))
                ]
                assert not len(meeting_faces_exhaustive(*placed))
        assert (covered == 1).all()


def test_its_nodes_are_those_of_the_walks_and_sizes_not_for_kernels_ask_every_face():
    plate = build_box_tree(grid_plate())
    pair = PairFronts((plate, plate))
    turns, places = np.tile(np.eye(3), (3, 2, 1, 1)), np.zeros((3, 2, 3))
    places[:, 1, 2] = 1e-9, 1e-8, 3.0
    fronts, which = pair.of(turns, places)
    first, second = pair.nodes
    ends = [(a, b) for k in which for _, a, b in walked((plate, plate), fronts[k])]
    assert {a for a, _ in ends} <= {*first.tolist()} and {b for _, b in ends} <= {*second.tolist()}
    huge = build_box_tree(grid_plate() * 1e80)
    assert PairFronts((huge, huge)).of(turns, places)[0] == [EVERY_FACE] * 3
