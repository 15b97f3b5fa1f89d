import pytest
from support.small_worlds import TWO_BUMPS, cubes

from replay.auditing.matching import EpisodeMatch, EpisodeMatches
from replay.base.wilson import wilson
from replay.pipeline.engine import compute
from replay.pipeline.scores import episode_figures, pool
from sessions.model.scene import Scene, SceneBody


def test_contacts_of_a_body_and_its_parent_are_no_episodes():
    scene = Scene(bodies=(SceneBody("a"), SceneBody("b", parent="a")))
    result = compute(cubes(TWO_BUMPS, scene=scene), detectors="discrete", pairs=[("a", "b")])
    figures = result.summary["audit"]["discrete"]
    assert [figures["episodes"][key] for key in ("truth", "found", "missed", "invented")] == [0] * 4
    (pair,) = result.summary["pairs"]
    assert pair["audit"]["discrete"]["held"] == figures["held"] and figures["held"]["contacts"] == 2
    assert [*pair["held_contacts"]] == ["exact"]


def test_excused_contacts_are_no_part_of_a_share():
    matches = EpisodeMatches((EpisodeMatch(1, 1, 3, 0.5, -0.25),), missed=(2,), excused_truth=(3,), excused_found=(2,))
    figures = episode_figures(matches, 3, 2)
    assert figures["missed_share"]["of"] == 2 and figures["invented_share"]["of"] == 1
    assert figures["onset_error"] == pytest.approx({"mean": 0.5, "median": 0.5, "p95_off": 0.5, "most_off": 0.5})


ONE = {
    "missed": {"count": 1, "of": 10, "share": 0.1, "low": 0, "high": 1},
    "pair_frames": {"BOTH": 9, "MISSED": 1},
    "between_frames": "not examined",
    "episodes": {"truth": 3, "onset_error": {"mean": 0.1}},
}


def test_counts_add_up_and_shares_are_those_of_the_sums():
    (figures,) = pool([{"x": ONE}, {"x": ONE | {"word": "a"}}, {"x": {"word": "b"}}]).values()
    assert figures["missed"]["count"] == 2 and figures["missed"]["of"] == 20
    assert (figures["missed"]["low"], figures["missed"]["high"]) == wilson(2, 20)
    assert figures["pair_frames"] == {"BOTH": 18, "MISSED": 2}
    assert (figures["between_frames"], figures["word"]) == ("not examined", "a; b")
    assert figures["episodes"] == {"truth": 6}


def test_one_session_keeps_everything_and_a_detector_of_one_session_only_is_there():
    assert pool([{"x": ONE}]) == {"x": ONE}
    assert list(pool([{"x": ONE}, {"y": ONE}])) == ["x", "y"]
    assert pool([]) == {}
