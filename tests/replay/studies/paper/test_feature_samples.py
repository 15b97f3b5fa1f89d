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
    """Five of 8 poses collide: the snapshot has how many of their pairs that meet are in samples of 200 faces and of
    all, and after how many evaluations a random search hits (None: not after 3,000).
    """
    monkeypatch.setattr(feature_samples, "SAMPLE_SIZES", (200, None))
    monkeypatch.setattr(feature_samples, "SEARCH_VARIANTS", ("random",))
    monkeypatch.setattr(feature_samples, "MOST_EVALUATIONS", 3000)
    result = feature_samples.search_samples("torus-sphere", pose_count=8, seed=1)
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
    """Two cubes that meet in five poses; samples have three faces of each, or all, drawn four times with own seeds.

    The first draw serves poses 0 and 4. Three faces leave some poses without a pair that meets, and these are not
    searched; a planted search hits with all faces alone, after 7 evaluations.
    """
    motion = motion_at([[0.9 - 0.01 * k, 0.1, 0.2] for k in range(5)])
    poses = NearPoses("cubes", body_pair(box_mesh(), box_mesh()), colliding=motion, free=motion.frames(0, 1))
    searches = []

    def create(name, bodies, **settings):
        if name == "exact":
            return create_detector(name, bodies, **settings)
        searches.append(SampledSearch(settings))
        return searches[-1]

    monkeypatch.setattr(feature_samples, "create_detector", create)
    monkeypatch.setattr(feature_samples, "near_poses", lambda family, count, seed: poses)
    monkeypatch.setattr(feature_samples, "SAMPLE_SIZES", (3, None))
    seed, draws, all_faces = 3, 4, None
    result = feature_samples.search_samples("cubes", pose_count=5, seed=seed)
    assert {search.settings["seed"] for search in searches} == {seed * draws + draw for draw in range(draws)}
    assert {size: len(counts) for size, counts in result.meeting_counts.items()} == {3: 5, all_faces: 5}
    assert all(count > 0 for count in result.meeting_counts[all_faces])
    assert result.evaluations_to_hit["random", all_faces] == [7] * 5
    covered = sum(count > 0 for count in result.meeting_counts[3])
    assert covered < 5
    assert result.evaluations_to_hit["random", 3] == [None] * covered


NEVER = None


@pytest.mark.parametrize(
    ("evaluations_to_hit", "poses", "expected"),
    [
        pytest.param([5, 1, 2, 3, 4, 6, 7, 8, 9, NEVER], 10, 9, id="nine of ten poses"),
        pytest.param([5, 1, 2, 3, 4, 6, 7, 8, NEVER, NEVER], 10, None, id="eight of ten poses"),
        pytest.param([1, 2], 10, None, id="two of ten poses"),
        pytest.param([], 0, None, id="no pose"),
    ],
)
def test_nine_in_ten_are_reached_by_the_ninth_of_ten(evaluations_to_hit, poses, expected):
    """Evaluations after which a search hit in each pose; expected is the least with which 90 % of the poses are hit."""
    assert feature_samples.least_evaluations(evaluations_to_hit, poses) == expected


def test_misses_without_a_sampled_pair_are_counted_separately():
    """Five poses, of which two have no pair that meets in their sample, and are misses of coverage: 2 / 5.

    Of the other three one search spends more than its budget, a miss of the search: 1 / 3; 2 / 5 of all succeed.
    """
    meeting_pairs_in_sample = {size: [0, 1, 0, 2, 1] for size in SAMPLE_SIZES}
    spent = {key: [9, 10, EVALUATIONS_PER_POSE + 1] for key in product(SEARCH_VARIANTS, SAMPLE_SIZES)}
    coverage, search = feature_sample_tables([SampleSearches("torus-sphere", meeting_pairs_in_sample, spent)])
    assert len(coverage.rows) == len(SAMPLE_SIZES) and len(search.rows) == len(spent)
    for row in coverage.rows:
        _family, _size, poses, misses, rate, *_interval = row
        assert (poses, misses, rate) == (5, 2, 2 / 5)
    for row in search.rows:
        _family, _search, _size, covered, misses, rate, _lower, _upper, success, *_ = row
        assert (covered, misses, rate, success) == (3, 1, 1 / 3, 2 / 5)


@pytest.mark.parametrize(("covered", "expected"), [(20, 18), (19, None)])
def test_few_covered_poses_have_no_budget_of_nine_in_ten(covered, expected):
    """The first pose is hit after one evaluation, the second after two, and so on: 18 are 90 % of 20 poses.

    Below LEAST_COVERED, 20, poses whose sample has a pair that meets, a share of nine in ten says nothing.
    """
    evaluations_to_hit = {key: [*range(1, covered + 1)] for key in product(SEARCH_VARIANTS, SAMPLE_SIZES)}
    meeting_pairs_in_sample = {size: [1] * covered for size in SAMPLE_SIZES}
    searches = SampleSearches("torus-sphere", meeting_pairs_in_sample, evaluations_to_hit)
    _coverage, search = feature_sample_tables([searches])
    assert search.rows
    for row in search.rows:
        *_, success, evaluations_of_covered, _evaluations_of_all = row
        assert success == 1.0 and evaluations_of_covered == expected
