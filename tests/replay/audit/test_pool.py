from replay.audit.pool import pool
from replay.audit.wilson import wilson

ONE = {
    "missed": {"count": 1, "of": 10, "share": 0.1, "low": 0, "high": 1},
    "pair_frames": {"BOTH": 9, "MISSED": 1},
    "between_frames": "not examined",
    "faces": None,
    "episodes": {"truth": 3, "onset_error": {"mean": 0.1}},
}


def test_counts_add_up_and_shares_are_those_of_the_sums():
    (figures,) = pool([{"x": ONE}, {"x": ONE}]).values()
    assert figures["missed"]["count"] == 2 and figures["missed"]["of"] == 20
    assert (figures["missed"]["low"], figures["missed"]["high"]) == wilson(2, 20)
    assert figures["pair_frames"] == {"BOTH": 18, "MISSED": 2}
    assert figures["between_frames"] == "not examined" and figures["faces"] is None
    assert figures["episodes"] == {"truth": 6}


def test_one_session_keeps_everything_and_a_detector_of_one_session_only_is_there():
    assert pool([{"x": ONE}]) == {"x": ONE}
    assert list(pool([{"x": ONE}, {"y": ONE}])) == ["x", "y"]
    assert pool([]) == {}
