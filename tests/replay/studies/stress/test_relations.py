"""Each relation asks another question with the same answer; what it moves, it moves without rounding."""

import numpy as np
import pytest

from cdcore.narrow.triangles.integers import pair_intersects_integers
from replay.errors import StressError
from replay.studies.stress import attempts
from replay.studies.stress.attempts import ATTEMPTS
from replay.studies.stress.families import FAMILIES
from replay.studies.stress.relations import RELATIONS, relations_of

PAIRS = np.concatenate([family.pairs(12, seed=8) for family in FAMILIES])


def asked(name, pairs=PAIRS):
    return RELATIONS[name](pairs, np.random.default_rng(1))


@pytest.mark.parametrize("name", RELATIONS)
def test_the_integers_answer_both_questions_alike_and_most_questions_are_new(name):
    before, after = ([pair_intersects_integers(pair.tolist()) for pair in pairs] for pairs in (PAIRS, asked(name)))
    assert before == after
    changed = (asked(name) != PAIRS).any(axis=(1, 2, 3))
    assert changed.mean() > (0.1 if name == "shift" else 0.7)


def test_swapping_twice_and_reordering_keep_the_corners():
    assert np.array_equal(asked("swap", asked("swap")), PAIRS)
    assert np.array_equal(np.sort(asked("order"), axis=2), np.sort(PAIRS, axis=2))


def test_a_shift_that_would_round_is_not_made():
    lattice, rounded = FAMILIES[23].pairs(100), FAMILIES[1].pairs(100)
    assert (asked("shift", lattice) != lattice).any(axis=(1, 2, 3)).mean() > 0.9
    assert (asked("shift", rounded) != rounded).any(axis=(1, 2, 3)).mean() < 0.1


def test_names_choose_relations_in_the_order_given():
    assert list(relations_of("axes,swap")) == ["axes", "swap"]
    assert relations_of("all") == RELATIONS
    with pytest.raises(StressError, match="no relation 'wave'; there are: swap"):
        relations_of("swap,wave")


@pytest.mark.parametrize("detector", ["exact", "hybrid"])
@pytest.mark.parametrize("number", ATTEMPTS)
def test_nothing_goes_wrong_with_a_sound_detector(number, detector):
    found = {name: attempt(detector) for name, attempt in ATTEMPTS[number][1]()}
    assert set(found.values()) == {""}
    assert len(found) >= 5


@pytest.mark.parametrize("number", [34, 36])
def test_an_engine_that_takes_everything_is_seen(number, monkeypatch):
    monkeypatch.setattr(attempts, "_matrix", lambda values: attempts.at([[0, 0, 0]]))
    found = {name: attempt("exact") for name, attempt in ATTEMPTS[number][1]()}
    assert "taken as if it were sound" in found.values()


def test_an_answer_that_depends_on_blocks_is_seen(monkeypatch):
    monkeypatch.setattr(attempts, "join", lambda parts: parts[0])
    found = {name: attempt("exact") for name, attempt in ATTEMPTS[43][1]()}
    assert found["blocks of 1"] == "another digest" and found["1 threads"] == ""
