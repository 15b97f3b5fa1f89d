import numpy as np

from replay.effects.models.transfers import Stream, flows


def stream(times, volumes, source="a", target="b"):
    times = np.array(times)
    return Stream(
        source, target, False, times, np.round(times * 100).astype(int), np.array(volumes), np.zeros((len(times), 3))
    )


def test_a_pause_splits_a_flow_and_a_shorter_one_does_not():
    parts = flows([stream([0.0, 0.2, 0.6], [0.1] * 3)], gap_s=0.3, least_ml=0.0)
    assert [one.times.tolist() for one in parts] == [[0.0, 0.2], [0.6]]


def test_what_goes_elsewhere_is_another_flow_at_the_same_time():
    parts = flows([stream([0.0, 0.1], [0.1] * 2), stream([0.0, 0.1], [0.1] * 2, target="")], 0.0, 0.3)
    assert [(one.target, len(one.times)) for one in parts] == [("", 2), ("b", 2)]


def test_less_than_a_flow_is_none():
    assert flows([stream([0.0, 0.1], [0.02, 0.02])], 0.05, 0.3) == []
    assert len(flows([stream([0.0, 0.1], [0.03, 0.03])], 0.05, 0.3)) == 1
