"""Recordings of more than an hour: every verb and detector gives the answer that it gives of a short one."""

import json
from pathlib import Path

import pytest
from support.optional import ROWS
from support.small_worlds import swinging_cubes

from replay.cli.console import EXIT_OK
from replay.cli.main import main
from replay.detection import run_detector as detecting
from replay.detection.run_detector import MOST_FRAMES_IN_MEMORY
from replay.engine import compute
from sessions import write_session

FRAMES = 2_000
"""Frames of 90 Hz, 22 s, in which a cube swings through another once a second."""
FAST = "sphere,slow=discrete[rate_hz=7.5]"


def answers(result):
    """All that a run answers: digests of detections, misses, causes and contacts."""
    digests = {label: actual.digest for label, actual in result.detections.items()}
    return digests, result.misses, result.causes, result.episodes


QUICK = ("exact", "discrete")
OTHERS = (*(name for name in ROWS if name not in QUICK), "continuous as oracle")
SLOW = [
    pytest.param(*name.values, marks=[*name.marks, pytest.mark.slow])
    if hasattr(name, "values")
    else pytest.param(name, marks=pytest.mark.slow)
    for name in OTHERS
]


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", [*QUICK, *SLOW])
def test_detector_answers_equally_whether_the_motion_fits_in_memory(name, monkeypatch):
    """A recording of as many frames as fit in memory, and with a limit of one less, where it is read in three blocks.

    ``name``: of the detector, or of the reference where it says so. There are contacts to answer about.
    """
    frames = 100 if name == "image-space" else FRAMES  # it draws every frame
    if name.startswith("continuous"):
        settings = {"detectors": "hybrid,slow=discrete[rate_hz=7.5]", "oracle": "continuous"}
    else:
        settings = {"detectors": name, "oracle": "exact"}
    monkeypatch.setattr(detecting, "MOST_FRAMES_PER_CALL", frames // 3)
    monkeypatch.setattr(detecting, "MOST_FRAMES_IN_MEMORY", frames)
    in_memory = answers(compute(swinging_cubes(frames), **settings))
    monkeypatch.setattr(detecting, "MOST_FRAMES_IN_MEMORY", frames - 1)
    in_blocks = answers(compute(swinging_cubes(frames), **settings))
    assert repr(in_memory) == repr(in_blocks)
    *_, contacts = in_memory
    assert any(contacts.values())


@pytest.mark.slow
def test_every_verb_reads_a_recording_of_more_than_an_hour(tmp_path):
    """A cube swings through another once a second, for a frame more than an hour: 3600 contacts in the first hour.

    Every verb ends with exit code 0; the run has all frames and contacts, and a picture of more than 100 kB.
    """
    file, run, runs, frames = tmp_path / "long.mcap", tmp_path / "run", tmp_path / "runs", MOST_FRAMES_IN_MEMORY + 1
    write_session(swinging_cubes(frames), file)
    detectors = ["--detectors", FAST, "--oracle", "continuous", "--quiet"]
    window = ["--start", "1", "--end", "10"]
    commands = [
        ["info", file],
        ["doctor", file],
        ["recover", file, tmp_path / "again.mcap"],
        ["run", file, "--out", run, *detectors],
        ["run", file, "--out", tmp_path / "short", *window, *detectors],
        ["run", file, "--out", runs / "two", "--no-picture", *window, *detectors],
        ["tradeoff", file, "--out", tmp_path / "costs", "--oracle", "hybrid", "--time-limit", "0.01", "--quiet"],
        ["diff", run, runs / "two"],
    ]
    for command in commands:
        assert main([str(argument) for argument in command]) == EXIT_OK, command
    summary = json.loads((Path(run) / "summary.json").read_text())
    assert summary["session"]["frames"] == frames
    assert summary["audit"]["slow"]["contacts"] == 3_600
    assert (run / "run.rrd").stat().st_size > 100_000
