"""Hard case 40: time stamps that lie and poses that jump are each reported by name, with their body."""

import numpy as np
import pytest
from support.small_worlds import framed

from sessions import Status, examine

STEP = 11_000_000
COUNT = 400


def codes(stamps=None, position=None):
    stamps = np.arange(COUNT) * STEP if stamps is None else stamps
    if position is None:
        position = smooth()
    session = framed(stamps, np.full((COUNT, 2), int(Status.VALID)), position)
    return {finding.code: finding for finding in examine(session)}


def smooth():
    """Two bodies on slow circles with a little noise, a metre apart."""
    time = np.arange(COUNT)[:, None] * STEP / 1e9
    place = np.empty((COUNT, 2, 3))
    place[..., 0] = 0.3 * np.sin(time + np.array([0, 1])) + np.array([0, 1])
    place[..., 1] = 1 + 0.1 * np.cos(time + np.array([0, 2]))
    place[..., 2] = 0.2 * np.sin(2 * time)
    return place + np.random.default_rng(0).normal(size=place.shape) * 1e-4


def changed(stamps_of):
    stamps = np.arange(COUNT) * STEP
    stamps_of(stamps)
    return stamps


def set_at(index, value):
    def change(stamps):
        stamps[index] = value

    return change


def gap(stamps):
    stamps[200:] += 1_000_000_000


@pytest.mark.parametrize(
    ("code", "change"),
    [
        ("duplicate-stamps", set_at(200, 199 * STEP)),
        ("time-backwards", set_at(200, 150 * STEP + 1)),
        ("gap", gap),
    ],
)
def test_40_a_stamp_that_repeats_goes_back_or_leaps_is_named(code, change):
    assert code not in codes()
    assert code in codes(changed(change))


def test_40_a_teleport_of_three_metres_is_named_with_its_body():
    position = smooth()
    position[200:, 1, 0] += 3.0
    found = codes(position=position)
    assert "teleport" not in codes()
    assert found["teleport"].body == "b"


def test_40_a_frozen_pose_is_named_with_its_body():
    position = smooth()
    position[150:230, 0] = position[150, 0]
    assert {"frozen", "at-rest"}.isdisjoint(codes())
    found = codes(position=position)
    assert [found[code].body for code in ("frozen", "at-rest") if code in found] == ["a"]
