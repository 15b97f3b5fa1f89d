"""On the bench and in a titration, hardly a miss of any detector stays unexplained."""

import pytest

from replay.audit.causes import Cause
from replay.engine import compute
from replay.made_up import made_up_session

DETECTORS = "poor=hybrid-qaco[budget=200],slow=discrete[rate_hz=22.5],collider[shape=capsule,rate_hz=50],hybrid"
MOST_UNEXPLAINED = 0.01


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "window"), [("bench-bumps", (0.0, 25.0)), ("titration", (0.0, 10.0))])
def test_misses_have_a_cause(scene, window):
    session, _ = made_up_session(scene)
    result = compute(session, detectors=DETECTORS, start=window[0], end=window[1])
    found = {label: told.pair_frames for label, told in result.causes.items() if told.examined}
    if scene == "bench-bumps":
        assert {"poor", "slow"} <= set(found)
    examined = sum(told.examined for told in result.causes.values())
    unexplained = sum(frames.get(Cause.UNEXPLAINED, 0) for frames in found.values())
    assert unexplained <= MOST_UNEXPLAINED * examined
