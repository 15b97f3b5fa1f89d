import json
from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import cubes

from replay.cli.main import main
from sessions import Event, GazeTrack, Interval, ScalarTrack, Scene, write_session
from sessions.model.scene import SceneBody


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    scene = Scene(name="two-cubes", bodies=(SceneBody("a", proxy=True),))
    session = cubes(
        {"a": range(200), "b": [9] * 200},
        scene=scene,
        events=[Event(5, "press"), Event(9, "press")],
        intervals=[Interval(20_000_000, 90_000_000, "task", "stir")],
        facts={"vr_type": "immersive", "synthetic": "cubes"},
    )
    path = tmp_path_factory.mktemp("session") / "s.mcap"
    still = np.zeros((200, 3))
    looked = GazeTrack(10_000_000 * np.arange(200), still, still - (0, 0, 1), np.arange(200) > 49)
    heart = ScalarTrack([0, 10**9, 5 * 10**9, 6 * 10**9], [70, np.nan, 72.5, 68], "1/min")
    scalars = {"heart rate": heart, "one": ScalarTrack([5], [1]), "none": ScalarTrack([5, 6], [np.nan] * 2, "K")}
    write_session(replace(session, gaze={"anna": looked}, scalars=scalars), path)
    return path


def test_text_names_bodies_clock_tasks_and_events(file, capsys):
    assert main(["info", str(file)]) == 0
    text = capsys.readouterr().out
    assert "2.0 s, 200 frames at 100.0 Hz, 0 gaps" in text
    assert "events: press 2" in text and "task  stir" in text and "vr_type: immersive" in text
    row = next(line for line in text.splitlines() if line.strip().startswith("b ")).split()
    assert row[:5] == ["b", "12", "200", "100.0", "Hz"]
    assert "synthetic" not in text
    assert "  gaze of anna: 200 samples at 100.0 Hz, 0 gaps, 150 valid\n" in text
    assert "  scalar heart rate: 4 samples at 1.0 Hz, 1 gap, 68 to 72.5 1/min\n" in text
    assert "  scalar one: 1 sample at 0.0 Hz, 0 gaps, 1 to 1\n" in text
    assert "  scalar none: 2 samples at 1000000000.0 Hz, 0 gaps, no number\n" in text


def test_json_holds_the_same(file, capsys):
    assert main(["info", str(file), "--format", "json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["frames"]["count"] == 200 and [body["name"] for body in report["bodies"]] == ["a", "b"]
