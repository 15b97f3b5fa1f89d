"""Among distant bodies the search does not grow with the frames: by its counters, which no machine changes."""

import pytest

from replay.studies.bench.growth import grow
from replay.studies.bench.workload import make_workload


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_ten_times_the_frames_of_distant_bodies_take_one_or_two_tests_more_a_pair(seed):
    short, long = (grow("distant", "frames", frames, seed=seed) for frames in (2_700, 27_000))
    pairs = len(make_workload(100, 1).pairs)
    for one in (short, long):
        assert one.work["skipped"] == one.pair_frames
        assert one.work["blocks"] == one.work["gap_tests"] == one.work["node_tests"] == 0
    assert short.tests == 3 * pairs
    assert long.tests == 4 * pairs


def test_near_bodies_take_tests_in_proportion_and_most_pair_frames_are_skipped_all_the_same():
    short, long = (grow("near", "frames", frames) for frames in (2_700, 13_500))
    assert 4 < long.tests / short.tests < 6
    assert long.work["skipped"] > 0.85 * long.pair_frames


def test_growth_says_how_much_was_asked_and_where_time_went():
    one = grow("near", "bodies", 5)
    assert one.pair_frames == 5400 * len(make_workload(10, 1, bodies=5).pairs)
    assert 0 < one.reading + one.search < one.seconds
    assert one.stages.keys() >= {"check", "poses", "search", "exact"}
