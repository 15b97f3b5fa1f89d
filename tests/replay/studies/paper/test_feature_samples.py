"""Coverage misses are counted from the truth, and search misses from covered poses alone."""

from itertools import pairwise, product

import pytest

from replay.studies.paper import feature_samples


@pytest.fixture(scope="module")
def drawn():
    parts = (("torus-sphere", 0), ("torus-sphere", 1), ("beaker-flask", 0))
    return [feature_samples.search_samples(family, draw, 40, 0) for family, draw in parts]


@pytest.mark.slow
def test_all_faces_cover_every_pose_and_smaller_samples_fewer(drawn):
    for one in drawn:
        counts = [one.meeting[size] for size in feature_samples.SIZES]
        assert all(count > 0 for count in counts[-1])
        for few, more in pairwise(counts):
            assert all(a <= b for a, b in zip(few, more, strict=True))
        assert sum(counts[0]) < sum(counts[-1]) / 10


@pytest.mark.slow
def test_searches_are_asked_about_covered_poses_only(drawn):
    for one in drawn:
        assert set(one.spent) == set(product(feature_samples.SEARCHERS, feature_samples.SIZES))
        for (_, size), spent in one.spent.items():
            assert len(spent) == sum(there > 0 for there in one.meeting[size])
            assert all(hit is None or 0 < hit <= feature_samples.LIMIT for hit in spent)


def test_nine_in_ten_are_reached_by_the_ninth_of_ten():
    assert feature_samples.least_evaluations([5, 1, 2, 3, 4, 6, 7, 8, 9, None], 10) == 9
    assert feature_samples.least_evaluations([5, 1, 2, 3, 4, 6, 7, 8, None, None], 10) is None
    assert feature_samples.least_evaluations([], 0) is None and feature_samples.least_evaluations([1, 2], 10) is None


def test_misses_for_want_of_a_pair_and_misses_of_the_search_are_counted_apart():
    kinds = feature_samples
    meeting = {key: [0, 1, 0, 2, 1] for key in kinds.SIZES}
    spent = {key: [9, None, kinds.BUDGET + 1] for key in product(kinds.SEARCHERS, kinds.SIZES)}
    drawn = [kinds.Drawn(family, meeting, spent) for family in kinds.FAMILY_NAMES]
    coverage, search = kinds.feature_sample_tables(drawn)
    assert {row[2:5] for row in coverage.rows} == {(5, 2, 0.4)}
    assert {(*row[3:6], row[8]) for row in search.rows} == {(3, 2, 2 / 3, 0.2)}
