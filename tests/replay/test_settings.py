"""Settings of a run that no run can follow are refused."""

from math import inf, nan

import pytest

from replay import errors
from replay.settings import RunSettings


@pytest.mark.parametrize("seconds", [-1.0, inf, nan])
def test_time_for_a_fix_is_finite_and_not_negative(seconds):
    """A run may take so many ``seconds`` to try fixes: below 0, infinite and no number are refused."""
    with pytest.raises(errors.DetectorSpecError, match="the time for a fix is"):
        RunSettings(fix_time=seconds)


@pytest.mark.parametrize("hertz", [0.0, -50.0, inf, nan])
def test_step_rate_is_finite_and_positive(hertz):
    """The physics steps of an engine, a second: 0, below 0, infinite and no number are refused."""
    with pytest.raises(errors.DetectorSpecError, match="the step rate is"):
        RunSettings(step_rate=hertz)
