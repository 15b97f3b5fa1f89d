"""Each relation asks another question with the same answer; what it moves, it moves without rounding."""

import numpy as np
import pytest

from cdcore.narrow.triangles.integers import pair_intersects_integers
from replay.studies.stress.families import FAMILIES
from replay.studies.stress.relations import RELATIONS

PAIRS = np.concatenate([family.pairs(12, seed=8) for family in FAMILIES])


def asked(name, pairs=PAIRS):
    return RELATIONS[name](pairs, np.random.default_rng(1))


@pytest.mark.parametrize("name", RELATIONS)
def test_the_integers_answer_both_questions_alike_and_most_questions_are_new(name):
    before, after = ([pair_intersects_integers(pair.tolist()) for pair in pairs] for pairs in (PAIRS, asked(name)))
    assert before == after
    changed = (asked(name) != PAIRS).any(axis=(1, 2, 3))
    assert changed.mean() > (0.1 if name == "shift" else 0.7)


def test_a_shift_that_would_round_is_not_made():
    lattice, rounded = FAMILIES[23].pairs(100), FAMILIES[1].pairs(100)
    assert (asked("shift", lattice) != lattice).any(axis=(1, 2, 3)).mean() > 0.9
    assert (asked("shift", rounded) != rounded).any(axis=(1, 2, 3)).mean() < 0.1
