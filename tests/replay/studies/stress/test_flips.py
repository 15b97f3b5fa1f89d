"""A flip is counted once, refusals apart from it; exact has none, and python-fcl behind hybrid has some."""

import numpy as np
import pytest

from cdcore import Verdict
from replay.errors import StressError
from replay.studies.stress.cases import read_cases
from replay.studies.stress.families import FAMILIES
from replay.studies.stress.flips import count_flips, flips_of
from replay.studies.stress.relations import RELATIONS


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
