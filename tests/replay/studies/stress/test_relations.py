"""Each relation asks another question with the same answer; what it moves, it moves without rounding."""

import numpy as np
import pytest
from support.stress_files import read_cases

from cdcore import Verdict
from cdcore.narrow.triangles.integers import pair_intersects_integers
from replay.errors import StressError
from replay.studies.stress.families import FAMILIES
from replay.studies.stress.relations import RELATIONS, count_flips, flips_of, relations_of

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


def test_exact_flips_nowhere():
    found = count_flips(["exact"], families=[FAMILIES[k] for k in (1, 9, 14, 17, 24)], pairs=25, seed=3)
    assert len(found) == 5 * 5
    assert sum(one.flips + one.refused for one in found) == 0
    assert [one.number for one in found[:5]] == [2, 10, 15, 18, 25]


def test_python_fcl_flips_and_the_file_holds_both_questions_and_both_answers(tmp_path):
    (found,) = count_flips(["hybrid"], {"axes": RELATIONS["axes"]}, families=FAMILIES[9:10], pairs=200, out=tmp_path)
    assert found.flips > 0
    cases = read_cases(tmp_path / "family-10-hybrid-seed-100-axes.npz")
    assert found.file == str(tmp_path / "family-10-hybrid-seed-100-axes.npz")
    assert cases.relation == "axes" and len(cases.row) == 2 * found.flips
    assert (cases.verdict[::2] != cases.verdict[1::2]).all()
    assert np.array_equal(cases.truth[::2], cases.truth[1::2])
    pairs = FAMILIES[9].pairs(200)
    assert np.array_equal(cases.triangles[::2], pairs[cases.row[::2]])
    assert (np.sort(np.abs(cases.triangles[1::2]), axis=-1) == np.sort(np.abs(cases.triangles[::2]), axis=-1)).all()


def test_refusals_are_counted_apart_and_volumes_not_at_all():
    before = np.array([Verdict.CLEAR, Verdict.CONTACT, Verdict.CLEAR, Verdict.CANDIDATE, Verdict.CLEAR], dtype=np.uint8)
    after = np.array([Verdict.CLEAR, Verdict.CLEAR, Verdict.INVALID, Verdict.CLEAR, Verdict.NOT_FOUND], dtype=np.uint8)
    pairs = FAMILIES[0].pairs(5)
    one = flips_of("planted", "swap", FAMILIES[0], 100, (pairs, pairs), (before, after))
    assert (one.flips, one.refused, one.pairs, one.file) == (1, 1, 5, None)


@pytest.mark.parametrize("bad", [{"pairs": 0}, {"seed": -1}])
def test_numbers_that_mean_nothing_are_refused(bad):
    with pytest.raises(StressError, match="give 1 pair or more"):
        count_flips(["exact"], **bad)
