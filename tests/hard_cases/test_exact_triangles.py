"""On every hard family the exact predicate agrees with two other exact algorithms and with every exact metamorphic
relation.
"""

import itertools

import numpy as np
import pytest
from oracles.separating_axes import meets_by_axes

from cdcore.narrow.predicates import triangles_intersect
from cdcore.narrow.triangle_integers import pair_intersects_integers
from replay.stress.families import FAMILIES

by_name = pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
QUICK = 150
FULL = 4_000
FRESH_SEEDS = (20_261, 77_003)


def count_wrong(family, count, seed):
    pairs = family.pairs(count, seed=seed)
    ours = triangles_intersect(pairs)
    integers = np.array([pair_intersects_integers(pair.tolist()) for pair in pairs])
    axes = np.array([meets_by_axes(pair) for pair in pairs])
    by_construction = 0 if family.expected is None else int((ours != family.expected).sum())
    return int((ours != integers).sum()), int((ours != axes).sum()), by_construction


@by_name
def test_a_sample_of_each_family_agrees_with_both_exact_algorithms(family):
    assert count_wrong(family, QUICK, FRESH_SEEDS[0]) == (0, 0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", FRESH_SEEDS)
@by_name
def test_four_thousand_pairs_of_each_family_agree_with_both_exact_algorithms(family, seed):
    assert count_wrong(family, FULL, seed) == (0, 0, 0)


def swapped(pairs, rng):
    return pairs[:, ::-1]


def reordered(pairs, rng):
    order = np.array(list(itertools.permutations(range(3))))
    first, second = (order[rng.integers(0, 6, len(pairs))] for _ in range(2))
    rows = np.arange(len(pairs))[:, None]
    return np.stack([pairs[rows, 0, first], pairs[rows, 1, second]], axis=1)


def turned(pairs, rng):
    order = list(rng.permutation(3))
    return pairs[..., order] * rng.choice([-1.0, 1.0], 3)


def scaled(pairs, rng):
    return pairs * 2.0 ** rng.integers(-10, 11, (len(pairs), 1, 1, 1))


def shifted(pairs, rng):
    moved = pairs + 8.0 * rng.integers(-4, 5, (len(pairs), 1, 1, 3))
    exact = (moved - (moved - pairs) == pairs).all(axis=(1, 2, 3))
    shift = moved - pairs
    exact &= (shift == shift[:, :1, :1]).all(axis=(1, 2, 3))
    return np.where(exact[:, None, None, None], moved, pairs)


@pytest.mark.parametrize("relation", [swapped, reordered, turned, scaled, shifted])
@by_name
def test_no_exact_relation_flips_an_answer(family, relation):
    rng = np.random.default_rng(family.number)
    pairs = family.pairs(2_000, seed=FRESH_SEEDS[1])
    assert np.array_equal(triangles_intersect(relation(pairs, rng)), triangles_intersect(pairs))


def test_the_shift_relation_is_not_empty():
    rng = np.random.default_rng(0)
    pairs = FAMILIES[23].pairs(100)
    assert (shifted(pairs, rng) != pairs).any(axis=(1, 2, 3)).mean() > 0.9
