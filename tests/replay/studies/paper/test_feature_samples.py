"""Coverage misses are counted from the truth, and search misses from covered poses alone."""

from itertools import product

import pytest

from replay.studies.paper import feature_samples
from replay.studies.paper.feature_samples import (
    EVALUATIONS_PER_POSE,
    SAMPLE_SIZES,
    SEARCH_VARIANTS,
    SampleSearches,
    feature_sample_tables,
)
from replay.studies.paper.pictures import figure_8


@pytest.mark.slow
def test_samples_cover_as_many_poses_in_the_same_time(snapshot, monkeypatch):
    for name, few in {"SAMPLE_SIZES": (200, None), "SEARCH_VARIANTS": ("random",), "MOST_EVALUATIONS": 3000}.items():
        monkeypatch.setattr(feature_samples, name, few)
    result = feature_samples.search_samples("torus-sphere", 8, 1)
    assert (result.meeting_counts, result.evaluations_to_hit) == snapshot


def test_nine_in_ten_are_reached_by_the_ninth_of_ten():
    least = feature_samples.least_evaluations
    assert least([5, 1, 2, 3, 4, 6, 7, 8, 9, None], 10) == 9
    assert least([5, 1, 2, 3, 4, 6, 7, 8, None, None], 10) is least([], 0) is least([1, 2], 10) is None


def test_misses_without_a_sampled_pair_are_counted_and_drawn_separately():
    meeting_counts = {size: [0, 1, 0, 2, 1] for size in SAMPLE_SIZES}
    spent = {key: [9, 10, EVALUATIONS_PER_POSE + 1] for key in product(SEARCH_VARIANTS, SAMPLE_SIZES)}
    coverage, search = feature_sample_tables([SampleSearches("torus-sphere", meeting_counts, spent)])
    assert {row[2:5] for row in coverage.rows} == {(5, 2, 0.4)}
    assert {(*row[3:6], row[8]) for row in search.rows} == {(3, 1, 1 / 3, 0.4)}
    assert figure_8({table.key: table for table in (coverage, search)}).startswith(b"\x89PNG")
