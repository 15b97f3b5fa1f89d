import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from replay.comparison.clock_offset import estimate_offset
from replay.errors import AuditError

BEGIN, END = ("a", "b", "begin"), ("a", "b", "end")


@settings(max_examples=40)
@given(st.floats(-1e6, 1e6), st.integers(0, 2**31))
def test_a_shift_is_found_again_whatever_its_size_with_lost_and_extra_reports(shift, seed):
    rng = np.random.default_rng(seed)
    begins = np.sort(rng.uniform(0, 60, 20))
    truth = {BEGIN: begins.tolist(), END: (begins + rng.uniform(0.1, 1.0, 20)).tolist()}
    reported = {
        key: (np.array(times) - shift + rng.uniform(-0.008, 0.008, 20))[rng.random(20) < 0.8].tolist()
        for key, times in truth.items()
    }
    reported[BEGIN] = [*reported[BEGIN], -shift + 200.0]
    found = estimate_offset(reported, truth)
    assert found.seconds == pytest.approx(shift, abs=0.012)
    assert found.residual < 0.025 and found.matched >= found.of - 4


def test_the_offset_is_exact_where_the_reports_are():
    found = estimate_offset({BEGIN: [10.0, 11.0, 13.5]}, {BEGIN: [0.0, 1.0, 3.5]})
    assert (found.seconds, found.residual, found.matched, found.of) == (-10.0, 0.0, 3, 3)
    assert "-10.0000 s, residual 0.0 ms, 3 of 3" in str(found)


def test_of_shifts_that_fit_equally_the_smallest_is_taken():
    assert estimate_offset({BEGIN: [1.0]}, {BEGIN: [0.0, 1.2, 5.0]}).seconds == pytest.approx(0.2)


def test_a_given_offset_is_kept_and_its_fit_said():
    found = estimate_offset({BEGIN: [1.0, 2.0]}, {BEGIN: [1.01, 2.5]}, 0.0)
    assert (found.seconds, found.matched) == (0.0, 1) and found.residual == pytest.approx(0.01)
    assert estimate_offset({BEGIN: [1.0]}, {}, 0.5).matched == 0


def test_without_a_common_pair_nothing_is_guessed():
    with pytest.raises(AuditError, match="--offset"):
        estimate_offset({BEGIN: [1.0]}, {END: [1.0]})
