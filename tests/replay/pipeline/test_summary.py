import json
from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import cubes, framed, verdicts

import replay
from cdcore import Detection
from cdcore.detectors import load_detector
from replay.base.wilson import wilson
from replay.comparison.matching import EpisodeMatch, EpisodeMatches
from replay.effects import load_effect
from replay.pipeline.citations import citations, sources_behind
from replay.pipeline.engine import compute
from replay.pipeline.scores import NOT_EXAMINED, episode_figures, pool
from replay.pipeline.summary import SCHEMA, frame_seconds
from sessions import Status


@pytest.fixture(scope="module")
def summary():
    session = cubes({"a": [0] * 6, "b": [3, 3, 0.9, 3, 3, 3]})
    return compute(session, detectors="slow=discrete[rate_hz=30]", oracle="hybrid", seed=5, start=0.0).summary


def test_json_holds_the_whole_summary(summary):
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    assert summary["schema"] == SCHEMA and summary["seed"] == 5 and summary["window"] == {"start": 0.0, "end": None}


def test_settings_digests_and_times_of_every_detector_are_in_it(summary):
    for detector in summary["detectors"].values():
        assert len(detector["digest"]) == 64 and detector["settings"] and detector["seconds"]["stages"]
    slow, hybrid = summary["detectors"]["slow"], summary["detectors"]["hybrid"]
    assert slow["settings"]["rate_hz"] == 30 and slow["online"] and not hybrid["online"]
    assert slow["seconds"]["per_frame"]["max"] >= slow["seconds"]["per_frame"]["median"] >= 0
    assert "per_frame" not in hybrid["seconds"] and len(hybrid["faces_digest"]) == 64
    assert sum(hybrid["verdicts"].values()) == 6


def test_what_was_done_to_the_frames_is_counted():
    session = framed([0, 10, 10, 5, 30], np.full((5, 2), int(Status.VALID)))
    told = compute(session, detectors="sphere", oracle="none").summary["session"]
    assert told["dropped_frames"] == {"repeated": 1, "backwards": 1} and told["frames"] == 3
    assert len(told["notes"]) == 2


def test_seconds_of_a_frame_are_the_sum_of_its_stages_where_known():
    head = verdicts(["..", ".."])
    online = Detection(**{**vars(head), "seconds": {"x": np.array([1.0, 2.0]), "y": np.array([0.5, 0.25])}})
    assert frame_seconds(online).tolist() == [1.5, 2.25]
    assert frame_seconds(head) is None
    assert frame_seconds(Detection(**{**vars(head), "seconds": {"x": 1.0}})) is None


def test_serials_of_devices_stay_in_the_session_file():
    session = cubes(
        {"a": [0] * 6, "b": [3, 3, 0.9, 0.9, 3, 3]}, facts={"devices": "LHR-8F0A0C11 -> left", "clock": "steady"}
    )
    told = compute(session, detectors="hybrid", oracle="none").summary["session"]["facts"]
    assert told["clock"] == "steady" and "LHR" not in str(told)


PLACES = {"a": [0] * 6, "b": [3, 3, 0.9, 3, 3, 3]}


@pytest.fixture(scope="module")
def result():
    return replay.run(cubes(PLACES), detectors="sphere,first=discrete,second=discrete[rate_hz=30]", oracle="hybrid")


def test_each_detector_of_the_run_is_cited_once_with_its_own_sources(result):
    behind = sources_behind(result)
    assert set(behind) == {"detector sphere", "detector discrete", "detector hybrid"}
    for what, sources in behind.items():
        assert sources == load_detector(what.removeprefix("detector ")).sources


def test_effects_that_ran_are_cited_too(result):
    behind = sources_behind(replace(result, effects={"contact": None}))
    assert behind["effect contact"] == tuple(load_effect("contact").sources)


def test_a_detector_from_outside_without_sources_is_said_to_have_none(result, monkeypatch):
    monkeypatch.delattr(load_detector("sphere"), "sources")
    assert sources_behind(result)["detector sphere"] == ("names no sources",)


def test_the_text_puts_sources_below_what_they_are_of():
    text = citations({"detector x": ("A, 1996", "B, 1997"), "effect y": ("C, 2001",)})
    assert text.splitlines() == ["sources", "  detector x", "    A, 1996", "    B, 1997", "  effect y", "    C, 2001"]


PLACES_scores = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}


def test_matched_and_unmatched_counts_add_up_to_the_contacts():
    figures = compute(cubes(PLACES_scores), detectors="slow=discrete[rate_hz=20]").summary["audit"]["slow"]
    told = figures["episodes"]
    assert told["truth"] == told["matched"] + told["missed"] + told["absorbed"] + told["excused_truth"] == 2
    assert told["found"] == told["matched"] + told["invented"] + told["pieces"] + told["excused_found"]
    assert (told["matched"], told["missed"]) == (1, 1) and told["missed_share"]["share"] == 0.5
    frames = figures["pair_frames"]
    assert figures["missed"]["of"] == frames["BOTH"] + frames["MISSED"] == 4


def test_between_frames_is_not_examined_by_an_oracle_of_instants():
    figures = compute(cubes(PLACES_scores), detectors="hybrid").summary["audit"]["hybrid"]
    assert figures["between_frames"] == NOT_EXAMINED


def test_excused_contacts_are_no_part_of_a_share():
    matches = EpisodeMatches((EpisodeMatch(1, 1, 3, 0.5, -0.25),), missed=(2,), excused_truth=(3,), excused_found=(2,))
    figures = episode_figures(matches, 3, 2)
    assert figures["missed_share"]["of"] == 2 and figures["invented_share"]["of"] == 1
    assert figures["onset_error"] == pytest.approx({"mean": 0.5, "median": 0.5, "p95_off": 0.5, "most_off": 0.5})


ONE = {
    "missed": {"count": 1, "of": 10, "share": 0.1, "low": 0, "high": 1}, "pair_frames": {"BOTH": 9, "MISSED": 1},
    "between_frames": "not examined", "faces": None, "episodes": {"truth": 3, "onset_error": {"mean": 0.1}},
}  # fmt: skip


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
