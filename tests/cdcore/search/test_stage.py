"""Over a motion the search carries on where it was closest, and a look at the same poses is not done twice."""

import numpy as np
from support.crossing_paths import crossing_paths
from support.search_scenes import ball_of
from support.shapes import still

from cdcore import Body, Motion, Verdict, create_detector, join
from cdcore.search.settings import SearchSettings
from cdcore.search.stage import SearchStage

PAIRS = np.array([[0, 1]])


def two_balls():
    return [Body("a", ball_of(2000)), Body("b", ball_of(2000))]


def approach(frames=60):
    place = np.zeros((frames, 2, 3))
    place[:, 0, 0] = np.linspace(2.3, 1.7, frames)
    place[:, 0, 1] = 0.1
    return Motion(np.arange(frames) / 90, place, np.tile(np.eye(3), (frames, 2, 1, 1)))


def everywhere(motion):
    return np.ones((len(motion), 1), dtype=bool)


def decide(motion, faces=False, **settings):
    stage = SearchStage(two_balls(), PAIRS, SearchSettings(**settings))
    return stage.decide(motion, everywhere(motion), stage.fresh_memory(), faces=faces)


def test_a_pair_that_stands_still_is_searched_once():
    answer = decide(still(two_balls(), [[1.6, 0, 0], [0, 0, 0]], frames=30), faces=True)
    assert answer.hits.all()
    assert (answer.work["looks"], answer.work["reused"]) == (1, 29)
    sets = answer.face_sets()
    assert len(sets.at(29, 0)) > 10
    assert np.array_equal(sets.at(0, 0), sets.at(29, 0))


def test_a_warm_start_finds_more_for_less_than_a_cold_one():
    warm = decide(approach(), budget=300)
    cold = decide(approach(), budget=300, warm_start=False)
    assert warm.hits.sum() > cold.hits.sum()
    assert warm.work["evaluations"] < cold.work["evaluations"]


def test_frames_that_are_not_candidates_are_not_looked_at():
    motion = approach()
    stage = SearchStage(two_balls(), PAIRS, SearchSettings())
    near = everywhere(motion)
    near[:50] = False
    answer = stage.decide(motion, near, stage.fresh_memory())
    assert not answer.hits[:50].any()
    assert answer.work["looks"] == 10


def test_asking_for_faces_changes_no_hit_and_no_evaluation():
    plain, faced = decide(approach()), decide(approach(), faces=True)
    assert np.array_equal(plain.hits, faced.hits)
    assert plain.work["evaluations"] == faced.work["evaluations"]
    assert plain.work["flood_tests"] == 0 < faced.work["flood_tests"]


def test_without_stopping_at_the_first_hit_the_budget_is_spent_on_further_curves():
    first, more = (decide(approach(), faces=True, budget=3000, stop_first=stop) for stop in (True, False))
    assert np.array_equal(first.hits, more.hits)
    assert more.work["evaluations"] == 3000 * 60
    assert first.work["evaluations"] < more.work["evaluations"]


def test_auto_exceeds_the_budget_in_one_frame_of_25_at_most_and_is_the_same_for_any_block():
    bodies, motion = crossing_paths(5, 120)
    detector = create_detector("qaco", bodies, samples="auto", frame_budget=900)
    parts = list(detector.stream(motion.blocks(1)))
    spent = np.array([part.work["evaluations"] for part in parts])
    assert 0 < spent.max() <= 4 * 900
    assert (spent > 900).mean() <= 0.04
    whole = detector.detect(motion)
    assert join(parts).digest == whole.digest == detector.detect(motion, faces=True).digest
    assert (whole.verdict == Verdict.CONTACT).any()


def test_a_fixed_number_of_samples_finds_less_than_all_faces():
    bodies, motion = crossing_paths(5, 120)
    found = [
        (create_detector("qaco", bodies, samples=samples).detect(motion).verdict == Verdict.CONTACT).sum()
        for samples in (60, 10_000, None)
    ]
    assert found[0] < found[1] == found[2]
