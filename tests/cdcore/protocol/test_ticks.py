import numpy as np
import pytest

from cdcore.protocol.ticks import looks_at, looks_of


@pytest.mark.parametrize("rate", [22.5, 50.0, 60.0, 72.0, 90.0])
def test_looks_of_blocks_are_those_of_the_whole_and_of_single_frames(rate):
    times = np.cumsum(np.random.default_rng(0).uniform(0.002, 0.03, 300))
    whole, tick = looks_of(times, rate)
    first, before = looks_of(times[:77], rate)
    second, after = looks_of(times[77:], rate, before)
    assert np.array_equal(np.concatenate([first, second]), whole) and after == tick
    assert [looks_at(times, frame, rate) for frame in range(300)] == whole.tolist()


def test_a_rate_at_the_frames_own_looks_at_every_frame_though_stamps_are_rounded():
    times = np.round(np.arange(9000) / 90, 9)
    assert looks_of(times, 90.0)[0].all()
    assert looks_of(times, 45.0)[0].sum() == 4500


def test_no_frame_is_no_look():
    looks, tick = looks_of(np.zeros(0), 50.0, 3.0)
    assert len(looks) == 0 and tick == 3.0
