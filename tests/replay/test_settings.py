"""Settings of a run that no run can follow are refused."""

from math import inf, nan

import pytest

from replay import errors
from replay.settings import RunSettings


@pytest.mark.parametrize("seconds", [-1.0, inf, nan])
def test_time_for_a_fix_is_finite_and_not_negative(seconds):
    """``seconds``: below 0, infinite, or no number."""
    with pytest.raises(errors.DetectorSpecError, match="the time for a fix is"):
        RunSettings(fix_time=seconds)


@pytest.mark.parametrize("rate", [0.0, -50.0, inf, nan])
def test_step_rate_is_finite_and_positive(rate):
    """``rate``: hertz, 0 or below, infinite, or no number."""
    with pytest.raises(errors.DetectorSpecError, match="the step rate is"):
        RunSettings(step_rate=rate)
