"""The control gives no more than there is, no more than hits have needed, and passes over only what it has measured."""

import numpy as np
import pytest

from cdcore.search.sample_control import BANDS, ENOUGH, EXPLORE, FORGET, LEVELS, TRY_LEVEL, SampleControl, band_of


def taught(hits=200, band=0, evaluations=300, target=0.99):
    control = SampleControl(4000, target)
    for _ in range(hits):
        control.learn(0, band, evaluations, True)
    return control


def test_bands_grow_with_the_gap():
    bands = [band_of(gap) for gap in (-1.0, 0.0, 1e-9, 0.2, 0.3, 1.0, 3.0, 1e9)]
    assert bands == sorted(bands)
    assert (bands[0], bands[-1]) == (0, BANDS - 1)
    assert band_of(float("nan")) == 0


def test_while_little_is_known_every_pair_gets_its_share():
    assert SampleControl(4000, 0.99).allowance(9, 1000, 4) == 250
    assert taught(ENOUGH - 1).allowance(9, 1000, 4) == 250


def test_no_pair_gets_more_than_twice_what_hits_have_needed():
    assert 300 <= taught().allowance(0, 10**6, 1) <= 4 * 300


def test_distant_pairs_are_passed_over_only_after_a_hundred_hits_and_still_looked_at_now_and_then():
    assert taught(20).allowance(5, 4000, 2) > 0
    control = taught(150)
    given = [control.allowance(5, 4000, 2) for _ in range(2 * EXPLORE)]
    assert [extra > 0 for extra in given].count(True) == 2
    assert taught(150, band=5).allowance(5, 4000, 2) > 0


def test_a_thinner_sample_is_taken_only_for_hits_of_its_own():
    control = taught()
    assert [control.level() for _ in range(TRY_LEVEL - 1)] == [0] * (TRY_LEVEL - 1)
    tried = [control.level() for _ in range(TRY_LEVEL * len(LEVELS))]
    assert set(tried) == set(range(len(LEVELS)))
    for _ in range(ENOUGH):
        control.learn(1, 0, 10, True)
    assert control.level() == 1


@pytest.mark.parametrize("hit", [True, False])
def test_counts_fade_so_that_a_session_that_changes_is_followed(hit):
    control = taught(FORGET - 1)
    control.learn(0, 0, 300, hit)
    assert control.hits.sum() == (FORGET / 2 if hit else FORGET - 1)
    assert np.isfinite(control.needed).all()


def test_one_frame_in_25_may_run_on_and_none_before_there_were_25():
    control = SampleControl(1000, 0.99)
    granted = []
    for _ in range(100):
        assert control.begin() == 1000
        granted.append(control.run_on())
    assert granted[:24] == [0] * 24
    assert granted.count(3000) == 4
    assert granted.count(0) == 96
