"""The float bounds hold on every hard family: never less than zero promised too much."""

import numpy as np
import pytest
from support.motions import rotations
from support.shapes import ball_mesh, beaker_mesh, box_mesh

from cdcore.narrow.margins.margin_kernels import boxes_of, certainly_apart, overlap_bounds
from cdcore.narrow.margins.triangle_margins import triangle_margins
from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.numerics import place_points
from replay.studies.stress.families import FAMILIES


def bounds(pairs):
    low, high, apart = (np.empty(len(pairs)) for _ in range(3))
    overlap_bounds(np.ascontiguousarray(pairs).reshape(-1, 6, 3), low, high, apart)
    return low, high, apart


@pytest.mark.parametrize("family", [f for f in FAMILIES if f.number not in (15, 16)], ids=lambda f: f.name)
def test_the_exact_margin_lies_within_the_bounds(family):
    pairs = family.pairs(300, seed=9)
    meets, margin = triangle_margins(pairs)
    low, high, apart = bounds(pairs)
    assert (low[meets] <= margin[meets]).all()
    assert (margin[meets] <= high[meets]).all()
    assert (apart[~meets] <= margin[~meets]).all()


def test_the_bounds_are_tight_where_nothing_is_hard():
    pairs = FAMILIES[0].pairs(500)
    meets, margin = triangle_margins(pairs)
    low, high, apart = bounds(pairs)
    assert (high[meets] - low[meets]).max() < 1e-9
    assert (high[meets] > margin[meets] - 1e-12).all()
    assert ((apart > 0) == ~meets).mean() > 0.99


def least_distance(first, second):
    pairs = np.stack(np.broadcast_arrays(first[:, None], second[None]), axis=2).reshape(-1, 2, 3, 3)
    meets, margin = triangle_margins(pairs)
    return 0.0 if meets.any() else margin.min()


def test_surfaces_called_apart_are_and_most_that_are_get_called_so():
    rng = np.random.default_rng(2)
    meshes = [ball_mesh(0.05, 3, 4).triangles, box_mesh((0.1, 0.1, 0.02)).triangles]
    a, b = (build_box_tree(mesh) for mesh in meshes)
    count, reach = 40, 0.003
    turns, moves = rotations(rng, (count,)), rng.normal(size=(count, 3)) * 0.06
    apart = np.zeros(count, dtype=bool)
    certainly_apart(boxes_of(a), a, boxes_of(b), b, turns, moves, np.full(count, reach), apart)
    far = [least_distance(place_points(meshes[0].reshape(-1, 3), t, m).reshape(-1, 3, 3), meshes[1]) > reach
           for t, m in zip(turns, moves, strict=True)]  # fmt: skip
    assert not (apart & ~np.array(far)).any()
    assert 10 < sum(far) < 40
    assert apart.sum() > 0.8 * sum(far)


def test_a_body_inside_a_hollow_one_is_apart_from_its_surface():
    a, b = build_box_tree(ball_mesh(0.01).triangles), build_box_tree(beaker_mesh().triangles)
    apart = np.zeros(2, dtype=bool)
    moves = np.array([[0, 0, 0.05], [0, 0, 0.012]])
    certainly_apart(boxes_of(a), a, boxes_of(b), b, np.tile(np.eye(3), (2, 1, 1)), moves, np.full(2, 1e-3), apart)
    assert apart.tolist() == [True, False]
