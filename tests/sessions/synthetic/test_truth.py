import json

import numpy as np

from sessions.synthetic.truth import (
    CLEAR,
    OPEN,
    PRESENT,
    Fact,
    PlantedEpisode,
    Truth,
    truth_path,
    write_truth,
)  # fmt: skip

TOUCH = PlantedEpisode(("a", "b"), "contact", (1.0, 2.0), (1.1, 1.9), (0.9, 2.1), "a touch")
NEAR = PlantedEpisode(("a", "b"), "contact", None, None, (5.0, 5.5))
POUR = Fact("pour", 3.0, 4.0, ("a",), {"volume_ml": 0.1 + 0.2, "into": "b"})


def truth(*facts):
    return Truth("made up", 7, 10**18, 6.0, "off", (TOUCH, NEAR), facts)


def test_a_written_truth_is_plain_json_that_says_the_same(tmp_path):
    path = truth_path(tmp_path / "x.mcap")
    write_truth(truth(POUR), path)
    held = json.loads(path.read_text())
    assert path.name == "x.truth.json" and held["facts"][0]["values"] == {"volume_ml": 0.1 + 0.2, "into": "b"}
    assert [episode["nominal"] for episode in held["episodes"]] == [[1.0, 2.0], None]


def test_expected_knows_sure_open_and_clear_frames():
    stamps = 10**18 + np.array([0.5, 1.0, 1.5, 2.05, 3.0, 5.2]) * 1e9
    answer = truth().expected("b", "a", stamps.astype(np.int64)).tolist()
    assert answer == [CLEAR, OPEN, PRESENT, OPEN, CLEAR, OPEN]
    lost = truth(Fact("loss", 1.2, 1.7, ("a",))).expected("a", "b", stamps.astype(np.int64)).tolist()
    assert lost == [CLEAR, OPEN, OPEN, OPEN, CLEAR, OPEN]
    assert truth().expected("a", "c", stamps.astype(np.int64)).tolist() == [CLEAR] * 6
