from __future__ import annotations

import numpy as np
import pytest

from sessions.errors import SessionError
from sessions.synthetic.assembly import START_NS, Recording, recorded
from sessions.synthetic.paths import Key, KeyPath, still

PATHS = {
    "a": still((0.0, 1.0, 0.0)),
    "b": KeyPath([Key(0.0, (0.0, 0.0, 0.0)), Key(5.0, (1.0, 0.0, 0.0), ease="linear")]),
}


def test_without_noise_the_recorded_poses_are_the_path():
    seen = recorded(PATHS, Recording(seconds=5.0))
    position, _ = seen.poses["b"]
    np.testing.assert_allclose(position[:, 0], seen.stamps * 1e-9 / 5.0, atol=1e-12)
    assert seen.valid["b"].all() and seen.facts == ()


def test_noise_comes_late_and_a_bodys_noise_does_not_depend_on_others():
    how = Recording(seconds=5.0, noise="vive", losses="off", seed=4)
    both, alone = recorded(PATHS, how), recorded({"b": PATHS["b"]}, how)
    np.testing.assert_array_equal(both.poses["b"][0], alone.poses["b"][0])
    lag = both.poses["b"][0][20:, 0] - (both.stamps[20:] * 1e-9 - 0.022) / 5.0
    assert np.abs(lag).max() < 0.001


def test_losses_become_facts_and_spare_what_is_kept():
    facts = [
        fact
        for seed in range(20)
        for fact in recorded(PATHS, Recording(seconds=60.0, noise="vive", seed=seed), keep={"a": [(0.0, 60.0)]}).facts
    ]
    assert facts and all(fact.kind == "loss" and fact.bodies == ("b",) for fact in facts)


def test_tracks_carry_absolute_stamps():
    seen = recorded(PATHS, Recording(seconds=1.0))
    tracks = seen.tracks({"prop": seen.poses["a"]})
    assert list(tracks) == ["a", "b", "prop"]
    assert tracks["prop"].times_ns[0] == START_NS


@pytest.mark.parametrize("wrong", [{"noise": "loud"}, {"jitter": "odd"}, {"losses": "many"}, {"rate_hz": -1.0}])
def test_what_cannot_be_is_refused_by_name(wrong):
    with pytest.raises(SessionError, match=str(next(iter(wrong)))):
        Recording(**wrong)
