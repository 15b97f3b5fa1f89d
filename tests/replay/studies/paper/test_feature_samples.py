"""Coverage misses are counted from the truth, and search misses from covered poses alone."""

from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from cdcore import Verdict, create_detector
from replay.studies.paper import feature_samples
from replay.studies.paper.colony import NearPoses
from replay.studies.paper.feature_samples import (
    EVALUATIONS_PER_POSE,
    SAMPLE_SIZES,
    SEARCH_VARIANTS,
    SampleSearches,
    feature_sample_tables,
)
from replay.studies.stress.scenes import body_pair, motion_at
from replay.studies.stress.solids import box_mesh


@pytest.mark.slow
def test_samples_cover_as_many_poses_in_the_same_time(snapshot, monkeypatch):
    """The snapshot has of 8 poses the pairs that meet in samples of 200 faces and of all, and evaluations to a hit."""
    for name, few in {"SAMPLE_SIZES": (200, None), "SEARCH_VARIANTS": ("random",), "MOST_EVALUATIONS": 3000}.items():
        monkeypatch.setattr(feature_samples, name, few)
    result = feature_samples.search_samples("torus-sphere", 8, 1)
    assert (result.meeting_counts, result.evaluations_to_hit) == snapshot


class SampledSearch:
    """A search that hits after 7 evaluations where it has all faces, and never in a sample."""

    def __init__(self, settings):
        self.settings = settings

    def detect(self, motion):
        hit = self.settings["samples"] is None and len(motion) == 1
        verdict = np.array([[Verdict.CONTACT if hit else Verdict.NOT_FOUND]])
        return SimpleNamespace(verdict=verdict, work={"evaluations": 7})


def test_each_draw_of_samples_serves_every_fourth_pose(monkeypatch):
    """Five poses that meet: the first of four draws serves poses 0 and 4, and all faces cover every pose."""
    motion = motion_at([[0.9 - 0.01 * k, 0.1, 0.2] for k in range(5)])
    poses = NearPoses("cubes", body_pair(box_mesh(), box_mesh()), motion, motion.frames(0, 1))
    searches = []

    def create(name, bodies, **settings):
        if name == "exact":
            return create_detector(name, bodies, **settings)
        searches.append(SampledSearch(settings))
        return searches[-1]

    monkeypatch.setattr(feature_samples, "create_detector", create)
    monkeypatch.setattr(feature_samples, "near_poses", lambda family, count, seed: poses)
    monkeypatch.setattr(feature_samples, "SAMPLE_SIZES", (3, None))
    result = feature_samples.search_samples("cubes", 5, seed=3)
    assert {search.settings["seed"] for search in searches} == {12, 13, 14, 15}
    assert {size: len(counts) for size, counts in result.meeting_counts.items()} == {3: 5, None: 5}
    assert all(result.meeting_counts[None]) and result.evaluations_to_hit["random", None] == [7] * 5
    covered = sum(count > 0 for count in result.meeting_counts[3])
    assert result.evaluations_to_hit["random", 3] == [None] * covered and covered < 5


def test_nine_in_ten_are_reached_by_the_ninth_of_ten():
    """Evaluations after which 9 of 10 searches have hit; None: never."""
    least = feature_samples.least_evaluations
    assert least([5, 1, 2, 3, 4, 6, 7, 8, 9, None], 10) == 9
    assert least([5, 1, 2, 3, 4, 6, 7, 8, None, None], 10) is least([], 0) is least([1, 2], 10) is None


def test_misses_without_a_sampled_pair_are_counted_separately():
    """Two of five poses have no meeting pair in their sample; of three searches one spends more than its budget."""
    meeting_counts = {size: [0, 1, 0, 2, 1] for size in SAMPLE_SIZES}
    spent = {key: [9, 10, EVALUATIONS_PER_POSE + 1] for key in product(SEARCH_VARIANTS, SAMPLE_SIZES)}
    coverage, search = feature_sample_tables([SampleSearches("torus-sphere", meeting_counts, spent)])
    for row in coverage.rows:
        _family, _size, poses, misses, rate, *_interval = row
        assert (poses, misses, rate) == (5, 2, 0.4)
    for row in search.rows:
        _family, _search, _size, covered, misses, rate, _lower, _upper, success, *_ = row
        assert (covered, misses, rate, success) == (3, 1, 1 / 3, 2 / 5)


@pytest.mark.parametrize(("covered", "expected"), [(20, 18), (19, None)])
def test_few_covered_poses_have_no_budget_of_nine_in_ten(covered, expected):
    """The 18th of 20 poses is reached with 18 evaluations; below 20 poses a share of nine in ten says nothing."""
    hits = {key: [*range(1, covered + 1)] for key in product(SEARCH_VARIANTS, SAMPLE_SIZES)}
    meeting = {size: [1] * covered for size in SAMPLE_SIZES}
    _, search = feature_sample_tables([SampleSearches("torus-sphere", meeting, hits)])
    for row in search.rows:
        *_, success, evaluations_of_covered, _evaluations_of_all = row
        assert success == 1.0 and evaluations_of_covered == expected
