"""Numbers that were recorded beside the poses come with the time of the session."""

from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import cube

from replay.outputs.run_tables import effect_table
from replay.pipeline.engine import compute
from sessions import ScalarTrack, Session

STEP = 10_000_000


@pytest.fixture(scope="module")
def session():
    """A cube at rest for a second, a pulse every tenth of it, and numbers of another time."""
    stamps = 7 * 10**9 + STEP * np.arange(100)
    poses = {"cube": (np.tile([0.0, 1, -1], (100, 1)), np.tile([0.0, 0, 0, 1], (100, 1)))}
    pulse = ScalarTrack(stamps[::10] + 3, 70 + np.arange(10.0), "1/min")
    late = ScalarTrack(stamps + 10**10, np.zeros(100))
    return replace(Session.from_arrays(stamps, poses, {"cube": cube(0.2)}), scalars={"pulse": pulse, "late": late})


def test_numbers_come_with_the_time_of_the_session_and_those_of_another_time_do_not(session):
    result = compute(session, detectors=())
    (pulse,) = result.effects["scalars"].series.values()
    assert pulse.unit == "1/min" and pulse.values.tolist() == [70.0 + k for k in range(10)]
    assert np.allclose(pulse.times, 0.1 * np.arange(10) + 3e-9)
    found = {row[0]: row[1:] for row in effect_table(result).only("effect", "because", "found").rows}
    assert found == {"scalars": ("it was recorded", "1 curve")}


def test_a_window_cuts_them_and_a_recording_without_has_none(session):
    part = compute(session, detectors=(), start=0.2, end=0.49)
    assert part.effects["scalars"].series["pulse"].values.tolist() == [72.0, 73.0, 74.0]
    assert compute(replace(session, scalars={}), detectors=()).effects == {}
