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
    """The truth of a made-up session of 6 s: TOUCH and NEAR are planted contacts of a and b, ``facts`` other facts."""
    return Truth("made up", seed=7, start_ns=10**18, seconds=6.0, noise="off", episodes=(TOUCH, NEAR), facts=facts)


def test_truth_file_is_json_with_the_planted_facts(tmp_path):
    """The session file x.mcap has its truth beside it, x.truth.json, with a contact that is sure and one that is not.

    A pour has its volume to the last digit.
    """
    path = truth_path(tmp_path / "x.mcap")
    assert path.name == "x.truth.json"
    write_truth(truth(POUR), path)
    content = json.loads(path.read_text())
    (pour,) = content["facts"]
    assert pour["values"] == {"volume_ml": 0.1 + 0.2, "into": "b"}
    assert [episode["nominal"] for episode in content["episodes"]] == [[1.0, 2.0], None]


# Seconds 0.5 and 3 are outside of both contacts; 1 and 2.05 are where TOUCH is possible and not sure, 1.5 is where it
# is sure, and of NEAR, 5 to 5.5 s, nothing is sure.
STAMPS = (10**18 + np.array([0.5, 1.0, 1.5, 2.05, 3.0, 5.2]) * 1e9).astype(np.int64)
IN_CONTACTS = [CLEAR, OPEN, PRESENT, OPEN, CLEAR, OPEN]


@pytest.mark.parametrize(
    ("facts", "pair", "expected"),
    [
        pytest.param([], ("a", "b"), IN_CONTACTS, id="a and b"),
        pytest.param([], ("b", "a"), IN_CONTACTS, id="b and a"),
        pytest.param([], ("a", "c"), [CLEAR] * 6, id="a pair without contact"),
        pytest.param(
            [Fact("loss", start=1.2, end=1.7, bodies=("a",))],
            ("a", "b"),
            [CLEAR, OPEN, OPEN, OPEN, CLEAR, OPEN],
            id="a is lost at 1.5 s",
        ),
        pytest.param(
            [POUR, Fact("loss", start=0.0, end=6.0, bodies=("c",))], ("a", "b"), IN_CONTACTS, id="c is lost, a pours"
        ),
    ],
)
def test_expected_knows_sure_open_and_clear_frames(facts, pair, expected):
    """For six frames the truth says whether contact is there (PRESENT), is not (CLEAR), or may be (OPEN).

    While a pose of the pair is lost nothing is expected for sure.
    """
    assert truth(*facts).expected(*pair, STAMPS).tolist() == expected


NOISE, TESSELLATION = 0.125, 0.25
"""Of poses, and of meshes against smooth shapes: metres, and at 1 m/s also seconds."""

LATENCY, SESSION_SECONDS = 0.5, 8.5
BOUNDS = {"noise": NOISE, "tessellation": TESSELLATION, "clock": (LATENCY, SESSION_SECONDS)}


def intervals_closer_than(gap):
    """When the gap of two surfaces at 1 m/s is at most ``gap`` m: they meet from 2 to 4 s and only touch at 8 s."""
    return [(2.0 - gap, 4.0 + gap)] + [(8.0 - gap, 8.0 + gap)] * (gap > 0.0)


@pytest.mark.parametrize(
    ("kind", "earliest", "latest"),
    [("contact", NOISE, NOISE + TESSELLATION), ("contained", NOISE + TESSELLATION, NOISE)],
)
def test_episode_length_is_bounded_by_noise_and_tessellation(kind, earliest, latest):
    """Smooth shapes meet from 2 to 4 s; poses are 0.5 s late, so that in the recording they do later (``nominal``).

    Meshes may meet ``earliest`` seconds before that, and ``latest`` after it. Noise does either; meshes lie inside the
    smooth shapes: so they touch later, and are contained earlier. Of a mere touch at 8 s nothing is sure, and it ends
    with the session.
    """
    meeting, touch = levelled_episodes(("a", "b"), kind, intervals_closer_than, **BOUNDS)
    begin, end = 2.0 + LATENCY, 4.0 + LATENCY
    assert (meeting.pair, meeting.kind) == (("a", "b"), kind)
    assert meeting.nominal == (begin, end)
    assert meeting.surely == (begin + latest, end - latest)
    assert meeting.possibly == (begin - earliest, end + earliest)
    assert touch.nominal is None
    assert touch.surely is None
    assert touch.possibly == (8.0 + LATENCY - earliest, SESSION_SECONDS)


def test_contact_from_the_start_has_no_uncertain_begin():
    """Contact lasts from the first frame to 1 s. Poses are 0.5 s late, which moves its end alone.

    Its end is uncertain by noise either way, and earlier by what meshes lack of the smooth shapes.
    """
    (episode,) = levelled_episodes(("a", "b"), "contact", lambda gap: [(0.0, 1.0 + gap)], **BOUNDS)
    end = 1.0 + LATENCY
    assert episode.nominal == (0.0, end)
    assert episode.surely == (0.0, end - NOISE - TESSELLATION)
    assert episode.possibly == (0.0, end + NOISE)


@pytest.mark.parametrize("name", ["ball-plate", "fast-ball"])
def test_noise_leaves_both_ends_of_a_contact_open(name):
    """A made-up session of 6 s has the noise of a tracker and several whole contacts.

    The contact of smooth shapes (``nominal``) lies within what is possible, and what is sure within it.
    """
    seconds = 6.0
    _session, truth = make_analytic(name, seconds=seconds, noise="vive")
    whole_contacts = 0
    for episode in truth.episodes:
        possible_start, possible_end = episode.possibly
        if possible_start <= 0.0 or possible_end >= seconds:
            continue
        whole_contacts += 1
        start, end = episode.nominal
        sure_start, sure_end = episode.surely
        assert possible_start < start < sure_start
        assert sure_end < end < possible_end
    assert whole_contacts > 2


def test_each_contact_has_its_own_sure_interval():
    """Smooth shapes touch three times, first from the start of the session on; poses are 0.5 s late.

    That moves all times but the start. For sure a contact is 0.25 s shorter at either end, by the noise, but not at the
    start of the session: 0.25 s of the first are those that the late poses repeat there.
    """
    contacts = [(0.0, 1.0), (2.0, 4.0), (6.0, 7.0)]
    closer_than = lambda gap: [(max(start - gap, 0.0), end + gap) for start, end in contacts]  # noqa: E731
    episodes = levelled_episodes(("a", "b"), "contact", closer_than, noise=0.25, tessellation=0.0, clock=(0.5, 9.0))
    assert [episode.nominal for episode in episodes] == [(0.0, 1.5), (2.5, 4.5), (6.5, 7.5)]
    assert [episode.surely for episode in episodes] == [(0.75, 1.25), (2.75, 4.25), (6.75, 7.25)]
