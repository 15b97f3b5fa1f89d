"""The float64 filter never contradicts integers, and leaves ordinary geometry undecided nowhere."""

import pytest

from cdcore.kernels.compiling import kernel
from cdcore.narrow.triangles import filter as triangle_filter
from cdcore.narrow.triangles.filter import UNDECIDED
from cdcore.narrow.triangles.integers import pair_intersects_integers
from replay.studies.stress.families import FAMILIES


@kernel
def pair_intersects_filtered(pair):
    return triangle_filter.pair_intersects_filtered(pair.ravel())


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
def test_a_decided_pair_is_decided_rightly(family):
    for pair in family.pairs(200, seed=21):
        answer = pair_intersects_filtered(pair.reshape(6, 3))
        assert answer == UNDECIDED or bool(answer) == pair_intersects_integers(pair.tolist())


def test_ordinary_pairs_are_all_decided():
    answers = [pair_intersects_filtered(pair.reshape(6, 3)) for pair in FAMILIES[0].pairs(2_000, seed=22)]
    assert UNDECIDED not in answers
    assert {0, 1} <= set(answers)


@pytest.mark.parametrize("number", [15, 16])
def test_products_out_of_range_are_left_open_not_guessed(number):
    answers = [pair_intersects_filtered(pair.reshape(6, 3)) for pair in FAMILIES[number - 1].pairs(300)]
    assert 1 not in answers
    assert UNDECIDED in answers
