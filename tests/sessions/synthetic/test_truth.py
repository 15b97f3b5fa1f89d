import json

import numpy as np
import pytest

from sessions.synthetic.analytic import make_analytic
from sessions.synthetic.truth import (
    CLEAR,
    OPEN,
    PRESENT,
    Fact,
    PlantedEpisode,
    Truth,
    levelled_episodes,
    truth_path,
    write_truth,
)

TOUCH = PlantedEpisode(
    ("a", "b"), "contact", nominal=(1.0, 2.0), surely=(1.1, 1.9), possibly=(0.9, 2.1), note="a touch"
)
NEAR = PlantedEpisode(("a", "b"), "contact", nominal=None, surely=None, possibly=(5.0, 5.5))
POUR = Fact("pour", start=3.0, end=4.0, bodies=("a",), values={"volume_ml": 0.1 + 0.2, "into": "b"})


def truth(*facts):
    """Planted contacts of a and b, and other facts."""
    return Truth("made up", seed=7, start_ns=10**18, seconds=6.0, noise="off", episodes=(TOUCH, NEAR), facts=facts)


def test_truth_file_is_json_with_the_planted_facts(tmp_path):
    """x.mcap gets x.truth.json: a pour with its volume, and a sure and an unsure contact."""
    path = truth_path(tmp_path / "x.mcap")
    write_truth(truth(POUR), path)
    kept = json.loads(path.read_text())
    assert path.name == "x.truth.json" and kept["facts"][0]["values"] == {"volume_ml": 0.1 + 0.2, "into": "b"}
    assert [episode["nominal"] for episode in kept["episodes"]] == [[1.0, 2.0], None]


def test_expected_knows_sure_open_and_clear_frames():
    """Frames before, at the edges of and within TOUCH and NEAR; while a pose is lost nothing is expected for sure."""
    stamps = 10**18 + np.array([0.5, 1.0, 1.5, 2.05, 3.0, 5.2]) * 1e9
    answer = truth().expected("b", "a", stamps.astype(np.int64)).tolist()
    assert answer == [CLEAR, OPEN, PRESENT, OPEN, CLEAR, OPEN]
    lost = truth(Fact("loss", start=1.2, end=1.7, bodies=("a",))).expected("a", "b", stamps.astype(np.int64)).tolist()
    assert lost == [CLEAR, OPEN, OPEN, OPEN, CLEAR, OPEN]
    others = truth(POUR, Fact("loss", start=0.0, end=6.0, bodies=("c",)))
    assert others.expected("a", "b", stamps.astype(np.int64)).tolist() == answer
    assert truth().expected("a", "c", stamps.astype(np.int64)).tolist() == [CLEAR] * 6


NOISE, TESSELLATION = 0.125, 0.25
"""Metres, and at 1 m/s also seconds."""

LATENCY, SESSION_SECONDS = 0.5, 8.5
BOUNDS = {"noise": NOISE, "tessellation": TESSELLATION, "clock": (LATENCY, SESSION_SECONDS)}


def intervals_closer_than(height):
    """When two surfaces at 1 m/s are at most ``height`` m apart: they meet from 2 to 4 s and only touch at 8 s."""
    return [(2.0 - height, 4.0 + height)] + [(8.0 - height, 8.0 + height)] * (height > 0.0)


@pytest.mark.parametrize(
    ("kind", "earliest", "latest"),
    [("contact", NOISE, NOISE + TESSELLATION), ("contained", NOISE + TESSELLATION, NOISE)],
)
def test_episode_length_is_bounded_by_noise_and_tessellation(kind, earliest, latest):
    """``earliest``, ``latest``: seconds that it may begin earlier, and later; noise does either.

    Meshes lie inside the smooth shapes: so they touch later, and are contained earlier.
    """
    meeting, touch = levelled_episodes(("a", "b"), kind, intervals_closer_than, **BOUNDS)
    begin, end = 2.0 + LATENCY, 4.0 + LATENCY
    assert meeting.pair == ("a", "b") and meeting.kind == kind
    assert meeting.nominal == (begin, end)
    assert meeting.surely == (begin + latest, end - latest)
    assert meeting.possibly == (begin - earliest, end + earliest)
    assert touch.nominal is touch.surely is None
    assert touch.possibly == (8.0 + LATENCY - earliest, SESSION_SECONDS)


def test_contact_from_the_start_has_no_uncertain_begin():
    """Contact lasts from the first frame to 1 s. Poses are 0.5 s late, which moves its end alone."""
    (episode,) = levelled_episodes(("a", "b"), "contact", lambda height: [(0.0, 1.0 + height)], **BOUNDS)
    end = 1.0 + LATENCY
    assert episode.nominal == (0.0, end)
    assert episode.surely == (0.0, end - NOISE - TESSELLATION)
    assert episode.possibly == (0.0, end + NOISE)


@pytest.mark.parametrize("name", ["ball-plate", "fast-ball"])
def test_noise_leaves_both_ends_of_a_contact_open(name):
    """Frames that noise may shift lie between the span of possible contact and that of sure contact."""
    seconds = 6.0
    _, truth = make_analytic(name, seconds=seconds, noise="vive")
    whole = [episode for episode in truth.episodes if episode.possibly[0] > 0.0 and episode.possibly[1] < seconds]
    assert len(whole) > 2
    for episode in whole:
        assert episode.possibly[0] < episode.nominal[0] < episode.surely[0]
        assert episode.surely[1] < episode.nominal[1] < episode.possibly[1]


def test_each_contact_has_its_own_sure_interval():
    """Two contacts and, from the start of the session, a third, which late poses do not shorten."""
    contacts = [(0.0, 1.0), (2.0, 4.0), (6.0, 7.0)]
    shifted = lambda height: [(max(start - height, 0.0), end + height) for start, end in contacts]  # noqa: E731
    episodes = levelled_episodes(("a", "b"), "contact", shifted, noise=0.25, tessellation=0.0, clock=(0.5, 9.0))
    assert [episode.nominal for episode in episodes] == [(0.0, 1.5), (2.5, 4.5), (6.5, 7.5)]
    assert [episode.surely for episode in episodes] == [(0.75, 1.25), (2.75, 4.25), (6.75, 7.25)]
