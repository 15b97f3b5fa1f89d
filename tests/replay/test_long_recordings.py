"""Recordings of more than an hour: every verb and detector gives the answer that it gives of a short one."""

import json
from pathlib import Path

import pytest
from support.optional import ROWS
from support.small_worlds import swinging_cubes

from replay.cli.main import main
from replay.detection import run_detector as detecting
from replay.detection.run_detector import MOST_FRAMES_IN_MEMORY
from replay.engine import compute
from sessions import write_session

FRAMES = 2_000
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
    """With a limit of one frame less than the recording has, it is read in blocks of a third."""
    frames = 100 if name == "image-space" else FRAMES  # it draws every frame
    requested = {"oracle": "continuous"} if name.startswith("continuous") else {"detectors": name, "oracle": "exact"}
    requested.setdefault("detectors", "hybrid,slow=discrete[rate_hz=7.5]")
    answers_by_limit = []
    for limit in (frames, frames - 1):
        monkeypatch.setattr(detecting, "MOST_FRAMES_IN_MEMORY", limit)
        monkeypatch.setattr(detecting, "MOST_FRAMES_PER_CALL", frames // 3)
        answers_by_limit.append(answers(compute(swinging_cubes(frames), **requested)))
    in_memory, in_blocks = answers_by_limit
    assert repr(in_memory) == repr(in_blocks)
    *_, contacts = in_memory
    assert any(contacts.values())


@pytest.mark.slow
def test_every_verb_reads_a_recording_of_more_than_an_hour(tmp_path):
    """A cube swings through another once a second: 3600 contacts in the first hour."""
    file, run, runs, frames = tmp_path / "long.mcap", tmp_path / "run", tmp_path / "runs", MOST_FRAMES_IN_MEMORY + 1
    write_session(swinging_cubes(frames), file)
    requested = ["--detectors", FAST, "--oracle", "continuous", "--quiet"]
    window = ["--start", "1", "--end", "10"]
    lines = [
        ["info", file],
        ["doctor", file],
        ["recover", file, tmp_path / "again.mcap"],
        ["run", file, "--out", run, *requested],
        ["run", file, "--out", tmp_path / "short", *window, *requested],
        ["run", file, "--out", runs / "two", "--no-picture", *window, *requested],
        ["tradeoff", file, "--out", tmp_path / "costs", "--oracle", "hybrid", "--time-limit", "0.01", "--quiet"],
        ["diff", run, runs / "two"],
    ]
    for line in lines:
        assert main([str(word) for word in line]) == 0, line
    summary = json.loads((Path(run) / "summary.json").read_text())
    assert summary["session"]["frames"] == frames and (run / "run.rrd").stat().st_size > 100_000
    assert summary["audit"]["slow"]["contacts"] == 3_600
