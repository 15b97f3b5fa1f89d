"""At one instant two faces meet exactly when the triangle predicate says so of the points that count."""

import numpy as np
import pytest
from motions import KINDS, placed, soup
from shapes import random_rotations

from cdcore.narrow.continuous.meeting import faces_meet_at
from cdcore.narrow.exact_sums import new_digits
from cdcore.narrow.predicates import triangles_intersect
from cdcore.narrow.spacetime.box_tree import build_box_tree


@pytest.mark.parametrize("kind", KINDS)
def test_it_equals_the_predicate_on_placed_triangles(kind):
    rng = np.random.default_rng(4)
    meshes = [soup(rng, size=1.0) if kind == "soup" else KINDS[kind](rng) for _ in (0, 1)]
    trees = [build_box_tree(mesh) for mesh in meshes]
    turns = random_rotations(rng, 2) if kind == "soup" else np.tile(np.eye(3), (2, 1, 1))
    places = np.zeros((2, 3))
    poses = [np.concatenate([turns[k].ravel(), places[k]]) for k in (0, 1)]
    world = [placed(meshes[k], turns[k], places[k]) for k in (0, 1)]
    pair, digits = np.empty((6, 3)), new_digits()
    met = 0
    for i in range(len(meshes[0])):
        for j in range(len(meshes[1])):
            faces = trees[0].faces[i], trees[1].faces[j]
            want = triangles_intersect(np.stack([world[0][faces[0]], world[1][faces[1]]])[None])[0]
            assert faces_meet_at(trees[0], i, poses[0], trees[1], j, poses[1], pair, digits) == want
            met += want
    assert met > 0
