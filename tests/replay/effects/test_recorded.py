"""Numbers that were recorded beside the poses come with the time of the session."""

from dataclasses import replace

import numpy as np
from support.small_worlds import cubes

from replay.pipeline.engine import compute
from sessions import ScalarTrack


def test_numbers_come_with_the_time_of_the_session_and_those_of_another_time_do_not():
    bare = cubes({"a": [0.0] * 100, "b": [3.0] * 100}, first_ns=10**9)
    stamps = bare.stamps()
    pulse = ScalarTrack(stamps[::10] + 3, 70 + np.arange(10.0), "1/min")
    session = replace(bare, scalars={"pulse": pulse, "late": ScalarTrack(stamps + 10**10, np.zeros(100))})
    run = compute(session, detectors=()).effects["scalars"]
    (series,) = run.series.values()
    assert series.unit == "1/min" and series.values.tolist() == [70.0 + k for k in range(10)]
    assert np.allclose(series.times, 0.1 * np.arange(10) + 3e-9) and run.because == ("it was recorded",)
    part = compute(session, detectors=(), start=0.2, end=0.49)
    assert part.effects["scalars"].series["pulse"].values.tolist() == [72.0, 73.0, 74.0]
    assert compute(bare, detectors=()).effects == {}
